//! Matching features and expanding patches (3.1 and 3.2 of the paper).

use super::cells::Cells;
use super::features::{Feature, detect};
use super::refine::Matching;
use super::view::View;
use super::{Limits, Patch, PatchStereo, bits};
use crate::BaselineError;
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use strandbench_types::Monitor;

/// Features whose patches are sought at once.
const BATCH: usize = 128;
/// Candidates of a feature that are tried, nearest first.
const MOST_CANDIDATES: usize = 60;

/// The patches so far, in the cells of all views.
pub(super) struct Reconstruction<'a> {
    pub views: &'a [View],
    pub p: &'a PatchStereo,
    /// Depths in camera 0 that count, mm.
    pub range_mm: (f64, f64),
    pub patches: Vec<Patch>,
    pub cells: Cells,
}

impl Reconstruction<'_> {
    fn add(&mut self, patch: Patch) {
        self.cells.insert(self.views, self.patches.len() as u32, &patch);
        self.patches.push(patch);
    }

    /// Whether a point lies in the working volume and in the hair of every view that reaches it.
    fn possible(&self, at: DVec3) -> bool {
        let depth = self.views[0].camera.to_camera(at).z;
        let shown = |v: &View| match v.camera.project(at) {
            Some((p, _)) if v.camera.contains(p) => v.is_hair(p),
            _ => true,
        };
        depth >= self.range_mm.0 && depth <= self.range_mm.1 && self.views.iter().all(shown)
    }

    /// Views from which a patch is seen at less than the largest angle.
    fn facing(&self, at: DVec3, normal: DVec3) -> u32 {
        let least = self.p.angle_deg.to_radians().cos();
        let sees = |v: &View| v.shows(at) && normal.dot(v.towards(at)) > least;
        (0..self.views.len()).filter(|&v| sees(&self.views[v])).fold(0, |set, v| set | 1 << v)
    }

    /// Patches from features: the features of each view in turn, each with those near its epipolar line in the other
    /// views, nearest first. Returns the number of features.
    pub fn match_features(&mut self, limits: Limits, monitor: &dyn Monitor) -> Result<usize, BaselineError> {
        let p = self.p;
        let features: Vec<Vec<Feature>> =
            self.views.par_iter().map(|v| detect(v, p.block_px, p.features_per_block)).collect();
        let count = features.iter().map(Vec::len).sum();
        for (reference, own) in features.iter().enumerate() {
            for batch in own.chunks(BATCH) {
                monitor.check()?;
                let this = &*self;
                let found: Vec<Option<Patch>> = batch
                    .par_iter()
                    .map(|f| {
                        let cell = this.cell_at(reference, f.pixel);
                        if !this.cells.agreeing(reference, cell).is_empty() {
                            return None;
                        }
                        let candidates = this.candidates(reference, f, &features);
                        candidates.into_iter().find_map(|c| this.at_point(reference, c, limits))
                    })
                    .collect();
                for (f, patch) in batch.iter().zip(found) {
                    let cell = self.cell_at(reference, f.pixel);
                    if let Some(patch) = patch
                        && self.cells.agreeing(reference, cell).is_empty()
                    {
                        self.add(patch);
                    }
                }
            }
        }
        Ok(count)
    }

    fn cell_at(&self, view: usize, pixel: DVec2) -> usize {
        let columns = self.views[view].image.width.div_ceil(self.p.cell_px);
        pixel.y as usize / self.p.cell_px * columns + pixel.x as usize / self.p.cell_px
    }

    /// Points at which a feature's ray passes features of its kind in other views, nearest first.
    fn candidates(&self, reference: usize, f: &Feature, features: &[Vec<Feature>]) -> Vec<DVec3> {
        let view = &self.views[reference];
        let ray = view.camera.ray_direction(f.pixel);
        let mut depths: Vec<f64> = Vec::new();
        for (other, theirs) in
            self.views.iter().zip(features).enumerate().filter(|(k, _)| *k != reference).map(|(_, o)| o)
        {
            // Images of the ray at depth t: a + b / t for the camera's centre a and direction b, up to scale.
            let base = other.pixel_from_world * (view.centre - other.centre);
            let along = other.pixel_from_world * ray;
            let line = base.cross(along);
            let norm = line.truncate().length();
            for g in theirs.iter().filter(|g| g.kind == f.kind) {
                if line.dot(g.pixel.extend(1.0)).abs() > self.p.epipolar_px * norm {
                    continue;
                }
                // t with (base + t along) at the feature's place along the line.
                let u = if line.x.abs() > line.y.abs() { 1 } else { 0 };
                let t = (g.pixel[u] * base.z - base[u]) / (along[u] - g.pixel[u] * along.z);
                if t.is_finite() && t > 0.0 {
                    depths.push(t);
                }
            }
        }
        depths.sort_unstable_by(f64::total_cmp);
        depths
            .into_iter()
            .map(|t| view.centre + ray * t)
            .filter(|&at| self.possible(at))
            .take(MOST_CANDIDATES)
            .collect()
    }

    /// A patch at a point that faces the reference view, if it can be made to agree.
    fn at_point(&self, reference: usize, centre: DVec3, limits: Limits) -> Option<Patch> {
        let normal = self.views[reference].towards(centre);
        let visible = self.facing(centre, normal) | 1 << reference;
        let patch = Patch { centre, normal, reference, visible, agreeing: 0, cost: 0.0 };
        self.settle(patch, limits, false)
    }

    /// Refines a patch and finds the views that it agrees in: first those within `limits.before`, after the refinement
    /// those within `limits.after`; `None` if they are fewer than wanted.
    fn settle(&self, mut patch: Patch, limits: Limits, by_depth: bool) -> Option<Patch> {
        let wanted = self.p.min_images as u32;
        let matching = Matching::new(self.views, &patch, self.p)?;
        patch.agreeing = matching.agreeing(&patch, patch.visible, limits.before);
        if patch.agreeing.count_ones() < wanted {
            return None;
        }
        matching.refine(&mut patch);
        if !self.possible(patch.centre) {
            return None;
        }
        let mut visible = self.facing(patch.centre, patch.normal);
        if by_depth {
            let seen = |v: usize| self.cells.in_front(self.views, &self.patches, v, patch.centre);
            visible = bits(visible).filter(|&v| seen(v)).fold(0, |set, v| set | 1 << v);
        }
        patch.visible = visible | patch.agreeing;
        patch.agreeing = matching.agreeing(&patch, patch.visible, limits.after);
        if patch.agreeing.count_ones() < wanted {
            return None;
        }
        patch.cost = matching.mean_cost(patch.agreeing, patch.centre, patch.normal);
        Some(patch)
    }

    /// Grows patches into neighbouring cells until no cell takes one. A wave looks at every cell once, from the best of
    /// the patches beside it, and its patches are added in order: threads change nothing.
    pub fn expand(&mut self, limits: Limits, monitor: &dyn Monitor) -> Result<(), BaselineError> {
        let mut order: Vec<u32> = (0..self.patches.len() as u32).collect();
        order.sort_by(|&a, &b| {
            self.patches[a as usize].cost.total_cmp(&self.patches[b as usize].cost).then(a.cmp(&b))
        });
        let mut waiting: Vec<Vec<(u32, usize)>> = vec![Vec::new(); self.views.len()];
        for k in order {
            self.ask_beside(k, &mut waiting);
        }
        while waiting.iter().any(|w| !w.is_empty()) {
            for view in 0..self.views.len() {
                monitor.check()?;
                let tasks = std::mem::take(&mut waiting[view]);
                let mut claimed = std::collections::HashSet::new();
                let (mut now, mut later) = (Vec::new(), Vec::new());
                for task in tasks {
                    if self.taken(task.0, view, task.1) {
                        continue;
                    }
                    if claimed.insert(task.1) { now.push(task) } else { later.push(task) }
                }
                let this = &*self;
                let found: Vec<Option<Patch>> =
                    now.par_iter().map(|&(from, cell)| this.grown(from, view, cell, limits)).collect();
                waiting[view] = later;
                for ((from, cell), patch) in now.into_iter().zip(found) {
                    if let Some(patch) = patch
                        && !self.taken(from, view, cell)
                        && self.fills_a_cell(&patch)
                    {
                        self.add(patch);
                        self.ask_beside(self.patches.len() as u32 - 1, &mut waiting);
                    }
                }
            }
        }
        Ok(())
    }

    fn ask_beside(&self, number: u32, waiting: &mut [Vec<(u32, usize)>]) {
        let patch = &self.patches[number as usize];
        for v in bits(patch.visible) {
            if let Some(cell) = self.cells.cell_of(self.views, v, patch.centre) {
                let free = self.cells.beside(v, cell).filter(|&c| !self.taken(number, v, c));
                waiting[v].extend(free.map(|c| (number, c)));
            }
        }
    }

    /// Whether a cell needs no patch grown from another: one agrees there already, or a neighbour of it is visible.
    fn taken(&self, from: u32, view: usize, cell: usize) -> bool {
        let patch = &self.patches[from as usize];
        !self.cells.agreeing(view, cell).is_empty()
            || self
                .cells
                .visible(view, cell)
                .iter()
                .any(|&k| self.cells.neighbours(self.views, patch, &self.patches[k as usize]))
    }

    /// Whether a patch agrees in a cell in which none does yet. One that refining moved out of the cell it was grown for may
    /// not; without this, such patches would be grown again and again.
    fn fills_a_cell(&self, patch: &Patch) -> bool {
        bits(patch.agreeing).any(|v| {
            let cell = self.cells.cell_of(self.views, v, patch.centre);
            cell.is_some_and(|c| self.cells.agreeing(v, c).is_empty())
        })
    }

    /// The patch beside another whose image lies in the middle of a cell.
    fn grown(&self, from: u32, view: usize, cell: usize, limits: Limits) -> Option<Patch> {
        let patch = &self.patches[from as usize];
        let pixel = self.cells.centre_px(view, cell);
        let v = &self.views[view];
        if !v.is_hair(pixel) {
            return None;
        }
        let ray = v.camera.ray_direction(pixel);
        let t = patch.normal.dot(patch.centre - v.centre) / patch.normal.dot(ray);
        let centre = v.centre + ray * t;
        if !(t.is_finite() && t > 0.0 && self.possible(centre)) {
            return None;
        }
        self.settle(Patch { centre, ..*patch }, limits, true)
    }
}
