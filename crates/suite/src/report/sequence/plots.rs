//! What changes over time, and by distance and angle, as drawings.

use super::data::Moving;
use crate::pictures::sequential;
use crate::report::chart::{Chart, Series, ticks};
use crate::sequence::FrameRow;
use maud::{Markup, PreEscaped, html};
use strandbench_score::StrandGrid;

/// A figure of each frame.
type Pick<'a> = Box<dyn Fn(&FrameRow) -> Option<f64> + 'a>;

/// A chart of some figures over the frames.
fn over_time(data: &Moving, title: &str, series: Vec<(&str, &str, Pick<'_>)>) -> Option<String> {
    let rows = &data.figures.frames;
    let ms = |r: &FrameRow| f64::from(r.index) / data.sequence.file.frame_rate_hz * 1e3;
    let drawn: Vec<Series> = series
        .into_iter()
        .map(|(name, colour, pick)| Series {
            name,
            colour,
            dash: "",
            points: rows.iter().filter_map(|r| Some((ms(r), pick(r)?))).collect(),
        })
        .filter(|s| !s.points.is_empty())
        .collect();
    let top = drawn.iter().flat_map(|s| s.points.iter().map(|p| p.1)).fold(0.0, f64::max);
    if drawn.is_empty() || rows.len() < 2 {
        return None;
    }
    let x = (ms(&rows[0]), ms(&rows[rows.len() - 1]));
    let y = (0.0, if top > 0.0 { top * 1.08 } else { 1.0 });
    Some(
        Chart {
            x,
            y,
            x_title: "time, ms",
            y_title: title,
            x_ticks: ticks(x.0, x.1, 6),
            y_ticks: ticks(y.0, y.1, 5),
            size: (560.0, 300.0),
        }
        .lines(&drawn),
    )
}

/// Charts over time.
pub(super) fn time(data: &Moving) -> Markup {
    let figure = |metric: &'static str| -> Pick<'_> {
        Box::new(move |r: &FrameRow| r.method.get(metric).copied().flatten())
    };
    let charts = [
        (
            over_time(
                data,
                "depth error, mm",
                vec![("median", "#0a5c8a", figure("A1.median")), ("90 %", "#b3541e", figure("A1.p90"))],
            ),
            "Depth error (A1) of each frame.",
        ),
        (
            over_time(
                data,
                "share",
                vec![
                    ("precision", "#0a5c8a", figure("B1.precision_3mm")),
                    ("recall", "#b3541e", figure("B1.recall_3mm")),
                    ("survival", "#2f7d4f", Box::new(|r| r.motion.survival)),
                ],
            ),
            "Strands within 3 mm and 30° (B1, over V2), and the share of the first frame's strands that still follow theirs (C7).",
        ),
        (
            over_time(
                data,
                "mm",
                vec![
                    ("drift", "#b3541e", Box::new(|r| r.motion.drift_mm)),
                    ("truth", "#7a7a7a", Box::new(|r| r.motion.moved_mm)),
                ],
            ),
            "Drift of tracked strands against the first frame (C4), beside how far the true hair has moved.",
        ),
        (
            over_time(
                data,
                "mm a frame",
                vec![
                    ("jitter", "#0a5c8a", Box::new(|r| r.motion.jitter_mm)),
                    ("change", "#8b5fa8", Box::new(|r| r.motion.regrown_mm)),
                    ("flow error", "#b3541e", Box::new(|r| r.motion.flow_mm)),
                ],
            ),
            "Jitter of tracked strands (C1), change of the strands from frame to frame once the true motion is taken away (C2), error of their motion (C6).",
        ),
    ];
    html! {
        div.two {
            @for (svg, caption) in charts {
                @if let Some(svg) = svg {
                    figure { (PreEscaped(svg)) figcaption { (caption) } }
                }
            }
        }
    }
}

/// Gain and lag by frequency as a table.
pub(super) fn bands(data: &Moving) -> Markup {
    let t = data.table();
    let rows: Vec<(&str, Vec<Option<f64>>)> = ["1hz", "2hz", "4hz", "8hz"]
        .into_iter()
        .map(|band| {
            let of = |name: &str| t.method(&format!("{name}_{band}"));
            (band, vec![of("C5.log2_gain"), of("C5.lag"), of("C5.depth.log2_gain"), of("C5.depth.lag")])
        })
        .filter(|(_, values)| values.iter().any(Option::is_some))
        .collect();
    html! {
        @if !rows.is_empty() {
            h3 { "Is the motion followed, and in time?" }
            table {
                tr { th { "around" } th.n { "strands: amplitude" } th.n { "lag, ms" } th.n { "depth: amplitude" } th.n { "lag, ms" } }
                @for (band, v) in &rows {
                    tr {
                        td { (band.replace("hz", " Hz")) }
                        @for (i, value) in v.iter().enumerate() {
                            td.n { @match value {
                                Some(g) if i % 2 == 0 => (format!("{:.0} %", g.exp2() * 100.0)),
                                Some(ms) => (format!("{ms:+.1}").replace('-', "−")),
                                None => "—",
                            } }
                        }
                    }
                }
            }
            p.note { "Amplitude below 100 % or a lag is what blurring over time costs (C5). Frequencies at which the true hair does not move are left out." }
        }
    }
}

/// Precision and recall over distance and angle, the mean over frames, method beside ceiling.
pub(super) fn grids(data: &Moving) -> Markup {
    let mean = |subject: &str, pick: fn(&StrandGrid) -> &[[f64; 6]; 7]| -> Option<[[f64; 6]; 7]> {
        let all = data.grids.get(subject).filter(|g| !g.is_empty())?;
        let mut sum = [[0.0; 6]; 7];
        for g in all {
            for (row, own) in sum.iter_mut().zip(pick(g)) {
                row.iter_mut().zip(own).for_each(|(s, v)| *s += v / all.len() as f64);
            }
        }
        Some(sum)
    };
    let tables = [
        ("precision", mean("method", |g| &g.precision)),
        ("recall", mean("method", |g| &g.recall)),
        ("ceiling’s precision", mean("C", |g| &g.precision)),
        ("ceiling’s recall", mean("C", |g| &g.recall)),
    ];
    html! {
        @if tables[0].1.is_some() {
            h2 { "Strands by distance and angle" }
            div.two {
                @for (title, grid) in tables {
                    @if let Some(grid) = grid {
                        figure {
                            table.heat {
                                tr { th { (title) } @for deg in StrandGrid::DEG { th.n { (deg) "°" } } }
                                @for (mm, row) in StrandGrid::MM.iter().zip(&grid) {
                                    tr { td { (mm) " mm" } @for v in row { (cell(*v)) } }
                                }
                            }
                        }
                    }
                }
            }
            p.note { "Share of strand length within a distance of a strand of the other set that runs within an angle of it (B1, hair that two cameras or more see; the mean over frames). Precision is over what the estimate shows, recall over what is there." }
        }
    }
}

fn cell(share: f64) -> Markup {
    let [r, g, b] = sequential(share as f32 * 0.8);
    let ink = if share > 0.55 { "#fff" } else { "#1d2327" };
    html! { td.n style=(format!("background:rgb({r},{g},{b});color:{ink}")) { (format!("{:.0}", share * 100.0)) } }
}
