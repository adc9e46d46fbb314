//! The truth of one frame, a view at a time.

use super::render::{Pose, Shooter};
use crate::SuiteError;
use crate::render::TRUTH;
use std::path::Path;
use strandbench_groundtruth::face::{
    Follicles, Frames, HairIndex, SkinSightings, face_view, hair_field, hair_roots, skin_cover,
};
use strandbench_groundtruth::{GroundTruthError, Sightings};
use strandbench_renderer::{Probe, RenderError};
use strandbench_scenes::face::{FaceStage, HairKind};
use strandbench_types::{FaceTruth, FaceView, Moment, Monitor, SampleHits, StrandSet, TriMesh};

/// Edge of a voxel of the field of distances to hair, mm.
const VOXEL_MM: f32 = 1.0;
/// How far the field reaches beyond the hair, mm.
const MARGIN_MM: f32 = 10.0;

/// The skin.
const SKIN: u32 = 0;

/// Where the hairs stand and what they are, as the skin's own mesh counts triangles; the same in every frame.
pub(super) struct Roots {
    triangles: Vec<u32>,
    barycentrics: Vec<[f32; 3]>,
    kinds: Vec<u8>,
}

impl Roots {
    pub fn new(stage: &FaceStage) -> Roots {
        let faces = &stage.skin().faces;
        let own = |face: u32| faces.binary_search(&face).expect("hair grows on skin") as u32;
        let follicles = &stage.hair.follicles;
        Roots {
            triangles: follicles.iter().map(|f| own(f.triangle)).collect(),
            barycentrics: follicles.iter().map(|f| f.barycentric).collect(),
            kinds: stage.hair.kinds.iter().map(|k| *k as u8).collect(),
        }
    }
}

/// What hides what at one moment, with hair and without.
pub(super) struct Probes<'a> {
    pub moment: Moment<'a>,
    hairy: Probe<'a>,
    bare: Probe<'a>,
}

impl<'a> Probes<'a> {
    /// `meshes` and `bald` outlive the probes: the surfaces of the pose, and a set of no strands.
    pub fn new(
        pose: &'a Pose,
        meshes: &'a [&'a TriMesh],
        bald: &'a StrandSet,
    ) -> Result<Probes<'a>, RenderError> {
        let strands = &pose.moment.scene.strands;
        Ok(Probes {
            moment: Moment { strands, meshes, follicle_axes: &pose.axes },
            hairy: Probe::new(strands, meshes)?,
            bare: Probe::new(bald, meshes)?,
        })
    }
}

/// What the cameras looked through so far have seen of a frame.
pub(super) struct FrameTruth<'a> {
    shooter: &'a Shooter<'a>,
    pose: &'a Pose,
    now: Probes<'a>,
    sightings: Sightings<'a>,
    skin: SkinSightings,
}

impl<'a> FrameTruth<'a> {
    pub fn new(
        shooter: &'a Shooter<'a>,
        pose: &'a Pose,
        now: Probes<'a>,
    ) -> Result<FrameTruth<'a>, SuiteError> {
        let scene = &pose.moment.scene;
        let sightings = Sightings::new(&scene.rig, &scene.strands).map_err(|e| shooter.truth_error(e))?;
        let skin = SkinSightings::new(scene.surfaces[0].mesh.vertices.len());
        Ok(FrameTruth { shooter, pose, now, sightings, skin })
    }

    /// Adds a camera and writes what is true of its view below `dir`.
    pub fn view(
        &mut self,
        camera: usize,
        hits: &SampleHits,
        dir: &Path,
        monitor: &dyn Monitor,
    ) -> Result<FaceView, SuiteError> {
        let scene = &self.pose.moment.scene;
        let c = &scene.rig.cameras[camera];
        let truth = |e: GroundTruthError| self.shooter.truth_error(e);
        let render = |e: RenderError| self.shooter.render_error(e);
        self.sightings.add(camera, hits).map_err(truth)?;
        let mesh = &scene.surfaces[0].mesh;
        self.skin.add((camera, c), (SKIN, mesh), &self.now.hairy, &self.now.bare).map_err(truth)?;
        let seen = self.now.hairy.first_hits(c, monitor).map_err(render)?;
        let bare = self.now.bare.behind_hair(c, &seen, monitor).map_err(render)?;
        let frames = Frames {
            now: self.now.moment,
            reference: self.shooter.reference.moment,
            kinds: &self.shooter.roots.kinds,
            sight: &self.shooter.reference.hairy,
            bare_sight: &self.shooter.reference.bare,
        };
        let view = face_view(&frames, c, seen, bare, monitor).map_err(truth)?;
        strandbench_io::write_face_view(&dir.join(TRUTH).join(&c.name), &view)?;
        Ok(view)
    }

    /// Writes what is true of the frame apart from its views, once all cameras have been added.
    pub fn finish(self, dir: &Path, monitor: &dyn Monitor) -> Result<(), SuiteError> {
        let truth = |e: GroundTruthError| self.shooter.truth_error(e);
        let scene = &self.pose.moment.scene;
        let roots = &self.shooter.roots;
        let follicles =
            Follicles { triangles: &roots.triangles, barycentrics: &roots.barycentrics, kinds: &roots.kinds };
        let index = HairIndex::new(&scene.strands, |_| true).map_err(truth)?;
        let field = hair_field(&index, VOXEL_MM, MARGIN_MM, monitor).map_err(truth)?;
        let cover = skin_cover(&scene.surfaces[0].mesh, Some(&index), &self.skin).map_err(truth)?;
        let frame = FaceTruth {
            skin: scene.surfaces[0].mesh.clone(),
            strands: scene.strands.clone(),
            roots: hair_roots(&scene.strands, &follicles).map_err(truth)?,
            kinds: HairKind::ALL.iter().map(|k| k.name().to_owned()).collect(),
            visibility: self.sightings.finish(),
            skin_seen_by: self.skin.seen_by,
            skin_bare_seen_by: self.skin.bare_seen_by,
            skin_cover: cover,
        };
        strandbench_io::write_face_truth(&dir.join(TRUTH), &frame)?;
        strandbench_io::write_rig(&dir.join(TRUTH).join("rig.json"), &scene.rig)?;
        Ok(strandbench_io::write_hair_field(&dir.join(TRUTH), &field)?)
    }
}
