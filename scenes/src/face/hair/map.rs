//! Density and length as maps over texture coordinates: read from files, and drawn from the regions for users to edit.

use super::{HairKind, region};
use crate::face::{FaceError, FaceModel, Identity, Part};
use glam::{Vec2, Vec3};
use std::path::Path;
use strandbench_io::read_png_grey;
use strandbench_types::Plane;

/// Fewest and most pixels of a map's side.
pub const MAP_SIDES_PX: std::ops::RangeInclusive<usize> = 256..=8192;

/// How far values reach beyond the charts' borders, px, so that no seam is a bald line.
const MARGIN_PX: usize = 4;

/// Reads a map: grey PNG, square, a power of two of pixels a side.
pub(super) fn read(path: &Path) -> Result<Plane<f32>, FaceError> {
    let map = read_png_grey(path).map_err(|e| FaceError::File { path: e.path, problem: e.problem })?;
    let (w, h) = map.size();
    if w != h || !MAP_SIDES_PX.contains(&w) || !w.is_power_of_two() {
        let problem = format!(
            "{w}x{h} pixels; a map of hair is square, {} to {} pixels a side, a power of two: resize it",
            MAP_SIDES_PX.start(),
            MAP_SIDES_PX.end()
        );
        return Err(FaceError::File { path: path.to_owned(), problem });
    }
    Ok(map)
}

/// How far a map of density may be painted over a chart's border, as a share of its side.
const OVER_THE_BORDER: f64 = 1.0 / 64.0;
/// Density beside the charts that is read as none: what an editor's soft brush leaves.
const NONE: f32 = 2.5 / 255.0;

/// Reads a map of density, which says where hair grows and must lie on the skin: most often one that does not was drawn for
/// another face's texture coordinates, or upside down.
pub(super) fn read_density(path: &Path, model: &FaceModel) -> Result<Plane<f32>, FaceError> {
    let map = read(path)?;
    let side = map.width;
    let over = (side as f64 * OVER_THE_BORDER) as usize;
    let near = widened(&charts(model, side), over);
    let beside = (0..side * side).filter(|&i| map.data[i] > NONE && !near.data[i]);
    let Some(i) = beside.clone().next() else {
        return Ok(map);
    };
    let (x, y) = (i % side, i / side);
    let at = |k: usize| (k as f64 + 0.5) / side as f64;
    let problem = format!(
        "{} pixels have hair where no skin's texture coordinates lie, more than {over} px from any, the first in column {x}, \
         row {y} (u {:.3}, v {:.3}): draw over the maps that a rendered face has in render/subject/hair, or paint them black",
        beside.count(),
        at(x),
        1.0 - at(y)
    );
    Err(FaceError::File { path: path.to_owned(), problem })
}

/// Pixels that the skin's texture coordinates cover.
fn charts(model: &FaceModel, side: usize) -> Plane<bool> {
    let mut covered = Plane::filled(side, side, false);
    let skin = model.uv_triangles().iter().zip(model.parts());
    for (uv, _) in skin.filter(|(_, p)| **p == Part::Skin) {
        cover(on_map(model, uv, side), side, |x, y, _, inside| *covered.at_mut(x, y) |= inside);
    }
    covered
}

/// Pixels within `by` of one that is set, along both axes.
fn widened(plane: &Plane<bool>, by: usize) -> Plane<bool> {
    let side = plane.width;
    let spread = |line: &dyn Fn(usize) -> bool| {
        // How many of the pixels before each are set.
        let mut before = vec![0u32; side + 1];
        (0..side).for_each(|k| before[k + 1] = before[k] + u32::from(line(k)));
        (0..side)
            .map(|k| before[(k + by + 1).min(side)] > before[k.saturating_sub(by)])
            .collect::<Vec<bool>>()
    };
    let mut wide = Plane::filled(side, side, false);
    for y in 0..side {
        wide.data[y * side..][..side].copy_from_slice(&spread(&|x| *plane.at(x, y)));
    }
    for x in 0..side {
        let column = spread(&|y| *wide.at(x, y));
        (0..side).for_each(|y| *wide.at_mut(x, y) = column[y]);
    }
    wide
}

/// What grows where, over texture coordinates; row 0 is v = 1.
pub struct HairMaps {
    /// Density relative to the patch's, 0..1.
    pub density: Plane<f32>,
    /// Length relative to the patch's, 0..1.
    pub length: Plane<f32>,
    /// Direction of growth in the skin on the mean neutral face, world axes from 0 (-1) to 1 (+1); 0 where nothing grows.
    pub direction: Plane<[f32; 3]>,
}

impl HairMaps {
    /// The region of a kind as maps of `side` pixels.
    ///
    /// # Errors
    /// [`FaceError::Value`] if `side` is not one of [`MAP_SIDES_PX`].
    pub fn draw(model: &FaceModel, kind: HairKind, side: usize) -> Result<HairMaps, FaceError> {
        if !MAP_SIDES_PX.contains(&side) || !side.is_power_of_two() {
            let (low, high) = (*MAP_SIDES_PX.start() as f64, *MAP_SIDES_PX.end() as f64);
            return Err(FaceError::Value { key: "map side", value: side as f64, low, high });
        }
        let mean = Identity::mean(model).vertices(model);
        let mut covered = Plane::filled(side, side, 0usize);
        let mut out = HairMaps {
            density: Plane::filled(side, side, 0.0),
            length: Plane::filled(side, side, 0.0),
            direction: Plane::filled(side, side, [0.0; 3]),
        };
        let skin = model.triangles().iter().zip(model.uv_triangles()).zip(model.parts());
        for ((t, uv), _) in skin.filter(|(_, p)| **p == Part::Skin) {
            let corners = t.map(|v| mean[v as usize]);
            let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or(Vec3::Z);
            cover(on_map(model, uv, side), side, |x, y, weights, inside| {
                // A pixel in a chart belongs to the chart; one beside it to the nearest border drawn first.
                let rank = if inside { 2 } else { 1 };
                if *covered.at(x, y) >= rank {
                    return;
                }
                *covered.at_mut(x, y) = rank;
                let p = corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2];
                let density = region::density(kind, p);
                *out.density.at_mut(x, y) = density;
                *out.length.at_mut(x, y) = if density > 0.0 { 1.0 } else { 0.0 };
                if density > 0.0 {
                    let d =
                        region::direction(kind, p, normal).reject_from_normalized(normal).normalize_or_zero();
                    *out.direction.at_mut(x, y) = (d * 0.5 + 0.5).to_array();
                }
            });
        }
        Ok(out)
    }
}

/// Corners of a triangle of texture coordinates, px of a map.
fn on_map(model: &FaceModel, uv: &[u32; 3], side: usize) -> [Vec2; 3] {
    uv.map(|k| {
        let c = model.uvs()[k as usize];
        Vec2::new(c.x, 1.0 - c.y) * side as f32
    })
}

/// Calls `paint` with pixel, weights of the corners and whether it lies inside, for every pixel within [`MARGIN_PX`] of a
/// triangle on the map. Outside, the weights are those of the nearest place of the triangle, about.
fn cover(uv: [Vec2; 3], side: usize, mut paint: impl FnMut(usize, usize, [f32; 3], bool)) {
    let area = (uv[1] - uv[0]).perp_dot(uv[2] - uv[0]);
    if area == 0.0 {
        return;
    }
    let margin = MARGIN_PX as f32;
    let low = uv[0].min(uv[1]).min(uv[2]) - margin;
    let high = uv[0].max(uv[1]).max(uv[2]) + margin;
    let range = |a: f32, b: f32| a.max(0.0) as usize..(b.max(0.0) as usize + 1).min(side);
    for y in range(low.y, high.y) {
        for x in range(low.x, high.x) {
            let p = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
            let raw: [f32; 3] =
                std::array::from_fn(|k| (uv[(k + 1) % 3] - p).perp_dot(uv[(k + 2) % 3] - p) / area);
            let inside = raw.iter().all(|w| *w >= 0.0);
            let kept = raw.map(|w| w.max(0.0));
            let sum: f32 = kept.iter().sum();
            let weights = kept.map(|w| w / sum);
            let place = uv[0] * weights[0] + uv[1] * weights[1] + uv[2] * weights[2];
            if inside || place.distance(p) <= margin {
                paint(x, y, weights, inside);
            }
        }
    }
}
