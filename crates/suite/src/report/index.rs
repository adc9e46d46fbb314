//! The table over all cells of a run.

use super::page::frame;
use super::tables::{format_value, subject_meaning};
use crate::cell::{Outcome, Row};
use crate::pool::Summary;
use maud::{Markup, html};
use std::path::Path;

const COLUMNS: &[(&str, &str)] = &[
    ("A1.median", "median depth error"),
    ("A1.p90", "90th percentile"),
    ("A1.over_10mm", "beyond 10 mm"),
    ("A5.median", "3-D line error"),
    ("B7.median", "2-D line error"),
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
                @if failed > 0 { " " (failed) " of " (summary.rows.len()) " cells failed; they count as scenes without any answer." }
            }
        }
        h2 { "Scene by scene" }
        table {
            tr {
                th { "scene" } th { "variant" } th.n { "seed" }
                @for (_, title) in COLUMNS { th.n { (title) } }
                th.n { "answered" } th.n { "best null’s median" } th.n { "reconstruction, s" }
            }
            @for row in &summary.rows { (line(row, out)) }
        }
        h2 { "All scenes together" }
        p { "Raw depth errors of all scenes pooled, each scene with the same weight; a median of medians would hide the bad scenes." }
        table {
            tr { th { "variant" } th { "subject" } th.n { "scenes" } th.n { "median" } th.n { "90 %" } th.n { "95 %" } th.n { "within 10 mm" } }
            @for p in &summary.pooled {
                tr {
                    td { (p.variant) }
                    td.method[p.subject == "method"] { (p.subject) @if p.subject != "method" { span.why { (subject_meaning(&p.subject)) } } }
                    td.n { (p.scenes) }
                    @for v in [p.median_mm, p.p90_mm, p.p95_mm] { td.n.method[p.subject == "method"] { (format_value(v, "mm")) } }
                    td.n.method[p.subject == "method"] { (format_value(Some(p.within_10mm), "share")) }
                }
            }
        }
    };
    frame("strandbench · all scenes", content)
}

fn verdict(summary: &Summary) -> String {
    let scored = summary.rows.iter().filter_map(|r| Some((r, r.score("A1.median", "method")?)));
    // Without a value the median is infinite: that is the worst there can be.
    let worst = scored.max_by(|a, b| {
        let of = |v: Option<f64>| v.unwrap_or(f64::INFINITY);
        of(a.1.value).total_cmp(&of(b.1.value))
    });
    let pooled = summary.pooled.iter().find(|p| p.subject == "method");
    match (worst, pooled) {
        (Some((row, score)), Some(p)) => format!(
            "Pooled over {} scenes the median depth error is {}; the worst scene is {} with {}.",
            p.scenes,
            format_value(p.median_mm, "mm"),
            row.scene,
            format_value(score.value, "mm")
        ),
        _ => "No cell was scored.".to_owned(),
    }
}

fn line(row: &Row, out: &Path) -> Markup {
    let link = row.report.as_ref().map(|r| relative(r, out));
    let nulls = row.scores.iter().filter(|s| s.metric == "A1.median" && s.subject.starts_with('N'));
    let best = nulls.filter_map(|s| s.value).reduce(f64::min);
    html! {
        tr {
            td { @match &link { Some(l) => a href=(l) { (row.scene) }, None => (row.scene) } }
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
                    td.n { (row.costs.get("reconstruct").map_or("—".into(), |c| format!("{:.1}", c.wall_s))) }
                }
                Outcome::Failed { stage, message } => {
                    td colspan=(COLUMNS.len() + 3) { b { "failed in " (stage) ": " } (message) }
                }
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
