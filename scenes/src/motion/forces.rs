//! What acts on a guide's segments besides its joints.

use super::body::{Body, HeadTurn};
use super::bulk::{Bulk, CELL_MM};
use super::drive::Wind;
use super::rest::GRAVITY;
use super::rod::Rod;
use crate::spec::MotionSolver;
use glam::{DQuat, DVec3};

/// Density of air, kg/m³, and its kinematic viscosity, m²/s, at 20 °C.
const AIR_DENSITY: f64 = 1.2;
const AIR_VISCOSITY: f64 = 1.5e-5;

/// Density of keratin, kg/m³.
const FIBRE_DENSITY: f64 = 1320.0;

/// Drag along a thin fibre relative to that across it: between the half of slow flow and the sixth of turbulent.
const AXIAL_DRAG: f64 = 0.35;

/// Cells that are looked through towards the wind for shelter.
const SHELTER_CELLS: u32 = 4;

/// Natural frequency of a segment on the pile of hair that it lies on, rad/s: gravity presses it in by 2.7 mm.
const PILE_RAD_S: f64 = 60.0;

/// Distance from the skin that guides keep, mm, or what they had when groomed if that is less.
const GUIDE_CLEARANCE_MM: f32 = 1.0;

/// A guide's surroundings in its groomed pose, indexed by segment.
pub(super) struct Groomed {
    /// Share 0..1 of the pile under it that bears it.
    pub pile: Vec<f64>,
    /// Height above the head as thick hair feels it, mm.
    pub pile_gap_mm: Vec<f32>,
    /// The pile's push at rest, mm/s².
    pub pile_push: Vec<f64>,
    /// Distance from the skin that its outer end keeps, mm.
    pub clearance_mm: Vec<f32>,
    /// Fibre per volume around it, 1/mm².
    pub density_per_mm2: Vec<f64>,
}

impl Groomed {
    /// Segments that lie over the upper half of the head, or on the shoulders, bear on what is beneath them.
    pub fn new(body: &Body, middles: &[DVec3], ends: &[DVec3]) -> (Groomed, Vec<DVec3>) {
        let ramp = |x: f32, from: f32, reach: f32| {
            let t = ((x - from) / reach).clamp(0.0, 1.0);
            t * t * (3.0 - 2.0 * t)
        };
        let (mut pile, mut pile_gap_mm, mut direction) = (Vec::new(), Vec::new(), Vec::new());
        for x in middles {
            let (gap, normal) = body.support(&AT_REST, x.as_vec3());
            let share = f64::from(ramp(normal.y, -0.1, 0.45) * (1.0 - ramp(gap, 25.0, 25.0)));
            pile.push(share);
            pile_gap_mm.push(gap);
            direction.push(normal.as_dvec3() * share);
        }
        let clearance_mm =
            ends.iter().map(|e| GUIDE_CLEARANCE_MM.min(body.rest_gap(e.as_vec3()).0 - 0.02)).collect();
        let zero = vec![0.0; middles.len()];
        (
            Groomed { pile, pile_gap_mm, pile_push: zero.clone(), clearance_mm, density_per_mm2: zero },
            direction,
        )
    }
}

pub(super) const AT_REST: HeadTurn = HeadTurn { rotation: DQuat::IDENTITY };

/// What all guides share in a step.
pub(super) struct Surroundings<'a> {
    pub body: &'a Body,
    pub bulk: &'a Bulk,
    pub wind: &'a Wind,
    pub solver: &'a MotionSolver,
    /// Radius of the fibres, mm.
    pub radius_mm: f64,
    /// Head at the step's beginning and end.
    pub heads: [HeadTurn; 2],
    /// Time at the step's beginning, s.
    pub time_s: f64,
    /// Length of the step, s.
    pub dt: f64,
}

impl Surroundings<'_> {
    /// Applies dissipation to the velocities and gives the other accelerations, mm/s².
    pub fn act(&self, rod: &mut Rod, groomed: &Groomed, out: &mut Vec<DVec3>) {
        out.clear();
        for k in 0..rod.len() {
            let (x, v) = (rod.x[k], rod.v[k]);
            let mut a = DVec3::NEG_Y * GRAVITY;
            let around = self.bulk.around(x);
            a += around.pressure(groomed.density_per_mm2[k]);

            let air = self.wind.at(x, self.time_s);
            let rub = self.solver.friction_per_s * around.crowd() * self.dt;
            let damp = self.solver.damping_per_s * self.dt;
            let mut v = (v + around.velocity * rub + air * damp) / (1.0 + rub + damp);
            v += self.drag(x, v, air, rod.tangent(k), around.density_per_mm2);

            if groomed.pile[k] > 0.0 {
                let (gap, normal) = self.body.support(&self.heads[0], x.as_vec3());
                let sunk = f64::from(groomed.pile_gap_mm[k] - gap);
                let push = groomed.pile_push[k] + PILE_RAD_S * PILE_RAD_S * sunk;
                let push = groomed.pile[k] * push.clamp(0.0, 6.0 * GRAVITY);
                if push > 0.0 {
                    let n = normal.as_dvec3();
                    a += n * push;
                    let ground = self.body.velocity([&self.heads[0], &self.heads[1]], x.as_vec3(), self.dt);
                    let slip = v - ground;
                    let slip = slip - n * slip.dot(n);
                    let speed = slip.length();
                    if speed > 0.0 {
                        v -= slip * ((self.solver.skin_friction * push * self.dt) / speed).min(1.0);
                    }
                }
            }
            rod.v[k] = v;
            out.push(a);
        }
    }

    /// Change of velocity (mm/s) by the air. A fibre alone is a cylinder with drag coefficient 1 + 10 Re^(-2/3)
    /// (White, Viscous Fluid Flow). Where there is much fibre, the first of it takes the wind's momentum from the
    /// rest: per area and depth, n fibres of diameter d take the share Cd n d of it (Beer and Lambert), which
    /// shelters what is behind, and within a cell a fibre gets the cell's mean.
    fn drag(&self, x: DVec3, v: DVec3, air: DVec3, tangent: DVec3, density_per_mm2: f64) -> DVec3 {
        let wind = air - v;
        let speed = wind.length();
        if speed < 1.0 {
            return DVec3::ZERO;
        }
        let metres = speed * 1e-3;
        let reynolds = metres * 2.0 * self.radius_mm * 1e-3 / AIR_VISCOSITY;
        let cd = 1.0 + 10.0 / libm::cbrt(reynolds * reynolds);
        let depth_per_density = cd * 2.0 * self.radius_mm * CELL_MM;
        let own = density_per_mm2 * depth_per_density;
        let mut exposed = if own > 1e-6 { (1.0 - libm::exp(-own)) / own } else { 1.0 };
        let towards = wind / speed * -CELL_MM;
        let mut before = 0.0;
        for cell in 1..=SHELTER_CELLS {
            let p = x + towards * f64::from(cell);
            before += self.bulk.density_per_mm2(p) * depth_per_density;
            if before > 12.0 {
                return DVec3::ZERO;
            }
        }
        if air != DVec3::ZERO {
            // The head casts a shadow of still air some of its own size.
            for step in [2.0, 5.0, 9.0] {
                let (gap, _) = self.body.gap(&self.heads[0], (x + towards * step).as_vec3());
                if gap < 0.0 {
                    before += 2.0;
                    break;
                }
            }
        }
        exposed *= libm::exp(-before);
        let rate = AIR_DENSITY * cd * metres / (FIBRE_DENSITY * std::f64::consts::PI * self.radius_mm * 1e-3)
            * exposed;
        let along = tangent * tangent.dot(wind);
        (wind - along * (1.0 - AXIAL_DRAG)) * (rate * self.dt / (1.0 + rate * self.dt))
    }

    /// Keeps the segments' outer ends out of the skin, with Coulomb friction.
    pub fn contact(&self, rod: &mut Rod, groomed: &Groomed, x0: &[DVec3], q0: &[DQuat]) {
        for k in 0..rod.len() {
            let end = rod.end(k);
            let (gap, normal) = self.body.gap(&self.heads[1], end.as_vec3());
            let depth = f64::from(groomed.clearance_mm[k] - gap);
            if depth <= 0.0 {
                continue;
            }
            let n = normal.as_dvec3();
            rod.push_end(k, n * depth);
            let start = x0[k] + q0[k] * DVec3::Z * (0.5 * rod.length_mm[k]);
            let ground =
                self.body.velocity([&self.heads[0], &self.heads[1]], end.as_vec3(), self.dt) * self.dt;
            let slip = rod.end(k) - start - ground;
            let slip = slip - n * slip.dot(n);
            let way = slip.length();
            if way > 0.0 {
                rod.push_end(k, -slip * (self.solver.skin_friction * depth / way).min(1.0));
            }
        }
    }
}
