//! The shape of each hair on the neutral face, before the skin keeps it out.

use super::roots::Root;
use super::{HairKind, Patch, region};
use crate::face::FollicleFrame;
use crate::groom::{LineNoise, quintic, ramp, standard_lognormal, standard_normal};
use glam::{IVec3, Vec3};
use std::collections::HashMap;
use strandbench_rng::Rng;

/// Shortest hair that grows, mm.
const SHORTEST_MM: f32 = 0.4;
/// Longest segment of straight hair, mm, and segments of a curl's turn.
const SEGMENT_MM: f32 = 1.4;
const TURN_SEGMENTS: f32 = 14.0;
/// A hair's fewest and most segments.
const SEGMENTS: std::ops::RangeInclusive<usize> = 3..=120;

/// A hair where it would be if the skin did not keep it out.
#[derive(Clone, Debug)]
pub(super) struct Shape {
    /// Points, mm, the first in the skin.
    pub points: Vec<Vec3>,
    /// Length of each segment, mm.
    pub segment_mm: f32,
    pub radii_mm: Vec<f32>,
}

/// Shapes of a patch's hairs, each by its own key; tufts after all have a shape.
pub(super) fn shapes(
    kind: HairKind,
    patch: &Patch,
    roots: &[(Root, bool)],
    frames: &[FollicleFrame],
    key: u64,
) -> Vec<Shape> {
    let grown: Vec<Shape> =
        (0..roots.len()).map(|i| grow(kind, patch, &roots[i], &frames[i], &[key, i as u64])).collect();
    gathered(patch, &grown, key)
}

fn grow(
    kind: HairKind,
    patch: &Patch,
    (root, upper): &(Root, bool),
    frame: &FollicleFrame,
    key: &[u64; 2],
) -> Shape {
    let mut rng = Rng::keyed(&[key[0], key[1], 1]);
    let lash = kind == HairKind::Lash;
    // Lower lashes are shorter.
    let lid = if lash && !upper { 0.62 } else { 1.0 };
    let length = (patch.length_mm * lid * root.length * standard_lognormal(&mut rng, patch.length_spread))
        .max(SHORTEST_MM);
    let normal = frame.axes.col(2);
    let wanted = if lash {
        let up = if *upper { 0.35 } else { -0.5 };
        Vec3::new(0.35 * root.rest.x.signum() * ((root.rest.x.abs() - 31.0) / 16.0), up, 1.0)
    } else {
        region::direction(kind, root.rest, normal)
    };
    let turn = patch.disorder_deg.to_radians();
    let along =
        wanted.reject_from_normalized(normal).try_normalize().unwrap_or(normal.any_orthonormal_vector());
    let along = rotated(along, normal, turn * standard_normal(&mut rng));
    let angle = (patch.angle_deg.to_radians() + 0.6 * turn * standard_normal(&mut rng)).clamp(0.05, 1.5);
    let mut heading = along * libm::cosf(angle) + normal * libm::sinf(angle);
    // Where it goes once it has left the skin: on along it, or down; lashes curve towards their end.
    let settled = if lash {
        heading = wanted.normalize();
        Vec3::new(0.0, if *upper { 1.6 } else { -1.3 }, 0.8).normalize()
    } else {
        let lie = along * 0.985 + normal * 0.17;
        (lie * (1.0 - patch.hang) + Vec3::NEG_Y * patch.hang).normalize_or(along)
    };
    let curl = patch.curl_mm * standard_lognormal(&mut rng, 0.3);
    let pitch = patch.pitch_mm * standard_lognormal(&mut rng, 0.2);
    let longest = if patch.curl_mm > 0.0 { (pitch / TURN_SEGMENTS).min(SEGMENT_MM) } else { SEGMENT_MM };
    let count = ((length / longest).ceil() as usize).clamp(*SEGMENTS.start(), *SEGMENTS.end());
    let step = length / count as f32;
    let wander = LineNoise::new(&[key[0], key[1], 2]);
    let mut points = vec![frame.position];
    let mut carrier = frame.position;
    let phase = std::f32::consts::TAU * rng.f32();
    let mut sideways = heading.any_orthonormal_vector();
    for k in 0..count {
        let s = (k as f32 + 0.5) * step;
        let pull = (step / patch.bend_mm).min(1.0);
        let drift = wander.at(s / (2.5 * patch.bend_mm)) * (0.5 * turn * pull.sqrt());
        heading = (heading + (settled - heading) * pull + drift).normalize_or(settled);
        carrier += heading * step;
        sideways = sideways.reject_from_normalized(heading).normalize_or(heading.any_orthonormal_vector());
        let end = (k + 1) as f32 * step;
        let radius = curl * ramp(end, 0.5, 0.6 * pitch);
        let (sin, cos) = libm::sincosf(phase + std::f32::consts::TAU * end / pitch);
        let offset = sideways * cos + heading.cross(sideways) * sin;
        // The curl starts at the root.
        points.push(carrier + offset * radius);
    }
    let radius = 5e-4 * patch.diameter_um * standard_lognormal(&mut rng, patch.diameter_spread);
    let radii = (0..=count).map(|k| {
        let t = k as f32 / count as f32;
        radius * (1.0 - (1.0 - patch.tip) * quintic(((t - 0.3) / 0.7).max(0.0)))
    });
    let mut shape = Shape { points, segment_mm: step, radii_mm: radii.collect() };
    shape.even();
    shape
}

impl Shape {
    /// Makes all segments equally long, from the root on, along the directions that they have.
    fn even(&mut self) {
        let was = self.points.clone();
        for k in 1..was.len() {
            let towards = (was[k] - self.points[k - 1]).try_normalize();
            let towards = towards.or((was[k] - was[k - 1]).try_normalize()).unwrap_or(Vec3::NEG_Y);
            self.points[k] = self.points[k - 1] + towards * self.segment_mm;
        }
    }

    fn at(&self, s: f32) -> Vec3 {
        let x = (s / self.segment_mm).max(0.0);
        let k = (x as usize).min(self.points.len() - 2);
        self.points[k].lerp(self.points[k + 1], (x - k as f32).min(1.0))
    }
}

/// Hairs closed up to the leader of their tuft: the nearest of hairs that are chosen some `tuft_mm` apart.
fn gathered(patch: &Patch, grown: &[Shape], key: u64) -> Vec<Shape> {
    if patch.tuft_strength == 0.0 {
        return grown.to_vec();
    }
    let cell = |p: Vec3| (p / patch.tuft_mm).floor().as_ivec3();
    let mut leaders: HashMap<IVec3, Vec<usize>> = HashMap::new();
    let around = |leaders: &HashMap<IVec3, Vec<usize>>, p: Vec3| -> Option<(f32, usize)> {
        let c = cell(p);
        let cells = (0..27).map(|i| c + IVec3::new(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1));
        let all = cells.filter_map(|c| leaders.get(&c)).flatten();
        all.map(|&i| (grown[i].points[0].distance(p), i))
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
    };
    for (i, shape) in grown.iter().enumerate() {
        let p = shape.points[0];
        if around(&leaders, p).is_none_or(|(d, _)| d >= patch.tuft_mm) {
            leaders.entry(cell(p)).or_default().push(i);
        }
    }
    let close = |i: usize| {
        let shape = &grown[i];
        let mut rng = Rng::keyed(&[key, i as u64, 3]);
        let strength = patch.tuft_strength * (0.6 + 0.8 * rng.f32()).min(1.0 / patch.tuft_strength.max(1e-3));
        let Some((_, leader)) =
            around(&leaders, shape.points[0]).filter(|l| l.1 != i && rng.f32() >= patch.stray)
        else {
            return shape.clone();
        };
        let mut out = shape.clone();
        let length = shape.segment_mm * (shape.points.len() - 1) as f32;
        for k in 1..out.points.len() {
            let s = k as f32 * shape.segment_mm;
            let share = strength * quintic((s / length.max(4.0)).min(1.0));
            out.points[k] = shape.points[k].lerp(grown[leader].at(s), share);
        }
        out.even();
        out
    };
    (0..grown.len()).map(close).collect()
}

/// A vector turned about a unit axis that it is at right angles to.
fn rotated(v: Vec3, axis: Vec3, angle: f32) -> Vec3 {
    let (sin, cos) = libm::sincosf(angle);
    v * cos + axis.cross(v) * sin
}
