//! What is done to a frame between its envelope and its answer.

use super::{Item, SequenceReconstructor};
use crate::field3d::{Neighbour, lines, temporal_pass};
use crate::pipeline::Clock;
use crate::strands::StrandInput;
use crate::surface::FrameSurface;
use crate::temporal::{Correspondence, FrameTracker, average};
use crate::{ReconError, Reconstruction};
use glam::Vec3;
use strandbench_types::{Camera, Estimate, Monitor};

impl SequenceReconstructor {
    /// Registers a frame to its neighbours and averages their depths (4.4).
    pub(super) fn clean(&mut self, k: usize, monitor: &dyn Monitor) -> Result<(), ReconError> {
        let (camera, temporal) = (&self.rig.cameras[0], &self.variant.temporal);
        let slot = self.present(k).expect("asked for a frame that has an envelope");
        let mut clock = Clock { stages: slot.diagnostics.stages.clone(), monitor };
        let mut notes = Vec::new();
        // From near to far, before and after.
        let others: Vec<Option<usize>> = (1..=self.reach()).flat_map(|away| self.around(k, away)).collect();
        let mut found: Vec<Option<Correspondence>> = vec![None; others.len()];
        if others.iter().any(Option::is_some) {
            found = clock.stage("registration", others.len() as u64, || {
                let mut tracker = FrameTracker::new(camera, &slot.raw, temporal)?;
                for (place, at) in found.iter_mut().zip(&others) {
                    let Some(other) = at.and_then(|n| self.present(n)) else { continue };
                    match tracker.find(&other.raw, monitor) {
                        Ok(c) => {
                            notes.push(note(tracker.nodes(), &c));
                            *place = Some(c);
                        }
                        Err(e @ ReconError::Deform { .. }) => {
                            notes.push(format!("without frame {}: {e}", other.index))
                        }
                        Err(e) => return Err(e),
                    }
                    monitor.advance(1);
                }
                Ok(found)
            })?;
        }
        let clean = clock.stage("denoise", 1, || {
            if !temporal.denoise {
                return Ok(slot.raw.clone());
            }
            let neighbours: Vec<&Correspondence> = found.iter().flatten().collect();
            let depth = average(&slot.raw, &neighbours);
            FrameSurface::new(camera, slot.index, depth, self.variant.parameters.cut_mm)
        })?;
        let stages = clock.stages;
        let slot = self.present_mut(k);
        slot.diagnostics.stages = stages;
        slot.diagnostics.notes.extend(notes);
        let mut nearest = found.into_iter();
        slot.neighbours = std::array::from_fn(|_| nearest.next().flatten());
        slot.clean = Some(clean);
        Ok(())
    }

    /// Whether the pass with this number can be done at `k`, and has not been; pass 0 lays the lines on the envelope.
    pub(super) fn ready(&self, k: usize, pass: usize, ended: bool) -> bool {
        let has = |n: usize| self.present(n).is_some_and(|s| s.clean.is_some() && s.passes.len() >= pass);
        let own = self.present(k).is_some_and(|s| s.clean.is_some() && s.passes.len() == pass);
        if pass == 0 {
            return own;
        }
        let waits = k + 1 == self.items.len() && !ended;
        own && !waits && self.neighbours(k).into_iter().flatten().all(has)
    }

    pub(super) fn filter(&mut self, k: usize, pass: usize, monitor: &dyn Monitor) -> Result<(), ReconError> {
        let camera = &self.rig.cameras[0];
        let p = self.variant.strands.expect("strands are grown");
        let slot = self.present(k).expect("ready");
        let clean = slot.clean.as_ref().expect("ready");
        let mut clock = Clock { stages: slot.diagnostics.stages.clone(), monitor };
        let tensors = clock.stage("orientation 3d", 1, || {
            if pass == 0 {
                return Ok(clean.tensors(camera, &slot.orientation));
            }
            let mut neighbours = Vec::new();
            for (at, correspondence) in self.neighbours(k).into_iter().zip(&slot.neighbours) {
                let (Some(other), Some(correspondence)) = (at.and_then(|n| self.present(n)), correspondence)
                else {
                    continue;
                };
                neighbours.push(Neighbour {
                    surface: other.clean.as_ref().expect("ready"),
                    correspondence,
                    registered: &slot.raw.envelope.vertex,
                    tensors: &other.passes[pass - 1],
                });
            }
            Ok(temporal_pass(clean, &slot.passes[pass - 1], &neighbours, &p))
        })?;
        let stages = clock.stages;
        let slot = self.present_mut(k);
        slot.diagnostics.stages = stages;
        slot.passes.push(tensors);
        Ok(())
    }

    /// Puts a frame's answer together.
    pub(super) fn estimate(&mut self, k: usize, monitor: &dyn Monitor) -> Result<Reconstruction, ReconError> {
        let Item::Present(slot) = &mut self.items[k] else {
            unreachable!("asked for a frame that has an envelope")
        };
        let camera: &Camera = &self.rig.cameras[0];
        let clean = slot.clean.as_ref().expect("de-noised before");
        let mut clock = Clock { stages: std::mem::take(&mut slot.diagnostics.stages), monitor };
        let mut estimate = Estimate {
            depth: Some(clean.depth.clone()),
            envelope: Some(clean.envelope.mesh.clone()),
            orientation: Some(slot.orientation.clone()),
            ..Estimate::default()
        };
        match &self.variant.strands {
            None => {
                estimate.orientation_3d =
                    Some(crate::envelope::orientation_3d(camera, &slot.orientation, &clean.envelope));
            }
            Some(p) => {
                let tensors = slot.passes.last().expect("filtered before");
                estimate.orientation_3d = Some(clean.raster(&lines(tensors), Vec3::ZERO));
                let cameras: Vec<&Camera> = self.used.iter().map(|&c| &self.rig.cameras[c]).collect();
                let input = StrandInput {
                    cameras: &cameras,
                    masks: &slot.masks,
                    surface: clean,
                    orientation: &slot.orientation,
                    tensors,
                };
                let grown = self.grower.grow(&input, p, &self.variant.temporal, &mut clock)?;
                slot.diagnostics.notes.extend(grown.notes);
                estimate.strands = Some(grown.strands);
                estimate.strand_ids = Some(grown.ids);
            }
        }
        slot.diagnostics.stages = clock.stages;
        Ok(Reconstruction { estimate, diagnostics: slot.diagnostics.clone() })
    }
}

fn note(nodes: usize, c: &Correspondence) -> String {
    let share = c.pixels.iter().flatten().count() as f64 / c.pixels.len() as f64;
    let r = &c.registered;
    format!(
        "registered to frame {}: {nodes} nodes, {} searches, {} systems, {:.3} mm off the planes of {} partners, {:.1} % of the vertices found",
        c.other,
        r.searches,
        r.steps,
        r.plane_rms_mm,
        r.partners,
        100.0 * share
    )
}
