//! `compare.html`.

use super::drawing::forest;
use super::text::{estimate, notes, p_text, short, signed, words};
use super::{Compared, Comparison};
use crate::report::page::frame;
use maud::{Markup, PreEscaped, html};

pub(crate) fn page(c: &Comparison) -> String {
    let content = html! {
        header {
            p.kicker { "strandbench · " (c.cells) " pairs of cells in " (c.scenes) " scenes" }
            h1 { (c.b.variant) span { " against " } (c.a.variant) }
            p.lead { (lead(c)) }
        }
        h2 { "Primary metrics" }
        p { "Declared ahead; p is corrected for their number. A difference is " (c.b.variant) " less " (c.a.variant) ", on the same renders." }
        (table(&c.primary, true))
        @for note in notes(c) { p.note { (note) } }
        @for m in &c.primary {
            h3 { (m.metric) ": " (title(m)) }
            figure {
                (PreEscaped(forest(m)))
                figcaption { "Each dot is a scene, sorted by difference; an arrow is an infinite difference, where one side has no answer." }
            }
        }
        @if !c.exploratory.is_empty() {
            h2 { "Exploratory" }
            p { "Every other figure that both have. Not corrected for their number; nothing is decided by them." }
            details { summary { (c.exploratory.len()) " metrics" } (table(&c.exploratory, false)) }
        }
    };
    frame(&format!("{} against {}", c.b.variant, c.a.variant), content)
}

fn title(m: &Compared) -> &'static str {
    strandbench_score::metric(&m.metric).map_or("", |known| known.title)
}

/// A sentence a primary metric.
fn lead(c: &Comparison) -> String {
    let of = |m: &Compared| {
        let (mean, interval) = estimate(m);
        format!(
            "{} ({}): {} by {mean}, {interval}; {:.0} % of the scenes won.",
            title(m),
            m.metric,
            words(m),
            m.difference.won * 100.0
        )
    };
    c.primary.iter().map(of).collect::<Vec<_>>().join(" ")
}

fn table(metrics: &[Compared], primary: bool) -> Markup {
    html! {
        div.wide { table {
            tr {
                th { "metric" } th { "what" } th.n { "mean difference" } th.n { "interval" } th.n { "median" }
                th.n { @if primary { "p (Holm)" } @else { "p" } } th.n { "effect" } th.n { "won" } th.n { "tied" } th { "worst scene" } th { "the interval says" }
            }
            @for m in metrics {
                @let d = &m.difference;
                @let (mean, interval) = estimate(m);
                tr {
                    td { code { (m.metric) } } td { (title(m)) }
                    td.n.method[primary] { (mean) } td.n { (interval) }
                    td.n { (d.median.map_or("infinite".into(), |v| signed(v, &m.unit))) }
                    td.n { (p_text(m.p_holm.unwrap_or(d.p))) }
                    td.n { (d.effect.map_or("none".into(), |e| format!("{e:+.2}").replace('-', "−"))) }
                    td.n { (format!("{:.0} %", d.won * 100.0)) } td.n { (format!("{:.0} %", d.tied * 100.0)) }
                    td { (short(m, &d.worst.scene)) " (" (d.worst.difference.map_or("infinite".into(), |v| signed(v, &m.unit))) ")" }
                    td { (words(m)) }
                }
            }
        } }
    }
}
