//! Pictures of the report: both images, their difference, p-values.

use crate::Pictures;
use crate::images::BLOCK;
use base64::Engine as _;
use maud::{Markup, html};
use strandbench_types::Plane;

/// Times that small pictures are enlarged, so that blocks can be seen.
const ZOOM: usize = 3;
/// Relative difference at the ends of the difference map's scale.
const DIFFERENCE_ENDS: f64 = 0.1;

pub(super) fn row(pictures: &Pictures) -> Markup {
    let gain = exposure(&pictures.theirs);
    let shown = |plane: &Plane<[f32; 3]>| enlarge(&plane.map(|v| v.map(|x| srgb(x * gain))), ZOOM);
    let blocks = |colour: &dyn Fn((f64, f64)) -> [u8; 3]| {
        let map = pictures.blocks.map(|b| b.map_or([244, 243, 240], colour));
        enlarge(&map, BLOCK * ZOOM)
    };
    let figure = |picture: &Plane<[u8; 3]>, text: &str| {
        html! { figure { img src=(data_uri(picture)) alt=(text); figcaption { (text) } } }
    };
    html! {
        div.four {
            (figure(&shown(&pictures.ours), "ours, mean of all seeds"))
            (figure(&shown(&pictures.theirs), "Mitsuba, mean of all seeds"))
            (figure(&blocks(&|b| diverging(b.0 / DIFFERENCE_ENDS)), "relative difference of the blocks: blue −10 % (ours darker) to red +10 %"))
            (figure(&blocks(&|b| p_colour(b.1)), "p-values of the blocks: white above 0.1, orange at 0.01, red below 0.0001"))
        }
    }
}

/// What to multiply radiance with so that 99 % of the lit pixels stay below white.
fn exposure(image: &Plane<[f32; 3]>) -> f32 {
    let mut lit: Vec<f32> =
        image.data.iter().map(|v| v[0].max(v[1]).max(v[2])).filter(|v| *v > 0.0).collect();
    lit.sort_by(f32::total_cmp);
    lit.get(lit.len() * 99 / 100).map_or(1.0, |v| 0.9 / v)
}

/// The transfer function of sRGB (IEC 61966-2-1).
fn srgb(linear: f32) -> u8 {
    let v = linear.clamp(0.0, 1.0);
    let v = if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
    (v * 255.0).round() as u8
}

fn mix(a: [f64; 3], b: [f64; 3], t: f64) -> [u8; 3] {
    std::array::from_fn(|c| (a[c] + (b[c] - a[c]) * t.clamp(0.0, 1.0)).round() as u8)
}

/// -1 blue, 0 white, 1 red.
pub(super) fn diverging(t: f64) -> [u8; 3] {
    let end = if t < 0.0 { [33.0, 94.0, 160.0] } else { [178.0, 34.0, 40.0] };
    mix([252.0, 252.0, 250.0], end, t.abs())
}

/// By the logarithm of the p-value, from 0.1 to 0.0001.
pub(super) fn p_colour(p: f64) -> [u8; 3] {
    let t = (-p.max(1e-300).log10() - 1.0) / 3.0;
    if t < 0.5 {
        mix([252.0, 252.0, 250.0], [240.0, 150.0, 40.0], 2.0 * t)
    } else {
        mix([240.0, 150.0, 40.0], [170.0, 0.0, 30.0], 2.0 * t - 1.0)
    }
}

pub(super) fn enlarge(picture: &Plane<[u8; 3]>, times: usize) -> Plane<[u8; 3]> {
    let (w, h) = picture.size();
    let data = (0..w * h * times * times)
        .map(|i| *picture.at(i % (w * times) / times, i / (w * times) / times))
        .collect();
    Plane::from_vec(w * times, h * times, data)
}

fn data_uri(picture: &Plane<[u8; 3]>) -> String {
    let mut png = std::io::Cursor::new(Vec::new());
    let bytes = picture.data.as_flattened().to_vec();
    image::RgbImage::from_raw(picture.width as u32, picture.height as u32, bytes)
        .expect("three bytes a pixel")
        .write_to(&mut png, image::ImageFormat::Png)
        .expect("memory takes every PNG");
    format!("data:image/png;base64,{}", base64::engine::general_purpose::STANDARD.encode(png.get_ref()))
}
