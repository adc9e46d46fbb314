//! Methods from outside: a program that reads a dataset folder and writes an answer's folder.

mod config;
mod process;

pub use config::{CONFIG_FILE, Config, Outside, PLACEHOLDERS};

use crate::dataset::{self, DatasetOptions, Source};
use crate::reconstruct::{DIAGNOSTICS, ESTIMATE};
use crate::sequence::{ABSENT, AbsentFile, Stages, frame_name};
use crate::stage::{self, Done, Progress, write_json};
use crate::{Cost, Meter, SuiteError};
use process::{End, Limits, Ran};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;
use strandbench_recon::{Diagnostics, StageTime};
use strandbench_types::{Camera, Estimate, StopOnly};

/// Lets the method answer to a render folder (of one frame or of a sequence), or to a frame folder, and writes what it
/// says into `out` as a built-in method's answer lies there. It is given an export without truth in a folder of its own;
/// frames to which it writes nothing are absent. An answer whose inputs did not change is kept.
///
/// # Errors
/// If the program cannot be started, fails, takes more time or memory than it may, writes nothing or nothing that can be
/// used, or the work is cancelled; the answers that were there before then stand.
pub fn reconstruct(
    method: &Outside,
    folder: &Path,
    out: &Path,
    progress: &dyn Progress,
) -> Result<Done, SuiteError> {
    let source = Source::open(folder)?;
    let frames = source.frames();
    let place = |index: u32| if source.moves() { out.join(frame_name(index)) } else { out.to_owned() };
    let mut all = method.inputs()?;
    all.extend(source.hashes(method.head)?);
    all.insert("code".into(), env!("STRANDBENCH_CODE_OUTSIDE").into());
    let inputs = |index: u32| -> BTreeMap<String, String> {
        let own = source.moves().then(|| ("answer to".to_owned(), index.to_string()));
        all.iter().map(|(k, v)| (k.clone(), v.clone())).chain(own).collect()
    };
    progress.check()?;
    let kept: Vec<Result<Done, String>> =
        frames.iter().map(|&f| stage::current("reconstruct", &place(f), &inputs(f))).collect();
    let Some(reason) = kept.iter().find_map(|k| k.as_ref().err()).cloned() else {
        let done = Stages { done: kept.into_iter().flatten().collect() };
        let done = if source.moves() { done.whole() } else { done.done[0].clone() };
        progress.stage_done(&done);
        return Ok(done);
    };
    progress.stage_begins("reconstruct", out, &reason);
    let meter = Meter::start();
    let work = tempfile::Builder::new()
        .prefix("strandbench-outside-")
        .tempdir()
        .map_err(|e| SuiteError::file(&std::env::temp_dir(), format!("cannot make a folder here: {e}")))?;
    let answered = run(method, &source, work.path(), progress)?;
    let spent = Cost { peak_mib: answered.ran.peak_mib, ..meter.stop() }.part(frames.len());
    let quiet = StopOnly(progress);
    let mut stages = Stages::default();
    for (index, answer) in frames.iter().zip(&answered.answers) {
        let write = |dir: &Path| match answer {
            Ok(estimate) => {
                strandbench_io::write_estimate(&dir.join(ESTIMATE), estimate)?;
                for log in ["stdout.txt", "stderr.txt"] {
                    let (from, to) = (work.path().join(log), dir.join(log));
                    std::fs::copy(&from, &to).map_err(|e| SuiteError::file(&to, e))?;
                }
                write_json(&dir.join(DIAGNOSTICS), &diagnostics(method, &answered))
            }
            Err(reason) => write_json(&dir.join(ABSENT), &AbsentFile { reason: reason.clone() }),
        };
        let (inputs, reason) = (inputs(*index), reason.clone());
        stages.done.push(stage::write(
            "reconstruct",
            &place(*index),
            inputs,
            Some(spent),
            reason,
            &quiet,
            write,
        )?);
    }
    let done = if source.moves() { stages.whole() } else { stages.done.remove(0) };
    progress.stage_done(&done);
    Ok(done)
}

/// What a program said.
struct Answered {
    ran: Ran,
    wall_s: f64,
    /// Per frame, or why there is none.
    answers: Vec<Result<Estimate, String>>,
}

/// Exports, runs the program in `work`, and reads what it wrote.
fn run(
    method: &Outside,
    source: &Source,
    work: &Path,
    progress: &dyn Progress,
) -> Result<Answered, SuiteError> {
    let fault = |problem: String, said: &str| SuiteError::Outside {
        method: method.name.clone(),
        problem,
        said: said.to_owned(),
    };
    let [input, output] = ["input", "output"].map(|name| work.join(name));
    for dir in [&input, &output] {
        std::fs::create_dir(dir).map_err(|e| SuiteError::file(dir, e))?;
    }
    dataset::fill(source, DatasetOptions { head: method.head, truth: false }, &input, &StopOnly(progress))?;
    progress.begin(&method.name, 1);
    let program = method.program().map_err(|e| fault(e, ""))?;
    let mut command = Command::new(&program);
    command.args(method.arguments(&input, &output, rayon::current_num_threads())).current_dir(&method.folder);
    let limits = Limits { time_s: method.time_limit_s, memory_mib: method.memory_limit_mib };
    let meter = Meter::start();
    let ran = process::run(&mut command, work, limits, progress)
        .map_err(|e| fault(format!("{} did not start: {e}", program.display()), ""))?;
    let wall_s = meter.stop().wall_s;
    match &ran.end {
        End::Exited(status) if status.success() => {}
        End::Exited(status) => return Err(fault(format!("ended with {status}"), &ran.said)),
        End::Late => {
            let limit_s = method.time_limit_s.unwrap_or_default();
            return Err(SuiteError::OverTime { method: method.name.clone(), limit_s, said: ran.said });
        }
        End::Large => {
            let limit = method.memory_limit_mib.unwrap_or_default();
            let problem = format!("took more than the {limit} MiB of memory that it may (memory_limit_mib)");
            return Err(fault(problem, &ran.said));
        }
        End::Talkative => {
            return Err(fault(
                "wrote more than 256 MiB of text to standard output and error".into(),
                &ran.said,
            ));
        }
        End::Stopped => return Err(SuiteError::Cancelled),
    }
    let (rig, _) = source.read(source.frames()[0])?;
    let reader = Reader { method, output: &output, reference: &rig.cameras[0], said: &ran.said };
    let answers =
        if source.moves() { reader.of_frames(&source.frames())? } else { vec![Ok(reader.one(&output)?)] };
    progress.advance(1);
    Ok(Answered { wall_s, answers, ran })
}

/// Reads answers below `output`; errors name files from there on, as the folder itself is gone when they are read.
struct Reader<'a> {
    method: &'a Outside,
    output: &'a Path,
    reference: &'a Camera,
    said: &'a str,
}

impl Reader<'_> {
    fn fault(&self, problem: String) -> SuiteError {
        SuiteError::Outside { method: self.method.name.clone(), problem, said: self.said.to_owned() }
    }

    fn one(&self, dir: &Path) -> Result<Estimate, SuiteError> {
        strandbench_io::read_any_estimate(dir, self.reference).map_err(|e| {
            let name = e.path.strip_prefix(self.output).unwrap_or(&e.path).to_owned();
            let name = if name.as_os_str().is_empty() { PathBuf::from("{output}") } else { name };
            self.fault(format!("gave an answer that cannot be used: {}: {}", name.display(), e.problem))
        })
    }

    fn of_frames(&self, frames: &[u32]) -> Result<Vec<Result<Estimate, String>>, SuiteError> {
        let mut answers = Vec::new();
        for &index in frames {
            let dir = self.output.join(frame_name(index));
            let some = std::fs::read_dir(&dir).is_ok_and(|mut entries| entries.next().is_some());
            answers.push(if some {
                Ok(self.one(&dir)?)
            } else {
                Err("the method wrote nothing for it".to_owned())
            });
        }
        if answers.iter().any(Result::is_ok) {
            return Ok(answers);
        }
        let mut found: Vec<String> = std::fs::read_dir(self.output)
            .map(|all| all.flatten().map(|e| e.file_name().to_string_lossy().into_owned()).take(5).collect())
            .unwrap_or_default();
        found.sort_unstable();
        let there =
            if found.is_empty() { "nothing at all".to_owned() } else { format!("only {}", found.join(", ")) };
        Err(self.fault(format!(
            "answered to no frame: it wrote {there}; an answer goes into {{output}}/{}",
            frame_name(frames[0])
        )))
    }
}

/// The run as a built-in method's account of its work.
fn diagnostics(method: &Outside, answered: &Answered) -> Diagnostics {
    let mut parameters = BTreeMap::from([("command".to_owned(), method.command.join(" "))]);
    for (name, value) in
        [("time_limit_s", method.time_limit_s), ("memory_limit_mib", method.memory_limit_mib)]
    {
        parameters.insert(name.to_owned(), value.map_or("none".to_owned(), |v| v.to_string()));
    }
    parameters.insert(
        "given".to_owned(),
        if method.head { "images, masks, rig, head and scalp" } else { "images, masks, rig" }.to_owned(),
    );
    let notes =
        answered.ran.peak_mib.map(|m| format!("most resident memory of the program seen: {m:.0} MiB"));
    Diagnostics {
        stages: vec![StageTime { name: method.name.clone(), wall_s: answered.wall_s }],
        notes: notes.into_iter().collect(),
        parameters,
        ..Diagnostics::default()
    }
}

#[cfg(all(test, unix))]
mod tests;
