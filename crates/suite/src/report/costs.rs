//! What the cells of a run cost: never on the page of figures, as no two runs cost the same.

use super::page::frame;
use crate::Cost;
use crate::pool::Summary;
use maud::html;

const STAGES: [&str; 4] = ["render", "reconstruct", "score", "report"];

/// Seconds of every stage of every cell, and the largest peak of memory.
pub(crate) fn page(summary: &Summary) -> String {
    let seconds = |cost: Option<&Cost>| cost.map_or("—".to_owned(), |c| format!("{:.1}", c.wall_s));
    let content = html! {
        header {
            p.kicker { "strandbench · " (summary.rows.len()) " cells" }
            h1 { "What it cost" }
            p.lead { "Wall seconds of each stage, of the run that made it. Figures of accuracy stand in " a href="index.html" { "index.html" } "." }
        }
        div.wide { table {
            tr {
                th { "scene" } th { "variant" } th.n { "seed" }
                @for stage in STAGES { th.n { (stage) ", s" } }
                th.n { "peak memory, MiB" } th { "re-used" }
            }
            @for row in &summary.rows {
                tr {
                    td { (row.scene) } td { (row.variant) } td.n { (row.seed) }
                    @for stage in STAGES { td.n { (seconds(row.costs.get(stage))) } }
                    @let peak = row.costs.values().filter_map(|c| c.peak_mib).reduce(f64::max);
                    td.n { (peak.map_or("—".to_owned(), |m| format!("{m:.0}"))) }
                    td { (row.reused.join(", ")) }
                }
            }
        } }
    };
    frame("strandbench · what it cost", content)
}
