//! Boxes, and bins of their centres by which ranges are split.

use super::node::WIDTH;

/// A primitive's box and identity while the tree is built.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(super) struct Prim {
    pub low: [f32; 3],
    /// Strand, or surface with the top bit set.
    pub owner: u32,
    pub high: [f32; 3],
    /// Start point of the segment, or triangle.
    pub item: u32,
}

/// Marks the owner of a triangle.
pub(super) const SURFACE: u32 = 1 << 31;

#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub low: [f32; 3],
    pub high: [f32; 3],
}

impl Bounds {
    pub(super) const NONE: Bounds = Bounds { low: [f32::INFINITY; 3], high: [f32::NEG_INFINITY; 3] };

    #[inline(always)]
    pub(super) fn add(&mut self, low: [f32; 3], high: [f32; 3]) {
        for k in 0..3 {
            self.low[k] = if low[k] < self.low[k] { low[k] } else { self.low[k] };
            self.high[k] = if high[k] > self.high[k] { high[k] } else { self.high[k] };
        }
    }

    pub(super) fn merge(&mut self, other: &Bounds) {
        self.add(other.low, other.high);
    }

    pub(super) fn half_area(&self) -> f32 {
        let [x, y, z] = std::array::from_fn(|k| (self.high[k] - self.low[k]).max(0.0));
        x * y + y * z + z * x
    }
}

/// Twice the centre of a box.
#[inline(always)]
pub(super) fn centre(p: &Prim) -> [f32; 3] {
    std::array::from_fn(|k| p.low[k] + p.high[k])
}

const BINS: usize = 16;

#[derive(Clone, Copy)]
struct Bin {
    bounds: Bounds,
    count: u32,
}

/// Indexed [axis][bin].
pub(super) struct Bins([[Bin; BINS]; 3]);

/// From twice a centre to its bin, per axis.
#[derive(Clone, Copy)]
pub(super) struct Binning {
    low: [f32; 3],
    scale: [f32; 3],
}

impl Binning {
    pub(super) fn new(centres: &Bounds) -> Binning {
        let scale = std::array::from_fn(|k| {
            let extent = centres.high[k] - centres.low[k];
            // An extent below this would give bins that rounding cannot tell apart.
            if extent > 1e-30 { BINS as f32 * 0.9999 / extent } else { 0.0 }
        });
        Binning { low: centres.low, scale }
    }

    #[inline(always)]
    pub(super) fn bin(&self, centre: f32, axis: usize) -> usize {
        (((centre - self.low[axis]) * self.scale[axis]) as usize).min(BINS - 1)
    }

    /// What falls into each bin.
    pub(super) fn fill(&self, prims: &[Prim]) -> Bins {
        let mut bins = Bins::EMPTY;
        for p in prims {
            let c = centre(p);
            for axis in 0..3 {
                let bin = &mut bins.0[axis][self.bin(c[axis], axis)];
                bin.bounds.add(p.low, p.high);
                bin.count += 1;
            }
        }
        bins
    }
}

/// Full leaves that `n` primitives fill: what a side of a split costs to test.
fn leaves(n: u32) -> f32 {
    n.div_ceil(WIDTH as u32) as f32
}

impl Bins {
    pub(super) const EMPTY: Bins = Bins([[Bin { bounds: Bounds::NONE, count: 0 }; BINS]; 3]);

    /// Of both together.
    pub(super) fn merged(mut self, other: Bins) -> Bins {
        for (a, b) in self.0.iter_mut().flatten().zip(other.0.iter().flatten()) {
            a.bounds.merge(&b.bounds);
            a.count += b.count;
        }
        self
    }

    /// Axis and first bin of the upper side of the cheapest split; none if all centres fall into one bin of each
    /// axis.
    pub(super) fn cheapest(&self) -> Option<(usize, usize)> {
        let mut best = (f32::INFINITY, None);
        for (axis, bins) in self.0.iter().enumerate() {
            let mut above = [0.0f32; BINS];
            let (mut bounds, mut n) = (Bounds::NONE, 0);
            for k in (1..BINS).rev() {
                bounds.merge(&bins[k].bounds);
                n += bins[k].count;
                above[k] = if n == 0 { f32::INFINITY } else { bounds.half_area() * leaves(n) };
            }
            (bounds, n) = (Bounds::NONE, 0);
            for k in 1..BINS {
                bounds.merge(&bins[k - 1].bounds);
                n += bins[k - 1].count;
                let cost = bounds.half_area() * leaves(n) + above[k];
                if n > 0 && cost < best.0 {
                    best = (cost, Some((axis, k)));
                }
            }
        }
        best.1
    }
}
