//! `cargo xtask readme`: runs the commands that reports/commands.md documents and writes what they print beside them.
//!
//! A block is a comment and the fence after it. `<!-- file NAME -->` puts the fence's content into a file of the folder
//! that the commands run in; `<!-- run [OPTION ...]: COMMAND -->` has a shell run the command there and writes the fence
//! anew. Options: `first=N` and `last=M` keep that many lines (what is left out is counted), `digits` hides every number,
//! `exit=N` expects that exit code instead of 0.

use anyhow::{Context, Result, bail};
use std::path::Path;
use std::process::Command;
use std::time::Instant;

/// The file with the blocks.
pub const COMMANDS: &str = "reports/commands.md";

/// Runs every block of [`COMMANDS`] in one temporary folder, with `strandbench` and Python on the path.
pub fn readme(root: &Path, programs: &Path, python: Option<&Path>) -> Result<()> {
    let path = root.join(COMMANDS);
    let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
    let folder = std::env::temp_dir().join(format!("strandbench-readme-{}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    let made = rewrite(&text, |step| match step {
        Step::File { name, content } => {
            std::fs::write(folder.join(name), content)?;
            Ok(String::new())
        }
        Step::Run(run) => {
            let start = Instant::now();
            let said = shell(run, &folder, programs, python)?;
            eprintln!("{:6.1} s  {}", start.elapsed().as_secs_f64(), run.command);
            Ok(run.shown(&said, &[(&folder, "."), (root, "PROJECT")]))
        }
    });
    std::fs::remove_dir_all(&folder)?;
    std::fs::write(&path, made?).with_context(|| path.display().to_string())
}

/// Runs a command and returns what it wrote to standard output and error, as a terminal shows it.
fn shell(run: &Run, folder: &Path, programs: &Path, python: Option<&Path>) -> Result<String> {
    let paths = std::env::var_os("PATH").unwrap_or_default();
    let path = std::env::join_paths([programs.to_owned()].into_iter().chain(std::env::split_paths(&paths)))?;
    let mut command = Command::new("sh");
    command.args(["-c", &format!("exec 2>&1; {}", run.command)]).current_dir(folder).env("PATH", path);
    if let Some(python) = python {
        command.env("STRANDBENCH_PYTHON", python);
    }
    let out = command.output().context("starting a shell")?;
    let said = String::from_utf8_lossy(&out.stdout).into_owned();
    if out.status.code() != Some(run.exit) {
        bail!("{}: {}, not {}\n{said}", run.command, out.status, run.exit);
    }
    Ok(said)
}

/// What a block asks for.
enum Step<'a> {
    File { name: &'a str, content: &'a str },
    Run(&'a Run),
}

/// A command and how its output is shown.
#[derive(Debug, PartialEq)]
struct Run {
    command: String,
    first: usize,
    last: usize,
    digits: bool,
    exit: i32,
}

impl Run {
    fn parse(text: &str) -> Result<Run> {
        let (options, command) = text.split_once(": ").with_context(|| format!("no command in {text:?}"))?;
        let mut run =
            Run { command: command.trim().to_owned(), first: usize::MAX, last: 0, digits: false, exit: 0 };
        for option in options.split_whitespace() {
            let number = |value: &str| value.parse().with_context(|| format!("{option} in {text:?}"));
            match option.split_once('=') {
                Some(("first", n)) => run.first = number(n)?,
                Some(("last", n)) => run.last = number(n)?,
                Some(("exit", n)) => run.exit = i32::try_from(number(n)?)?,
                None if option == "digits" => run.digits = true,
                _ => bail!("unknown option {option} in {text:?}"),
            }
        }
        Ok(run)
    }

    /// The command as typed and what it said: paths of this machine, times and memory replaced, the middle left out.
    fn shown(&self, said: &str, folders: &[(&Path, &str)]) -> String {
        let mut said = said.to_owned();
        for (folder, name) in folders {
            let folder = folder.display().to_string();
            said = if *name == "." { said.replace(&format!("{folder}/"), "") } else { said };
            said = said.replace(&folder, name);
        }
        let lines: Vec<String> = said.lines().map(|l| plain(l, self.digits)).collect();
        let mut kept = vec![format!("$ {}", self.command)];
        if lines.len() > self.first.saturating_add(self.last).saturating_add(1) {
            kept.extend_from_slice(&lines[..self.first]);
            kept.push(format!("... {} lines ...", lines.len() - self.first - self.last));
            kept.extend_from_slice(&lines[lines.len() - self.last..]);
        } else {
            kept.extend(lines);
        }
        kept.join("\n") + "\n"
    }
}

/// A line without what differs from run to run: a number before a unit of time or memory becomes `…`, or every number.
fn plain(line: &str, digits: bool) -> String {
    let measured = |word: &str| {
        let unit = word.trim_end_matches([',', ')', ';', '.', ':']);
        ["s", "ms", "min", "MiB"].contains(&unit)
    };
    let number = |word: &str| word.trim_start_matches('(').parse::<f64>().is_ok();
    let words: Vec<&str> = line.trim_end().split(' ').collect();
    let shown = words.iter().enumerate().map(|(i, word)| {
        let hidden = if digits {
            word.bytes().any(|b| b.is_ascii_digit())
        } else {
            number(word) && words.get(i + 1).is_some_and(|next| measured(next))
        };
        if hidden { "…".to_owned() } else { (*word).to_owned() }
    });
    let shown = shown.collect::<Vec<_>>().join(" ");
    // Columns are as wide as their numbers were: one blank is as good.
    if digits { shown.split_whitespace().collect::<Vec<_>>().join(" ") } else { shown }
}

/// The text with the fence of every command written anew; `work` is given the blocks in order.
fn rewrite(text: &str, mut work: impl FnMut(Step<'_>) -> Result<String>) -> Result<String> {
    let mut made = String::new();
    let mut rest = text;
    while let Some(at) = rest.find("<!-- ") {
        let end = rest[at..].find(" -->\n").context("a comment that does not end its line")? + at;
        let comment = &rest[at + 5..end];
        let after = &rest[end + 5..];
        made.push_str(&rest[..end + 5]);
        if let Some(name) = comment.strip_prefix("file ") {
            let (fence, behind) = fenced(after, comment)?;
            let content = fence.split_once('\n').map_or("", |(_, c)| c);
            work(Step::File { name, content: content.trim_end_matches("```\n") })?;
            made.push_str(fence);
            rest = behind;
        } else if let Some(text) = comment.strip_prefix("run").filter(|t| t.starts_with([' ', ':'])) {
            let run = Run::parse(text)?;
            // A new block needs no fence yet.
            rest = if after.starts_with("```") { fenced(after, comment)?.1 } else { after };
            made.push_str(&format!("```text\n{}```\n", work(Step::Run(&run))?));
        } else {
            rest = after;
        }
    }
    Ok(made + rest)
}

/// A fence with both its lines, and what follows.
fn fenced<'a>(text: &'a str, comment: &str) -> Result<(&'a str, &'a str)> {
    let close = text.starts_with("```").then(|| text.find("\n```\n")).flatten();
    let end = close.with_context(|| format!("no fence after <!-- {comment} -->"))? + 5;
    Ok(text.split_at(end))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_written_anew_and_the_second_time_nothing_changes() {
        let text = "# Title\n<!-- file a.toml -->\n```toml\nx = 1\n```\n<!-- run first=1: cmd --a -->\n\nprose <!-- a remark -->\n";
        let mut steps = Vec::new();
        let mut go = |text: &str| {
            rewrite(text, |step| {
                Ok(match step {
                    Step::File { name, content } => {
                        steps.push(format!("{name}={content}"));
                        String::new()
                    }
                    Step::Run(run) => run.shown("one\ntwo\nthree\n", &[]),
                })
            })
            .unwrap()
        };
        let once = go(text);
        assert!(once.contains("--a -->\n```text\n$ cmd --a\none\n... 2 lines ...\n```\n\nprose"), "{once}");
        assert_eq!(go(&once), once);
        assert_eq!(steps, ["a.toml=x = 1\n", "a.toml=x = 1\n"]);
    }

    #[test]
    fn times_memory_and_places_are_hidden_and_figures_stay() {
        assert_eq!(
            plain("             done in 1.2 s, at most 30 MiB", false),
            "             done in … s, at most … MiB"
        );
        assert_eq!(plain("depth  2.26 mm  4 s", false), "depth  2.26 mm  … s");
        assert_eq!(plain("embree   12.5e6   rays/s  1.20x", true), "embree … rays/s …");
        let run = Run::parse(" exit=1: x").unwrap();
        assert_eq!((run.exit, run.command.as_str()), (1, "x"));
        let shown =
            run.shown("in /t/1/out/a and /p/b", &[(Path::new("/t/1"), "."), (Path::new("/p"), "PROJECT")]);
        assert_eq!(shown, "$ x\nin out/a and PROJECT/b\n");
        assert!(Run::parse(" secnd=1: x").is_err() && Run::parse(" no command").is_err());
        assert!(rewrite("<!-- file a -->\nno fence\n", |_| Ok(String::new())).is_err());
    }
}
