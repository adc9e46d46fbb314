//! Growing one carrier: the smooth path of a fibre before clumping, waves and frizz.
//!
//! A carrier is integrated from its root by its heading. Each influence pulls the heading towards a direction
//! at a rate per millimetre:
//!
//! * **Weight.** A heavy elastic fibre under tension obeys EI θ'' = w (L - s) sin θ, with bending stiffness EI,
//!   weight w per length and L - s the length hanging below. Its decaying solution turns towards the vertical
//!   at the rate sqrt((L - s) / λ³) with λ³ = EI / w, so that long hair hangs within two or three centimetres
//!   while the last centimetres and short hair keep their heading. λ is about 50 mm.
//! * **Combing**, which fades along the fibre.
//! * **Layers.** Hair lies on the hair that is rooted below it: the fibre is held at a height above the head
//!   that grows with arc length, so that what comes from the crown ends up outermost, and the hair has a
//!   thickness in which fibres of many roots are found at many depths.
//! * **The head**, which no fibre enters, the window in front of the face, and the shoulders' ridge.
//! * **Wander** of the tuft, the wisp and the fibre.

use super::field::Comb;
use super::noise::{LineNoise, ramp};
use crate::head::Head;
use crate::spec::StyleSpec;
use glam::Vec3;

/// Density of keratin fibre, kg/m³.
const DENSITY: f32 = 1320.0;
/// Standard gravity, m/s².
const GRAVITY: f32 = 9.81;

/// What makes one carrier differ from another.
#[derive(Clone, Debug)]
pub(crate) struct Seedling {
    pub root: Vec3,
    pub normal: Vec3,
    /// Length, mm.
    pub length_mm: f32,
    /// Height at which scissors cut, mm; -infinity for none.
    pub cut_y: f32,
    /// Height of the layer relative to its mean.
    pub rank: f32,
    /// Height added to the layer for the curl's radius, mm.
    pub curl_mm: f32,
    /// Share (0..1) to which it is combed forward.
    pub forward: f32,
    /// Whether it hangs in front of the face.
    pub fringe: bool,
    /// Share of natural weight.
    pub weight: f32,
    /// Wander: key and standard deviation of heading in radians, from coarse to fine.
    pub wander: [(LineNoise, f32); 3],
}

pub(crate) struct Grower<'a> {
    pub head: &'a Head,
    pub comb: &'a Comb,
    pub style: &'a StyleSpec,
    /// λ³ of the median fibre, mm³.
    pub bend_mm3: f32,
    pub wander_length_mm: f32,
}

/// λ³ = EI / w in mm³ of a round fibre: E r² / (4 ρ g).
pub(crate) fn bend_length_cubed_mm3(young_gpa: f32, radius_mm: f32) -> f32 {
    let r = radius_mm * 1e-3;
    young_gpa * 1e9 * r * r / (4.0 * DENSITY * GRAVITY) * 1e9
}

/// Path with equal steps.
#[derive(Clone, Debug, Default)]
pub(crate) struct Carrier {
    pub points: Vec<Vec3>,
    pub step_mm: f32,
}

impl Carrier {
    pub fn length_mm(&self) -> f32 {
        (self.points.len() - 1) as f32 * self.step_mm
    }

    /// Position at an arc length (Catmull-Rom); beyond the tip, straight on.
    pub fn at(&self, s: f32) -> Vec3 {
        let n = self.points.len();
        let x = s / self.step_mm;
        if x >= (n - 1) as f32 {
            let d = self.points[n - 1] - self.points[n - 2];
            return self.points[n - 1] + d * (x - (n - 1) as f32);
        }
        let i = x as usize;
        let t = x - i as f32;
        let (b, c) = (self.points[i], self.points[i + 1]);
        let a = if i > 0 { self.points[i - 1] } else { b * 2.0 - c };
        let d = if i + 2 < n { self.points[i + 2] } else { c * 2.0 - b };
        let (t2, t3) = (t * t, t * t * t);
        (a * (-t3 + 2.0 * t2 - t)
            + b * (3.0 * t3 - 5.0 * t2 + 2.0)
            + c * (-3.0 * t3 + 4.0 * t2 + t)
            + d * (t3 - t2))
            * 0.5
    }
}

impl Grower<'_> {
    /// Grows a carrier.
    pub fn grow(&self, seedling: &Seedling) -> Carrier {
        let style = self.style;
        let length = seedling.length_mm;
        let steps = ((length / 3.0).ceil() as usize).clamp(12, 400);
        let ds = length / steps as f32;
        let emergence = style.emergence_deg.to_radians();
        let comb_at = |p: Vec3, n: Vec3| self.comb.toward(p, n, seedling.forward);
        let mut heading = (comb_at(seedling.root, seedling.normal) * libm::cosf(emergence)
            + seedling.normal * libm::sinf(emergence))
        .normalize();
        let mut walks = seedling.wander.map(|(noise, sd)| (noise.along(ds / self.wander_length_mm), sd));
        let k = self.head.scale();
        let mut p = seedling.root;
        let mut points = Vec::with_capacity(steps + 1);
        points.push(p);
        for i in 0..steps {
            let s = i as f32 * ds;
            let (gap, normal) = self.head.support(p);
            let layer = self.layer_mm(s, seedling);
            let above = gap - layer;
            let mut pull = Vec3::ZERO;

            let rate = seedling.weight * style.gravity * ((length - s) / self.bend_mm3).sqrt();
            let mut down = Vec3::NEG_Y;
            if above < 4.0 {
                // The hair beneath carries the part of the weight that presses on it.
                down -= normal * down.dot(normal).min(0.0);
                // On the shoulders it also keeps hair from sliding out along the arm.
                let shoulder = ramp(-p.y, 120.0 * k, 30.0 * k);
                if down.x * p.x > 0.0 {
                    down.x *= 1.0 - 0.85 * shoulder;
                }
            }
            pull += (down - heading * down.dot(heading)) * rate;

            let combing = 0.09 * libm::expf(-s / style.comb_reach_mm) / (1.0 + (gap / 30.0) * (gap / 30.0));
            if combing > 1e-4 {
                let c = comb_at(p, normal);
                pull += (c - heading * c.dot(heading)) * combing;
            }

            // Height above the layer decays over about a centimetre.
            let (climb, stiffness) = if above < 0.0 {
                ((-above / 12.0).min(0.7), 0.16)
            } else {
                // Hanging hair has nothing that draws it in.
                let hold = style.cling * ramp(normal.y, -0.25, 0.5) * ramp(p.y, -60.0 * k, 50.0 * k);
                (-(above / 25.0).min(0.5), 0.10 * hold / (1.0 + (above / 25.0) * (above / 25.0)))
            };
            pull += normal * ((climb - heading.dot(normal)) * stiffness);

            if !seedling.fringe
                && let Some((depth, out)) = self.comb.face_window(p + heading * 8.0)
            {
                pull += (out - heading * out.dot(heading)) * (0.02 + 0.01 * depth).min(0.12);
            }
            pull += self.shoulder_pull(p, heading);

            let mut wander = Vec3::ZERO;
            for (walk, sd) in &mut walks {
                wander += walk.next() * *sd;
            }
            pull += wander * (1.0 / self.wander_length_mm * 2.0);

            heading = (heading + pull * ds).normalize_or(heading);
            let mut next = p + heading * ds;
            let clearance = (0.35 * (s + ds)).min(1.2);
            let (gap, normal) = self.head.distance(next);
            if gap < clearance {
                next += normal * (clearance - gap);
                // Keep the step's length and let the heading follow what the skin allows.
                heading = (next - p).normalize_or(heading);
                next = p + heading * ds;
            }
            if next.y < seedling.cut_y && i > 3 {
                let t = ((p.y - seedling.cut_y) / (p.y - next.y)).clamp(0.05, 1.0);
                return Self::cut(points, p + (next - p) * t, ds, t);
            }
            points.push(next);
            p = next;
        }
        Carrier { points, step_mm: ds }
    }

    /// Ends a path within a step and spaces it evenly again.
    fn cut(mut points: Vec<Vec3>, end: Vec3, ds: f32, share: f32) -> Carrier {
        points.push(end);
        let n = points.len() - 1;
        let length = (n as f32 - 1.0 + share) * ds;
        let step = length / n as f32;
        let even: Vec<Vec3> = (0..=n)
            .map(|k| {
                let x = (k as f32 * step / ds).min(n as f32 - 1.0 + share);
                let i = (x as usize).min(n - 1);
                let f = if i == n - 1 { (x - i as f32) / share } else { x - i as f32 };
                points[i] + (points[i + 1] - points[i]) * f.min(1.0)
            })
            .collect();
        Carrier { points: even, step_mm: step }
    }

    /// Height above the head at which a fibre lies after an arc length, mm.
    fn layer_mm(&self, s: f32, seedling: &Seedling) -> f32 {
        let style = self.style;
        style.lift_mm * seedling.rank * (1.0 - libm::expf(-s / 22.0))
            + style.layer_mm * seedling.rank * s / (s + 150.0)
            + seedling.curl_mm * ramp(s, 0.0, 60.0)
    }

    /// Hair that comes down on the shoulder's ridge slides off to the front or to the back.
    fn shoulder_pull(&self, p: Vec3, heading: Vec3) -> Vec3 {
        let k = self.head.scale();
        let near = ramp(-p.y, 100.0 * k, 60.0 * k) * (1.0 - ramp(-p.y, 260.0 * k, 60.0 * k));
        if near <= 0.0 {
            return Vec3::ZERO;
        }
        let side = (p.z - self.style.shoulder_divide_mm * k) / (18.0 * k);
        let strength = 0.022 * near / (1.0 + side * side * 0.15);
        let out = Vec3::Z * if side >= 0.0 { 1.0 } else { -1.0 };
        (out - heading * out.dot(heading)) * strength
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bending_length_of_hair_is_five_centimetres() {
        // By hand: 3.9e9 · (40e-6)² / (4 · 1320 · 9.81) = 1.2047e-4 m³, whose cube root is 49.4 mm.
        let l = libm::cbrtf(bend_length_cubed_mm3(3.9, 0.04));
        assert!((l - 49.4).abs() < 0.1, "{l}");
    }

    #[test]
    fn a_carrier_interpolates_its_points_and_goes_on_straight() {
        let c = Carrier {
            points: (0..6).map(|i| Vec3::new(i as f32, (i * i) as f32, 0.0)).collect(),
            step_mm: 2.0,
        };
        assert_eq!(c.at(4.0), c.points[2]);
        assert!(
            (c.at(5.0) - Vec3::new(2.5, 6.25, 0.0)).length() < 1e-4,
            "exact for a parabola: {}",
            c.at(5.0)
        );
        assert!((c.at(12.0) - Vec3::new(6.0, 34.0, 0.0)).length() < 1e-4);
        assert_eq!(c.length_mm(), 10.0);
    }
}
