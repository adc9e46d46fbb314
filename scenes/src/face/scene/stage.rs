//! Everything of a face's scene that does not change, and its moments.

use super::FaceScene;
use crate::face::model::PartTopology;
use crate::face::{
    FaceError, FaceModel, FacePose, FacialHair, FollicleFrame, Identity, Part, Performance, PosedFace,
};
use crate::{AreaLight, RigMotion, Scene, SceneError, SkinDetail, Surface, capture};
use glam::Vec3;
use std::path::Path;
use std::sync::Arc;
use strandbench_rng::Rng;
use strandbench_types::{Rig, StrandSet, TriMesh};

/// Diffuse albedo, linear RGB, of what has no texture.
const EYE: [f32; 3] = [0.55, 0.52, 0.5];
const TEETH: [f32; 3] = [0.62, 0.58, 0.48];
const TONGUE: [f32; 3] = [0.35, 0.14, 0.13];

/// Head breadth that is stated for the scene, mm: the mean face's.
const HEAD_BREADTH_MM: f32 = 155.0;

/// A person with hair in front of the rig.
pub struct FaceStage {
    /// The description.
    pub spec: FaceScene,
    model: &'static FaceModel,
    identity: Identity,
    /// The hair, rooted, in the neutral pose.
    pub hair: FacialHair,
    parts: [PartTopology; 4],
    skin: Arc<SkinDetail>,
    eyes: Arc<SkinDetail>,
    lights: Vec<AreaLight>,
    rig: Rig,
    calibrated: Rig,
    /// Whether a camera is cross-polarised, indexed `[camera]`.
    pub polarised: Vec<bool>,
}

/// One moment of a face's scene. Strands, points, vertices and triangles are the same in all of them.
pub struct FaceMoment {
    /// Ready to render; surfaces: skin, eyes, teeth, tongue.
    pub scene: Scene,
    /// Where each hair stands, indexed `[strand]`.
    pub follicles: Vec<FollicleFrame>,
    /// All vertices of the face, in the model's order.
    pub face: PosedFace,
}

impl FaceStage {
    /// Draws the person and grows the hair. `seed` is mixed with the scene's own seed, and moves the calibration error;
    /// `base_dir` is the folder that file names start from.
    ///
    /// # Errors
    /// [`SceneError::Spec`] for a value out of range or a groom map that does not fit.
    pub fn new(spec: &FaceScene, seed: u64, base_dir: Option<&Path>) -> Result<FaceStage, SceneError> {
        let fault =
            |(key, problem): (String, String)| SceneError::Spec { scene: spec.name.clone(), key, problem };
        spec.check().map_err(fault)?;
        let of = |key: &'static str| move |e: FaceError| fault((key.to_owned(), e.to_string()));
        let seed = Rng::keyed(&[seed, spec.seed]).next_u64();
        let model = FaceModel::embedded();
        let identity = Identity::draw(model, &spec.face).map_err(of("face"))?;
        let hair = FacialHair::grow(model, &identity, &spec.hair, seed, base_dir).map_err(of("hair"))?;
        let parts = [
            &[Part::Skin][..],
            &[Part::LeftEye, Part::RightEye],
            &[Part::UpperTeeth, Part::LowerTeeth],
            &[Part::Tongue],
        ]
        .map(|parts| model.part(parts));
        let mean = Identity::mean(model).vertices(model);
        let texture = &spec.skin_texture;
        let skin =
            SkinDetail::skin(texture.clone(), parts[0].gather(&mean), parts[0].gather(hair.stubble_shadow()));
        let eyes = SkinDetail::eyes(texture.clone(), parts[1].gather(&mean));
        let (rig, polarised) = spec.rig.rig();
        Ok(FaceStage {
            calibrated: capture::calibrated(&rig, &spec.rig.calibration_error, seed),
            lights: spec.lights.lights(spec.rig.target_mm()),
            skin: Arc::new(skin),
            eyes: Arc::new(eyes),
            spec: spec.clone(),
            model,
            identity,
            hair,
            parts,
            rig,
            polarised,
        })
    }

    /// The face's topology, texture coordinates and parts.
    pub fn model(&self) -> &'static FaceModel {
        self.model
    }

    /// Which vertices and triangles of the face are skin: the first surface of every moment.
    pub fn skin(&self) -> &PartTopology {
        &self.parts[0]
    }

    /// The middle of a frame's exposure, s.
    pub fn time_s(&self, frame: u32) -> f64 {
        f64::from(frame) / self.spec.rig.frame_rate_hz
    }

    /// The pose at a time: what is performed, and the fixed expression on top of it.
    fn pose(&self, time_s: f64) -> Result<FacePose, FaceError> {
        let mut pose = match self.spec.face.performance {
            Some(act) => Performance { act, seed: self.spec.face.identity }.pose(self.model, time_s),
            None => self.model.neutral(),
        };
        let fixed = self.spec.face.expressions.iter().map(|(name, &w)| (name.as_str(), w));
        for (w, f) in pose.weights.iter_mut().zip(self.model.weights(fixed)?) {
            *w = (*w + f).min(1.0);
        }
        Ok(pose)
    }

    /// The scene at a time in seconds from the beginning of the performance.
    ///
    /// # Errors
    /// [`SceneError::Spec`] if the face cannot take the pose.
    pub fn moment(&self, time_s: f64) -> Result<FaceMoment, SceneError> {
        let fault = |e: FaceError| SceneError::Spec {
            scene: self.spec.name.clone(),
            key: "face".into(),
            problem: e.to_string(),
        };
        let pose = self.pose(time_s).map_err(fault)?;
        let face = self.model.pose(&self.identity, &pose).map_err(fault)?;
        let hair = self.hair.posed(self.model, &face, time_s);
        let scene = self.scene(&face.vertices, hair.strands);
        Ok(FaceMoment { scene, follicles: hair.frames, face })
    }

    fn scene(&self, vertices: &[Vec3], strands: StrandSet) -> Scene {
        let spec = &self.spec;
        let mesh =
            |p: &PartTopology| TriMesh { vertices: p.gather(vertices), triangles: p.triangles.clone() };
        let [skin, eyes, teeth, tongue] = &self.parts;
        let detailed = |part, albedo, detail: &Arc<SkinDetail>| Surface {
            detail: Some(detail.clone()),
            ..Surface::plain(mesh(part), albedo)
        };
        let surfaces = vec![
            detailed(skin, spec.skin_texture.tone_rgb, &self.skin),
            detailed(eyes, EYE, &self.eyes),
            Surface::plain(mesh(teeth), TEETH),
            Surface::plain(mesh(tongue), TONGUE),
        ];
        Scene {
            name: spec.name.clone(),
            strands,
            pigments: self.hair.pigments.clone(),
            optics: spec.optics,
            surfaces,
            skin: spec.skin,
            lights: self.lights.clone(),
            environment: None,
            rig: self.rig.clone(),
            calibrated_rig: self.calibrated.clone(),
            polarised: self.polarised.clone(),
            lens: spec.rig.lens(),
            motion: RigMotion::default(),
            sensor: spec.sensor.clone(),
            background_rgb: spec.background_rgb,
            head_breadth_mm: HEAD_BREADTH_MM,
        }
    }
}
