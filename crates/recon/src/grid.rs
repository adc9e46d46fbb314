//! The part of the reference view that is worked on, at each level, and cost volumes over it.

use crate::ReconError;
use crate::pyramid::PyramidLevel;
use rayon::prelude::*;
use strandbench_types::{Monitor, Plane};

/// A rectangle of the reference view's level `level` that holds all of the hair.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Pyramid level; pixels are 2^level pixels of the finest.
    pub level: usize,
    /// First column and row, pixels of the level.
    pub origin: (usize, usize),
    /// Width in pixels of the level.
    pub width: usize,
    /// Height in pixels of the level.
    pub height: usize,
    /// Hair pixels, row by row.
    pub active: Vec<bool>,
}

impl Grid {
    /// Grids of all levels; origins are aligned, so that a pixel's parent is at half its coordinates.
    /// `None` without hair at the finest level.
    pub fn all(levels: &[PyramidLevel]) -> Option<Vec<Grid>> {
        let (w, h) = levels[0].image.size();
        let hair = |i: &usize| levels[0].is_hair(*i);
        let columns = |i: usize| i % w;
        let xs = (0..w * h).filter(hair).map(columns);
        let (x0, x1) = (xs.clone().min()?, xs.max()? + 1);
        let ys = (0..w * h).filter(hair).map(|i| i / w);
        let (y0, y1) = (ys.clone().min()?, ys.max()? + 1);
        let step = 1usize << (levels.len() - 1);
        let (x0, y0) = (x0 / step * step, y0 / step * step);
        Some(
            levels
                .iter()
                .enumerate()
                .map(|(level, pyramid)| {
                    let s = 1usize << level;
                    let origin = (x0 / s, y0 / s);
                    let (width, height) = (x1.div_ceil(s) - origin.0, y1.div_ceil(s) - origin.1);
                    let row = pyramid.image.width;
                    let active = (0..width * height)
                        .map(|i| pyramid.is_hair((origin.1 + i / width) * row + origin.0 + i % width))
                        .collect();
                    Grid { level, origin, width, height, active }
                })
                .collect(),
        )
    }

    /// Number of pixels.
    pub fn pixels(&self) -> usize {
        self.width * self.height
    }

    /// Centre of pixel (x, y) of the grid in pixels of the finest level.
    pub fn centre_px(&self, x: usize, y: usize) -> (f64, f64) {
        let s = (1usize << self.level) as f64;
        (((self.origin.0 + x) as f64 + 0.5) * s, ((self.origin.1 + y) as f64 + 0.5) * s)
    }

    /// The grid's part of a raster of its level.
    pub fn cut<T: Copy>(&self, plane: &Plane<T>) -> Vec<T> {
        (0..self.pixels())
            .map(|i| *plane.at(self.origin.0 + i % self.width, self.origin.1 + i / self.width))
            .collect()
    }
}

/// A cost per pixel of a grid and label, indexed [pixel * labels + label]; zero outside the hair.
#[derive(Clone, Debug, PartialEq)]
pub struct Volume {
    /// Depth labels.
    pub labels: usize,
    /// Costs.
    pub data: Vec<f32>,
}

impl Volume {
    /// A volume of zeros. Memory that is never written is never taken.
    pub fn zeros(grid: &Grid, labels: usize) -> Volume {
        Volume { labels, data: vec![0.0; grid.pixels() * labels] }
    }

    /// Costs of one pixel, indexed `[label]`.
    #[inline]
    pub fn costs(&self, pixel: usize) -> &[f32] {
        &self.data[pixel * self.labels..(pixel + 1) * self.labels]
    }

    /// Computes each hair pixel's costs, rows in parallel. `work` gets x, y and the pixel's costs, and a state
    /// of its own row.
    pub(crate) fn fill<S>(
        &mut self,
        grid: &Grid,
        monitor: &dyn Monitor,
        state: impl Fn() -> S + Sync,
        work: impl Fn(&mut S, usize, usize, &mut [f32]) + Sync,
    ) -> Result<(), ReconError> {
        let labels = self.labels;
        let rows = self.data.par_chunks_mut(grid.width * labels).enumerate();
        rows.try_for_each(|(y, row)| {
            monitor.check()?;
            let mut own = state();
            for x in 0..grid.width {
                if grid.active[y * grid.width + x] {
                    work(&mut own, x, y, &mut row[x * labels..(x + 1) * labels]);
                }
            }
            monitor.advance(1);
            Ok(())
        })
    }

    /// Adds the volume of the next coarser level, bilinearly interpolated between its hair pixels.
    pub fn add_coarser(
        &mut self,
        grid: &Grid,
        coarse: &Volume,
        coarse_grid: &Grid,
        monitor: &dyn Monitor,
    ) -> Result<(), ReconError> {
        assert_eq!(coarse_grid.level, grid.level + 1, "one level at a time");
        let none = || ();
        self.fill(grid, monitor, none, |(), x, y, out| {
            let mut total = 0.0;
            let parents = parents(x, y, coarse_grid);
            for (_, w) in parents {
                total += w;
            }
            if total > 0.0 {
                for (parent, w) in parents.into_iter().filter(|(_, w)| *w > 0.0) {
                    crate::aggregate::add_scaled(out, coarse.costs(parent), w / total);
                }
            }
        })
    }
}

/// The four pixels of the next coarser grid around a pixel and their bilinear weights (9, 3, 3 and 1
/// sixteenths), zero where there is no hair.
fn parents(x: usize, y: usize, coarse: &Grid) -> [(usize, f32); 4] {
    let pair = |v: usize, n: usize| {
        let near = v / 2;
        let far = if v.is_multiple_of(2) { near.checked_sub(1) } else { (near + 1 < n).then_some(near + 1) };
        [(Some(near), 0.75f32), (far, 0.25)]
    };
    let (xs, ys) = (pair(x, coarse.width), pair(y, coarse.height));
    let mut all = [(0, 0.0); 4];
    for (k, slot) in all.iter_mut().enumerate() {
        if let ((Some(px), wx), (Some(py), wy)) = (xs[k % 2], ys[k / 2]) {
            let i = py * coarse.width + px;
            if coarse.active[i] {
                *slot = (i, wx * wy);
            }
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pyramid::pyramid;
    use strandbench_types::Silent;

    #[test]
    fn grids_nest_and_interpolation_keeps_a_ramp() {
        let (w, h) = (70, 50);
        let mask =
            Plane::from_vec(w, h, (0..w * h).map(|i| i % w >= 13 && i % w < 57 && i / w >= 11).collect());
        let levels = pyramid(&Plane::filled(w, h, 0.5), &mask, 3);
        let grids = Grid::all(&levels).unwrap();
        assert_eq!((grids[0].origin, grids[1].origin, grids[2].origin), ((12, 8), (6, 4), (3, 2)));
        assert_eq!((grids[0].width, grids[0].height), (45, 42));
        assert_eq!(grids[0].active.iter().filter(|a| **a).count(), 44 * 39);
        assert_eq!(grids[1].centre_px(0, 0), (13.0, 9.0));

        // Costs linear in position must be found again at the centres of the finer pixels, away from the rim.
        let linear = |g: &Grid| {
            let mut v = Volume::zeros(g, 2);
            v.fill(
                g,
                &Silent,
                || (),
                |(), x, y, out| {
                    let (px, py) = g.centre_px(x, y);
                    out.copy_from_slice(&[px as f32, py as f32]);
                },
            )
            .unwrap();
            v
        };
        let mut fine = Volume::zeros(&grids[0], 2);
        fine.add_coarser(&grids[0], &linear(&grids[1]), &grids[1], &Silent).unwrap();
        let want = linear(&grids[0]);
        for y in 8..36 {
            for x in 8..38 {
                let i = y * grids[0].width + x;
                for (a, b) in fine.costs(i).iter().zip(want.costs(i)) {
                    assert!((a - b).abs() < 1e-4, "({x}, {y}): {a} for {b}");
                }
            }
        }
        let empty = pyramid(&Plane::filled(8, 8, 0.5), &Plane::filled(8, 8, false), 2);
        assert_eq!(Grid::all(&empty), None);
    }
}
