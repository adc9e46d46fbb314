//! Hair at a moment: carried by the skin, kept out of it, every segment as long as ever.

use super::{FacialHair, Shape};
use crate::face::{FaceModel, FollicleFrame, Part, PosedFace};
use crate::groom::{LineNoise, ramp};
use crate::head::MeshBvh;
use glam::{IVec3, Vec3};
use rayon::prelude::*;
use std::collections::HashMap;
use strandbench_types::StrandSet;

/// Follicles whose frames carry the hair beyond its root.
const NEIGHBOURS: usize = 6;
/// How far off they may stand, mm.
const REACH_MM: f32 = 9.0;
/// Arc length over which the frames around take over from the root's own, mm.
const HANDOVER_MM: f32 = 8.0;
/// Own motion at the tip, relative to the length, and most of it, mm.
const OWN_SHARE: f32 = 0.03;
pub(super) const OWN_MOST_MM: f32 = 0.35;
/// Changes of the own motion a second.
const OWN_HZ: f64 = 1.6;
/// Largest component of the noise of unit variance.
const NOISE_MOST: f32 = 1.733;
/// Within this arc length hair comes out of its follicle, mm; beyond it the skin keeps it out.
const FOLLICLE_MM: f32 = 0.5;
/// Distance that the skin keeps from a hair's surface, mm: chords between points sink no deeper than the skin.
const CLEAR_MM: f32 = 0.03;
/// Times that a point is moved off the skin and back to its distance from the last.
const PUSHES: usize = 6;
/// Directions tried between the hair's own and the skin's normal where pushing does not help.
const RAISES: usize = 5;

/// Hair at one moment; strands and points as in every other.
pub struct PosedHair {
    /// mm, world, root first.
    pub strands: StrandSet,
    /// Frames of the follicles, indexed `[strand]`.
    pub frames: Vec<FollicleFrame>,
}

/// The follicles around each follicle.
pub(super) struct Around {
    /// Indexed `[strand]`; the follicle itself is one of them.
    near: Vec<[u32; NEIGHBOURS]>,
}

impl Around {
    pub fn new(frames: &[FollicleFrame]) -> Around {
        let cell = |p: Vec3| (p / REACH_MM).floor().as_ivec3();
        let mut cells: HashMap<IVec3, Vec<u32>> = HashMap::new();
        for (i, f) in (0u32..).zip(frames) {
            cells.entry(cell(f.position)).or_default().push(i);
        }
        // Some of those within reach, spread over them: the nearest alone would say what the root's own frame says.
        let of = |i: usize| {
            let p = frames[i].position;
            let c = cell(p);
            let mut near: Vec<u32> = (0..27)
                .filter_map(|k| cells.get(&(c + IVec3::new(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1))))
                .flatten()
                .copied()
                .filter(|&j| frames[j as usize].position.distance(p) < REACH_MM)
                .collect();
            near.sort_unstable();
            std::array::from_fn(|k| if k == 0 { i as u32 } else { near[k * near.len() / NEIGHBOURS] })
        };
        Around { near: (0..frames.len()).into_par_iter().map(of).collect() }
    }
}

impl FacialHair {
    /// The hair on the face at a time (s) of the performance.
    pub fn posed(&self, model: &FaceModel, face: &PosedFace, time_s: f64) -> PosedHair {
        let frames: Vec<FollicleFrame> = self.follicles.par_iter().map(|f| f.frame(model, face)).collect();
        let skin = model.part(&[Part::Skin]);
        let bvh = MeshBvh::new(&skin.gather(&face.vertices), &skin.triangles);
        let hairs: Vec<Vec<Vec3>> =
            (0..self.shapes.len()).into_par_iter().map(|i| self.hair(i, &frames, &bvh, time_s)).collect();
        let mut strands = StrandSet::new();
        for (points, shape) in hairs.iter().zip(&self.shapes) {
            strands.push_tapered(points, &shape.radii_mm);
        }
        PosedHair { strands, frames }
    }

    fn hair(&self, i: usize, frames: &[FollicleFrame], skin: &MeshBvh, time_s: f64) -> Vec<Vec3> {
        let shape: &Shape = &self.shapes[i];
        let near = self.around.near[i].map(|j| j as usize);
        let length = shape.segment_mm * (shape.points.len() - 1) as f32;
        let own = LineNoise::new(&[self.key, i as u64]);
        // Nothing at the beginning: the reference frame is the neutral face.
        let sway = (own.at((time_s * OWN_HZ) as f32) - own.at(0.0)) / (2.0 * NOISE_MOST);
        let sway = sway * (OWN_SHARE * length).min(OWN_MOST_MM);
        let mut out = Vec::with_capacity(shape.points.len());
        out.push(frames[i].position);
        let mut hint = None;
        for (k, &p) in shape.points.iter().enumerate().skip(1) {
            let s = k as f32 * shape.segment_mm;
            let at_root = self.rest[i].carry(&frames[i], p);
            let around: Vec3 =
                near.iter().map(|&j| self.rest[j].carry(&frames[j], p)).sum::<Vec3>() / NEIGHBOURS as f32;
            let share = s / length;
            let wanted = at_root.lerp(around, ramp(s, 1.0, HANDOVER_MM)) + sway * (share * share);
            let last = out[k - 1];
            let heading = (wanted - last).try_normalize().unwrap_or(frames[i].axes.col(2));
            let limb = Limb {
                skin,
                start: last,
                length: shape.segment_mm,
                from_root: s - shape.segment_mm,
                radius: shape.radii_mm[k],
            };
            let heading = limb.outside(heading, frames[i].axes.col(2), &mut hint);
            out.push(last + heading * shape.segment_mm);
        }
        out
    }
}

/// A segment that starts at a fixed place and may be turned about it.
struct Limb<'a> {
    skin: &'a MeshBvh,
    start: Vec3,
    length: f32,
    /// Arc length before it, mm.
    from_root: f32,
    radius: f32,
}

impl Limb<'_> {
    /// How far the segment sinks below the distance that it should keep, the normal there, and the share of the segment.
    fn sunk(&self, heading: Vec3, hint: &mut Option<u32>) -> (f32, Vec3, f32) {
        let mut worst = (0.0, Vec3::ZERO, 1.0);
        for share in [1.0f32, 0.5, 0.75, 0.25] {
            let found = self.skin.closest(self.start + heading * (share * self.length), *hint);
            *hint = Some(found.triangle);
            let reach = ramp(self.from_root + share * self.length, 0.0, FOLLICLE_MM);
            let wanted = (self.radius + CLEAR_MM) * reach;
            if wanted - found.distance > worst.0 {
                worst = (wanted - found.distance, found.normal, share);
            }
            // The skin comes nearer by no more than what a place is moved.
            if share == 1.0 && found.distance > self.radius + CLEAR_MM + 0.75 * self.length {
                break;
            }
        }
        worst
    }

    /// The unit direction nearest to `heading`, about, in which the segment stays outside the skin; the least bad one where
    /// there is none, as between lips. `normal` leads away from the root.
    fn outside(&self, heading: Vec3, normal: Vec3, hint: &mut Option<u32>) -> Vec3 {
        let mut best = (f32::INFINITY, heading);
        let mut tried = heading;
        for _ in 0..PUSHES {
            let (depth, away, share) = self.sunk(tried, hint);
            if depth < best.0 {
                best = (depth, tried);
            }
            if depth == 0.0 {
                return tried;
            }
            let moved = tried * (share * self.length) + away * (1.05 * depth);
            tried = moved.try_normalize().unwrap_or(away);
        }
        // In a fold pushing goes to and fro: raise the segment towards the outside instead.
        for k in 1..=RAISES {
            let raised = heading.lerp(normal, k as f32 / RAISES as f32).try_normalize().unwrap_or(normal);
            let (depth, ..) = self.sunk(raised, hint);
            if depth < best.0 {
                best = (depth, raised);
            }
            if depth == 0.0 {
                break;
            }
        }
        best.1
    }
}
