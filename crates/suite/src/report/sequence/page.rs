//! The page of a moving scene.

use super::data::Moving;
use super::frames::{self, Pictures};
use super::plots;
use crate::report::page::frame;
use crate::report::tables::{self, format_value};
use maud::{Markup, PreEscaped, html};

const SCRIPT: &str = include_str!("player.js");

/// The result in a few sentences, from the figures alone.
pub(super) fn verdict(data: &Moving) -> String {
    let t = data.table();
    let n = data.sequence.file.frames.len();
    let absent = data.figures.frames.iter().filter(|f| f.absent.is_some()).count();
    let mut text = match t.score("A1.median", "method").map(|s| s.value) {
        Some(Some(mm)) => {
            format!("Over {n} frames half of the hair pixels have a depth within {mm:.2} mm of the truth.")
        }
        _ => format!(
            "Over {n} frames more than half of the hair pixels have no usable depth: the method fails here."
        ),
    };
    if absent > 0 {
        text.push_str(&format!(" {absent} of the frames have no answer and count as wrong."));
    }
    if let Some(mm) = t.method("C3.flicker.p50") {
        text.push_str(&format!(
            " The depth of a piece of hair flickers by {mm:.2} mm (median standard deviation)."
        ));
    }
    if let (Some(f), Some(n1)) = (t.method("B1.f_3mm"), t.score("B1.f_3mm", "N1").and_then(|s| s.value)) {
        let n2 = t.score("B1.f_3mm", "N2").and_then(|s| s.value).unwrap_or(n1);
        let best = n1.max(n2);
        text.push_str(&format!(
            " Strands agree with the true ones within 3 mm and 30° to {:.0} % (F); the best guess without images reaches {:.0} %{}.",
            f * 100.0,
            best * 100.0,
            if f > best { "" } else { ": nothing has been measured" }
        ));
    }
    text
}

/// The page.
pub(super) fn page(data: &Moving, pictures: &Pictures) -> String {
    let file = &data.sequence.file;
    let title = format!("{} · {}", file.scene, data.variant);
    let content = html! {
        (header(data))
        h2 { "Frame by frame" }
        (player(data, pictures))
        h2 { "Over time" }
        (plots::time(data))
        (plots::bands(data))
        (plots::grids(data))
        (tables::scores(data.table(), &html! {}))
        (absent(data))
        (costs(data))
        (provenance(data))
    };
    frame(&title, content)
}

fn header(data: &Moving) -> Markup {
    let t = data.table();
    let file = &data.sequence.file;
    let tile = |metric: &str, meaning: &str| {
        let score = t.score(metric, "method");
        html! { @if let Some(s) = score { div.tile { b { (format_value(s.value, &s.unit)) } span { (meaning) } } } }
    };
    html! {
        header {
            p.kicker { "strandbench report · seed " (data.scores.seed) " · protocol " (data.scores.protocol) }
            h1 { (file.scene) " " span { "reconstructed by " (data.variant) } }
            p.lead { (verdict(data)) }
            div.tiles {
                div.tile { b { (file.frames.len()) " " small { "frames" } } span { (format!("at {} a second", file.frame_rate_hz)) } }
                (tile("A1.median", "median depth error (A1)"))
                (tile("C3.flicker.p50", "flicker of the envelope (C3)"))
                (tile("C5.depth.lag_2hz", "lag of the depth at 2 Hz (C5)"))
                (tile("B1.f_3mm", "F of strands within 3 mm, 30° (B1, V2)"))
                (tile("B1.f_3mm.cc", "the same above chance"))
                (tile("C1.noise_sd", "jitter of tracked strands as noise (C1)"))
                (tile("C7.survival_1s", "survival of strands after 1 s (C7)"))
            }
        }
    }
}

fn player(data: &Moving, pictures: &Pictures) -> Markup {
    let files: Vec<serde_json::Value> = data
        .sequence
        .file
        .frames
        .iter()
        .map(|&index| {
            let names: Vec<String> = pictures
                .kinds
                .iter()
                .map(|k| format!("{}/{}", super::PICTURES, frames::name(index, k.0)))
                .collect();
            serde_json::json!({ "index": index, "files": names })
        })
        .collect();
    let rate = data.sequence.file.frame_rate_hz;
    let json = serde_json::json!({ "rate": rate, "frames": files }).to_string().replace("</", "<\\/");
    html! {
        div id="player" {
            div.panels {
                @for (i, (_, caption)) in pictures.kinds.iter().enumerate() {
                    figure { img data-panel=(i) alt=(caption); figcaption { (caption) } }
                }
            }
            div.controls {
                button type="button" name="play" { "play" }
                input type="range" name="frame" min="0" max=(data.sequence.file.frames.len() - 1) value="0" aria-label="frame";
                output {}
                label { "speed " select name="speed" {
                    option value="0.05" { "1/20" } option value="0.1" selected { "1/10" } option value="0.25" { "1/4" } option value="1" { "real time" }
                } }
            }
        }
        p.note {
            "Drag the slider, or use the arrow keys and the space bar. "
            @if let Some((index, file)) = &pictures.coloured {
                "The strands of frame " (index) " with their errors, for a viewer of meshes: " a href=(file) { (file) } "."
            }
        }
        script type="application/json" id="player-data" { (PreEscaped(json)) }
        script { (PreEscaped(SCRIPT)) }
    }
}

fn absent(data: &Moving) -> Markup {
    let rows: Vec<_> =
        data.figures.frames.iter().filter_map(|f| Some((f.index, f.absent.as_ref()?))).collect();
    html! {
        @if !rows.is_empty() {
            h3 { "Frames without an answer" }
            table {
                tr { th.n { "frame" } th { "why" } }
                @for (index, why) in rows { tr { td.n { (index) } td { (why) } } }
            }
        }
    }
}

/// What Luo et al. (section 6) give for a part of their method, s, and the steps that make up that part here.
const PAPER: [(&str, &str, &[&str]); 5] = [
    ("orientation field", "30", &["pyramid", "orientation"]),
    ("multi-view stereo", "300", &["cost volume", "aggregation", "level sum", "mrf", "refinement", "mesh"]),
    ("temporal de-noising", "180", &["registration", "denoise"]),
    ("surface tracking, seeds", "60", &["template", "layer", "seeds"]),
    ("growing", "120", &["orientation 3d", "diffusion", "growth"]),
];

fn costs(data: &Moving) -> Markup {
    let frames = data.sequence.file.frames.len() as f64;
    let known: Vec<&str> = PAPER.iter().flat_map(|p| p.2).copied().collect();
    let seconds = |steps: &[&str]| -> f64 {
        data.steps.iter().filter(|(name, _)| steps.contains(&name.as_str())).map(|(_, s)| s).sum()
    };
    let rest: Vec<&str> = data.steps.iter().map(|s| s.0.as_str()).filter(|s| !known.contains(s)).collect();
    let all: f64 = data.steps.iter().map(|s| s.1).sum();
    html! {
        h2 { "Time and memory" }
        div.two {
            div {
                h3 { "Stages, all frames" }
                table {
                    tr { th { "stage" } th.n { "wall, s" } th.n { "a frame, s" } th.n { "processor, s" } th.n { "peak memory, MiB" } }
                    @for (stage, cost) in data.costs() {
                        tr {
                            td { (stage) }
                            td.n { (format!("{:.1}", cost.wall_s)) }
                            td.n { (format!("{:.2}", cost.wall_s / frames)) }
                            td.n { (cost.cpu_s.map_or("—".to_owned(), |s| format!("{s:.1}"))) }
                            td.n { (cost.peak_mib.map_or("—".to_owned(), |m| format!("{m:.0}"))) }
                        }
                    }
                }
                p.note { "A frame whose inputs did not change is not worked on again; its cost is that of the run that made it. The method's own steps are on the right." }
            }
            div {
                h3 { "Inside the method, median frame" }
                table {
                    tr { th { "part" } th.n { "wall, s" } th.n { "Luo et al., s" } }
                    @for (part, paper, steps) in PAPER {
                        tr { td { (part) span.why { (steps.join(", ")) } } td.n { (format!("{:.2}", seconds(steps))) } td.n { (paper) } }
                    }
                    @if !rest.is_empty() {
                        tr { td { "other" span.why { (rest.join(", ")) } } td.n { (format!("{:.2}", seconds(&rest))) } td.n {} }
                    }
                    tr.total { td { "together" } td.n { (format!("{all:.2}")) } td.n { "690" } }
                }
                p.note { "The paper's figures are for a frame on its authors' machine of 2012; its 10 s of rendering are not part of the method here." }
            }
        }
    }
}

fn provenance(data: &Moving) -> Markup {
    let record = data.records.get("reconstruct").and_then(|r| r.last());
    html! {
        h2 { "How to make this again" }
        @if let Some(r) = record {
            p { "strandbench " (r.provenance.version) ", commit " code { (r.provenance.commit) } ", " (r.provenance.rustc) ", " (r.provenance.target) ", on " (r.provenance.cpu) " with " (r.provenance.threads) " threads." }
        }
        @if !data.notes.is_empty() {
            details { summary { "What the method says of the last frame" } ul { @for n in &data.notes { li { (n) } } } }
        }
        details { summary { "Parameters of the method" }
            table { @for (key, value) in &data.parameters { tr { td { code { (key) } } td { (value) } } } }
        }
        details { summary { "The scene" } pre { (data.sequence.file.toml) } }
    }
}
