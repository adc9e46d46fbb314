//! A comparison for a terminal and for a pull request.

use super::{Compared, Comparison, LEVEL};
use crate::report::tables::format_value;
use strandbench_stats::{Test, Verdict};

/// What an interval says, in words; b is the other, a the baseline.
pub(crate) fn words(m: &Compared) -> &'static str {
    match m.verdict {
        Verdict::Better => "better",
        Verdict::Worse => "worse",
        Verdict::Equivalent if m.margin == 0.0 => "the same",
        Verdict::Equivalent => "equivalent within the margin",
        Verdict::NotInferior => "no loss beyond the margin",
        Verdict::Undecided => "undecided",
    }
}

/// A scene's name without its overrides, where that tells it from the others.
pub(crate) fn short<'a>(m: &Compared, scene: &'a str) -> &'a str {
    let name = |s: &'a str| s.split_once('+').map_or(s, |f| f.0);
    let alike = m.difference.by_scene.iter().filter(|s| s.scene.split('+').next() == Some(name(scene)));
    if alike.count() == 1 { name(scene) } else { scene }
}

/// A signed difference in its unit; shares in percentage points.
pub(crate) fn signed(value: f64, unit: &str) -> String {
    let text = format_value(Some(value), unit);
    let text = if unit == "share" { text.replace('%', "points") } else { text };
    if value > 0.0 { format!("+{text}") } else { text }
}

/// Mean and interval of the difference, or that there is none.
pub(crate) fn estimate(m: &Compared) -> (String, String) {
    let d = &m.difference;
    let mean = d.mean.map_or_else(|| "none".to_owned(), |v| signed(v, &m.unit));
    let interval = d.interval.map_or_else(
        || "none".to_owned(),
        |[low, high]| format!("{} to {}", signed(low, &m.unit), signed(high, &m.unit)),
    );
    (mean, interval)
}

pub(crate) fn p_text(p: f64) -> String {
    if p < 0.0001 { "< 0.0001".to_owned() } else { format!("{p:.4}") }
}

/// What must be said beside any table: how it was found, what is left out, failed or undefined.
pub(crate) fn notes(c: &Comparison) -> Vec<String> {
    let within = c.primary.iter().any(|m| m.difference.cells_with_units > 0);
    let levels = if within { "scenes, and of A1.median clumps and strands" } else { "scenes" };
    let mut notes = vec![format!(
        "{} minus {}, {} cells in {} scenes; mean over scenes with its {:.0} % interval (bootstrap over {levels}, \
         {} resamples, seed {}), p by flipping signs, corrected by Holm over {} primary metrics. Protocol {}.",
        c.b.variant,
        c.a.variant,
        c.cells,
        c.scenes,
        c.confidence * 100.0,
        c.resamples,
        c.seed,
        c.primary.len(),
        c.protocol
    )];
    if c.smallest_p * c.primary.len() as f64 > LEVEL {
        notes.push(format!(
            "{} scenes cannot show any difference at {LEVEL}: the least p they can give is {:.4}, before the correction.",
            c.scenes, c.smallest_p
        ));
    }
    for (side, what) in [(&c.a, "baseline"), (&c.b, "other")] {
        for failure in &side.failed {
            notes.push(format!("{} ({what}) has no answer and counts as the worst: {failure}", side.variant));
        }
    }
    if !c.left_out.is_empty() {
        notes.push(format!("Left out, since one side does not have them: {}.", c.left_out.join("; ")));
    }
    for m in c.primary.iter().filter(|m| m.difference.undefined.is_some()) {
        let why = m.difference.undefined.as_deref().unwrap_or_default();
        let by = if m.difference.test == Test::SignedRank { "; p is by ranks" } else { "" };
        notes.push(format!("{}: {why}{by}.", m.metric));
    }
    if !c.one_sided.is_empty() {
        let n = c.one_sided.len();
        notes.push(format!(
            "{n} figures that one side alone has are not compared, {} among them.",
            c.one_sided[0]
        ));
    }
    notes
}

const COLUMNS: [&str; 8] =
    ["metric", "difference", "interval", "p", "effect", "won", "worst scene", "verdict"];

/// What a line of a table says, by [`COLUMNS`].
pub(crate) fn line(m: &Compared) -> [String; 8] {
    let d = &m.difference;
    let (mean, interval) = estimate(m);
    let worst = d.worst.difference.map_or_else(|| "infinite".to_owned(), |v| signed(v, &m.unit));
    [
        m.metric.clone(),
        mean,
        interval,
        m.p_holm.map_or_else(String::new, p_text),
        d.effect.map_or_else(|| "none".to_owned(), |e| format!("{e:+.2}").replace('-', "−")),
        format!("{:.0} %", d.won * 100.0),
        format!("{} ({worst})", short(m, &d.worst.scene)),
        words(m).to_owned(),
    ]
}

/// The primary metrics as text for a terminal, and the notes.
pub fn table(c: &Comparison) -> String {
    let mut lines = vec![COLUMNS.map(str::to_owned)];
    lines.extend(c.primary.iter().map(line));
    let width = |k: usize| lines.iter().map(|l| l[k].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..COLUMNS.len()).map(width).collect();
    let mut text = String::new();
    for l in &lines {
        let cells: Vec<String> =
            l.iter().zip(&widths).map(|(t, w)| format!("{t}{}", " ".repeat(w - t.chars().count()))).collect();
        text += &format!("  {}\n", cells.join("  ").trim_end());
    }
    for note in notes(c) {
        text += &format!("{note}\n");
    }
    text
}

/// The same as Markdown, with the exploratory metrics folded away.
pub fn markdown(c: &Comparison) -> String {
    let cell = |t: &str| t.replace('|', "\\|").replace('\n', " ");
    let rows = |of: &[Compared]| {
        let mut text = format!("| {} |\n|{}\n", COLUMNS.join(" | "), "---|".repeat(COLUMNS.len()));
        for m in of {
            text += &format!("| {} |\n", line(m).map(|t| cell(&t)).join(" | "));
        }
        text
    };
    let mut text =
        format!("### {} against {}\n\n{}\n", cell(&c.b.variant), cell(&c.a.variant), rows(&c.primary));
    for note in notes(c) {
        text += &format!("{}\n\n", cell(&note));
    }
    if !c.exploratory.is_empty() {
        text += &format!(
            "<details><summary>{} exploratory metrics (no correction, no decision rests on them)</summary>\n\n{}\n</details>\n",
            c.exploratory.len(),
            rows(&c.exploratory)
        );
    }
    text
}
