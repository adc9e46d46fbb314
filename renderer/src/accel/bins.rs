//! Boxes, and bins of their centres by which ranges are split.

use super::node::WIDTH;
use glam::{Vec3, Vec4};

/// A primitive's box and identity while the tree is built.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(super) struct Prim {
    pub low: [f32; 3],
    /// Strand, or surface with [`SURFACE`] set.
    pub owner: u32,
    pub high: [f32; 3],
    /// Start point of the segment, or triangle.
    pub item: u32,
}

/// Marks the owner of a triangle.
pub(super) const SURFACE: u32 = 1 << 31;

impl Prim {
    /// Lowest and highest corner in vectors of four, which the machine takes at once.
    #[inline(always)]
    fn corners(&self) -> (Vec4, Vec4) {
        (Vec3::from(self.low).extend(0.0), Vec3::from(self.high).extend(0.0))
    }

    pub(super) fn is_finite(&self) -> bool {
        self.low.iter().chain(&self.high).all(|v| v.is_finite())
    }

    /// Twice the centre.
    #[inline(always)]
    pub(super) fn centre(&self) -> Vec4 {
        let (low, high) = self.corners();
        low + high
    }
}

/// A box; the fourth component is unused.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub low: Vec4,
    pub high: Vec4,
}

impl Bounds {
    pub(super) const NONE: Bounds = Bounds { low: Vec4::INFINITY, high: Vec4::NEG_INFINITY };

    #[inline(always)]
    pub(super) fn add(&mut self, low: Vec4, high: Vec4) {
        self.low = self.low.min(low);
        self.high = self.high.max(high);
    }

    #[inline(always)]
    pub(super) fn add_prim(&mut self, p: &Prim) {
        let (low, high) = p.corners();
        self.add(low, high);
    }

    pub(super) fn half_area(&self) -> f32 {
        let d = (self.high - self.low).max(Vec4::ZERO);
        d.x * d.y + d.y * d.z + d.z * d.x
    }
}

const BINS: usize = 16;

#[derive(Clone, Copy)]
struct Bin {
    bounds: Bounds,
    count: u32,
}

/// Bins of each axis.
pub(super) struct Bins {
    /// Indexed [axis][bin]; bins from `used` on are not in use.
    rows: [[Bin; BINS]; 3],
    used: usize,
}

/// From twice a centre to its bin, per axis.
#[derive(Clone, Copy)]
pub(super) struct Binning {
    low: Vec4,
    scale: Vec4,
    bins: usize,
}

impl Binning {
    /// For `n` centres within `centres`; few get few bins, which are quicker to compare.
    pub(super) fn new(centres: &Bounds, n: usize) -> Binning {
        let bins = (6 + n / 8).min(BINS);
        let extent = centres.high - centres.low;
        // An extent below this would give bins that rounding cannot tell apart.
        let scale = extent.to_array().map(|e| if e > 1e-30 { bins as f32 * 0.9999 / e } else { 0.0 });
        Binning { low: centres.low, scale: Vec4::from(scale), bins }
    }

    /// Bin of twice a centre, per axis.
    #[inline(always)]
    pub(super) fn of(&self, centre: Vec4) -> [usize; 3] {
        let place = (centre - self.low) * self.scale;
        [place.x as usize, place.y as usize, place.z as usize].map(|b| b.min(self.bins - 1))
    }

    /// What falls into each bin.
    pub(super) fn fill(&self, prims: &[Prim]) -> Bins {
        let mut bins = Bins::empty(self.bins);
        for p in prims {
            let (low, high) = p.corners();
            for (row, k) in bins.rows.iter_mut().zip(self.of(low + high)) {
                row[k].bounds.add(low, high);
                row[k].count += 1;
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
    pub(super) fn empty(used: usize) -> Bins {
        Bins { rows: [[Bin { bounds: Bounds::NONE, count: 0 }; BINS]; 3], used }
    }

    /// Of both together.
    pub(super) fn merged(mut self, other: Bins) -> Bins {
        for (a, b) in self.rows.iter_mut().flatten().zip(other.rows.iter().flatten()) {
            a.bounds.add(b.bounds.low, b.bounds.high);
            a.count += b.count;
        }
        self.used = self.used.max(other.used);
        self
    }

    /// Axis and first bin of the upper side of the cheapest split; none if all centres fall into one bin of each
    /// axis.
    pub(super) fn cheapest(&self) -> Option<(usize, usize)> {
        let mut best = (f32::INFINITY, None);
        for (axis, row) in self.rows.iter().enumerate() {
            let mut above = [0.0f32; BINS];
            let (mut bounds, mut n) = (Bounds::NONE, 0);
            for k in (1..self.used).rev() {
                bounds.add(row[k].bounds.low, row[k].bounds.high);
                n += row[k].count;
                above[k] = if n == 0 { f32::INFINITY } else { bounds.half_area() * leaves(n) };
            }
            (bounds, n) = (Bounds::NONE, 0);
            for k in 1..self.used {
                bounds.add(row[k - 1].bounds.low, row[k - 1].bounds.high);
                n += row[k - 1].count;
                let cost = bounds.half_area() * leaves(n) + above[k];
                if n > 0 && cost < best.0 {
                    best = (cost, Some((axis, k)));
                }
            }
        }
        best.1
    }
}
