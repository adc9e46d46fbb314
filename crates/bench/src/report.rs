//! What a run found: as a table for people, as JSON and CSV for programs.

use crate::contest::Standing;
use crate::error::BenchError;
use crate::frames::FrameRow;
use crate::rays::{Kind, RaySets};
use serde::Serialize;
use std::fmt::Write;
use std::path::Path;
use strandbench_renderer::accel::Accel;

/// One build of an acceleration structure.
#[derive(Clone, Debug, Serialize)]
pub struct Build {
    /// What it was built over.
    pub scene: String,
    /// By whom.
    pub tracer: String,
    /// Seconds by the clock.
    pub wall_s: f64,
    /// Processor seconds of all threads.
    pub cpu_s: Option<f64>,
    /// Memory of the structure (this project's) or by which the process grew (others'), bytes.
    pub bytes: Option<u64>,
    /// Largest size of this process until then, with the strands themselves, bytes.
    pub peak_bytes: Option<u64>,
}

/// Mean work of a ray in this project's tree.
#[derive(Clone, Debug, Serialize)]
pub struct Work {
    /// What the rays ask.
    pub kind: Kind,
    /// Nodes tested.
    pub nodes: f64,
    /// Leaves tested, eight segments at once.
    pub leaves: f64,
    /// Segments intersected one by one.
    pub segments: f64,
}

impl Work {
    /// Of one kind of rays.
    pub fn mean(accel: &Accel, rays: &RaySets, kind: Kind) -> Work {
        let set = rays.of(kind);
        let mut sum = [0.0; 3];
        for r in set {
            let work = match kind {
                Kind::Shadow => accel.work_of_occluded(r.origin, r.direction, r.tmax),
                _ => accel.work_of_closest(r.origin, r.direction),
            };
            for (sum, n) in sum.iter_mut().zip([work.nodes, work.leaves, work.segments]) {
                *sum += n as f64 / set.len() as f64;
            }
        }
        Work { kind, nodes: sum[0], leaves: sum[1], segments: sum[2] }
    }
}

/// Everything that a run found.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Report {
    /// Processor.
    pub cpu: String,
    /// Its vector instructions that matter here.
    pub cpu_flags: Vec<String>,
    /// Processors that the system has.
    pub processors: usize,
    /// Programs waiting for a processor when the run began, last minute's mean: above 0, times by the clock are
    /// upper bounds and ratios are what counts.
    pub load: Option<f64>,
    /// Version of this program and of the other tracers.
    pub versions: Vec<String>,
    /// What was left out and why.
    pub skipped: Vec<String>,
    /// Builds.
    pub builds: Vec<Build>,
    /// Work of a ray.
    pub work: Vec<Work>,
    /// Rays.
    pub rays: Vec<Standing>,
    /// Frames.
    pub frames: Vec<FrameRow>,
}

pub(crate) fn mib(bytes: Option<u64>) -> String {
    bytes.map_or_else(|| "-".into(), |b| format!("{:.0}", b as f64 / 1_048_576.0))
}

pub(crate) fn optional(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "-".into(), |v| format!("{v:.digits$}"))
}

impl Report {
    /// With what is known of this machine.
    pub(crate) fn of_this_machine() -> Report {
        let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let field = |name: &str| {
            let line = info.lines().find(|l| l.split(':').next().is_some_and(|k| k.trim() == name))?;
            Some(line.split_once(':')?.1.trim().to_owned())
        };
        let flags = field("flags").or_else(|| field("Features")).unwrap_or_default();
        let wanted = ["sse4_2", "avx2", "fma", "avx512f", "avx512vl", "asimd", "sve"];
        let load = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
        Report {
            cpu: field("model name").unwrap_or_else(|| std::env::consts::ARCH.into()),
            cpu_flags: flags.split(' ').filter(|f| wanted.contains(f)).map(str::to_owned).collect(),
            processors: std::thread::available_parallelism().map_or(1, |n| n.get()),
            load: load.split(' ').next().and_then(|l| l.parse().ok()),
            versions: vec![format!("strandbench {}", env!("CARGO_PKG_VERSION"))],
            ..Report::default()
        }
    }

    /// Tables in plain text.
    pub fn table(&self) -> String {
        let mut out = String::new();
        // Writing to a string cannot fail.
        let _ = self.write_table(&mut out);
        out
    }

    fn write_table(&self, out: &mut String) -> std::fmt::Result {
        writeln!(out, "{} ({}), {} processors", self.cpu, self.cpu_flags.join(" "), self.processors)?;
        writeln!(out, "load {}; {}", optional(self.load, 1), self.versions.join(", "))?;
        if !self.builds.is_empty() {
            writeln!(out, "\n{:<36} {:<34} {:>7} {:>7} {:>7}", "build", "", "wall s", "CPU s", "MiB")?;
        }
        for b in &self.builds {
            let cpu = optional(b.cpu_s, 2);
            writeln!(out, "{:<36} {:<34} {:>7.2} {cpu:>7} {:>7}", b.scene, b.tracer, b.wall_s, mib(b.bytes))?;
        }
        for b in self.builds.iter().filter(|b| b.tracer == "strandbench").take(1) {
            writeln!(out, "peak of this process after the first build: {} MiB", mib(b.peak_bytes))?;
        }
        if !self.work.is_empty() {
            writeln!(out, "\n{:<36} {:>7} {:>7} {:>9}", "mean work of a ray", "nodes", "leaves", "segments")?;
        }
        for w in &self.work {
            let name = w.kind.name();
            writeln!(out, "{name:<36} {:>7.1} {:>7.1} {:>9.1}", w.nodes, w.leaves, w.segments)?;
        }
        let mut head = None;
        for r in &self.rays {
            if head != Some((&r.scene, r.threads)) {
                head = Some((&r.scene, r.threads));
                let title = format!("{}, {} thread(s)", r.scene, r.threads);
                writeln!(
                    out,
                    "\n{title:<44} {:<8} {:>8} {:>7} {:>9}",
                    "rays", "Mray/s", "ratio", "differing"
                )?;
            }
            let (kind, ratio) = (r.kind.name(), optional(r.ratio, 3));
            writeln!(
                out,
                "{:<44} {kind:<8} {:>8.3} {ratio:>7} {:>9.5}",
                r.tracer, r.mrays_per_s, r.differing
            )?;
        }
        write!(out, "{}", FrameRow::table(&self.frames))?;
        for s in &self.skipped {
            writeln!(out, "left out: {s}")?;
        }
        Ok(())
    }

    /// Writes `bench.json`, `builds.csv`, `rays.csv` and `frames.csv` into `folder`, which is made.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), BenchError> {
        std::fs::create_dir_all(folder).map_err(BenchError::file(folder))?;
        let put = |name: &str, text: String| {
            let path = folder.join(name);
            std::fs::write(&path, text).map_err(BenchError::file(&path))
        };
        let json = serde_json::to_string_pretty(self).map_err(|e| BenchError::Options(e.to_string()))?;
        put("bench.json", json)?;
        let quoted = |s: &str| format!("\"{}\"", s.replace('"', "\"\""));
        let empty = |v: Option<f64>| v.map_or_else(String::new, |v| v.to_string());
        let mut csv = String::from("scene,tracer,wall_s,cpu_s,bytes,peak_bytes\n");
        for b in &self.builds {
            let whole = |v: Option<u64>| v.map_or_else(String::new, |v| v.to_string());
            let (scene, tracer, cpu) = (quoted(&b.scene), quoted(&b.tracer), empty(b.cpu_s));
            csv +=
                &format!("{scene},{tracer},{},{cpu},{},{}\n", b.wall_s, whole(b.bytes), whole(b.peak_bytes));
        }
        put("builds.csv", csv)?;
        let mut csv = String::from("scene,tracer,kind,threads,rays,mrays_per_s,ratio,differing\n");
        for r in &self.rays {
            let (scene, tracer, kind) = (quoted(&r.scene), quoted(&r.tracer), r.kind.name());
            let (ratio, unlike) = (empty(r.ratio), r.differing);
            csv += &format!(
                "{scene},{tracer},{kind},{},{},{},{ratio},{unlike}\n",
                r.threads, r.rays, r.mrays_per_s
            );
        }
        put("rays.csv", csv)?;
        let mut csv = format!("{}\n", FrameRow::CSV);
        for f in &self.frames {
            csv += &format!("{}\n", f.csv());
        }
        put("frames.csv", csv)
    }
}
