//! Tables of scores and of costs.

use super::data::{Data, Figures};
use super::sections::thousands;
use maud::{Markup, html};

/// What a subject of the tables is, in a few words.
pub(crate) fn subject_meaning(subject: &str) -> &'static str {
    match subject {
        "method" => "the method",
        "N0" => "a random depth on the pixel's ray inside the visual hull, in a random direction",
        "N1" => "the same in the scene's principal direction",
        "N2" => "the front of the visual hull, with a smoothed direction field",
        "NC" => "one depth for all pixels",
        "C" => "the truth where at least two cameras see it: the ceiling",
        _ => "",
    }
}

/// Names of the subjects in a caption.
pub(crate) fn subject_key(figures: Figures<'_>) -> Markup {
    html! {
        @for (i, subject) in figures.subjects().into_iter().filter(|s| *s != "method").enumerate() {
            @if i > 0 { "; " }
            b style=(format!("color:{}", super::chart::colour_of(subject))) { (subject) } " " (subject_meaning(subject))
        }
        "."
    }
}

/// A figure for people: shares in per cent, otherwise three significant digits or so.
pub(crate) fn format_value(value: Option<f64>, unit: &str) -> String {
    let Some(v) = value else { return "none".into() };
    if unit == "share" {
        return format!("{:.1} %", v * 100.0).replace('-', "−");
    }
    let text = match v.abs() {
        a if a >= 10_000.0 => {
            format!("{}{}", if v < 0.0 { "−" } else { "" }, thousands(a.round() as u64))
        }
        a if a >= 100.0 => format!("{v:.0}"),
        a if a >= 10.0 => format!("{v:.1}"),
        _ => format!("{v:.2}"),
    };
    let text = text.replace('-', "−");
    match unit {
        "deg" => format!("{text}°"),
        "" => text,
        unit => format!("{text} {unit}"),
    }
}

/// A long value cut to one line.
pub(crate) fn one_line(text: &str) -> String {
    let line = text.replace('\n', " ");
    if line.chars().count() > 120 {
        format!("{}…", line.chars().take(119).collect::<String>())
    } else {
        line
    }
}

/// Figures that stand in the short table.
const KEY: &[&str] = &[
    "A1.median",
    "A1.p90",
    "A1.p95",
    "A1.bias_median",
    "A1.over_1mm",
    "A1.over_2mm",
    "A1.over_5mm",
    "A1.over_10mm",
    "A2.within_10mm",
    "A2.pushed.within_10mm",
    "A3.completeness",
    "A4.iou.mean",
    "A5.median",
    "A5.within_20deg",
    "B7.median",
    "B7.within_20deg",
    "B1.precision_3mm",
    "B1.recall_3mm",
    "B1.f_3mm",
    "B1.f_3mm.cc",
    "B3.idf1",
    "C1.noise_sd",
    "C2.regrown.mean",
    "C2.above_floor",
    "C3.flicker.p50",
    "C3.flicker.p95",
    "C4.drift.median",
    "C5.lag_1hz",
    "C5.depth.lag_1hz",
    "C6.flow.median",
    "C7.survival_1s",
];

/// The key figures, then every figure, a row a metric, a column a subject, a table a group; `more` are rows below the
/// key figures.
pub(crate) fn scores(figures: Figures<'_>, more: &Markup) -> Markup {
    let metrics = figures.metrics();
    let mut groups: Vec<&str> = Vec::new();
    for m in &metrics {
        if !groups.contains(&group(m)) {
            groups.push(group(m));
        }
    }
    let key: Vec<&str> = metrics.iter().copied().filter(|m| KEY.contains(m)).collect();
    html! {
        h2 { "Scores" }
        p {
            "Each figure stands beside what guesses reach that never looked at an image, and beside a ceiling. "
            "A pixel that was asked for and not answered counts as infinitely wrong; “none” means that the figure itself is infinite for that reason."
        }
        p.note { (subject_key(figures)) }
        (metric_table(figures, &key, more))
        @for name in &groups {
            details {
                summary { "All of " (name) ": " (group_title(name)) }
                (metric_table(figures, &metrics.iter().copied().filter(|m| group(m) == *name).collect::<Vec<_>>(), &html! {}))
            }
        }
    }
}

fn group(metric: &str) -> &str {
    metric.split('.').next().unwrap_or_default()
}

fn metric_table(figures: Figures<'_>, metrics: &[&str], more: &Markup) -> Markup {
    let subjects = figures.subjects();
    html! {
        table.scores {
            tr {
                th { "metric" }
                @for s in &subjects { th.n { (s) } }
                th.n { "answered" } th.n { "asked for" }
            }
            @for metric in metrics {
                tr {
                    td { (metric_title(metric)) span.why { code { (metric) } " " (metric_meaning(metric)) } }
                    @for subject in &subjects {
                        @let score = figures.score(metric, subject);
                        td.n.method[*subject == "method"].ceiling[*subject == "C"] {
                            @match score { Some(s) => (format_value(s.value, &s.unit)), None => "" }
                        }
                    }
                    @let method = figures.score(metric, "method");
                    td.n { @if let Some(s) = method { (format!("{:.1} %", s.coverage * 100.0)) } }
                    td.n { @if let Some(s) = method { (thousands(s.wanted)) } }
                }
            }
            (more)
        }
    }
}

fn group_title(group: &str) -> &'static str {
    match group {
        "A1" => "depth error along the reference camera's rays",
        "A2" => "distance to the nearest visible strand (Luo et al., Fig. 13)",
        "A3" => "completeness",
        "A4" => "silhouettes",
        "A5" => "3-D orientation of the surface",
        "B1" => "strands: precision, recall and F within a distance and an angle",
        "B2" => "strands: distances",
        "B3" => "strands: identity along their length",
        "B4" => "strands: length and number",
        "B5" => "strands: shape",
        "B6" => "strands: free space",
        "B7" => "2-D orientation in the image",
        "C1" => "jitter of tracked strands",
        "C2" => "change of strands without identity",
        "C3" => "flicker of the envelope",
        "C4" => "drift against the first frame",
        "C5" => "gain and lag of the motion by frequency",
        "C6" => "error of the motion from frame to frame",
        "C7" => "survival of the first frame's strands",
        _ => "",
    }
}

/// The protocol's row for a figure; a figure per camera (`A4.iou.2`) has its row without the number.
fn row(id: &str) -> Option<&'static strandbench_score::Metric> {
    let family = id.rsplit_once('.').map_or(id, |(family, _)| family);
    strandbench_score::metric(id).or_else(|_| strandbench_score::metric(family)).ok()
}

fn metric_title(id: &str) -> String {
    match row(id) {
        Some(m) if m.id == id => m.title.to_owned(),
        Some(m) => format!("{}, camera {}", m.title, id.rsplit('.').next().unwrap_or_default()),
        None => id.to_owned(),
    }
}

fn metric_meaning(id: &str) -> &'static str {
    row(id).map_or("", |m| m.meaning)
}

/// The cameras as they are and as calibration has them.
pub(crate) fn cameras(data: &Data) -> Markup {
    html! {
        table {
            tr {
                th { "camera" } th.n { "x, mm" } th.n { "y, mm" } th.n { "z, mm" } th.n { "focal length, px" }
                th.n { "calibration off by, mm" } th.n { "and by, °" }
            }
            @for (is, given) in data.truth.rig.cameras.iter().zip(&data.rig.cameras) {
                @let c = is.centre_mm();
                @let turn = is.camera_from_world * given.camera_from_world.transpose();
                @let trace = turn.x_axis.x + turn.y_axis.y + turn.z_axis.z;
                @let degrees = ((trace - 1.0) * 0.5).clamp(-1.0, 1.0).acos().to_degrees();
                tr {
                    td { (is.name) }
                    @for v in [c.x, c.y, c.z, is.focal_px.x] { td.n { (format!("{v:.1}")) } }
                    td.n { (format!("{:.3}", c.distance(given.centre_mm()))) }
                    td.n { (format!("{degrees:.4}")) }
                }
            }
        }
        p.note {
            (format!("{:.0} frames a second, {:.1} ms exposure.", data.rig.frame_rate_hz, data.rig.exposure_s * 1e3))
            " The method is given the calibrated rig, not the true one; the scores use the true one."
        }
    }
}

/// Time and memory of each stage, beside the paper's.
pub(crate) fn costs(data: &Data) -> Markup {
    let seconds = |v: Option<f64>| {
        v.map_or("—".to_owned(), |v| if v < 10.0 { format!("{v:.2}") } else { format!("{v:.1}") })
    };
    let reconstruct = data.records.iter().find(|r| r.stage == "reconstruct");
    let inner: f64 = data.diagnostics.stages.iter().map(|s| s.wall_s).sum();
    html! {
        h2 { "Time and memory" }
        p { "Cost is kept apart from accuracy. A stage whose inputs did not change is not run again; its figures are those of the run that made it." }
        div.two {
            div {
                h3 { "Stages" }
                table {
                    tr { th { "stage" } th.n { "wall, s" } th.n { "processor, s" } th.n { "peak memory, MiB" } }
                    @for record in &data.records {
                        tr {
                            td { (record.stage) }
                            td.n { (seconds(Some(record.cost.wall_s))) }
                            td.n { (seconds(record.cost.cpu_s)) }
                            td.n { (record.cost.peak_mib.map_or("—".to_owned(), |m| format!("{m:.0}"))) }
                        }
                    }
                    tr.total {
                        td { "together" }
                        td.n { (seconds(Some(data.records.iter().map(|r| r.cost.wall_s).sum()))) }
                        td.n { (seconds(data.records.iter().map(|r| r.cost.cpu_s).sum())) }
                        td.n { (data.records.iter().filter_map(|r| r.cost.peak_mib).reduce(f64::max).map_or("—".to_owned(), |m| format!("{m:.0}"))) }
                    }
                }
                @if let Some(r) = reconstruct {
                    p.note { (format!("{:.1} frames a minute through the reconstruction, on {} threads of {}.", 60.0 / r.cost.wall_s.max(1e-9), r.provenance.threads, r.provenance.cpu)) }
                }
            }
            div {
                h3 { "Inside the reconstruction" }
                table {
                    tr { th { "step" } th.n { "wall, s" } th.n { "Luo et al., s" } }
                    @for stage in &data.diagnostics.stages {
                        tr { td { (stage.name) } td.n { (seconds(Some(stage.wall_s))) } td.n { (paper_seconds(&stage.name)) } }
                    }
                    tr.total { td { "together" } td.n { (seconds(Some(inner))) } td.n { "330" } }
                }
                p.note { "The paper gives 30 s a frame for the orientation field and 5 minutes for multi-view stereo, on its authors' machine of 2012." }
            }
        }
    }
}

/// What Luo et al. (section 6) give for the part that a step belongs to: their two figures stand beside its
/// last step.
fn paper_seconds(step: &str) -> &'static str {
    match step {
        "orientation" => "30 (orientation field)",
        "mesh" => "300 (multi-view stereo)",
        _ => "",
    }
}
