//! The energy, its checks and its value.

/// E(l) = Σ_p unary(p, l_p) + Σ_(p,q) weight(p, q) (l_p - l_q)², over the active pixels of a 4-connected grid.
#[derive(Clone, Copy, Debug)]
pub struct GridProblem<'a> {
    /// Grid width.
    pub width: usize,
    /// Grid height.
    pub height: usize,
    /// Number of labels, at most 65,535.
    pub labels: usize,
    /// Data costs, indexed [pixel * labels + label].
    pub unary: &'a [f32],
    /// Weight of the edge from pixel (x, y) to (x + 1, y), at least 0; ignored in the last column.
    pub weight_right: &'a [f32],
    /// Weight of the edge from pixel (x, y) to (x, y + 1), at least 0; ignored in the last row.
    pub weight_down: &'a [f32],
    /// Pixels that take part; an edge takes part if both of its ends do.
    pub active: &'a [bool],
}

/// A labelling and what is known of its quality.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// Label of each pixel; 0 where inactive.
    pub labels: Vec<u16>,
    /// Energy of the labelling.
    pub energy: f64,
    /// A proven lower bound of the minimum, where the minimiser gives one.
    pub lower_bound: Option<f64>,
    /// (wall seconds, energy, lower bound) after each outer iteration.
    pub history: Vec<(f64, f64, Option<f64>)>,
}

/// Largest magnitude accepted of a data cost or a weight: far above any use, and far enough below the end of
/// f32 that no sum or weighted square of label differences can overflow.
pub const MAX_MAGNITUDE: f32 = 1e25;

/// Why a problem was not solved.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// The grid has no pixels or no labels, or more than can be counted.
    #[error(
        "a grid of {width} x {height} pixels with {labels} labels: width, height and labels must be at least 1, labels at most 65535, and their product must fit in memory"
    )]
    Size {
        /// Grid width.
        width: usize,
        /// Grid height.
        height: usize,
        /// Number of labels.
        labels: usize,
    },
    /// An array does not have the length that the grid asks for.
    #[error("`{array}` has {len} entries, the grid asks for {want}")]
    Length {
        /// Name of the array.
        array: &'static str,
        /// Entries that it has.
        len: usize,
        /// Entries that it should have.
        want: usize,
    },
    /// A data cost is NaN, infinite or beyond [`MAX_MAGNITUDE`].
    #[error(
        "the data cost of pixel ({x}, {y}), label {label} is {value}: costs must be finite and within ±1e25 (use a large finite cost to forbid a label, or mark the pixel inactive)"
    )]
    Unary {
        /// Column.
        x: usize,
        /// Row.
        y: usize,
        /// Label.
        label: usize,
        /// The cost found.
        value: f32,
    },
    /// A smoothness weight is NaN, negative, infinite or beyond [`MAX_MAGNITUDE`].
    #[error(
        "`{array}` at pixel ({x}, {y}) is {value}: smoothness weights must be finite, at least 0 and at most 1e25"
    )]
    Weight {
        /// Name of the array.
        array: &'static str,
        /// Column.
        x: usize,
        /// Row.
        y: usize,
        /// The weight found.
        value: f32,
    },
    /// A labelling given as a start does not fit the problem.
    #[error(
        "the starting labelling is no labelling of this grid: entry {index} (of {len}) is {label}, labels run from 0 to {max}"
    )]
    Start {
        /// First entry at fault; equal to `len` if the array ends too early.
        index: usize,
        /// Entries in the labelling.
        len: usize,
        /// The label found there, or 0 if there is none.
        label: u16,
        /// Largest label.
        max: usize,
    },
    /// The problem is larger than this method's data structures may grow.
    #[error(
        "{method} would need {need} {what}, its limit is {limit}: use coarse_to_fine for problems of this size"
    )]
    TooLarge {
        /// The method.
        method: &'static str,
        /// What there would be too many of.
        what: &'static str,
        /// How many there would be.
        need: u128,
        /// How many there may be.
        limit: u128,
    },
    /// The caller's callback asked for a stop.
    #[error("cancelled")]
    Cancelled,
}

impl GridProblem<'_> {
    /// Number of pixels, active or not.
    pub fn pixels(&self) -> usize {
        self.width * self.height
    }

    /// Checks sizes and values; only active pixels and edges between them are looked at.
    ///
    /// # Errors
    /// [`SolveError`] naming the array, the pixel and the value at fault.
    pub fn validate(&self) -> Result<(), SolveError> {
        let size = SolveError::Size { width: self.width, height: self.height, labels: self.labels };
        if self.width == 0 || self.height == 0 || self.labels == 0 || self.labels > 65_535 {
            return Err(size);
        }
        let n = self.width.checked_mul(self.height).filter(|&n| n < u32::MAX as usize).ok_or(size.clone())?;
        let nl = n.checked_mul(self.labels).ok_or(size)?;
        let arrays = [
            ("unary", self.unary.len(), nl),
            ("weight_right", self.weight_right.len(), n),
            ("weight_down", self.weight_down.len(), n),
            ("active", self.active.len(), n),
        ];
        for (array, len, want) in arrays {
            if len != want {
                return Err(SolveError::Length { array, len, want });
            }
        }
        for p in (0..n).filter(|&p| self.active[p]) {
            let (x, y) = (p % self.width, p / self.width);
            let costs = &self.unary[p * self.labels..(p + 1) * self.labels];
            // Branch-free first, so that the common case runs at memory speed.
            let legal = |v: &f32| v.abs() <= MAX_MAGNITUDE;
            if !costs.iter().fold(true, |ok, v| ok & legal(v)) {
                let label = costs.iter().take_while(|v| legal(v)).count();
                return Err(SolveError::Unary { x, y, label, value: costs[label] });
            }
            for (array, weights, q) in [
                ("weight_right", self.weight_right, self.right_of(p)),
                ("weight_down", self.weight_down, self.below(p)),
            ] {
                let value = weights[p];
                if q.is_some() && !(0.0..=MAX_MAGNITUDE).contains(&value) {
                    return Err(SolveError::Weight { array, x, y, value });
                }
            }
        }
        Ok(())
    }

    /// The active pixel to the right of active pixel `p`, if there is one.
    #[inline]
    pub(crate) fn right_of(&self, p: usize) -> Option<usize> {
        (!(p + 1).is_multiple_of(self.width) && self.active[p + 1]).then_some(p + 1)
    }

    /// The active pixel below active pixel `p`, if there is one.
    #[inline]
    pub(crate) fn below(&self, p: usize) -> Option<usize> {
        let q = p + self.width;
        (q < self.active.len() && self.active[q]).then_some(q)
    }

    /// Data costs of one pixel.
    #[inline]
    pub(crate) fn costs(&self, p: usize) -> &[f32] {
        &self.unary[p * self.labels..(p + 1) * self.labels]
    }

    /// Calls `f(p, q, weight)` for every edge of positive weight, in row-major order of `p`, right before down.
    pub(crate) fn for_each_edge(&self, mut f: impl FnMut(usize, usize, f32)) {
        for p in (0..self.pixels()).filter(|&p| self.active[p]) {
            if let Some(q) = self.right_of(p).filter(|_| self.weight_right[p] > 0.0) {
                f(p, q, self.weight_right[p]);
            }
            if let Some(q) = self.below(p).filter(|_| self.weight_down[p] > 0.0) {
                f(p, q, self.weight_down[p]);
            }
        }
    }

    /// Up to four (neighbour, weight) of active pixel `p` over edges of positive weight.
    pub(crate) fn neighbours(&self, p: usize) -> impl Iterator<Item = (usize, f32)> + '_ {
        let left =
            (!p.is_multiple_of(self.width) && self.active[p - 1]).then(|| (p - 1, self.weight_right[p - 1]));
        let up = (p >= self.width && self.active[p - self.width])
            .then(|| (p - self.width, self.weight_down[p - self.width]));
        let right = self.right_of(p).map(|q| (q, self.weight_right[p]));
        let down = self.below(p).map(|q| (q, self.weight_down[p]));
        [left, up, right, down].into_iter().flatten().filter(|&(_, w)| w > 0.0)
    }

    /// Energy of a labelling, summed in f64 in row-major order; entries of inactive pixels are ignored.
    ///
    /// # Panics
    /// If `labels` has another length than the grid, or names a label that the problem does not have.
    pub fn energy(&self, labels: &[u16]) -> f64 {
        assert_eq!(labels.len(), self.pixels(), "one label for each pixel");
        let mut sum = 0.0;
        for p in (0..self.pixels()).filter(|&p| self.active[p]) {
            sum += f64::from(self.costs(p)[usize::from(labels[p])]);
        }
        self.for_each_edge(|p, q, w| {
            let d = f64::from(labels[p]) - f64::from(labels[q]);
            sum += f64::from(w) * d * d;
        });
        sum
    }

    /// Refuses a starting labelling that does not fit.
    pub(crate) fn validate_start(&self, start: &[u16]) -> Result<(), SolveError> {
        let max = self.labels - 1;
        let bad = |index: usize, label| SolveError::Start { index, len: start.len(), label, max };
        if start.len() != self.pixels() {
            return Err(bad(start.len().min(self.pixels()), 0));
        }
        match start.iter().position(|&l| usize::from(l) > max) {
            Some(i) => Err(bad(i, start[i])),
            None => Ok(()),
        }
    }
}
