//! Results as text for a terminal.

use std::fmt::Write as _;
use strandbench_suite::{Exported, Imported, Outcome, Row, SceneJob, Score, Summary};

/// Metrics of the short table, and their names in it.
const KEY: &[(&str, &str)] = &[
    ("A1.median", "depth error, median"),
    ("A1.p90", "depth error, 90 %"),
    ("A1.over_10mm", "depth beyond 10 mm"),
    ("A2.within_10mm", "envelope near a strand"),
    ("A5.median", "3-D line, median"),
    ("B7.median", "2-D line, median"),
];

/// Each row's key figures beside nulls and ceiling, and where the reports are.
pub fn summary(summary: &Summary) -> String {
    let mut text = String::new();
    for row in &summary.rows {
        if row.outcome == Outcome::Ok {
            let _ = writeln!(text, "\n{} by {}, seed {}", row.scene, row.variant, row.seed);
            text.push_str(&scores(&key_scores(row)));
        }
        if let Some(report) = &row.report {
            let _ = writeln!(text, "report: {}", report.display());
        }
    }
    if summary.rows.len() > 1 {
        let _ = writeln!(text, "\nall scenes: {}", summary.index.display());
    }
    text
}

/// What became of a cell that failed.
pub fn failure(row: &Row) -> Option<String> {
    let trouble = row.outcome.trouble()?;
    Some(format!("{} by {}, seed {}: {trouble}", row.scene, row.variant, row.seed))
}

fn key_scores(row: &Row) -> Vec<Score> {
    KEY.iter().flat_map(|(m, _)| row.scores.iter().filter(|s| s.metric == *m)).cloned().collect()
}

/// A row a metric, a column a subject.
pub fn scores(scores: &[Score]) -> String {
    let (mut subjects, mut metrics): (Vec<&str>, Vec<&str>) = (Vec::new(), Vec::new());
    for s in scores {
        if !subjects.contains(&s.subject.as_str()) {
            subjects.push(&s.subject);
        }
        if !metrics.contains(&s.metric.as_str()) {
            metrics.push(&s.metric);
        }
    }
    let name =
        |metric: &str| KEY.iter().find(|(m, _)| *m == metric).map_or(metric, |(_, name)| name).to_owned();
    let mut lines = vec![
        std::iter::once(String::new())
            .chain(subjects.iter().map(|s| (*s).to_owned()))
            .chain(["answered".to_owned()])
            .collect::<Vec<_>>(),
    ];
    for metric in metrics {
        let find = |subject: &str| scores.iter().find(|s| s.metric == metric && s.subject == subject);
        let coverage = find("method").map_or(String::new(), |s| format!("{:.1} %", s.coverage * 100.0));
        let cells = subjects.iter().map(|s| find(s).map_or(String::new(), value));
        lines.push(std::iter::once(name(metric)).chain(cells).chain([coverage]).collect());
    }
    aligned(&lines)
}

fn value(s: &Score) -> String {
    match (s.value, s.unit.as_str()) {
        (None, _) => "none".into(),
        (Some(v), "share") => format!("{:.1} %", v * 100.0),
        (Some(v), "deg") => format!("{v:.1}°"),
        (Some(v), unit) => format!("{v:.2} {unit}").trim_end().to_owned(),
    }
}

/// The first column to the left, the others to the right.
fn aligned(lines: &[Vec<String>]) -> String {
    let columns = lines.iter().map(Vec::len).max().unwrap_or(0);
    let width =
        |c: usize| lines.iter().filter_map(|l| l.get(c)).map(|t| t.chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut text = String::new();
    for line in lines {
        let mut row = String::from("  ");
        for (c, cell) in line.iter().enumerate() {
            let fill = " ".repeat(widths[c] - cell.chars().count());
            if c == 0 {
                row += &format!("{cell}{fill}");
            } else {
                row += &format!("  {fill}{cell}");
            }
        }
        text.push_str(row.trim_end());
        text.push('\n');
    }
    text
}

/// The catalogue.
pub fn scenes(jobs: &[SceneJob]) -> String {
    let mut text = String::new();
    for job in jobs {
        let s = job.spec();
        let strands = s.groom.as_ref().map_or(String::new(), |g| format!("{} strands", g.strands));
        let mark = if job.name == strandbench_scenes::DEFAULT_SCENE { " (default)" } else { "" };
        let difficulty = format!("{:?}", s.difficulty).to_lowercase();
        let frames = s.motion.as_ref().map_or(String::new(), |m| format!(", {} frames", m.frames));
        let _ = writeln!(text, "{:<24} {difficulty:<7} {strands:>14}{frames}{mark}", job.name);
        let _ = writeln!(text, "    {}", s.description);
        let _ = writeln!(text, "    stresses: {}", s.stresses);
    }
    text
}

/// What was exported.
pub fn exported(made: &Exported) -> String {
    let mut text = String::new();
    let frames = if made.frames == 1 { "1 frame".to_owned() } else { format!("{} frames", made.frames) };
    let _ = writeln!(text, "{frames}, {} strands, {} meshes", made.strands, made.meshes);
    if !made.absent.is_empty() {
        let _ = writeln!(text, "without an answer, and empty: frames {:?}", made.absent);
    }
    for file in &made.open {
        let _ = writeln!(text, "{}", file.display());
    }
    text
}

/// What an import found and did.
pub fn import(made: &Imported) -> String {
    let r = &made.report;
    let l = &made.length_mm;
    let size: Vec<String> = (0..3).map(|k| format!("{:.0}", r.bounds_mm[1][k] - r.bounds_mm[0][k])).collect();
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "  {name:<22} {value}");
    };
    line("format", r.format.clone());
    line("strands", format!("{} in the file, {} kept", r.strands_in_file, made.strands));
    line("points", format!("{} in the file, {} resampled", r.points_in_file, r.points_resampled));
    line(
        "dropped",
        format!("{} strands without length, {} repeated points", r.zero_length_strands, r.repeated_points),
    );
    line("scale", format!("{} mm per unit", r.scale_mm));
    line("size", format!("{} mm (x, y, z)", size.join(" x ")));
    line("strand length", format!("{:.1} to {:.1} mm, median {:.1}", l[0], l[2], l[1]));
    line("longest segment", format!("{:.2} mm", made.longest_segment_mm));
    line("fibre radius", format!("{:.4} to {:.4} mm; {}", made.radius_mm[0], made.radius_mm[1], r.radius));
    for note in &r.notes {
        line("note", note.clone());
    }
    line("written", made.out.display().to_string());
    line("picture", made.picture.display().to_string());
    text
}
