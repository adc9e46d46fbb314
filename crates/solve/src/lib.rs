//! Minimisers that know no hair: labelling on a pixel grid with a weighted quadratic smoothness term.

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
