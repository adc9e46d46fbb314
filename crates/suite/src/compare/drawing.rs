//! Paired differences with their interval, scene by scene.

use super::Compared;
use super::text::{short, signed};
use crate::report::chart::ticks;
use std::fmt::Write as _;
use strandbench_stats::Winner;

const WIDTH: f64 = 900.0;
const LEFT: f64 = 250.0;
const RIGHT: f64 = 130.0;
const ROW: f64 = 22.0;
const TOP: f64 = 26.0;

const BETTER: &str = "#2f7d4f";
const WORSE: &str = "#b3541e";
const NEITHER: &str = "#7a7a7a";

/// A dot a scene, sorted, an arrow where the difference is infinite, and below them the mean with its interval.
pub(crate) fn forest(m: &Compared) -> String {
    let d = &m.difference;
    let mut scenes: Vec<_> = d.by_scene.iter().collect();
    let place = |s: &&strandbench_stats::SceneDifference| match (s.difference, s.winner == Winner::B) {
        (Some(v), _) => v,
        (None, better) => {
            if better == m.lower_is_better {
                f64::NEG_INFINITY
            } else {
                f64::INFINITY
            }
        }
    };
    scenes.sort_by(|a, b| place(a).total_cmp(&place(b)));
    let finite =
        scenes.iter().filter_map(|s| s.difference).chain(d.interval.into_iter().flatten()).chain([0.0]);
    let (low, high) = finite.fold((0.0f64, 0.0f64), |(l, h), v| (l.min(v), h.max(v)));
    // All equal to zero: any width does.
    let pad = if high > low { (high - low) * 0.06 } else { 1.0 };
    let (low, high) = (low - pad, high + pad);
    let x = |v: f64| LEFT + (v - low) / (high - low) * (WIDTH - LEFT - RIGHT);
    let bottom = TOP + ROW * (scenes.len() as f64 + 2.0);
    let mut svg = format!("<svg class=\"chart\" viewBox=\"0 0 {WIDTH} {}\" role=\"img\">", bottom + 44.0);
    let scale = if m.unit == "share" { 100.0 } else { 1.0 };
    for (value, text) in ticks(low * scale, high * scale, 6) {
        let at = x(value / scale);
        let _ = write!(
            svg,
            "<line class=\"grid\" x1=\"{at:.1}\" x2=\"{at:.1}\" y1=\"{TOP}\" y2=\"{bottom:.1}\"/>\
             <text class=\"tick\" text-anchor=\"middle\" x=\"{at:.1}\" y=\"{:.1}\">{}</text>",
            bottom + 16.0,
            text.replace('-', "−")
        );
    }
    let zero = x(0.0);
    let _ = write!(
        svg,
        "<line x1=\"{zero:.1}\" x2=\"{zero:.1}\" y1=\"{TOP}\" y2=\"{bottom:.1}\" stroke=\"#48525a\" stroke-width=\"1.5\"/>"
    );
    let (left, right) = if m.lower_is_better { ("better", "worse") } else { ("worse", "better") };
    let _ = write!(
        svg,
        "<text class=\"tick\" text-anchor=\"end\" x=\"{:.1}\" y=\"16\">← {left}</text>\
         <text class=\"tick\" x=\"{:.1}\" y=\"16\">{right} →</text>",
        zero - 8.0,
        zero + 8.0
    );
    for (i, s) in scenes.iter().enumerate() {
        let y = TOP + ROW * (i as f64 + 0.7);
        let colour = match s.winner {
            Winner::B => BETTER,
            Winner::A => WORSE,
            Winner::Tie => NEITHER,
        };
        label(&mut svg, LEFT - 12.0, y, "end", short(m, &s.scene));
        match s.difference {
            Some(v) => {
                let _ = write!(
                    svg,
                    "<line x1=\"{zero:.1}\" x2=\"{0:.1}\" y1=\"{y:.1}\" y2=\"{y:.1}\" stroke=\"{colour}\" stroke-width=\"1.2\" opacity=\".55\"/>\
                     <circle cx=\"{0:.1}\" cy=\"{y:.1}\" r=\"4.5\" fill=\"{colour}\"/>",
                    x(v)
                );
                label(&mut svg, WIDTH - RIGHT + 14.0, y, "start", &signed(v, &m.unit));
            }
            None if s.winner == Winner::Tie => label(&mut svg, WIDTH - RIGHT + 14.0, y, "start", "undecided"),
            None => {
                let (end, tip) = if place(s) > 0.0 { (WIDTH - RIGHT, -9.0) } else { (LEFT, 9.0) };
                let _ = write!(
                    svg,
                    "<path d=\"M{zero:.1} {y:.1}H{end:.1}M{:.1} {:.1}L{end:.1} {y:.1}L{:.1} {:.1}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>",
                    end + tip,
                    y - 5.0,
                    end + tip,
                    y + 5.0
                );
                label(&mut svg, WIDTH - RIGHT + 14.0, y, "start", "infinite");
            }
        }
    }
    let y = TOP + ROW * (scenes.len() as f64 + 1.3);
    match (d.mean, d.interval) {
        (Some(mean), interval) => {
            let [low, high] = interval.unwrap_or([mean, mean]);
            let _ = write!(
                svg,
                "<path d=\"M{0:.1} {y:.1}H{1:.1}M{0:.1} {2:.1}V{3:.1}M{1:.1} {2:.1}V{3:.1}\" stroke=\"#0a5c8a\" stroke-width=\"2.5\" fill=\"none\"/>\
                 <rect x=\"{4:.1}\" y=\"{5:.1}\" width=\"11\" height=\"11\" fill=\"#0a5c8a\" transform=\"rotate(45 {6:.1} {y:.1})\"/>",
                x(low),
                x(high),
                y - 6.0,
                y + 6.0,
                x(mean) - 5.5,
                y - 5.5,
                x(mean)
            );
            label(&mut svg, WIDTH - RIGHT + 14.0, y, "start", &signed(mean, &m.unit));
        }
        (None, _) => label(&mut svg, zero + 8.0, y, "start", "no mean: a difference is infinite"),
    }
    label(&mut svg, LEFT - 12.0, y, "end", "mean and interval");
    let title = if m.unit == "share" {
        "difference, percentage points".to_owned()
    } else {
        format!("difference, {}", m.unit)
    };
    let middle = (LEFT + WIDTH - RIGHT) / 2.0;
    let _ = write!(
        svg,
        "<text class=\"axis\" text-anchor=\"middle\" x=\"{middle:.1}\" y=\"{:.1}\">{title}</text></svg>",
        bottom + 36.0
    );
    svg
}

fn label(svg: &mut String, x: f64, y: f64, anchor: &str, text: &str) {
    let text: String = if text.chars().count() > 38 {
        text.chars().take(37).chain(['…']).collect()
    } else {
        text.to_owned()
    };
    let text = text.replace('&', "&amp;").replace('<', "&lt;");
    let _ = write!(
        svg,
        "<text class=\"tick\" text-anchor=\"{anchor}\" x=\"{x:.1}\" y=\"{:.1}\">{text}</text>",
        y + 4.0
    );
}
