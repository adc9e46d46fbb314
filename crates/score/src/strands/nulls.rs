//! Strands that know nothing of the images, and the ceiling.

use super::judge::Reference;
use super::samples::{STEP_MM, TrueStrands};
use super::shape::{Population, occupied, total_mm};
use crate::depth::pixel_centre;
use crate::hull::{NULL_KEY, hull};
use crate::nulls::{draped, isotropic, principal_direction};
use glam::{DVec3, Vec3};
use strandbench_rng::Rng;
use strandbench_types::{Rig, StrandSet, Truth};

/// Length of a null's straight strands, mm.
const PIECE_MM: f64 = 10.0;

/// A null has as much hair as the truth, in at most so many strands.
const MOST_PIECES: u64 = 1 << 17;

/// Radius given to strands that have none of their own, mm; no figure depends on it.
const RADIUS_MM: f32 = 0.04;

/// N0, N1, N2 and C.
pub(crate) fn all(
    reference: &Reference,
    population: &Population,
    seed: u64,
) -> [(&'static str, StrandSet); 4] {
    let truth = reference.strands.truth;
    let n = ((total_mm(&reference.strands) / PIECE_MM).round() as u64).clamp(1, MOST_PIECES);
    let cells = occupied(population);
    let camera = &truth.rig.cameras[0];
    let world = camera.camera_from_world.transpose();
    let principal = camera.camera_from_world * principal_direction(truth);
    let rng = |what: u64, i: u64| Rng::keyed(&[seed, NULL_KEY, 16 + what, i]);
    let volume = |direction: &dyn Fn(u64) -> DVec3| {
        // By cell, so that neighbours stay together.
        let mut drawn: Vec<(u64, u64)> = (0..n).map(|i| (rng(0, i).below(cells.len() as u64), i)).collect();
        drawn.sort_unstable();
        let mut set = StrandSet::new();
        for (cell, i) in drawn {
            let (cell, mut r) = (cells[cell as usize], rng(1, i));
            let p = DVec3::from_array(cell.map(|k| (f64::from(k) + r.f64()) * 5.0));
            push(&mut set, world * (p - camera.translation_mm), world * direction(i));
        }
        set
    };
    [
        ("N0", volume(&|i| isotropic(&mut rng(2, i)))),
        ("N1", volume(&|_| principal)),
        ("N2", on_the_hull(truth, n, seed)),
        ("C", ceiling(&reference.strands)),
    ]
}

fn push(set: &mut StrandSet, middle: DVec3, direction: DVec3) {
    let half = direction.normalize_or(DVec3::Y) * (0.5 * PIECE_MM);
    set.push(&[(middle - half).as_vec3(), (middle + half).as_vec3()], RADIUS_MM);
}

/// Hair that hangs on the visual hull, as each camera sees it from the front.
fn on_the_hull(truth: &Truth, n: u64, seed: u64) -> StrandSet {
    let mut surface: Vec<(DVec3, DVec3)> = Vec::new();
    let rig = &truth.rig;
    let reference = &rig.cameras[0];
    let middle = reference.unproject(reference.principal_px, 0.5 * (rig.near_mm + rig.far_mm));
    let half = 0.5 * (rig.far_mm - rig.near_mm);
    for c in 0..rig.cameras.len() {
        let mut order: Vec<usize> = (0..rig.cameras.len()).collect();
        order[..=c].rotate_right(1);
        let camera = &rig.cameras[c];
        let z = camera.to_camera(middle).z;
        let near_mm = (z - half).max(1e-3 * half);
        let turned = Rig {
            cameras: order.iter().map(|&k| rig.cameras[k].clone()).collect(),
            near_mm,
            far_mm: (z + half).max(2.0 * near_mm),
            ..rig.clone()
        };
        let masks: Vec<_> = order.iter().map(|&k| &truth.views[k].mask).collect();
        let mask = masks[0];
        let hair: Vec<u32> = (0..mask.data.len() as u32).filter(|&i| mask.data[i as usize]).collect();
        let rays = hull(&turned, &masks, &hair, seed);
        let (pixels, front): (Vec<u32>, Vec<f64>) =
            hair.iter().zip(&rays).filter_map(|(&i, r)| Some((i, r.as_ref()?.front))).unzip();
        let world = camera.camera_from_world.transpose();
        let lines = draped(camera, mask.size(), &pixels, &front);
        for ((&i, &z), d) in pixels.iter().zip(&front).zip(lines) {
            surface.push((camera.unproject(pixel_centre(i, camera.width), z), world * d));
        }
    }
    let mut set = StrandSet::new();
    for i in 0..if surface.is_empty() { 0 } else { n } {
        let mut r = Rng::keyed(&[seed, NULL_KEY, 19, i]);
        let (p, d) = surface[r.below(surface.len() as u64) as usize];
        push(&mut set, p, d);
    }
    set
}

/// The truth cut to V2: each stretch that two cameras see is a strand of its own.
fn ceiling(strands: &TrueStrands) -> StrandSet {
    let mut set = StrandSet::new();
    let truth = strands.truth;
    for s in 0..truth.strands.len() {
        let offsets = &truth.visibility.offsets;
        let n = (offsets[s + 1] - offsets[s]) as usize;
        let range = truth.strands.range(s);
        let mut i = 0;
        while i < n {
            if strands.cameras(s, i) < 2 {
                i += 1;
                continue;
            }
            let from = i;
            while i < n && strands.cameras(s, i) >= 2 {
                i += 1;
            }
            let end = strands.arc_mm[range.end - 1];
            let (lo, hi) = (from as f64 * STEP_MM, if i == n { end } else { i as f64 * STEP_MM });
            set.push(&cut(strands, s, lo, hi), RADIUS_MM);
        }
    }
    set
}

/// The points of a strand between two arc lengths, its ends included.
fn cut(strands: &TrueStrands, s: usize, lo: f64, hi: f64) -> Vec<Vec3> {
    let set = &strands.truth.strands;
    let mut walk = super::samples::Walk::new(set, s);
    let mut out = vec![walk.at(lo).position.as_vec3()];
    out.extend(
        set.range(s).filter(|&p| strands.arc_mm[p] > lo && strands.arc_mm[p] < hi).map(|p| set.points[p]),
    );
    out.push(walk.at(hi).position.as_vec3());
    out
}
