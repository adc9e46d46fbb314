//! What sampling needs of a fibre type: each lobe's azimuth by inversion of its table, and each lobe's energy.

use super::LOBES;
use super::rest::Rest;
use super::table::{PHI_STEPS, THETA_STEPS, Table, column, row};
use std::f64::consts::PI;

const ROW: usize = PHI_STEPS + 1;
/// Steps of the camera's inclination over [-π/2, π/2].
const CAMERA_STEPS: usize = 96;
/// Steps of the quadrature over θ_h.
const HALF_STEPS: usize = 64;
/// Standard deviations within which a Gaussian is integrated.
const REACH: f64 = 5.6;
/// Standard deviations past a cut in which a tail is integrated.
const TAIL: f64 = 4.0;

/// Azimuths distributed as each lobe's bilinear table is, without absorption: exactly, for a round fibre. TRT
/// of an elliptical fibre depends on where the ellipse lies; there the mean of the index slices is drawn from.
#[derive(Clone, Debug)]
pub(super) struct Sampler {
    /// N at the nodes, indexed [lobe][θ_d][φ].
    nodes: Vec<f32>,
    /// ∫ N from 0 to the node, indexed the same way.
    sums: Vec<f32>,
    /// ∫ N over all azimuths, indexed [θ_d][lobe].
    energies: Vec<[f32; LOBES]>,
    /// Energy that each lobe returns to a camera at θ_r without absorption, and the greatest of
    /// E_p(θ_d) cos²θ_i / cos²θ_d within its reach; indexed [θ_r][lobe].
    returned: Vec<[(f32, f32); LOBES]>,
    /// Whether TRT is drawn from another table than it is evaluated with.
    pub trt_differs: bool,
}

impl Sampler {
    /// Shifts and widths are those of the lobes' Gaussians in θ_h, radians.
    pub fn new(table: &Table, rest: Option<&Rest>, shifts: &[f64; LOBES], widths: &[f64; LOBES]) -> Sampler {
        let rows = THETA_STEPS + 1;
        let mut nodes = vec![0.0f32; LOBES * rows * ROW];
        for j in 0..rows {
            for i in 0..ROW {
                let first = table.cell(0, j, i);
                let trt = (0..table.slices()).map(|s| f64::from(table.cell(s, j, i).trt)).sum::<f64>()
                    / table.slices() as f64;
                let fourth = rest.map_or(0.0, |r| r.cells[j * ROW + i].weight);
                for (lobe, n) in [first.r, first.tt, trt as f32, fourth].into_iter().enumerate() {
                    nodes[(lobe * rows + j) * ROW + i] = n;
                }
            }
        }
        let step = PI / PHI_STEPS as f64;
        let mut sums = vec![0.0f32; nodes.len()];
        let mut energies = vec![[0.0f32; LOBES]; rows];
        for (k, line) in nodes.chunks(ROW).enumerate() {
            let mut sum = 0.0;
            for i in 1..ROW {
                sum += 0.5 * step * (f64::from(line[i - 1]) + f64::from(line[i]));
                sums[k * ROW + i] = sum as f32;
            }
            energies[k % rows][k / rows] = (2.0 * sum) as f32;
        }
        let mut sampler =
            Sampler { nodes, sums, energies, returned: Vec::new(), trt_differs: table.slices() > 1 };
        sampler.returned = (0..=CAMERA_STEPS)
            .map(|k| {
                let theta_r = PI * (k as f64 / CAMERA_STEPS as f64 - 0.5);
                std::array::from_fn(|p| sampler.integrate(theta_r, p, shifts[p], widths[p]))
            })
            .collect();
        sampler
    }

    /// ∫ M_p E_p(θ_d) cos²θ_i / cos²θ_d dθ_i, and the greatest of what stands behind M_p.
    fn integrate(&self, theta_r: f64, lobe: usize, shift: f64, width: f64) -> (f32, f32) {
        let (low, high) = (0.5 * (theta_r - 0.5 * PI), 0.5 * (theta_r + 0.5 * PI));
        // Of a lobe that the cut takes away, what is left of its tail.
        let from = (shift - REACH * width).min(high - TAIL * width).clamp(low, high);
        let to = (shift + REACH * width).max(low + TAIL * width).clamp(low, high);
        let behind = |theta_h: f64| {
            let theta_i = 2.0 * theta_h - theta_r;
            let theta_d = (theta_r - theta_h).abs();
            let ratio = theta_i.cos().max(0.0) / theta_d.cos().max(1e-6);
            f64::from(self.energy(theta_d as f32)[lobe]) * ratio * ratio
        };
        let step = (to - from) / HALF_STEPS as f64;
        let (mut sum, mut greatest) = (0.0, behind(from).max(behind(to)));
        for k in 0..HALF_STEPS {
            let theta_h = from + step * (k as f64 + 0.5);
            let z = (theta_h - shift) / width;
            let value = behind(theta_h);
            sum += step * libm::exp(-0.5 * z * z) / (width * (2.0 * PI).sqrt()) * value;
            greatest = greatest.max(value);
        }
        (sum as f32, greatest as f32)
    }

    /// ∫ N over all azimuths at a difference angle, without absorption.
    #[inline]
    pub fn energy(&self, theta_d: f32) -> [f32; LOBES] {
        let (j, t) = row(theta_d);
        let (a, b) = (&self.energies[j], &self.energies[j + 1]);
        std::array::from_fn(|k| a[k] + (b[k] - a[k]) * t)
    }

    /// Energy returned to a camera at inclination `theta_r` without absorption, and the greatest energy that a
    /// direction of the lobe's returns over the density of θ_h.
    #[inline]
    pub fn returned(&self, theta_r: f32) -> [(f32, f32); LOBES] {
        let x = (theta_r / std::f32::consts::PI + 0.5) * CAMERA_STEPS as f32;
        let k = (x.max(0.0) as usize).min(CAMERA_STEPS - 1);
        let t = (x - k as f32).clamp(0.0, 1.0);
        let (a, b) = (&self.returned[k], &self.returned[k + 1]);
        std::array::from_fn(|p| (a[p].0 + (b[p].0 - a[p].0) * t, a[p].1.max(b[p].1)))
    }

    /// The table that a lobe is drawn from, at (θ_d, φ).
    #[inline]
    pub fn node_value(&self, lobe: usize, theta_d: f32, phi: f32) -> f32 {
        let ((j, ty), (i, tx)) = (row(theta_d), column(phi));
        let at = (lobe * (THETA_STEPS + 1) + j) * ROW + i;
        let c = &self.nodes[at..at + ROW + 2];
        let (top, bottom) = (c[0] + (c[1] - c[0]) * tx, c[ROW] + (c[ROW + 1] - c[ROW]) * tx);
        top + (bottom - top) * ty
    }

    /// An azimuth in [-π, π] with density N(φ) / ∫ N at this difference angle. `choice` picks side and row,
    /// `u` the place. `None` where the lobe is empty.
    #[inline]
    pub fn azimuth(&self, lobe: usize, theta_d: f32, choice: f32, u: f32) -> Option<f32> {
        let (j, t) = row(theta_d);
        let (side, choice) =
            if choice < 0.5 { (1.0, 2.0 * choice) } else { (-1.0, (2.0 * choice - 1.0).min(1.0)) };
        let low = self.energies[j][lobe] * (1.0 - t);
        let high = self.energies[j + 1][lobe] * t;
        if low + high <= 0.0 {
            return None;
        }
        let j = if choice * (low + high) < low { j } else { j + 1 };
        let at = (lobe * (THETA_STEPS + 1) + j) * ROW;
        let sums = &self.sums[at..at + ROW];
        // Half of the last bit keeps off the places where N vanishes.
        let target = (u + 2.980_232_2e-8) * sums[PHI_STEPS];
        let i = sums.partition_point(|&s| s < target).clamp(1, PHI_STEPS) - 1;
        let step = std::f32::consts::PI / PHI_STEPS as f32;
        let r = ((target - sums[i]) / step).max(0.0);
        let (a, b) = (self.nodes[at + i], self.nodes[at + i + 1]);
        // a x + (b - a) x² / 2 = r
        let x = 2.0 * r / (a + (a * a + 2.0 * (b - a) * r).max(0.0).sqrt()).max(1e-30);
        Some(side * (i as f32 + x.min(1.0)) * step)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Fibre, Roots};
    use super::*;
    use strandbench_scenes::FibreOptics;

    #[test]
    fn azimuths_invert_the_tables_own_integral() {
        let optics = FibreOptics { rest: true, ..FibreOptics::default() };
        let sampler = Fibre::new(&optics, Roots::Exact).unwrap().sampler;
        let step = PI / PHI_STEPS as f64;
        // On a row of the table, so that the choice picks the side alone.
        for j in [0usize, 40, 100] {
            let theta_d = 0.5 * std::f32::consts::PI * j as f32 / THETA_STEPS as f32;
            for lobe in 0..LOBES {
                let at = (lobe * (THETA_STEPS + 1) + j) * ROW;
                let n: Vec<f64> = sampler.nodes[at..at + ROW].iter().map(|&v| f64::from(v)).collect();
                let below = |phi: f64| {
                    let i = ((phi / step) as usize).min(PHI_STEPS - 1);
                    let whole: f64 = (0..i).map(|k| 0.5 * step * (n[k] + n[k + 1])).sum();
                    let x = phi / step - i as f64;
                    whole + step * x * (n[i] + 0.5 * x * (n[i + 1] - n[i]))
                };
                let all = below(PI);
                for k in 1..500 {
                    let u = k as f32 / 500.0;
                    for (choice, side) in [(0.2, 1.0), (0.7, -1.0)] {
                        let phi = f64::from(sampler.azimuth(lobe, theta_d, choice, u).unwrap());
                        let got = below((phi * side).max(0.0)) / all;
                        // Sums and azimuths are rounded to f32: 2e-7 of the whole, and 2e-7 rad of N, at most
                        // 10 of the whole per radian.
                        assert!(
                            (got - f64::from(u)).abs() < 3e-6,
                            "lobe {lobe}, row {j}: {u} is drawn at {phi}, below which lies {got}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn lobes_have_the_widths_of_table_1() {
        let fibre =
            Fibre::new(&FibreOptics { shift_r_deg: 0.0, ..FibreOptics::default() }, Roots::Exact).unwrap();
        for (p, share) in [1.0, 0.5, 2.0, 2.0].into_iter().enumerate() {
            let (mut sum, mut second) = (0.0, 0.0);
            let n = 4000;
            for k in 0..n {
                let theta_h = PI * ((f64::from(k) + 0.5) / f64::from(n) - 0.5);
                let m = f64::from(fibre.longitudinal(theta_h as f32)[p]) * PI / f64::from(n);
                sum += m;
                second += m * theta_h * theta_h;
            }
            let width = (second / sum).sqrt().to_degrees();
            assert!((width - 7.5 * share).abs() < 1e-3 && (sum - 0.5).abs() < 1e-5, "{p}: {width}°, {sum}");
        }
    }
}
