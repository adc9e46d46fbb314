//! The page of a face: what fourteen cameras see, close by, the truth, the rig, a player.

use super::file::{FaceFile, FaceRenderFile};
use super::preview::{LEGEND, PREVIEW, TRUTHS, css, kind_colour, name};
use crate::report::PAGE;
use crate::report::page::frame;
use crate::report::rig::{Drawn, drawings};
use crate::sequence::frame_name;
use crate::stage::{self, Progress, Record, read_record};
use crate::{Done, SuiteError, hash};
use maud::{Markup, PreEscaped, html};
use std::collections::BTreeMap;
use std::path::Path;
use strandbench_scenes::face::{FaceMoment, FaceStage, HairKind};

const SCRIPT: &str = include_str!("../report/sequence/player.js");

/// Cameras of the player and of the truth's pictures.
const SHOWN: [&str; 3] = ["front-up-a", "left-a", "front-below-a"];
/// Cameras of the close-ups: a plain one, the polarised one beside it, one from the side, a hair camera.
const CLOSE: [&str; 4] = ["front-up-a", "front-up-x", "left-a", "hair-left"];

/// Everything that the page shows.
struct Data {
    file: FaceFile,
    stage: FaceStage,
    moment: FaceMoment,
    frames: Vec<FaceRenderFile>,
    records: Vec<Record>,
}

/// Makes the page of a rendered face from its folder.
///
/// # Errors
/// If `face.json` or a frame is missing or damaged, or the work is cancelled; the old page then stands.
pub fn report(render: &Path, progress: &dyn Progress) -> Result<Done, SuiteError> {
    let file = FaceFile::read(render)?;
    let mut inputs = BTreeMap::from([
        ("code".to_owned(), env!("STRANDBENCH_CODE_REPORT").to_owned()),
        ("face".to_owned(), hash::of_file(&render.join(super::FACE_FILE))?),
    ]);
    let (mut frames, mut records) = (Vec::new(), Vec::new());
    for &index in &file.frames {
        let dir = render.join(frame_name(index));
        let record = read_record(&dir)?;
        inputs.insert(format!("frame {index:06}"), format!("{} {}", record.key, hash::of_map(&record.files)));
        frames.push(FaceRenderFile::read(&dir)?);
        records.push(record);
    }
    stage::run("report", &render.join("report"), inputs, progress, |dir| {
        let stage = file.job()?.stage(file.seed)?;
        let moment = stage.moment(stage.time_s(file.frames[0]))?;
        let data = Data { file, stage, moment, frames, records };
        let path = dir.join(PAGE);
        std::fs::write(&path, page(&data)).map_err(|e| SuiteError::file(&path, e))
    })
}

/// A picture of a frame as the page names it.
fn picture(index: u32, camera: &str, what: &str) -> String {
    format!("../{}/{PREVIEW}/{}", frame_name(index), name(camera, what))
}

fn page(data: &Data) -> String {
    let content = html! {
        (header(data))
        (sheet(data))
        (close_ups(data))
        (truth(data))
        (player(data))
        (rig(data))
        (costs(data))
        (provenance(data))
    };
    frame(&format!("{} · face", data.file.scene), content)
}

fn header(data: &Data) -> Markup {
    let (spec, scene) = (&data.stage.spec, &data.moment.scene);
    let camera = &scene.rig.cameras[0];
    let strands = &scene.strands;
    let mut lengths: Vec<f32> = (0..strands.len()).map(|i| strands.length_mm(i) as f32).collect();
    lengths.sort_by(f32::total_cmp);
    let at = |share: usize| lengths.get((lengths.len().max(1) - 1) * share / 100).copied().unwrap_or(0.0);
    html! {
        header {
            p.kicker { "strandbench render · seed " (data.file.seed) }
            h1 { (data.file.scene) " " span { "fourteen cameras, sixteen banks of light" } }
            p.lead { (spec.description) @if !spec.stresses.is_empty() { ". It stresses: " (spec.stresses) "." } }
            div.tiles {
                div.tile { b { (strands.len()) } span { "hairs, each with its root in the skin" } }
                div.tile { b { (format!("{:.1} ", at(50))) small { "mm" } } span { (format!("median length; 5 to 95 %: {:.1} to {:.1} mm", at(5), at(95))) } }
                div.tile { b { (scene.surfaces[0].mesh.vertices.len()) } span { "vertices of the skin, the same in every frame" } }
                div.tile { b { (camera.width) " × " (camera.height) } span { (format!("pixels a view, {:.3} mm each at the face", spec.rig.pixel_mm())) } }
                div.tile { b { (data.frames.len()) " " small { "of " (spec.frames()) } } span { (format!("frames, {} a second", spec.rig.frame_rate_hz)) } }
            }
        }
    }
}

fn sheet(data: &Data) -> Markup {
    let first = data.file.frames[0];
    let scene = &data.moment.scene;
    html! {
        h2 { "What the cameras see" }
        p { "Frame " (first) ", " (format!("{:.2}", data.stage.time_s(first))) " s into the performance. A method gets these images in colour and full size as "
            code { (frame_name(first)) "/frame/<camera>.png" } ", 16 bits, linear, with the calibration, and nothing else." }
        div.sheet {
            @for (camera, crossed) in scene.rig.cameras.iter().zip(&scene.polarised) {
                figure {
                    img src=(picture(first, &camera.name, "")) alt=(camera.name) loading="lazy";
                    figcaption { (camera.name) @if *crossed { " · cross-polarised" } }
                }
            }
        }
    }
}

/// Kinds of hair that the scene has.
fn kinds(data: &Data) -> Vec<HairKind> {
    HairKind::ALL.into_iter().filter(|k| data.stage.hair.kinds.contains(k)).collect()
}

fn close_ups(data: &Data) -> Markup {
    let first = data.file.frames[0];
    html! {
        h2 { "Close by" }
        p { "Pixel by pixel, where hairs of each kind stand. The polarised camera sees no highlight of the skin and no hair's surface reflection." }
        div.wide { table {
            tr { th {} @for camera in CLOSE { th { (camera) } } }
            @for kind in kinds(data) {
                tr {
                    td { (kind.name()) }
                    @for camera in CLOSE {
                        td { img.close src=(picture(first, camera, &format!("close-{}", kind.name()))) alt=(format!("{} from {camera}", kind.name())) loading="lazy"; }
                    }
                }
            }
        } }
    }
}

fn truth(data: &Data) -> Markup {
    // The reference frame has no flow to itself.
    let last = *data.file.frames.last().expect("checked: there are frames");
    html! {
        h2 { "What is true" }
        p { "Frame " (last) ". Files beside: " code { (frame_name(last)) "/truth/" } ", for the scorer alone." }
        @for camera in SHOWN {
            h3 { (camera) }
            div.four {
                @for (what, caption) in TRUTHS {
                    figure { img src=(picture(last, camera, what)) alt=(caption) loading="lazy"; figcaption { (caption) } }
                }
            }
        }
        p.note {
            @for (what, colour) in LEGEND { span.swatch style=(format!("background:{}", css(colour))) {} (what) " " }
            @for (i, kind) in HairKind::ALL.into_iter().enumerate() {
                @if data.stage.hair.kinds.contains(&kind) {
                    span.swatch style=(format!("background:{}", css(kind_colour(i)))) {} (kind.name()) " "
                }
            }
        }
    }
}

fn player(data: &Data) -> Markup {
    let panels: Vec<(String, &str, &str)> = SHOWN
        .iter()
        .map(|&camera| (format!("Image, {camera}"), camera, ""))
        .chain([(format!("Flow to the reference frame, {}", SHOWN[0]), SHOWN[0], "flow")])
        .collect();
    let files =
        |index: u32| -> Vec<String> { panels.iter().map(|(_, c, what)| picture(index, c, what)).collect() };
    let frames: Vec<_> =
        data.file.frames.iter().map(|&i| serde_json::json!({ "index": i, "files": files(i) })).collect();
    let rate = data.stage.spec.rig.frame_rate_hz;
    let json = serde_json::json!({ "rate": rate, "frames": frames }).to_string().replace("</", "<\\/");
    html! {
        @if data.file.frames.len() > 1 {
            h2 { "In motion" }
            div id="player" {
                div.panels {
                    @for (i, (caption, ..)) in panels.iter().enumerate() {
                        figure { img data-panel=(i) alt=(caption); figcaption { (caption) } }
                    }
                }
                div.controls {
                    button type="button" name="play" { "play" }
                    input type="range" name="frame" min="0" max=(data.file.frames.len() - 1) value="0" aria-label="frame";
                    output {}
                    label { "speed " select name="speed" {
                        option value="0.1" { "1/10" } option value="0.25" { "1/4" } option value="1" selected { "real time" }
                    } }
                }
            }
            p.note { "Drag the slider, or use the arrow keys and the space bar." }
            script type="application/json" id="player-data" { (PreEscaped(json)) }
            script { (PreEscaped(SCRIPT)) }
        }
    }
}

fn rig(data: &Data) -> Markup {
    let scene = &data.moment.scene;
    let [top, side, front] = drawings(&Drawn {
        rig: &scene.rig,
        lights: &scene.lights,
        hair: &scene.strands.points,
        head: &scene.surfaces[0].mesh.vertices,
    });
    let target = data.stage.spec.rig.target_mm();
    html! {
        h2 { "The rig" }
        div.three {
            @for drawing in [top, side, front] { figure { (PreEscaped(drawing)) } }
        }
        p.note {
            span.swatch style="background:#0a5c8a" {} "cameras and where they aim  "
            span.swatch style="background:#f1c84b" {} "banks of light  "
            span.swatch style="background:#a8673a" {} "hair  "
            span.swatch style="background:#e9f0f4;border:1px solid #bfd2de" {}
            "depths that a reconstruction considers, " (format!("{:.0} to {:.0} mm", scene.rig.near_mm, scene.rig.far_mm))
        }
        details { summary { "Cameras" } div.wide { table {
            tr { th { "camera" } th.n { "left, degrees" } th.n { "up, degrees" } th.n { "distance, mm" } th.n { "focal length, px" } th { "filter" } }
            @for (c, crossed) in scene.rig.cameras.iter().zip(&scene.polarised) {
                @let d = c.centre_mm() - target;
                tr {
                    td { (c.name) }
                    td.n { (format!("{:.1}", d.x.atan2(d.z).to_degrees())) }
                    td.n { (format!("{:.1}", (d.y / d.length()).asin().to_degrees())) }
                    td.n { (format!("{:.0}", d.length())) }
                    td.n { (format!("{:.0}", c.focal_px.x)) }
                    td { @if *crossed { "crossed with the lights'" } @else { "none" } }
                }
            }
        } } }
    }
}

fn costs(data: &Data) -> Markup {
    html! {
        h2 { "Time and memory" }
        table {
            tr { th.n { "frame" } th.n { "wall, s" } th.n { "processor, s" } th.n { "peak memory, MiB" } th.n { "light on skin, s" } th.n { "views, s" } th.n { "truth, s" } th.n { "million rays" } th.n { "pixels at the noise asked for" } }
            @for (f, r) in data.frames.iter().zip(&data.records) {
                @let rays: u64 = f.views.iter().map(|v| v.primary_rays + v.shadow_rays + v.bounce_rays).sum();
                @let converged = f.views.iter().map(|v| v.converged).sum::<f64>() / f.views.len().max(1) as f64;
                tr {
                    td.n { (f.frame) }
                    td.n { (format!("{:.0}", r.cost.wall_s)) }
                    td.n { (r.cost.cpu_s.map_or("—".to_owned(), |s| format!("{s:.0}"))) }
                    td.n { (r.cost.peak_mib.map_or("—".to_owned(), |m| format!("{m:.0}"))) }
                    td.n { (format!("{:.1}", f.skin_light_s)) }
                    td.n { (format!("{:.0}", f.views.iter().map(|v| v.wall_s).sum::<f64>())) }
                    td.n { (format!("{:.0}", f.truth_s)) }
                    td.n { (format!("{:.0}", rays as f64 * 1e-6)) }
                    td.n { (format!("{:.1} %", converged * 100.0)) }
                }
            }
        }
    }
}

fn provenance(data: &Data) -> Markup {
    html! {
        h2 { "How to make this again" }
        @if let Some(r) = data.records.last() {
            p { "strandbench " (r.provenance.version) ", commit " code { (r.provenance.commit) } ", " (r.provenance.rustc) ", " (r.provenance.target) ", on " (r.provenance.cpu) " with " (r.provenance.threads) " threads." }
        }
        details { summary { "The scene" } pre { (data.stage.spec.to_toml()) } }
    }
}
