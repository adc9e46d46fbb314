//! The history as charts.

use super::Entry;
use crate::report::chart::{Chart, Series, ticks};
use crate::report::page::frame;
use crate::report::tables::format_value;
use maud::{PreEscaped, html};
use std::collections::BTreeMap;

const COLOURS: [&str; 6] = ["#0a5c8a", "#b3541e", "#2f7d4f", "#8b5fa8", "#c98a1b", "#7a7a7a"];

/// Values of one line by run.
type Runs = BTreeMap<i64, Option<f64>>;
/// Lines by variant and seed.
type Lines<'a> = BTreeMap<(&'a str, u64), Runs>;

pub(crate) fn page(entries: &[Entry]) -> String {
    // By scene and metric, then by variant and seed.
    let mut charts: BTreeMap<(&str, &str, &str), Lines> = BTreeMap::new();
    for e in entries.iter().filter(|e| !e.metric.is_empty()) {
        let lines = charts.entry((&e.scene, &e.metric, &e.unit)).or_default();
        lines.entry((&e.variant, e.seed)).or_default().insert(e.run, e.value);
    }
    // A failed cell is the worst answer of every metric that its line has.
    for e in entries.iter().filter(|e| e.metric.is_empty()) {
        for ((scene, ..), lines) in &mut charts {
            if let Some(runs) = lines.get_mut(&(e.variant.as_str(), e.seed)).filter(|_| *scene == e.scene) {
                runs.insert(e.run, None);
            }
        }
    }
    let runs: std::collections::BTreeSet<i64> = entries.iter().map(|e| e.run).collect();
    let content = html! {
        header {
            p.kicker { "strandbench · history" }
            h1 { (runs.len()) " runs" }
            p.lead { "What every run into this folder measured, in the order of runs. A gap is a run without an answer, the worst there is." }
        }
        @for ((scene, metric, unit), lines) in &charts {
            h3 { (metric) " · " (scene) }
            (PreEscaped(chart(lines, unit)))
            table {
                tr { th { "line" } th.n { "runs" } th.n { "first" } th.n { "last" } th.n { "least" } th.n { "most" } }
                @for ((variant, seed), values) in lines {
                    @let known: Vec<f64> = values.values().copied().flatten().collect();
                    @let value = |v: Option<f64>| format_value(v, unit);
                    tr {
                        td { (variant) ", seed " (seed) } td.n { (values.len()) }
                        td.n { (value(values.values().next().copied().flatten())) } td.n { (value(values.values().last().copied().flatten())) }
                        td.n { (value(known.iter().copied().reduce(f64::min))) } td.n { (value(known.iter().copied().reduce(f64::max))) }
                    }
                }
            }
        }
    };
    frame("strandbench · history", content)
}

fn chart(lines: &Lines, unit: &str) -> String {
    let known = lines.values().flat_map(|r| r.values().copied().flatten());
    let (low, high) = known.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    if low > high {
        return "<p class=\"fail\">No run gave an answer.</p>".to_owned();
    }
    let pad = if high > low { (high - low) * 0.1 } else { high.abs().max(1.0) * 0.1 };
    let (low, high) = (low - pad, high + pad);
    let runs = lines.values().flat_map(|r| r.keys().copied());
    let (first, last) = runs.fold((i64::MAX, i64::MIN), |(a, b), r| (a.min(r), b.max(r)));
    let names: Vec<String> = lines.keys().map(|(variant, seed)| format!("{variant} {seed}")).collect();
    let mut series = Vec::new();
    for (i, (values, name)) in lines.values().zip(&names).enumerate() {
        let colour = COLOURS[i % COLOURS.len()];
        // A run without an answer parts the line.
        let mut points: Vec<Vec<(f64, f64)>> = vec![Vec::new()];
        for (run, value) in values {
            match value {
                Some(v) => points.last_mut().expect("there is one").push((*run as f64, *v)),
                None => points.push(Vec::new()),
            }
        }
        points.retain(|p| !p.is_empty());
        let n = points.len();
        for (k, mut points) in points.into_iter().enumerate() {
            if let [(x, y)] = points[..] {
                points.push((x + 0.05, y));
            }
            let name = if k + 1 == n { name.as_str() } else { "" };
            series.push(Series { name, colour, dash: "", points });
        }
    }
    let step = ((last - first) / 10).max(1) as usize;
    Chart {
        x: (first as f64 - 0.5, last as f64 + 0.5),
        y: (low, high),
        x_title: "run",
        y_title: unit,
        x_ticks: (first..=last).step_by(step).map(|r| (r as f64, r.to_string())).collect(),
        y_ticks: ticks(low, high, 5),
        size: (900.0, 260.0),
    }
    .lines(&series)
}
