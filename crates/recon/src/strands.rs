//! Section 5 for one frame after another: template, layer, field, seeds, growth.

use crate::field3d::diffuse;
use crate::growth::{Stop, grow_all};
use crate::layer::{Layer, SignedDistance, VoxelBox};
use crate::pipeline::Clock;
use crate::seeds::{Cage, interior_seeds, surface_seeds};
use crate::surface::FrameSurface;
use crate::template::Template;
use crate::tensor::Tensor;
use crate::{Checkpoint, ReconError, StrandParameters, TemporalParameters};
use glam::{DVec3, Vec3};
use strandbench_types::{Camera, OrientationField, Plane, Silhouette, StrandSet, in_hull};

/// Edge of the voxels in which distance to the template is taken, in voxels of the tensor volume.
const DISTANCE_VOXELS: f32 = 2.0;

/// What a frame brings.
pub(crate) struct StrandInput<'a> {
    /// Cameras that the method may look at, the reference first.
    pub cameras: &'a [&'a Camera],
    /// Their hair masks.
    pub masks: &'a [Plane<bool>],
    /// The de-noised envelope.
    pub surface: &'a FrameSurface,
    /// The reference view's 2-D field.
    pub orientation: &'a OrientationField,
    /// Filtered tensors, indexed `[vertex]`.
    pub tensors: &'a [Tensor],
}

/// A frame's strands.
pub(crate) struct GrownFrame {
    pub strands: StrandSet,
    /// An interior seed's strand has the seed's number, the same in every frame; a surface seed's strand has a number
    /// of its own, (frame + 1) 2³² + seed.
    pub ids: Vec<u64>,
    pub notes: Vec<String>,
}

/// What lasts from frame to frame: the template and the seeds bound to it in the first frame.
#[derive(Debug, Default)]
pub(crate) struct Grower {
    tracked: Option<Tracked>,
}

#[derive(Debug)]
struct Tracked {
    template: Template,
    cage: Cage,
}

impl Grower {
    /// A grower that goes on after the frame of a checkpoint.
    pub(crate) fn resume(
        c: &Checkpoint,
        p: &StrandParameters,
        temporal: &TemporalParameters,
    ) -> Result<Grower, ReconError> {
        let template = Template::restore(c, p, temporal)?;
        let cage = Cage::new(template.first(), c.seeds.clone(), p);
        Ok(Grower { tracked: Some(Tracked { template, cage }) })
    }

    /// What it needs to go on after a frame; `None` before the first.
    pub(crate) fn checkpoint(&self, frame: u32) -> Option<Checkpoint> {
        self.tracked.as_ref().map(|t| t.template.state(frame, t.cage.points()))
    }

    /// Grows the strands of the next frame.
    pub(crate) fn grow(
        &mut self,
        input: &StrandInput<'_>,
        p: &StrandParameters,
        temporal: &TemporalParameters,
        clock: &mut Clock<'_>,
    ) -> Result<GrownFrame, ReconError> {
        let (camera, surface, monitor) = (input.cameras[0], input.surface, clock.monitor);
        let frame = surface.frame;
        let mut notes = Vec::new();
        let fresh = self.tracked.is_none();
        clock.stage("template", 1, || {
            if let Some(t) = &mut self.tracked {
                let r = t.template.track(camera, surface, monitor)?;
                notes.push(format!(
                    "template: {} searches, {} partners, {:.3} mm off their planes",
                    r.searches, r.partners, r.plane_rms_mm
                ));
            } else {
                let template = Template::new(camera, surface, p, temporal, monitor)?;
                let cage = Cage::new(template.points(), Vec::new(), p);
                self.tracked = Some(Tracked { template, cage });
            }
            Ok(())
        })?;
        let tracked = self.tracked.as_mut().expect("made above");
        let distance = clock.stage("layer", 1, || {
            // Refuses a grid that would not fit before any distance is taken.
            let (low, high) = tracked.template.mesh().bounds().unwrap_or_default();
            VoxelBox::new(frame, low - p.layer_mm, high + p.layer_mm, p.voxel_mm)?;
            let below = tracked.template.surface(frame)?;
            SignedDistance::new(frame, &below, p.layer_mm, p.voxel_mm, DISTANCE_VOXELS * p.voxel_mm)
        })?;
        let silhouettes: Vec<Silhouette<'_>> = input
            .cameras
            .iter()
            .zip(input.masks)
            .map(|(&camera, mask)| Silhouette { camera, mask })
            .collect();
        let layer = clock.stage("layer", 1, || Layer::new(surface, &distance, &silhouettes, p))?;
        if fresh {
            tracked.cage = clock.stage("seeds", 1, || {
                Ok(Cage::new(tracked.template.points(), interior_seeds(&distance, p), p))
            })?;
        }
        drop(distance);
        let volume =
            clock.stage("diffusion", 1, || Ok(diffuse(camera, surface, input.tensors, &layer, p)))?;
        notes.push(format!(
            "layer: {} of {:?} voxels of {} mm; diffusion: {} iterations, residual {:.1e}",
            layer.voxels.len(),
            layer.grid.size,
            p.voxel_mm,
            volume.iterations,
            volume.residual
        ));
        let (seeds, seed_ids) = clock.stage("seeds", 1, || {
            let strength: Vec<f32> = surface
                .pixels
                .iter()
                .map(|&i| input.orientation.line(i as usize).map_or(0.0, |l| l.1))
                .collect();
            let inside = |at: &Vec3| in_hull(&silhouettes, at.as_dvec3());
            let advected = tracked.cage.advect(tracked.template.points());
            let interior = advected.into_iter().zip(0u64..).filter(|(at, _)| inside(at));
            let own = (u64::from(frame) + 1) << 32;
            let outer = surface_seeds(surface, &strength, p).into_iter().zip(own..);
            Ok::<(Vec<Vec3>, Vec<u64>), ReconError>(interior.chain(outer).unzip())
        })?;
        if seeds.is_empty() {
            return Err(ReconError::NoSeeds { frame, strength: p.seed_strength });
        }
        let down = (camera.camera_from_world.transpose() * DVec3::Y).as_vec3();
        let grown = clock.stage("growth", 1, || Ok(grow_all(&layer, &volume, &seeds, down, p)))?;
        let mut result = GrownFrame { strands: StrandSet::new(), ids: Vec::new(), notes };
        let mut stops = [0usize; 4];
        for (strand, &id) in grown.iter().zip(&seed_ids) {
            let Some(strand) = strand else { continue };
            result.strands.push(&strand.points, p.radius_mm);
            result.ids.push(id);
            strand.stops.iter().for_each(|s| stops[*s as usize] += 1);
        }
        let ends = |s: Stop| stops[s as usize];
        result.notes.push(format!(
            "{} strands from {} seeds; ends: {} by length, {} out of the layer, {} by turn, {} without direction",
            result.ids.len(),
            seeds.len(),
            ends(Stop::Length),
            ends(Stop::Layer),
            ends(Stop::Turn),
            ends(Stop::NoDirection)
        ));
        Ok(result)
    }
}
