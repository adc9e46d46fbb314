//! The three filters (3.3 of the paper).

use super::bits;
use super::cells::Cells;
use super::spread::Reconstruction;
use rayon::prelude::*;

impl Reconstruction<'_> {
    /// Drops patches that contradict better ones, that too few views see, and that stand alone; returns how many each
    /// of the three filters dropped.
    pub fn filter(&mut self) -> [usize; 3] {
        [
            self.drop_unless(Self::consistent),
            self.drop_unless(Self::seen_enough),
            self.drop_unless(Self::in_company),
        ]
    }

    fn drop_unless(&mut self, holds: fn(&Self, usize) -> bool) -> usize {
        let this = &*self;
        let keep: Vec<bool> = (0..self.patches.len()).into_par_iter().map(|k| holds(this, k)).collect();
        let before = self.patches.len();
        let mut at = 0;
        self.patches.retain(|_| {
            at += 1;
            keep[at - 1]
        });
        self.cells = Cells::new(self.views, self.p.cell_px, &self.patches);
        before - self.patches.len()
    }

    /// Visibility consistency: |V*| (1 - g*) is at least the sum of 1 - g* over the patches that lie in the same cells
    /// and are no neighbours.
    pub(super) fn consistent(&self, number: usize) -> bool {
        let patch = &self.patches[number];
        let mut against: Vec<u32> = Vec::new();
        for v in bits(patch.visible) {
            let Some(cell) = self.cells.cell_of(self.views, v, patch.centre) else { continue };
            against.extend(self.cells.visible(v, cell).iter().filter(|&&k| {
                k as usize != number && !self.cells.neighbours(self.views, patch, &self.patches[k as usize])
            }));
        }
        against.sort_unstable();
        against.dedup();
        let sum: f64 = against.iter().map(|&k| 1.0 - self.patches[k as usize].cost).sum();
        f64::from(patch.agreeing.count_ones()) * (1.0 - patch.cost) >= sum
    }

    /// Enough of the views that agree see the patch by the depth test.
    pub(super) fn seen_enough(&self, number: usize) -> bool {
        let patch = &self.patches[number];
        let seen = |&v: &usize| self.cells.in_front(self.views, &self.patches, v, patch.centre);
        bits(patch.agreeing).filter(seen).count() >= self.p.min_images
    }

    /// Of the patches in its own cell and the four beside it, in all views that see it, enough are neighbours.
    pub(super) fn in_company(&self, number: usize) -> bool {
        let patch = &self.patches[number];
        let mut around: Vec<u32> = Vec::new();
        for v in bits(patch.visible) {
            let Some(cell) = self.cells.cell_of(self.views, v, patch.centre) else { continue };
            for c in self.cells.beside(v, cell).chain([cell]) {
                around.extend(self.cells.visible(v, c).iter().filter(|&&k| k as usize != number));
            }
        }
        around.sort_unstable();
        around.dedup();
        let near = around
            .iter()
            .filter(|&&k| self.cells.neighbours(self.views, patch, &self.patches[k as usize]))
            .count();
        near > 0 && near as f64 >= self.p.company * around.len() as f64
    }
}
