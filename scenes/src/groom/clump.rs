//! The hierarchy of tufts, wisps and fibres.

use super::field::Comb;
use super::grow::{Carrier, Grower, Seedling};
use super::noise::{LineNoise, lognormal, normal, ramp, space_noise};
use crate::head::{Head, Root};
use crate::spec::GroomSpec;
use glam::Vec3;
use rayon::prelude::*;
use std::collections::HashMap;
use strandbench_rng::Rng;

// Streams of random numbers, so that changing one draw leaves the others as they are.
pub(crate) const TUFT: u64 = 1;
pub(crate) const WISP: u64 = 2;
pub(crate) const FIBRE: u64 = 3;
const SPREAD: u64 = 4;
const PHASE: u64 = 5;

/// The fringe as a side: see [`Planner::side`].
const FRINGE: i32 = 3;

/// Waves of a wisp.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wave {
    pub radius_mm: f32,
    pub pitch_mm: f32,
    pub phase: f32,
    /// 1 or -1: right- or left-handed.
    pub hand: f32,
    pub drift: LineNoise,
}

/// A tuft or a wisp: the path that its members gather to.
#[derive(Clone, Debug)]
pub(crate) struct Clump {
    pub parent: usize,
    pub strength: f32,
    pub rank: f32,
    pub length_factor: f32,
    pub cut_shift_mm: f32,
    pub wander: LineNoise,
    pub wave: Wave,
    pub carrier: Carrier,
    /// Unit normals of the carrier, transported without twist, indexed as its points.
    pub frame: Vec<Vec3>,
}

pub(crate) struct Planner<'a> {
    pub spec: &'a GroomSpec,
    pub head: &'a Head,
    pub comb: &'a Comb,
    pub grower: &'a Grower<'a>,
    pub seed: u64,
}

impl Planner<'_> {
    /// Length (mm) before the spreads, and whether the root belongs to the fringe.
    fn base_length(&self, root: &Root) -> (f32, bool) {
        let k = self.head.scale();
        let l = &self.spec.length;
        if let (Some(f), Some(inside)) = (l.fringe, self.comb.fringe_mm(root.position))
            && inside > 0.0
        {
            return (f.length_mm + self.comb.behind_hairline_mm(root.position).max(0.0), true);
        }
        let sides = l.sides_mm.unwrap_or(l.top_mm);
        let top = ramp(root.position.y, 22.0 * k, 34.0 * k);
        (sides + (l.top_mm - sides) * top, false)
    }

    /// Direction in which the hair of a root is combed.
    fn combed(&self, root: &Root) -> Vec3 {
        self.comb.toward(root.position, root.normal, self.comb.forward(root.position))
    }

    /// Sides of the parting (-1, 1; 0 on neither) and [`FRINGE`], which do not share clumps.
    fn side(&self, root: &Root) -> i32 {
        if self.base_length(root).1 { FRINGE } else { self.comb.side(root.position) }
    }

    /// What a carrier of this root needs to grow.
    pub fn seedling(
        &self,
        root: &Root,
        rank: f32,
        factor: f32,
        cut_shift: f32,
        wave_mm: f32,
        wander: [(LineNoise, f32); 3],
    ) -> Seedling {
        let (base, fringe) = self.base_length(root);
        let cut = if fringe { None } else { self.spec.length.cut_height_mm };
        Seedling {
            root: root.position,
            normal: root.normal,
            length_mm: (base * factor).max(4.0),
            cut_y: cut.map_or(f32::NEG_INFINITY, |c| c * self.head.scale() + cut_shift),
            rank,
            curl_mm: wave_mm,
            forward: self.comb.forward(root.position),
            fringe,
            weight: 1.0,
            wander,
        }
    }

    fn clump(&self, level: u64, i: usize, root: &Root, parent: Option<(usize, &Clump)>) -> Clump {
        let spec = self.spec;
        let mut rng = Rng::keyed(&[self.seed, level, i as u64]);
        let c = &spec.clumping;
        let strength = if level == TUFT { c.tuft_strength } else { c.wisp_strength };
        let strength = (strength * (1.0 + c.strength_spread * normal(&mut rng))).clamp(0.0, 0.96);
        let w = &spec.wave;
        // A wisp varies about its tuft; waves that keep step vary between tufts alone.
        let share = std::f32::consts::FRAC_1_SQRT_2;
        let in_step = w.coherence_mm > 0.0;
        let wave_share = match (in_step, parent) {
            (false, _) => share,
            (true, None) => 1.0,
            (true, Some(_)) => 0.2,
        };
        let base = parent.map_or((w.radius_mm, w.pitch_mm), |(_, t)| (t.wave.radius_mm, t.wave.pitch_mm));
        let radius_mm = base.0 * lognormal(&mut rng, w.radius_spread * wave_share);
        let pitch_mm = base.1 * lognormal(&mut rng, w.pitch_spread * wave_share);
        let own = std::f32::consts::TAU * rng.f32();
        let hand = if in_step || rng.f32() < 0.5 { 1.0 } else { -1.0 };
        let phase = if in_step {
            let p = root.position / (w.coherence_mm * self.head.scale());
            let way = self.comb.way_mm(root.position) / pitch_mm;
            std::f32::consts::TAU * (way + 0.5 * space_noise(self.seed ^ PHASE, p)) + 0.25 * normal(&mut rng)
        } else {
            own
        };
        let rank = parent.map_or(1.0, |(_, t)| t.rank) * rng.range(0.72, 1.28);
        let length_factor = parent.map_or(1.0, |(_, t)| t.length_factor)
            * lognormal(&mut rng, spec.length.wisp_spread * share);
        let cut_shift_mm = parent.map_or(0.0, |(_, t)| t.cut_shift_mm)
            + spec.length.cut_spread_mm * share * normal(&mut rng);
        let wander = LineNoise::new(&[self.seed, level, i as u64, SPREAD]);
        let d = &spec.disorder;
        let own = (wander, d.wisp_wander_deg.to_radians());
        let still = (wander, 0.0);
        let levels = match parent {
            None => [(wander, d.tuft_wander_deg.to_radians()), still, still],
            Some((_, t)) => [(t.wander, d.tuft_wander_deg.to_radians()), own, still],
        };
        // Centres are grown longer than any member, so that members have something to follow to their tips.
        let seedling = self.seedling(root, rank, length_factor * 1.25, f32::NEG_INFINITY, radius_mm, levels);
        let carrier = self.grower.grow(&seedling);
        let frame = transported(&carrier, root.normal);
        Clump {
            parent: parent.map_or(0, |(i, _)| i),
            strength,
            rank,
            length_factor,
            cut_shift_mm,
            wander,
            wave: Wave {
                radius_mm,
                pitch_mm,
                phase,
                hand,
                drift: match parent {
                    Some((_, t)) if in_step => t.wave.drift,
                    _ => LineNoise::new(&[self.seed, level, i as u64, SPREAD, 1]),
                },
            },
            carrier,
            frame,
        }
    }

    fn count(&self, spacing_mm: f32) -> usize {
        let area = self.head.scalp().area_mm2() * self.head.scale() * self.head.scale();
        ((area / (spacing_mm * spacing_mm)) as usize).clamp(8, 60_000)
    }

    /// Tufts, their wisps, and the wisp of each fibre root; wisps without fibres are not grown.
    pub fn plan(&self, fibres: &[Root]) -> (Vec<Clump>, Vec<Clump>, Vec<usize>) {
        let scalp = self.head.scalp();
        let k = self.head.scale();
        let c = &self.spec.clumping;
        let roots = |level, spacing| scalp.roots(self.count(spacing), k, &[self.seed, level], 2);
        let tuft_roots = roots(TUFT, c.tuft_spacing_mm);
        let wisp_roots = roots(WISP, c.wisp_spacing_mm);

        let wisp_index = Nearest::new(self, &wisp_roots, c.wisp_spacing_mm);
        let of_fibre: Vec<usize> = fibres
            .par_iter()
            .enumerate()
            .map(|(i, r)| {
                let mut rng = Rng::keyed(&[self.seed, FIBRE, i as u64, WISP]);
                // Ragged borders: neighbours do not all choose by the same straight line.
                let jitter =
                    Vec3::new(rng.f32() - 0.5, rng.f32() - 0.5, rng.f32() - 0.5) * (0.9 * c.wisp_spacing_mm);
                wisp_index.find(self, r, jitter)
            })
            .collect();
        let mut used = vec![usize::MAX; wisp_roots.len()];
        let mut kept = Vec::new();
        for &w in &of_fibre {
            if used[w] == usize::MAX {
                used[w] = kept.len();
                kept.push(w);
            }
        }
        let tuft_index = Nearest::new(self, &tuft_roots, c.tuft_spacing_mm);
        let tufts: Vec<Clump> =
            tuft_roots.par_iter().enumerate().map(|(i, r)| self.clump(TUFT, i, r, None)).collect();
        let wisps: Vec<Clump> = kept
            .par_iter()
            .map(|&i| {
                let t = tuft_index.find(self, &wisp_roots[i], Vec3::ZERO);
                self.clump(WISP, i, &wisp_roots[i], Some((t, &tufts[t])))
            })
            .collect();
        (tufts, wisps, of_fibre.into_iter().map(|w| used[w]).collect())
    }
}

/// Normals carried along a path by the least rotation (double reflection is not needed at these steps: each
/// turn is a few degrees, and a projection is exact to second order).
fn transported(carrier: &Carrier, start: Vec3) -> Vec<Vec3> {
    let n = carrier.points.len();
    let mut out = Vec::with_capacity(n);
    let mut normal = start;
    for i in 0..n {
        let (a, b) = (carrier.points[i.saturating_sub(1)], carrier.points[(i + 1).min(n - 1)]);
        let t = (b - a).normalize_or(Vec3::NEG_Y);
        let flat = normal - t * normal.dot(t);
        normal = if flat.length_squared() > 1e-8 { flat.normalize() } else { t.any_orthonormal_vector() };
        out.push(normal);
    }
    out
}

impl Clump {
    /// Position, tangent and transported normal of the centre at an arc length.
    pub fn frame_at(&self, s: f32) -> (Vec3, Vec3, Vec3) {
        let c = &self.carrier;
        let n = c.points.len();
        let x = (s / c.step_mm).min((n - 1) as f32 - 1e-3).max(0.0);
        let i = x as usize;
        let f = x - i as f32;
        let t = (c.points[i + 1] - c.points[i]).normalize_or(Vec3::NEG_Y);
        let normal = self.frame[i] + (self.frame[i + 1] - self.frame[i]) * f;
        let normal = (normal - t * normal.dot(t)).normalize_or(self.frame[i]);
        (c.at(s), t, normal)
    }
}

/// Buckets of roots; the distance also counts how differently two roots are combed.
struct Nearest {
    cell: f32,
    buckets: HashMap<[i32; 3], Vec<u32>>,
    roots: Vec<(Vec3, Vec3, i32)>,
    turn_mm2: f32,
}

impl Nearest {
    fn new(planner: &Planner<'_>, roots: &[Root], spacing_mm: f32) -> Nearest {
        let cell = spacing_mm * 2.0;
        let mut buckets: HashMap<[i32; 3], Vec<u32>> = HashMap::new();
        let list: Vec<(Vec3, Vec3, i32)> =
            roots.iter().map(|r| (r.position, planner.combed(r), planner.side(r))).collect();
        for (i, r) in list.iter().enumerate() {
            buckets.entry((r.0 / cell).floor().to_array().map(|v| v as i32)).or_default().push(i as u32);
        }
        Nearest { cell, buckets, roots: list, turn_mm2: 4.0 * spacing_mm * spacing_mm }
    }

    fn find(&self, planner: &Planner<'_>, root: &Root, jitter: Vec3) -> usize {
        let (p, comb, side) = (root.position + jitter, planner.combed(root), planner.side(root));
        let cost = |i: u32| {
            let (q, c, s) = &self.roots[i as usize];
            let across =
                if s * side < 0 || (*s == FRINGE) != (side == FRINGE) { 1e3 * self.turn_mm2 } else { 0.0 };
            p.distance_squared(*q) + self.turn_mm2 * (1.0 - comb.dot(*c)) + across
        };
        let k = (p / self.cell).floor().to_array().map(|v| v as i32);
        let mut best = (f32::INFINITY, u32::MAX);
        for reach in 1..=2i32 {
            for dz in -reach..=reach {
                for dy in -reach..=reach {
                    for dx in -reach..=reach {
                        for &i in self.buckets.get(&[k[0] + dx, k[1] + dy, k[2] + dz]).into_iter().flatten() {
                            let c = cost(i);
                            if c < best.0 || (c == best.0 && i < best.1) {
                                best = (c, i);
                            }
                        }
                    }
                }
            }
            if best.1 != u32::MAX {
                return best.1 as usize;
            }
        }
        // A lone root far from every clump: all of them, in order.
        (0..self.roots.len() as u32).min_by(|&a, &b| cost(a).total_cmp(&cost(b))).expect("there is a clump")
            as usize
    }
}
