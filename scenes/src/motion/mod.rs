//! Moving hair: every strand of a scene through time, with its identity kept.
//!
//! Some 1500 fibres of the groomed scene, the guides, are simulated as inextensible rods ([`rod`]) that are at rest
//! as groomed ([`rest`]), held at the moving scalp ([`drive`], [`body`]), under gravity, drag and wind, contact with
//! head, neck and shoulders ([`forces`]), and friction and pressure between hairs in aggregate ([`bulk`]). All
//! other strands follow the guides about them ([`guides`], [`strands`]). Offsets never change, roots move with the
//! scalp, and segments keep their lengths to the rounding of their coordinates.
//!
//! [`Simulation`] computes one frame after the other; [`MotionCache`] keeps the guides on disk, so that any frame
//! can be had again without those before it, with the same bits. Neither holds more than a frame in memory.

mod block;
mod body;
mod bulk;
mod cache;
mod catalog;
mod drive;
mod error;
mod forces;
mod guides;
mod model;
mod rest;
mod rod;
mod strands;
mod turns;

pub use cache::MotionCache;
pub use catalog::moving_catalog;
pub use error::MotionError;

use crate::{Scene, SceneSpec};
use body::HeadTurn;
use bulk::Bulk;
use drive::Wind;
use forces::{Groomed, Surroundings};
use glam::{DQuat, DVec3, Vec3};
use model::Model;
use rayon::prelude::*;
use rod::{Clamp, Rod, Scratch};
use std::path::Path;
use strandbench_rng::Rng;
use strandbench_types::Monitor;

/// Stream of wind.
const WIND: u64 = 31;

/// Poisson's ratio that makes hair's twisting stiffness 0.72 of its bending stiffness.
const POISSON: f64 = 0.38;

/// Density of keratin, kg/m³.
const FIBRE_DENSITY: f64 = 1320.0;

/// Fibres of a full head. Fewer strands stand for as many, so that a scene with a few of its strands moves as the
/// whole scene does.
const FULL_HEAD: f64 = 80_000.0;

/// Where the head is in a frame: turned from its pose at rest about a fixed point in the neck.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeadPose {
    /// Rotation from the pose at rest.
    pub rotation: DQuat,
    /// Point that it turns about, mm, world.
    pub pivot_mm: DVec3,
}

impl HeadPose {
    /// Where a point of the head at rest (mm) is now, mm, world.
    pub fn carry(&self, rest: Vec3) -> Vec3 {
        if self.rotation == DQuat::IDENTITY {
            return rest;
        }
        (self.rotation * (rest.as_dvec3() - self.pivot_mm) + self.pivot_mm).as_vec3()
    }
}

/// One frame of a moving scene.
#[derive(Clone, Debug)]
pub struct MotionFrame {
    /// Index, from 0, the groomed pose.
    pub index: u32,
    /// Time since frame 0, s.
    pub time_s: f64,
    /// The scene at that time. Strands have the offsets, radii and order of every other frame; of the surfaces
    /// the head is turned, the shoulders are still and the neck is bent between them.
    pub scene: Scene,
    /// Where the head is.
    pub head: HeadPose,
}

/// What is simulated of one guide.
struct Moving {
    rod: Rod,
    root: DVec3,
    groomed: Groomed,
    /// Orientations of the segments as groomed.
    pose: Vec<DQuat>,
    fibres: f64,
}

/// Computes a moving scene frame by frame.
pub struct Simulation {
    model: Model,
    wind: Wind,
    wind_seed: u64,
    moving: Vec<Moving>,
    bulk: Bulk,
    stiffer: Vec<f64>,
    next: u32,
}

impl Simulation {
    /// Grooms the scene and prepares its guides. `seed` and `base_dir` are as for [`crate::build`]; frame 0 is
    /// the scene that `build` makes.
    ///
    /// # Errors
    /// [`MotionError::Still`] for a scene without `[motion]`, [`MotionError::Scene`] for one that cannot be built,
    /// [`MotionError::Cancelled`].
    pub fn new(
        spec: &SceneSpec,
        seed: u64,
        base_dir: Option<&Path>,
        monitor: &dyn Monitor,
    ) -> Result<Simulation, MotionError> {
        let model = Model::new(spec, seed, base_dir)?;
        monitor.check()?;
        let wind_seed = Rng::keyed(&[seed, spec.seed, WIND]).next_u64();
        let radius_m = model.radius_mm * 1e-3;
        // EI / μ = E r² / (4 ρ), in mm⁴/s².
        let bend = model.young_gpa * 1e9 * radius_m * radius_m / (4.0 * FIBRE_DENSITY) * 1e12;
        let share = (FULL_HEAD / model.scene.strands.len() as f64).max(1.0);
        let clamp = |root: DVec3| Clamp { anchor: root, rotation: DQuat::IDENTITY };
        let prepared: Vec<(Moving, f64)> = model
            .guides
            .par_iter()
            .map(|g| {
                let middles: Vec<DVec3> = g.nodes.windows(2).map(|w| (w[0] + w[1]) * 0.5).collect();
                let (mut groomed, pile) = Groomed::new(&model.body, &middles, &g.nodes[1..]);
                let pose = rest::Pose {
                    nodes: &g.nodes,
                    mass: f64::from(g.step_mm),
                    bend,
                    twist: bend / (1.0 + POISSON),
                    pile: &pile,
                };
                let gravity = DVec3::NEG_Y * rest::GRAVITY;
                let (rod, pushes, stiffer) = rest::rod(&pose, &clamp(g.nodes[0]), gravity);
                groomed.pile_push = pushes;
                let pose = rod.q.clone();
                (Moving { rod, root: g.nodes[0], groomed, pose, fibres: g.fibres * share }, stiffer)
            })
            .collect();
        monitor.check()?;
        let stiffer = prepared.iter().map(|p| p.1).collect();
        let mut simulation = Simulation {
            wind: Wind::new(model.motion.wind, wind_seed),
            wind_seed,
            moving: prepared.into_iter().map(|p| p.0).collect(),
            bulk: Bulk::default(),
            stiffer,
            next: 0,
            model,
        };
        simulation.fill();
        let bulk = &simulation.bulk;
        simulation.moving.par_iter_mut().for_each(|m| {
            for (k, x) in m.rod.x.iter().enumerate() {
                m.groomed.density_per_mm2[k] = bulk.density_per_mm2(*x);
            }
        });
        Ok(simulation)
    }

    /// Number of frames.
    pub fn frames(&self) -> u32 {
        self.model.motion.frames
    }

    /// Number of segments of all guides.
    pub fn segments(&self) -> usize {
        self.model.segments()
    }

    /// How many times stiffer than hair each guide had to be made to stay as it was groomed.
    pub fn guide_stiffness(&self) -> &[f64] {
        &self.stiffer
    }

    /// The next frame, or nothing after the last. `monitor` is asked between steps whether to go on.
    ///
    /// # Errors
    /// [`MotionError::Cancelled`]; the simulation can go on from the frame that was not finished.
    pub fn next_frame(&mut self, monitor: &dyn Monitor) -> Result<Option<MotionFrame>, MotionError> {
        let Some((index, codes)) = self.next_turns(monitor)? else { return Ok(None) };
        let frame = self.model.frame(index, &codes);
        Ok(Some(frame.unwrap_or_else(|k| panic!("code {k} of frame {index} was encoded from a rotation"))))
    }

    /// The turns of the next frame's guides, encoded.
    fn next_turns(&mut self, monitor: &dyn Monitor) -> Result<Option<(u32, Vec<u64>)>, MotionError> {
        if self.next >= self.frames() {
            return Ok(None);
        }
        monitor.check()?;
        if self.next > 0 {
            let substeps = self.model.motion.solver.substeps;
            let (from, to) = (self.model.time_s(self.next - 1), self.model.time_s(self.next));
            for i in 0..substeps {
                let at = |i: u32| from + (to - from) * f64::from(i) / f64::from(substeps);
                self.substep(at(i), at(i + 1));
            }
        }
        let index = self.next;
        self.next += 1;
        let codes = self
            .moving
            .iter()
            .flat_map(|m| m.rod.q.iter().zip(&m.pose))
            .map(|(q, pose)| {
                assert!(q.is_finite(), "frame {index}: a guide is not finite");
                turns::encode((*q * pose.conjugate()).normalize())
            })
            .collect();
        Ok(Some((index, codes)))
    }

    fn fill(&mut self) {
        let segments = self
            .moving
            .iter()
            .flat_map(|m| (0..m.rod.len()).map(move |k| (m.rod.x[k], m.rod.v[k], m.rod.mass[k] * m.fibres)));
        self.bulk.fill(segments);
    }

    fn substep(&mut self, from_s: f64, to_s: f64) {
        self.fill();
        let motion = &self.model.motion;
        let heads: [HeadTurn; 2] = [from_s, to_s].map(|t| drive::head(motion, t));
        let around = Surroundings {
            body: &self.model.body,
            bulk: &self.bulk,
            wind: &self.wind,
            solver: &motion.solver,
            radius_mm: self.model.radius_mm,
            heads,
            time_s: from_s,
            dt: to_s - from_s,
        };
        self.moving.par_iter_mut().with_min_len(8).for_each_init(Scratch::default, |scratch, m| {
            let clamps = around
                .heads
                .map(|h| Clamp { anchor: around.body.carry_with_head(&h, m.root), rotation: h.rotation });
            around.act(&mut m.rod, &m.groomed, &mut scratch.acceleration);
            let damping = around.solver.fibre_damping_s;
            m.rod.step(around.dt, clamps, damping, scratch, |rod, x0, q0| {
                around.contact(rod, &m.groomed, x0, q0);
            });
        });
    }
}

#[cfg(test)]
mod tests;
