//! The table over all cells of a run.

use super::goals::{best_null, goals};
use super::page::frame;
use super::tables::{format_value, subject_meaning};
use crate::cell::{Outcome, Row};
use crate::pool::{COSTS, Summary};
use maud::{Markup, html};
use std::path::Path;

const COLUMNS: &[(&str, &str)] = &[
    ("A1.median", "median depth error"),
    ("A1.p90", "90th percentile"),
    ("A1.over_10mm", "beyond 10 mm"),
    ("A4.iou.mean", "silhouette overlap"),
    ("A5.within_20deg", "3-D line within 20°"),
    ("B7.within_20deg", "2-D line within 20°"),
];

/// All rows, the worst scene of each variant, and the pooled quantiles.
pub(crate) fn page(summary: &Summary, out: &Path) -> String {
    let failed = summary.rows.iter().filter(|r| r.outcome != Outcome::Ok).count();
    let content = html! {
        header {
            p.kicker { "strandbench · " (summary.rows.len()) " cells" }
            h1 { "All scenes" }
            p.lead {
                (verdict(summary))
                @if failed > 0 { " " (failed) " of " (summary.rows.len()) " cells failed, timed out or were not run; they count as scenes without any answer." }
            }
        }
        h2 { "Scene by scene" }
        @let changed = overrides(summary);
        @if !changed.is_empty() { p.note { "Changed from the catalogue or the defaults: " (changed.join("; ")) "." } }
        div.wide { table {
            tr {
                th { "scene" } th { "variant" } th.n { "seed" }
                @for (_, title) in COLUMNS { th.n { (title) } }
                th.n { "answered" } th.n { "best null’s median" } th.n { "goals met" }
            }
            @for row in &summary.rows { (line(row, out)) }
        } }
        p.note { "What it cost stands in " a href=(COSTS) { (COSTS) } ": it is no part of the figures." }
        h2 { "All scenes together" }
        p { "Raw depth errors of all scenes pooled, each scene with the same weight; a median of medians would hide the bad scenes. Beside the method stand guesses that never looked at an image." }
        table {
            tr { th { "variant" } th { "subject" } th.n { "scenes" } th.n { "median" } th.n { "90 %" } th.n { "95 %" } th.n { "within 10 mm" } th { "worst scene" } }
            @for p in &summary.pooled {
                tr {
                    td { (p.variant) }
                    td.method[p.subject == "method"] { (p.subject) }
                    td.n { (p.scenes) }
                    @for v in [p.median_mm, p.p90_mm, p.p95_mm] { td.n.method[p.subject == "method"] { (format_value(v, "mm")) } }
                    td.n.method[p.subject == "method"] { (format_value(Some(p.within_10mm), "share")) }
                    td { (worst(summary, &p.variant, &p.subject).unwrap_or_default()) }
                }
            }
        }
        p.note {
            @for (i, null) in ["N0", "N1", "N2", "NC", "C"].into_iter().enumerate() {
                @if i > 0 { "; " } b { (null) } " " (subject_meaning(null))
            }
            "."
        }
    };
    frame("strandbench · all scenes", content)
}

/// A sentence a variant.
fn verdict(summary: &Summary) -> String {
    let pooled = summary.pooled.iter().filter(|p| p.subject == "method");
    let sentences: Vec<String> = pooled
        .map(|p| {
            format!(
                "{}: pooled over {} scene{} the median depth error is {} and {} of the pixels lie within 10 mm; the worst scene is {}.",
                p.variant,
                p.scenes,
                if p.scenes == 1 { "" } else { "s" },
                p.median_mm.map_or("infinite (most of it unanswered)".into(), |v| format_value(Some(v), "mm")),
                format_value(Some(p.within_10mm), "share"),
                worst(summary, &p.variant, &p.subject).unwrap_or_else(|| "unknown".into()),
            )
        })
        .collect();
    if sentences.is_empty() { "No cell was scored.".to_owned() } else { sentences.join(" ") }
}

/// The scene with the greatest median depth error of a subject, with it; a cell without a score is worse than
/// any for the method, and says nothing of the nulls.
fn worst(summary: &Summary, variant: &str, subject: &str) -> Option<String> {
    let of = |row: &Row| match row.score("A1.median", subject) {
        Some(score) => Some(score.value),
        None => (subject == "method").then_some(None),
    };
    let rows = summary.rows.iter().filter(|r| r.variant == variant);
    let (row, value) = rows
        .filter_map(|r| Some((r, of(r)?)))
        .max_by(|a, b| a.1.unwrap_or(f64::INFINITY).total_cmp(&b.1.unwrap_or(f64::INFINITY)))?;
    Some(match (&row.outcome, value) {
        (Outcome::Ok, value) => format!("{} ({})", name(row), format_value(value, "mm")),
        _ => format!("{} (no score)", name(row)),
    })
}

/// What was overridden, each set once.
fn overrides(summary: &Summary) -> Vec<String> {
    let mut all: Vec<String> = Vec::new();
    for row in &summary.rows {
        let text = row.scene[name(row).len()..].trim_start_matches('+').replace('+', ", ");
        if !text.is_empty() && !all.contains(&text) {
            all.push(text);
        }
    }
    all
}

/// The scene's name without what was overridden, which is the same for all rows of a run.
fn name(row: &Row) -> &str {
    row.scene.split('+').next().unwrap_or(&row.scene)
}

fn line(row: &Row, out: &Path) -> Markup {
    let link = row.report.as_ref().map(|r| relative(r, out));
    let best = best_null(&row.scores, "A1.median").map(|(_, v)| v);
    html! {
        tr {
            td.scene {
                @match &link { Some(l) => a href=(l) { (name(row)) }, None => (name(row)) }
            }
            td { (row.variant) }
            td.n { (row.seed) }
            @match &row.outcome {
                Outcome::Ok => {
                    @for (metric, _) in COLUMNS {
                        @let score = row.score(metric, "method");
                        td.n.method[*metric == "A1.median"] { (score.map_or("—".into(), |s| format_value(s.value, &s.unit))) }
                    }
                    td.n { (row.score("A1.median", "method").map_or("—".into(), |s| format_value(Some(s.coverage), "share"))) }
                    td.n { (format_value(best, "mm")) }
                    @let goals = goals(&row.scores);
                    td.n { (goals.iter().filter(|g| g.met).count()) " of " (goals.len()) }
                }
                other => { td.trouble colspan=(COLUMNS.len() + 3) { (other.trouble().unwrap_or_default()) } }
            }
        }
    }
}

/// A path from the index to a report, as an address: what is not plain is percent-encoded.
fn relative(report: &Path, out: &Path) -> String {
    let path = report.strip_prefix(out).unwrap_or(report).to_string_lossy().replace('\\', "/");
    let plain = |b: u8| b.is_ascii_alphanumeric() || b"/._-~".contains(&b);
    path.bytes().map(|b| if plain(b) { (b as char).to_string() } else { format!("%{b:02X}") }).collect()
}
