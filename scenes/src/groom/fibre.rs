//! From a carrier to the fibre: gathering into wisps, waves, frizz, the skin, and points as dense as the
//! curvature asks.

use super::clump::{Clump, FIBRE, Planner};
use super::noise::{LineNoise, lognormal, normal, ramp};
use crate::head::Root;
use glam::Vec3;
use strandbench_rng::Rng;

/// One finished fibre.
pub(crate) struct Fibre {
    pub points: Vec<Vec3>,
    pub radii_mm: Vec<f32>,
}

/// Most points of one fibre.
pub(crate) const MAX_POINTS: usize = 4000;

/// Distance from the skin (mm) that a fibre keeps once it has left its root; chords of 3 mm over a skull dip
/// by 0.014 mm, so they stay outside too.
fn clearance_mm(s: f32) -> f32 {
    (0.12 * s).min(0.35)
}

impl Planner<'_> {
    /// The fibre of a root.
    pub fn fibre(&self, index: usize, root: &Root, wisp: &Clump, tuft: &Clump) -> Fibre {
        let spec = self.spec;
        let mut rng = Rng::keyed(&[self.seed, FIBRE, index as u64]);
        let d = &spec.disorder;
        let radius = spec.radius_mm * lognormal(&mut rng, spec.radius_spread);
        let flyaway = rng.f32() < d.flyaway_share;
        let mut factor = wisp.length_factor * lognormal(&mut rng, spec.length.strand_spread);
        // Near the hairline some hair is young and short.
        let young = rng.f32();
        if young < 0.5 * (1.0 - ramp(root.inside_mm, 1.0, 9.0)) {
            factor *= rng.range(0.15, 0.6);
        }
        if flyaway {
            factor *= rng.range(0.15, 0.75);
        }
        let rank = wisp.rank * rng.range(0.92, 1.08) + if flyaway { rng.range(0.0, 0.35) } else { 0.0 };
        let own = LineNoise::new(&[self.seed, FIBRE, index as u64, 1]);
        let own_sd = if flyaway { d.flyaway_deg } else { d.strand_wander_deg }.to_radians();
        let wander = [
            (tuft.wander, d.tuft_wander_deg.to_radians()),
            (wisp.wander, d.wisp_wander_deg.to_radians()),
            (own, own_sd),
        ];
        let cut = wisp.cut_shift_mm + 0.3 * spec.length.cut_spread_mm * normal(&mut rng);
        let mut seedling = self.seedling(root, rank, factor, cut, wisp.wave.radius_mm, wander);
        if flyaway {
            seedling.weight = 0.8;
        }
        let carrier = self.grower.grow(&seedling);
        let phase = normal(&mut rng) * spec.wave.strand_phase_deg.to_radians();
        let amplitude = lognormal(&mut rng, 0.1) * if flyaway { rng.range(0.2, 1.0) } else { 1.0 };
        let loose = if flyaway { 0.15 } else { 1.0 };
        let frizz = LineNoise::new(&[self.seed, FIBRE, index as u64, 2]);

        let w = &spec.wave;
        let length = carrier.length_mm();
        let mut step = 1.5f32.min(d.frizz_length_mm / 6.0);
        if wisp.wave.radius_mm > 0.0 {
            step = step.min(wisp.wave.pitch_mm / 28.0);
        }
        let n = ((length / step).ceil() as usize).clamp(8, 4 * MAX_POINTS);
        let step = length / n as f32;
        let c = &spec.clumping;
        let reach = c.reach_mm.min(0.75 * length);
        let mut turn = wisp.wave.phase + phase;
        let mut dense = Vec::with_capacity(n + 1);
        dense.push(root.position);
        for i in 1..=n {
            let s = i as f32 * step;
            let (centre, tangent, normal) = wisp.frame_at(s);
            let gather = ramp(s, c.onset_mm, reach) * loose;
            let to_tuft = tuft.carrier.at(s) - centre;
            let shift = to_tuft * (tuft.strength * gather * limited(to_tuft, 40.0));
            let mut p = carrier.at(s) + shift;
            let to_wisp = centre + shift - p;
            p += to_wisp * (wisp.strength * gather * limited(to_wisp, 30.0));
            if wisp.wave.radius_mm > 0.0 {
                let drift = wisp.wave.drift.at(s / 70.0);
                let pitch = wisp.wave.pitch_mm * (1.0 + w.drift * drift.x).clamp(0.45, 1.8);
                turn += wisp.wave.hand * std::f32::consts::TAU * step / pitch;
                let r = wisp.wave.radius_mm
                    * amplitude
                    * (1.0 + w.drift * drift.y).clamp(0.3, 1.8)
                    * ramp(s, w.onset_mm, w.reach_mm);
                let across = tangent.cross(normal);
                p += normal * (r * (1.0 - w.flatness) * libm::cosf(turn)) + across * (r * libm::sinf(turn));
            }
            if d.frizz_mm > 0.0 {
                p += frizz.at(s / d.frizz_length_mm) * (d.frizz_mm * 0.577 * ramp(s, 3.0, length));
            }
            dense.push(self.outside(p, clearance_mm(s) + 0.1));
        }
        self.resampled(&dense, step, radius)
    }

    /// The point, or the nearest one at this distance from the head, by the sampled field.
    fn outside(&self, p: Vec3, clearance: f32) -> Vec3 {
        let (gap, normal) = self.head.distance(p);
        if gap < clearance { p + normal * (clearance - gap) } else { p }
    }

    /// Points along the dense curve, closer where it bends: chords of length l leave a curve of curvature κ by
    /// κ l² / 8.
    fn resampled(&self, dense: &[Vec3], step: f32, radius: f32) -> Fibre {
        let spec = self.spec;
        let n = dense.len();
        let mut need = Vec::with_capacity(n);
        need.push(0.0f32);
        for i in 1..n {
            let curvature = |i: usize| {
                if i == 0 || i + 1 >= n {
                    return 0.0;
                }
                let (a, b) = (dense[i] - dense[i - 1], dense[i + 1] - dense[i]);
                2.0 * a.cross(b).length() / (a.length() * b.length() * (a + b).length()).max(1e-9)
            };
            let k = curvature(i - 1).max(curvature(i));
            let density = (k / (8.0 * spec.chord_error_mm)).sqrt().max(1.0 / spec.max_segment_mm);
            need.push(need[i - 1] + density * dense[i].distance(dense[i - 1]));
        }
        let total = need[n - 1];
        let segments = (total.ceil() as usize).clamp(3, MAX_POINTS - 1);
        let mut points = Vec::with_capacity(segments + 1);
        points.push(dense[0]);
        let mut i = 1;
        for k in 1..=segments {
            let want = total * k as f32 / segments as f32;
            while i < n - 1 && need[i] < want {
                i += 1;
            }
            let t = ((want - need[i - 1]) / (need[i] - need[i - 1]).max(1e-9)).clamp(0.0, 1.0);
            let s = (i as f32 - 1.0 + t) * step;
            points.push(self.skin_clear(smooth_at(dense, i - 1, t), s));
        }
        points.dedup_by(|a, b| a.distance_squared(*b) < 1e-8);
        if points.len() < 2 {
            points.push(points[0] + self.head.exact_distance(points[0]).1 * 0.5);
        }
        let last = (points.len() - 1) as f32;
        let radii_mm = (0..points.len())
            .map(|k| radius * (1.0 - (1.0 - spec.tip_radius) * ramp(k as f32 / last, 0.8, 0.2)))
            .collect();
        Fibre { points, radii_mm }
    }

    /// Pushes a point out of the skin by the mesh itself.
    fn skin_clear(&self, mut p: Vec3, s: f32) -> Vec3 {
        let want = clearance_mm(s);
        for _ in 0..3 {
            if self.head.distance(p).0 > 5.0 {
                return p;
            }
            let (gap, normal) = self.head.exact_distance(p);
            if gap >= want {
                return p;
            }
            p += normal * (want - gap + 1e-3);
        }
        p
    }
}

/// 1 for short vectors, falling for long ones: a fibre whose way parts from its clump's is let go.
fn limited(v: Vec3, reach_mm: f32) -> f32 {
    1.0 / (1.0 + v.length_squared() / (reach_mm * reach_mm))
}

/// Catmull-Rom between points i and i + 1.
fn smooth_at(p: &[Vec3], i: usize, t: f32) -> Vec3 {
    let (b, c) = (p[i], p[i + 1]);
    let a = if i > 0 { p[i - 1] } else { b * 2.0 - c };
    let d = if i + 2 < p.len() { p[i + 2] } else { c * 2.0 - b };
    let (t2, t3) = (t * t, t * t * t);
    (a * (-t3 + 2.0 * t2 - t)
        + b * (3.0 * t3 - 5.0 * t2 + 2.0)
        + c * (-3.0 * t3 + 4.0 * t2 + t)
        + d * (t3 - t2))
        * 0.5
}
