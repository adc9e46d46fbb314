//! Pictures of the arms side by side, laid out as the papers have them.

use super::ArmRow;
use super::cells::{Plan, cell};
use super::table::Ablation;
use crate::SuiteError;
use crate::cell::Outcome;
use crate::dataset::Source;
use crate::pictures::{PAPER, signed_error};
use crate::reconstruct::ESTIMATE;
use crate::report::page::ERROR_LIMIT_MM;
use crate::score::read_error_map;
use crate::sequence::frame_name;
use glam::{DVec2, DVec3};
use std::path::Path;
use strandbench_types::{Camera, DepthMap, Plane};

/// A picture of one arm.
pub(super) struct Picture {
    /// The arm.
    pub arm: &'static str,
    /// File of the surface, lit from the upper left; absent if the cell failed.
    pub relief: Option<String>,
    /// File of the signed depth error.
    pub error: Option<String>,
}

/// Writes each arm's surface and error map on the plan's first case, tuned, and a sheet `figure.png` of both: arms from
/// left to right, what the paper argues for last, as its figures have it.
pub(super) fn write(
    plan: &Plan,
    ablation: &Ablation,
    factors: &[f32],
    rows: &[ArmRow],
    out: &Path,
    dir: &Path,
) -> Result<Vec<Picture>, SuiteError> {
    let Some(first) = plan.cases.first() else { return Ok(Vec::new()) };
    let mut pictures = Vec::new();
    let mut columns = Vec::new();
    let mut arms: Vec<_> = ablation.arms().zip(factors.iter().copied()).enumerate().collect();
    arms.rotate_left(1);
    for (i, (arm, factor)) in arms {
        let cell = cell(plan, first, arm, factor)?;
        let mut picture = Picture { arm: arm.label, relief: None, error: None };
        // The last row is that of the tuned weight.
        let row = rows
            .iter()
            .rfind(|r| r.arm == arm.label && r.scene_name == first.scene && r.row.seed == first.seed);
        if row.is_some_and(|r| r.row.outcome == Outcome::Ok) {
            let mut places = cell.places(out);
            let source = Source::open(&places.render)?;
            let frames = source.frames();
            let index = frames[1.min(frames.len() - 1)];
            if source.moves() {
                places.reconstruct.push(frame_name(index));
                places.score.push(frame_name(index));
            }
            let (rig, _) = source.read(index)?;
            let estimate = strandbench_io::read_estimate(&places.reconstruct.join(ESTIMATE))?;
            let error = read_error_map(&places.score)?;
            let error = signed_error(&error, ERROR_LIMIT_MM);
            let surface = estimate.depth.as_ref().map_or_else(
                || Plane::filled(error.width, error.height, PAPER),
                |depth| relief(&rig.cameras[0], depth),
            );
            for (kind, image, file) in
                [("surface", &surface, &mut picture.relief), ("error", &error, &mut picture.error)]
            {
                let name = format!("{i}-{kind}.png");
                strandbench_io::write_png_rgb(&dir.join(&name), image)?;
                *file = Some(name);
            }
            columns.push([surface, error]);
        }
        pictures.push(picture);
    }
    if !columns.is_empty() {
        strandbench_io::write_png_rgb(&dir.join("figure.png"), &sheet(&columns))?;
    }
    Ok(pictures)
}

/// Columns of equally large pictures beside each other.
fn sheet(columns: &[[Plane<[u8; 3]>; 2]]) -> Plane<[u8; 3]> {
    const GAP: usize = 6;
    let (w, h) = columns[0][0].size();
    let mut all = Plane::filled(columns.len() * (w + GAP) - GAP, 2 * h + GAP, [255; 3]);
    for (c, column) in columns.iter().enumerate() {
        for (r, picture) in column.iter().enumerate().filter(|(_, p)| p.size() == (w, h)) {
            for y in 0..h {
                for x in 0..w {
                    *all.at_mut(c * (w + GAP) + x, r * (h + GAP) + y) = *picture.at(x, y);
                }
            }
        }
    }
    all
}

/// A depth map as a surface of plaster: lit from the upper left, normals from neighbouring pixels.
fn relief(camera: &Camera, depth: &DepthMap) -> Plane<[u8; 3]> {
    let (width, height) = (camera.width as usize, camera.height as usize);
    let light = DVec3::new(-0.5, -0.6, -0.7).normalize();
    let point = |x: usize, y: usize| -> Option<DVec3> {
        let z = depth.get_index(y * width + x)?;
        let world = camera.unproject(DVec2::new(x as f64 + 0.5, y as f64 + 0.5), f64::from(z));
        Some(camera.to_camera(world))
    };
    let mut picture = Plane::filled(width, height, PAPER);
    for y in 0..height.saturating_sub(1) {
        for x in 0..width.saturating_sub(1) {
            let (Some(p), Some(right), Some(down)) = (point(x, y), point(x + 1, y), point(x, y + 1)) else {
                continue;
            };
            // x right, y down, z away: this product faces the camera.
            let n = (down - p).cross(right - p).normalize_or_zero();
            let lit = 0.12 + 0.88 * n.dot(light).max(0.0);
            *picture.at_mut(x, y) = [crate::pictures::srgb((0.8 * lit * lit) as f32); 3];
        }
    }
    picture
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_surface_that_turns_to_the_light_is_brighter() {
        let camera = Camera::look_at("c", (32, 32), 40.0, DVec3::ZERO, DVec3::Z, DVec3::Y);
        let tilted = |by: f32| {
            let z = (0..32 * 32).map(|i| 100.0 + by * (i % 32) as f32).collect();
            relief(&camera, &DepthMap::from_raw(Plane::from_vec(32, 32, z)))
        };
        // What is nearer on the right faces left, where the light is.
        let (left, flat, right) = (tilted(-1.0), tilted(0.0), tilted(1.0));
        let at = |p: &Plane<[u8; 3]>| p.at(16, 16)[0];
        assert!(
            at(&left) > at(&flat) && at(&flat) > at(&right),
            "{} {} {}",
            at(&left),
            at(&flat),
            at(&right)
        );
        assert_eq!(*flat.at(31, 31), PAPER, "no neighbour, no normal");
    }

    #[test]
    fn a_sheet_has_a_column_an_arm() {
        let one = |v: u8| Plane::filled(2, 3, [v; 3]);
        let s = sheet(&[[one(1), one(2)], [one(3), one(4)]]);
        assert_eq!(s.size(), (10, 12));
        assert_eq!(
            [s.at(0, 0)[0], s.at(0, 9)[0], s.at(8, 0)[0], s.at(9, 11)[0], s.at(4, 0)[0]],
            [1, 2, 3, 4, 255]
        );
    }
}
