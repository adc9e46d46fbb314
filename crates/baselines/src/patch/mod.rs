//! Patch-based multi-view stereo after Furukawa and Ponce (PAMI 2010), and a surface through its patches.
//!
//! Sections and equations are the paper's. Views are matched as a display would show them, with the hair's brightest at
//! white. The masks of the hair bound features, patches and surface, as the paper's optional silhouettes do.

mod cells;
mod features;
mod filter;
mod photo;
mod refine;
mod spread;
mod view;

use crate::account::Clock;
use crate::poisson::{Oriented, PoissonOptions, poisson, trim};
use crate::{BaselineError, Reconstruction as Answer};
use cells::Cells;
use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use spread::Reconstruction;
use strandbench_solve::deform::PointTree;
use strandbench_types::{DepthMap, Estimate, Frame, Monitor, Rig, Silhouette, TriMesh, in_hull};
use view::View;

/// Every number of the method; the paper's where it gives them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PatchStereo {
    /// How often images are halved before matching, the level of the authors' program.
    pub level: usize,
    /// Edge of an image cell β, pixels of the level (the paper: 2).
    pub cell_px: usize,
    /// Edge of a patch's window µ, pixels of the level, odd (the paper: 5 or 7).
    pub window_px: usize,
    /// Views that must agree γ, the reference view of the patch among them. The paper's 3 is for rings of many views; of
    /// four cameras in front of a head often only two see a side, and 2 does better on the scenes that this was tuned on.
    pub min_images: usize,
    /// Least NCC of a view before a patch is refined (the paper: 0.4).
    pub ncc_before: f64,
    /// Least NCC of a view after a patch is refined (the paper: 0.7).
    pub ncc_after: f64,
    /// How much lower both are after every round. The paper lowers them for poor texture.
    pub ncc_step: f64,
    /// Rounds of expansion and filtering (the paper: 3).
    pub rounds: usize,
    /// Largest angle between a patch's normal and the ray to a view, degrees (the paper: 60).
    pub angle_deg: f64,
    /// Edge of the blocks whose strongest features are kept, pixels of the level (the paper: 32).
    pub block_px: usize,
    /// Features of either kind kept in a block (the paper: 4).
    pub features_per_block: usize,
    /// Largest distance of a feature from the epipolar line, pixels of the level (the paper: 2).
    pub epipolar_px: f64,
    /// Share of the patches around one that must be its neighbours (the paper: 0.25).
    pub company: f64,
    /// Edge of the Poisson grid's cells, mm.
    pub surface_cell_mm: f64,
    /// Point weight α of the screened Poisson equation (Kazhdan and Hoppe: 4).
    pub screening: f64,
    /// Samples on a cell's face over which a patch is smoothed (Kazhdan and Hoppe: 1.5; more for noisy samples).
    pub samples_per_node: f64,
    /// Farthest that the surface may lie from a patch, in median distances between patches; what is farther is trimmed.
    pub trim: f64,
}

impl PatchStereo {
    /// The papers' values, but for `min_images` and those that they leave open, which do best on two scenes kept apart
    /// (reports/README.md).
    pub const TUNED: PatchStereo = PatchStereo {
        level: 1,
        cell_px: 2,
        window_px: 7,
        min_images: 2,
        ncc_before: 0.4,
        ncc_after: 0.7,
        ncc_step: 0.05,
        rounds: 3,
        angle_deg: 60.0,
        block_px: 32,
        features_per_block: 4,
        epipolar_px: 2.0,
        company: 0.25,
        surface_cell_mm: 3.0,
        screening: 4.0,
        samples_per_node: 1.5,
        trim: 8.0,
    };

    /// The first parameter out of its range: name and what is wanted.
    pub(crate) fn fault(&self) -> Option<(&'static str, &'static str)> {
        let within = |v: f64, low: f64, high: f64| v >= low && v <= high;
        let checks = [
            (self.level <= 5, "level", "a whole number up to 5"),
            ((1..=64).contains(&self.cell_px), "cell_px", "a whole number from 1 to 64"),
            (
                self.window_px % 2 == 1 && (3..=photo::MOST_WINDOW).contains(&self.window_px),
                "window_px",
                "an odd number from 3 to 15",
            ),
            ((2..=32).contains(&self.min_images), "min_images", "a whole number from 2 to 32"),
            (within(self.ncc_before, -1.0, 1.0), "ncc_before", "a number from -1 to 1"),
            (within(self.ncc_after, -1.0, 1.0), "ncc_after", "a number from -1 to 1"),
            (within(self.ncc_step, 0.0, 1.0), "ncc_step", "a number from 0 to 1"),
            ((1..=20).contains(&self.rounds), "rounds", "a whole number from 1 to 20"),
            (within(self.angle_deg, 1.0, 89.0), "angle_deg", "a number from 1 to 89"),
            ((4..=4096).contains(&self.block_px), "block_px", "a whole number from 4 to 4096"),
            (
                (1..=1000).contains(&self.features_per_block),
                "features_per_block",
                "a whole number from 1 to 1000",
            ),
            (within(self.epipolar_px, 0.1, 100.0), "epipolar_px", "a number from 0.1 to 100"),
            (within(self.company, 0.0, 1.0), "company", "a number from 0 to 1"),
            (within(self.surface_cell_mm, 0.05, 1000.0), "surface_cell_mm", "a number from 0.05 to 1000"),
            (within(self.screening, 1e-6, 1e6), "screening", "a number from 1e-6 to 1e6"),
            (within(self.samples_per_node, 0.1, 1000.0), "samples_per_node", "a number from 0.1 to 1000"),
            (within(self.trim, 0.1, 1e6), "trim", "a number from 0.1 to 1e6"),
        ];
        checks.into_iter().find(|(holds, ..)| !holds).map(|(_, key, wanted)| (key, wanted))
    }
}

/// A small piece of the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Patch {
    /// Centre c(p), mm.
    pub centre: DVec3,
    /// Unit normal n(p), towards the cameras.
    pub normal: DVec3,
    /// View R(p) whose ray the centre stays on.
    pub reference: usize,
    /// Views V(p) in which it should be visible, a bit each.
    pub visible: u32,
    /// Views V*(p) in which it agrees, the reference view among them.
    pub agreeing: u32,
    /// Mean of 1 - NCC over those, g*(p).
    pub cost: f64,
}

/// Largest 1 - NCC before and after refining.
#[derive(Clone, Copy, Debug)]
struct Limits {
    before: f64,
    after: f64,
}

/// Members of a set of views.
fn bits(set: u32) -> impl Iterator<Item = usize> {
    (0..32).filter(move |v| set >> v & 1 == 1)
}

/// Most cameras: views are bits.
const MOST_CAMERAS: usize = 32;

/// The patches of a frame, and a line about each step.
pub(crate) fn patches(
    rig: &Rig,
    frame: &Frame,
    p: &PatchStereo,
    clock: &mut Clock<'_>,
) -> Result<Vec<Patch>, BaselineError> {
    let cameras = rig.cameras.len();
    if cameras < p.min_images || cameras > MOST_CAMERAS {
        return Err(BaselineError::Cameras {
            cameras,
            wanted: format!("{} to {MOST_CAMERAS}", p.min_images),
        });
    }
    let monitor = clock.monitor;
    let views = View::all(rig, frame, p.level);
    let limits = |round: usize| {
        let lower = p.ncc_step * round as f64;
        Limits { before: 1.0 - p.ncc_before + lower, after: 1.0 - p.ncc_after + lower }
    };
    let mut state = Reconstruction {
        cells: Cells::new(&views, p.cell_px, &[]),
        views: &views,
        p,
        range_mm: (rig.near_mm, rig.far_mm),
        patches: Vec::new(),
    };
    let features = clock.stage("matching", || state.match_features(limits(0), monitor))?;
    clock.note(format!("{features} features, {} patches from them", state.patches.len()));
    for round in 0..p.rounds {
        clock.stage("expansion", || state.expand(limits(round), monitor))?;
        let grown = state.patches.len();
        let dropped = clock.stage("filtering", || Ok(state.filter()))?;
        clock.note(format!(
            "round {}: {grown} patches; dropped as inconsistent {}, seen by too few {}, alone {}",
            round + 1,
            dropped[0],
            dropped[1],
            dropped[2]
        ));
    }
    if state.patches.is_empty() {
        return Err(BaselineError::NoPatches { frame: frame.index, features });
    }
    Ok(state.patches)
}

/// Patches, the surface through them where it is near to them and inside the masks, and its depth.
pub(crate) fn reconstruct(
    rig: &Rig,
    frame: &Frame,
    p: &PatchStereo,
    monitor: &dyn Monitor,
) -> Result<Answer, BaselineError> {
    let mut clock = Clock::new(monitor);
    let patches = patches(rig, frame, p, &mut clock)?;
    let samples: Vec<Oriented> =
        patches.iter().map(|q| Oriented { position: q.centre, normal: q.normal }).collect();
    let options = PoissonOptions {
        cell_mm: p.surface_cell_mm,
        screening: p.screening,
        samples_per_node: p.samples_per_node,
    };
    let solved = clock.stage("poisson", || poisson(&samples, &options, monitor))?;
    clock.note(format!(
        "Poisson grid of {} nodes, {} steps; residual at the patches {:.3} of the jump",
        solved.nodes, solved.steps, solved.residual
    ));
    let mesh = clock.stage("trimming", || {
        Ok(trimmed(rig, frame, &samples, &solved.mesh, median(&solved.area_mm2).sqrt() * p.trim))
    })?;
    let mut depth = DepthMap::of_mesh(&rig.cameras[0], &mesh).map_err(BaselineError::Mesh)?;
    let mask = &frame.masks[0];
    for i in (0..mask.data.len()).filter(|&i| !mask.data[i]) {
        depth.set(i % mask.width, i / mask.width, None);
    }
    let estimate = Estimate { depth: Some(depth), envelope: Some(mesh), ..Estimate::default() };
    Ok(Answer { estimate, account: clock.account() })
}

/// The triangles within `reach_mm` of a sample that reach into the visual hull.
fn trimmed(rig: &Rig, frame: &Frame, samples: &[Oriented], mesh: &TriMesh, reach_mm: f64) -> TriMesh {
    let points: Vec<DVec3> = samples.iter().map(|s| s.position).collect();
    let tree = PointTree::new(&points);
    let silhouettes: Vec<Silhouette<'_>> =
        rig.cameras.iter().zip(&frame.masks).map(|(camera, mask)| Silhouette { camera, mask }).collect();
    let all: Vec<(bool, bool)> = mesh
        .vertices
        .par_iter()
        .map(|v| v.as_dvec3())
        .map(|v| (tree.nearest(v, reach_mm).is_some(), in_hull(&silhouettes, v)))
        .collect();
    trim(mesh, |t| t.iter().all(|&i| all[i].0) && t.iter().any(|&i| all[i].1))
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests;
