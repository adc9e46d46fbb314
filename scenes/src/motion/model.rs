//! What stays the same from frame to frame: the groomed scene, its guides, and which of them each strand follows.

use super::body::{Body, HeadTurn};
use super::guides::{Followed, Guide, bind, choose};
use super::strands::{Turned, moved};
use super::turns::{decode, unwound};
use super::{HeadPose, MotionError, MotionFrame, drive};
use crate::spec::{MotionSpec, SceneSpec};
use crate::{Scene, Surface, build};
use glam::DQuat;
use rayon::prelude::*;
use std::path::Path;
use strandbench_types::TriMesh;

/// Young's modulus of hair from files, GPa.
const YOUNG_GPA: f32 = 3.9;

/// Version of the motion's computation; one more whenever the same scene moves otherwise.
const VERSION: u64 = 1;

pub(super) struct Model {
    pub scene: Scene,
    pub motion: MotionSpec,
    pub body: Body,
    pub guides: Vec<Guide>,
    pub radius_mm: f64,
    pub young_gpa: f64,
    pub frame_rate_hz: f64,
    followed: Vec<Followed>,
}

impl Model {
    pub fn new(spec: &SceneSpec, seed: u64, base_dir: Option<&Path>) -> Result<Model, MotionError> {
        let motion = spec.motion.clone().ok_or_else(|| MotionError::Still { scene: spec.name.clone() })?;
        let scene = build(spec, seed, base_dir)?;
        let body = if spec.head.embedded {
            Body::embedded(spec.head.breadth_mm)
        } else {
            Body::mesh(scene.surfaces.first().map(|s| &s.mesh), spec.head.breadth_mm)
        };
        let wanted = motion.solver.guides as usize;
        let (mut guides, cell_mm) = choose(&scene.strands, wanted, motion.solver.segment_mm as f32);
        let followed = bind(&scene.strands, &mut guides, cell_mm);
        let radius_mm = match &spec.groom {
            Some(g) => g.radius_mm,
            None => median(&scene.strands.radii_mm),
        };
        let young_gpa = spec.groom.as_ref().map_or(YOUNG_GPA, |g| g.style.young_gpa);
        Ok(Model {
            scene,
            motion,
            body,
            guides,
            radius_mm: radius_mm.into(),
            young_gpa: young_gpa.into(),
            frame_rate_hz: spec.rig.frame_rate_hz,
            followed,
        })
    }

    /// Segments of all guides together.
    pub fn segments(&self) -> usize {
        self.guides.iter().map(|g| g.nodes.len() - 1).sum()
    }

    /// Time of a frame, s.
    pub fn time_s(&self, frame: u32) -> f64 {
        f64::from(frame) / self.frame_rate_hz
    }

    /// A hash of all that the motion is computed from.
    pub fn fingerprint(&self, wind_seed: u64) -> u64 {
        let motion = toml::to_string(&self.motion).expect("a motion has no value that TOML cannot hold");
        let numbers = [
            VERSION,
            wind_seed,
            self.frame_rate_hz.to_bits(),
            self.radius_mm.to_bits(),
            self.young_gpa.to_bits(),
            u64::from(self.scene.head_breadth_mm.to_bits()),
        ];
        let nodes = self.guides.iter().flat_map(|g| &g.nodes).flat_map(|p| p.to_array()).map(f64::to_bits);
        let strands =
            self.scene.strands.points.iter().flat_map(|p| p.to_array()).map(|v| u64::from(v.to_bits()));
        let bytes = motion.bytes().map(u64::from);
        fnv(numbers.into_iter().chain(bytes).chain(nodes).chain(strands))
    }

    /// The scene of a frame from its guides' turns, one code a segment ([`super::turns::encode`]).
    ///
    /// # Errors
    /// The index of a code that is no rotation.
    pub fn frame(&self, index: u32, codes: &[u64]) -> Result<MotionFrame, usize> {
        let time_s = self.time_s(index);
        let head = drive::head(&self.motion, time_s);
        let mut turned = Turned { turns: Vec::new(), starts: vec![0] };
        let mut at = 0;
        for g in &self.guides {
            let n = g.nodes.len() - 1;
            let segments: Vec<DQuat> = codes[at..at + n]
                .iter()
                .enumerate()
                .map(|(k, c)| decode(*c).ok_or(at + k))
                .collect::<Result<_, _>>()?;
            at += n;
            unwound(head.rotation, segments.into_iter(), &mut turned.turns);
            turned.starts.push(turned.turns.len() as u32);
        }
        let strands = moved(&self.scene.strands, &self.followed, &self.guides, &turned, &self.body, &head);
        let surfaces = self.scene.surfaces.iter().map(|s| self.surface(s, &head)).collect();
        // Everything but the strands and the surfaces, which are large, is copied.
        let scene = Scene { strands, surfaces, ..self.without_geometry() };
        let head = HeadPose { rotation: head.rotation, pivot_mm: self.body.pivot_mm };
        Ok(MotionFrame { index, time_s, scene, head })
    }

    fn without_geometry(&self) -> Scene {
        let s = &self.scene;
        Scene {
            name: s.name.clone(),
            strands: Default::default(),
            pigments: s.pigments.clone(),
            optics: s.optics,
            skin: s.skin,
            surfaces: Vec::new(),
            lights: s.lights.clone(),
            rig: s.rig.clone(),
            calibrated_rig: s.calibrated_rig.clone(),
            environment: s.environment.clone(),
            lens: s.lens,
            motion: s.motion,
            polarised: s.polarised.clone(),
            sensor: s.sensor.clone(),
            background_rgb: s.background_rgb,
            head_breadth_mm: s.head_breadth_mm,
        }
    }

    fn surface(&self, rest: &Surface, head: &HeadTurn) -> Surface {
        let vertices = rest.mesh.vertices.par_iter().map(|&v| self.body.carry(head, v)).collect();
        Surface { mesh: TriMesh { vertices, triangles: rest.mesh.triangles.clone() }, ..rest.clone() }
    }
}

fn median(values: &[f32]) -> f32 {
    let mut v = values.to_vec();
    let middle = v.len() / 2;
    *v.select_nth_unstable_by(middle, f32::total_cmp).1
}

/// FNV-1a over words.
pub(super) fn fnv(words: impl Iterator<Item = u64>) -> u64 {
    words.fold(0xcbf2_9ce4_8422_2325, |h, w| (h ^ w).wrapping_mul(0x0100_0000_01b3).rotate_left(23))
}
