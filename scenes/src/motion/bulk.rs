//! Hair as a continuum, on a grid: how much fibre there is, and how it moves on average.
//!
//! Contacts between single fibres are not resolved. In their place, as in mixed methods for hair (Petrovic et al.
//! 2005; McAdams et al. 2009), every segment gives its fibre and its momentum to the nodes around it. Friction
//! draws a segment's velocity towards the mean around it, at a rate that grows with the amount of fibre; a
//! pressure opposes packing hair more densely than it was groomed at that segment. Sums are made in one order.

use glam::DVec3;

/// Edge of a cell, mm: about the size of a lock.
pub(super) const CELL_MM: f64 = 10.0;

/// Fibre (mm of length per mm³) at which friction reaches half its rate: a hundredth of the inside of a head of hair.
const LOOSE_PER_MM2: f64 = 0.1;

/// Speed at which an excess of density spreads, mm/s.
const PRESSURE_MM_S: f64 = 600.0;

/// Cells a side beyond which hair is not followed: two metres.
const MAX_SIDE: usize = 200;

#[derive(Default)]
pub(super) struct Bulk {
    low: [i64; 3],
    size: [usize; 3],
    /// Fibre length per mm³, and its momentum, at nodes; x fastest.
    nodes: Vec<[f64; 4]>,
}

/// What surrounds a point.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Around {
    /// Length of fibre per volume, 1/mm².
    pub density_per_mm2: f64,
    /// Its gradient, 1/mm³.
    pub gradient: DVec3,
    /// Mean velocity, mm/s.
    pub velocity: DVec3,
}

impl Around {
    /// Share 0..1 of the full rate of friction.
    pub fn crowd(&self) -> f64 {
        self.density_per_mm2 / (self.density_per_mm2 + LOOSE_PER_MM2)
    }

    /// Acceleration (mm/s²) out of hair packed more densely than at rest.
    pub fn pressure(&self, rest_per_mm2: f64) -> DVec3 {
        let excess = self.density_per_mm2 / rest_per_mm2.max(1e-9) - 1.0;
        if excess <= 0.0 {
            return DVec3::ZERO;
        }
        self.gradient * (-PRESSURE_MM_S * PRESSURE_MM_S / rest_per_mm2.max(1e-9) * (5.0 * excess).min(1.0))
    }
}

impl Bulk {
    /// Gathers segments: middle (mm), velocity (mm/s), length of fibre (mm, all fibres that move with it).
    pub fn fill(&mut self, segments: impl Iterator<Item = (DVec3, DVec3, f64)> + Clone) {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for (x, _, _) in segments.clone() {
            (low, high) = (low.min(x), high.max(x));
        }
        // Nodes stand at whole multiples of the cell, so that the grid does not move with the hair.
        let node = |v: f64| (v / CELL_MM).floor() as i64;
        self.low = low.to_array().map(node);
        let top = high.to_array().map(node);
        self.size = std::array::from_fn(|a| (top[a] - self.low[a] + 2).clamp(2, MAX_SIDE as i64) as usize);
        self.nodes.clear();
        self.nodes.resize(self.size.iter().product(), [0.0; 4]);
        for (x, v, fibre) in segments {
            let Some((base, f)) = self.place(x) else { continue };
            for (offset, w) in self.corners(f) {
                let w = w * fibre;
                let n = &mut self.nodes[base + offset];
                n[0] += w;
                n[1] += w * v.x;
                n[2] += w * v.y;
                n[3] += w * v.z;
            }
        }
    }

    fn place(&self, p: DVec3) -> Option<(usize, DVec3)> {
        let p = p.to_array();
        let (mut base, mut stride, mut f) = (0usize, 1usize, [0.0; 3]);
        for a in 0..3 {
            let g = p[a] / CELL_MM;
            let i = g.floor();
            f[a] = g - i;
            let i = i as i64 - self.low[a];
            if i < 0 || i as usize + 1 >= self.size[a] {
                return None;
            }
            base += i as usize * stride;
            stride *= self.size[a];
        }
        Some((base, DVec3::from_array(f)))
    }

    fn corners(&self, f: DVec3) -> [(usize, f64); 8] {
        let (sy, sz) = (self.size[0], self.size[0] * self.size[1]);
        std::array::from_fn(|c| {
            let at = |bit: usize, f: f64| if c >> bit & 1 == 1 { f } else { 1.0 - f };
            ((c & 1) + (c >> 1 & 1) * sy + (c >> 2) * sz, at(0, f.x) * at(1, f.y) * at(2, f.z))
        })
    }

    /// Fibre length per volume at a point, 1/mm².
    pub fn density_per_mm2(&self, p: DVec3) -> f64 {
        let Some((base, f)) = self.place(p) else { return 0.0 };
        let sum: f64 = self.corners(f).iter().map(|(o, w)| self.nodes[base + o][0] * w).sum();
        sum / (CELL_MM * CELL_MM * CELL_MM)
    }

    /// Density, its gradient and the mean velocity at a point.
    pub fn around(&self, p: DVec3) -> Around {
        let Some((base, f)) = self.place(p) else { return Around::default() };
        let mut sum = [0.0; 4];
        let mut slope = [0.0; 3];
        let f = f.to_array();
        for (c, (offset, w)) in self.corners(DVec3::from_array(f)).into_iter().enumerate() {
            let n = &self.nodes[base + offset];
            for k in 0..4 {
                sum[k] += n[k] * w;
            }
            for (a, s) in slope.iter_mut().enumerate() {
                let (b, d) = ((a + 1) % 3, (a + 2) % 3);
                let at = |axis: usize| if c >> axis & 1 == 1 { f[axis] } else { 1.0 - f[axis] };
                let sign = if c >> a & 1 == 1 { 1.0 } else { -1.0 };
                *s += n[0] * sign * at(b) * at(d);
            }
        }
        let volume = CELL_MM * CELL_MM * CELL_MM;
        Around {
            density_per_mm2: sum[0] / volume,
            gradient: DVec3::from_array(slope) / (volume * CELL_MM),
            velocity: if sum[0] > 0.0 { DVec3::new(sum[1], sum[2], sum[3]) / sum[0] } else { DVec3::ZERO },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use strandbench_rng::Rng;

    #[test]
    fn fibre_and_momentum_are_conserved_and_uniform_motion_is_left_alone() {
        let mut r = Rng::keyed(&[1]);
        let drift = DVec3::new(3.0, -20.0, 5.0);
        let segments: Vec<(DVec3, DVec3, f64)> = (0..500)
            .map(|_| {
                let p = DVec3::new(r.f64() * 90.0, r.f64() * 70.0 - 35.0, r.f64() * 50.0);
                (p, drift, 1.0 + r.f64())
            })
            .collect();
        let mut bulk = Bulk::default();
        bulk.fill(segments.iter().copied());
        let total: f64 = segments.iter().map(|s| s.2).sum();
        let kept: f64 = bulk.nodes.iter().map(|n| n[0]).sum();
        assert!((kept / total - 1.0).abs() < 1e-12);
        for (p, _, _) in &segments {
            let a = bulk.around(*p);
            assert!(a.velocity.distance(drift) < 1e-10, "{:?}", a.velocity);
            assert!((a.density_per_mm2 / bulk.density_per_mm2(*p) - 1.0).abs() < 1e-12);
            // The gradient against a central difference within the cell.
            let h = 1e-4;
            for axis in DVec3::AXES {
                let cell = |p: DVec3| (p / CELL_MM).floor();
                let (low, high) = (*p - axis * h, *p + axis * h);
                if cell(low) == cell(high) {
                    let slope = (bulk.density_per_mm2(high) - bulk.density_per_mm2(low)) / (2.0 * h);
                    assert!((slope - a.gradient.dot(axis)).abs() < 1e-8, "{slope} {:?}", a.gradient);
                }
            }
            assert_eq!(a.pressure(a.density_per_mm2), DVec3::ZERO);
            assert!(a.pressure(0.5 * a.density_per_mm2).dot(a.gradient) <= 0.0);
        }
    }
}
