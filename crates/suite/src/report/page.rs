//! The report as one page that stands alone: no server, no network.

use super::chart::{Chart, percent, subjects, ticks};
use super::data::Data;
use super::{lines, rig, sections, tables, turntable, views};
use crate::pictures::{self, ABSENT, data_uri};
use maud::{DOCTYPE, Markup, PreEscaped, html};
use strandbench_types::Plane;

/// Ends of the signed error scale, mm: the widest of Luo's own thresholds (Fig. 13 speaks of 1 cm).
pub(crate) const ERROR_LIMIT_MM: f32 = 10.0;
const STYLE: &str = include_str!("style.css");
const SCRIPT: &str = include_str!("turntable.js");

/// A whole page around its content.
pub(crate) fn frame(title: &str, content: Markup) -> String {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body { main { (content) } }
        }
    }
    .into_string()
}

/// The report of one scene and variant.
pub(crate) fn page(data: &Data) -> String {
    let title = format!("{} · {}", data.render.scene, data.variant);
    let content = html! {
        (sections::header(data))
        (cameras(data))
        (rig_section(data))
        (orientation(data))
        (depth(data))
        (error(data))
        (cut_outs(data))
        (turntable(data))
        (tables::scores(data.figures(), &lines::answered_rows(data)))
        (tables::costs(data))
        (sections::energy(data))
        (sections::provenance(data))
    };
    frame(&title, content)
}

pub(crate) fn img(picture: &Plane<[u8; 3]>, alt: &str) -> Markup {
    html! { img src=(data_uri(picture)) alt=(alt) width=(picture.width) height=(picture.height); }
}

fn cameras(data: &Data) -> Markup {
    let gain = pictures::exposure(data.frame.images.iter().flat_map(|i| i.data.iter().copied()));
    html! {
        h2 { "What the cameras saw" }
        div.hero {
            figure {
                (img(&data.colour, "colour render of the reference view"))
                figcaption { "The scene as a colour camera in the reference's place would show it. For people only, exposed for them: the method never sees it." }
            }
            figure {
                div.mono {
                    @for (camera, image) in data.rig.cameras.iter().zip(&data.frame.images) {
                        (img(&pictures::monochrome(image, gain), &camera.name))
                    }
                }
                figcaption {
                    "What the method gets: " (data.rig.cameras.len()) " monochrome images of "
                    (data.rig.cameras[0].width) " × " (data.rig.cameras[0].height) " pixels ("
                    (data.rig.cameras.iter().map(|c| c.name.as_str()).collect::<Vec<_>>().join(", "))
                    "), with the sensor's noise and faults, a hair mask for each, and the calibration. Shown "
                    (format!("{gain:.1}")) " times as bright as recorded."
                }
            }
        }
    }
}

fn rig_section(data: &Data) -> Markup {
    let [top, side] = rig::rig_drawings(data);
    html! {
        h2 { "The rig" }
        div.two {
            figure { (PreEscaped(top)) }
            figure { (PreEscaped(side)) }
        }
        p.note {
            span.swatch style="background:#0a5c8a" {} "cameras and where they aim  "
            span.swatch style="background:#f1c84b" {} "area lights  "
            span.swatch style="background:#a8673a" {} "hair  "
            span.swatch style="background:#e9f0f4;border:1px solid #bfd2de" {}
            "depths that the reconstruction considers, " (format!("{:.0} to {:.0} mm", data.rig.near_mm, data.rig.far_mm))
        }
        (tables::cameras(data))
    }
}

fn orientation(data: &Data) -> Markup {
    let truth = &data.truth.views[0];
    html! {
        h2 { "Orientation of the hair in the image" }
        div.two {
            figure {
                @match &data.estimate.orientation {
                    Some(field) => (img(&pictures::orientation(field, &truth.mask), "estimated orientation")),
                    None => p.fail { "The method gave no orientation." },
                }
                figcaption { "Estimated from the reference image. Hue is the direction of the line, brightness the filter's response." }
            }
            figure {
                (img(&pictures::true_orientation(&truth.orientation_2d, &truth.orientation_agreement, &truth.mask), "true orientation"))
                figcaption { "True: the mean line of the fibres that each pixel sees. Brightness is how far they agree; dark pixels hold crossing fibres." }
            }
        }
        div.wheel {
            (img(&pictures::orientation_wheel(148), "legend"))
            p.note { "The wheel shows the colour of a line that runs in each direction; a line has no head and no tail, so opposite directions share a colour." }
        }
        (lines::section(data))
    }
}

fn depth_limits(data: &Data) -> (f32, f32) {
    let map = &data.truth.views[0].depth_50;
    let mut depths: Vec<f32> = (0..map.raw().data.len()).filter_map(|i| map.get_index(i)).collect();
    depths.sort_by(f32::total_cmp);
    if depths.is_empty() {
        return (data.rig.near_mm as f32, data.rig.far_mm as f32);
    }
    let at = |share: f64| depths[((depths.len() - 1) as f64 * share) as usize];
    let (near, far) = (at(0.005), at(0.995));
    ((near / 5.0).floor() * 5.0, (far / 5.0).ceil() * 5.0)
}

fn scale(low: &str, high: &str, colour: impl Fn(f32) -> [u8; 3], from: f32) -> Markup {
    let mut bar = Plane::filled(256, 1, [0; 3]);
    for (i, pixel) in bar.data.iter_mut().enumerate() {
        *pixel = colour(from + (1.0 - from) * i as f32 / 255.0);
    }
    html! { div.scale { span { (low) } (img(&bar, "scale")) span { (high) } } }
}

fn absent_note() -> Markup {
    let [r, g, b] = ABSENT;
    html! { span.swatch style=(format!("background:rgb({r},{g},{b})")) {} "asked for and not answered" }
}

fn depth(data: &Data) -> Markup {
    let truth = &data.truth.views[0];
    let limits = depth_limits(data);
    html! {
        h2 { "Depth" }
        div.two {
            figure {
                @match &data.estimate.depth {
                    Some(map) => (img(&pictures::depth(map, &truth.mask, limits), "estimated depth")),
                    None => p.fail { "The method gave no depth." },
                }
                figcaption { "Estimated depth along the reference camera's axis." }
            }
            figure {
                (img(&pictures::depth(&truth.depth_50, &truth.mask, limits), "true depth"))
                figcaption { "True depth: where half of the pixel is covered by hair, counted from the camera." }
            }
        }
        (scale(&format!("{:.0} mm (near)", limits.0), &format!("{:.0} mm (far)", limits.1), pictures::sequential, 0.0))
        p.note { (absent_note()) }
    }
}

fn error(data: &Data) -> Markup {
    let mut map = pictures::signed_error(&data.error_mm, ERROR_LIMIT_MM);
    let worst = data.scores.worst_region;
    if let Some(w) = worst {
        pictures::frame_block(&mut map, (w.x as usize, w.y as usize), w.size as usize);
    }
    html! {
        h2 { "Depth error" }
        div.two {
            figure {
                (img(&map, "signed depth error"))
                (scale(&format!("−{ERROR_LIMIT_MM:.0} mm, too near"), &format!("+{ERROR_LIMIT_MM:.0} mm, too far"), pictures::diverging, -1.0))
                figcaption { "Estimated minus true depth. White is right. " (absent_note()) ". Errors beyond the scale keep its end's colour."
                    @if let Some(w) = worst {
                        " The frame marks the worst region, " (w.size) " × " (w.size) " pixels from column " (w.x) ", row " (w.y) ": "
                        (match w.median_mm {
                            Some(mm) => format!("half of its {} hair pixels are off by more than {mm:.1} mm.", w.wanted),
                            None => format!("most of its {} hair pixels are unanswered.", w.wanted),
                        })
                    }
                }
            }
            figure {
                (PreEscaped(error_curves(data)))
                figcaption {
                    "Share of hair pixels whose depth is off by at most so many millimetres. The further up and left the better; a curve that ends "
                    "below 100 % leaves pixels further off or unanswered. " (tables::subject_key(data.figures()))
                }
            }
        }
    }
}

fn error_curves(data: &Data) -> String {
    let at: Vec<f64> = (0..=200).map(|i| f64::from(i) * 0.1).collect();
    let series = subjects(data.curves_of("A1"), &at);
    Chart {
        x: (0.0, 20.0),
        y: (0.0, 1.0),
        x_title: "depth error at most, mm",
        y_title: "share of hair pixels",
        x_ticks: ticks(0.0, 20.0, 10),
        y_ticks: percent(),
        size: (560.0, 400.0),
    }
    .lines(&series)
}

fn cut_outs(data: &Data) -> Markup {
    let cuts = views::cuts(data);
    html! {
        h2 { "Cut through the hair" }
        @if cuts.is_empty() {
            p.fail { "The method gave no envelope, so there is nothing to cut." }
        } @else {
            div.three {
                @for (cut, name) in cuts.iter().zip(["high", "in the middle", "low"]) {
                    figure {
                        (PreEscaped(&cut.svg))
                        figcaption { "Cut " (name) ", " (format!("{:+.0} mm", cut.height_mm)) " from the origin of the world." }
                    }
                }
            }
            p.note {
                "Horizontal planes through the hair, seen from above with the reference camera at the top (as Luo et al., Fig. 13e). "
                span.swatch style="background:#0a5c8a" {} "estimated envelope  "
                span.swatch style="background:#c4441c" {} "strands that the reference camera sees there  "
                span.swatch style="background:#c9c4ba" {} "strands that it does not see  "
                span.swatch style="background:#b8860b" {} "head. "
                "The envelope should run along the red dots."
            }
        }
    }
}

fn turntable(data: &Data) -> Markup {
    let json = turntable::json(data, ERROR_LIMIT_MM).replace("</", "<\\/");
    html! {
        h2 { "Envelope against strands" }
        div id="turntable" {
            canvas {}
            div.controls {
                label { input type="checkbox" name="envelope" checked; " envelope" }
                label { input type="checkbox" name="errors" checked; " coloured by depth error" }
                label { input type="checkbox" name="seen" checked; " strands the reference sees" }
                label { input type="checkbox" name="rest"; " other strands" }
                label { input type="checkbox" name="head" checked; " head" }
                label { "cut from the top " input type="range" name="cut" min="0" max="100" value="100"; }
            }
            p.missing { "This browser offers no WebGL; the cuts above show the same geometry." }
            p.note { "Drag to turn, use the wheel to move closer, move the slider to cut the model open. Decimated for display; scores use all of it." }
        }
        script type="application/json" id="turntable-data" { (PreEscaped(json)) }
        script { (PreEscaped(SCRIPT)) }
    }
}
