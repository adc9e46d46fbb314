//! An ablation's page and table.

use super::figure::Picture;
use super::{Ablation, Outcomes, Tuned};
use crate::cell::Outcome;
use crate::compare::drawing::forest;
use crate::compare::text::{line, p_text};
use crate::report::page::frame;
use maud::{Markup, PreEscaped, html};
use serde::Serialize;
use strandbench_stats::Verdict;

/// A line of `ablation.csv`: a figure of a cell, or a cell without any.
#[derive(Serialize)]
pub(super) struct Line<'a> {
    arm: &'a str,
    weights: &'static str,
    scene: &'a str,
    condition: &'a str,
    seed: u64,
    outcome: &'static str,
    metric: &'a str,
    unit: &'a str,
    value: Option<f64>,
    coverage: f64,
}

pub(super) fn lines(outcome: &Outcomes) -> Vec<Line<'_>> {
    let mut lines = Vec::new();
    for r in &outcome.rows {
        let cell = || Line {
            arm: &r.arm,
            weights: if r.tuned { "tuned" } else { "own" },
            scene: &r.scene_name,
            condition: &r.condition,
            seed: r.row.seed,
            outcome: if r.row.outcome == Outcome::Ok { "ok" } else { "no answer" },
            metric: "",
            unit: "",
            value: None,
            coverage: 0.0,
        };
        if r.row.scores.is_empty() {
            lines.push(cell());
        }
        lines.extend(r.row.scores.iter().filter(|s| s.subject == "method").map(|s| Line {
            metric: &s.metric,
            unit: &s.unit,
            value: s.value,
            coverage: s.coverage,
            ..cell()
        }));
    }
    lines
}

pub(super) fn page(ablation: &Ablation, outcome: &Outcomes, pictures: &[Picture]) -> String {
    let failed: Vec<_> = outcome.rows.iter().filter(|r| r.row.outcome != Outcome::Ok).collect();
    let content = html! {
        header {
            p.kicker { "strandbench · ablation · " (outcome.set) " set" }
            h1 { (ablation.source) ": " (ablation.name) }
            p.lead { "The claim: " (ablation.claim) "." }
        }
        @for sentence in &outcome.sentences { p { (sentence) } }
        p.note {
            "Differences are the paper’s arm (" (ablation.with.label) ") less the other, paired by scene, condition, noise and seed. The unit is \
             the scene. Intervals: 95 %, bootstrap over scenes, and of A1.median over clumps and strands within them (BCa at the expanded level, 10,000 resamples); p by sign flips. Reproduced means that the \
             interval excludes zero in the paper’s direction. A cell without an answer counts as the worst."
        }
        @if !failed.is_empty() {
            div.fail { @for r in &failed {
                p { (r.arm) " on " (r.row.scene) ": " (r.row.outcome.trouble().unwrap_or_default()) }
            } }
        }
        h2 { "Differences" }
        (table(outcome))
        @for c in outcome.comparisons.iter().filter(|c| c.primary) {
            h3 { (ablation.with.label) " less " (c.against) ", " (c.compared.metric) }
            (PreEscaped(forest(&c.compared)))
        }
        (figure(ablation, pictures))
        @if !outcome.tuned.is_empty() { (weights(&outcome.tuned, ablation.primary)) }
        h2 { "Cells" }
        (cells(ablation, outcome))
        p.note {
            "strandbench " (outcome.provenance.version) ", commit " (outcome.provenance.commit) "."
        }
    };
    frame(&format!("strandbench · {}", ablation.name), content)
}

fn table(outcome: &Outcomes) -> Markup {
    html! { div.wide { table {
        tr {
            th { "against" } th { "metric" } th { "weights" } th.n { "mean" } th.n { "95 % interval" } th.n { "effect" } th.n { "scenes won" }
            th { "worst scene" } th.n { "p" } th.n { "p, Holm" } th { "claim" }
        }
        @for c in &outcome.comparisons {
            @let m = &c.compared;
            @let [metric, mean, interval, p_holm, effect, won, worst, _] = line(m);
            tr.aside[!c.primary] {
                td { (c.against) }
                td { (metric) @if !c.primary { " (exploratory)" } }
                td { (if c.tuned { "tuned" } else { "the variant’s own" }) }
                td.n { (mean) } td.n { (interval) } td.n { (effect) } td.n { (won) } td { (worst) }
                td.n { (p_text(m.difference.p)) } td.n { (p_holm) }
                @match m.verdict {
                    Verdict::Better => td.met { "holds" },
                    Verdict::Worse => td.missed { "the opposite" },
                    _ => td { "open" },
                }
            }
        }
    } } }
}

fn figure(ablation: &Ablation, pictures: &[Picture]) -> Markup {
    html! {
        h2 { "Side by side" }
        p.note { "The set’s first scene, tuned weights: the surface lit from the upper left, and its signed depth error, blue towards the camera, red away, full colour at 10 mm. \
            In the order of " (ablation.source) ": what it argues against first. All of them in one picture: " a href="figure.png" { "figure.png" } "." }
        div.three { @for p in pictures {
            figure {
                @for (file, what) in [(&p.relief, "surface"), (&p.error, "depth error")] {
                    @if let Some(file) = file { img src=(file) alt=(format!("{what}, {}", p.arm)); }
                }
                figcaption { (p.arm) @if p.error.is_none() { ": no answer" } }
            }
        } }
    }
}

/// Whether the best weight is the least or the greatest tried: a better one may lie beyond.
fn edge(t: &Tuned) -> bool {
    [t.tried.first(), t.tried.last()].into_iter().flatten().any(|end| end.0 == t.lambda)
}

fn weights(tuned: &[Tuned], metric: &str) -> Markup {
    html! {
        h2 { "Weights of smoothness" }
        p.note { "Every arm got the same trials, on scenes from which no result is drawn: mean " (metric) " over them." }
        div.wide { table {
            tr { th { "arm" } th.n { "own λ" } th.n { "tuned λ" } th { "tried" } }
            @for t in tuned { tr {
                td { (t.arm) } td.n { (t.own_lambda) } td.n.method { (t.lambda) }
                td { @if edge(t) { "at the edge of what was tried: " }
                    @for (i, (lambda, v)) in t.tried.iter().enumerate() {
                    @if i > 0 { "; " } (lambda) ": " (v.map_or_else(|| "no answer".to_owned(), |v| format!("{v:.3}")))
                } }
            } }
        } }
    }
}

fn cells(ablation: &Ablation, outcome: &Outcomes) -> Markup {
    let value = |r: &super::ArmRow| super::figure_of(&r.row, ablation.primary);
    html! { div.wide { table {
        tr { th { "scene" } th { "condition" } th.n { "seed" } th { "arm" } th { "weights" } th.n { (ablation.primary) } }
        @for r in &outcome.rows { tr {
            td { (r.scene_name) } td { (r.condition) } td.n { (r.row.seed) } td { (r.arm) }
            td { (if r.tuned { "tuned" } else { "own" }) }
            td.n { (value(r).map_or_else(|| "no answer".to_owned(), |v| format!("{v:.3}"))) }
        } }
    } } }
}
