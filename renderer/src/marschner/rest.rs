//! The paths of two and more inner reflections (p >= 3), which the published model leaves out, as a fourth lobe.
//!
//! Their energy is exact: at each θ_d the light is followed over h through p = 3, 4, ... with the Fresnel
//! reflectance of each, and what is left after the last followed path is counted with it. Azimuthally each path
//! leaves where Snell's law (or the cubic) sends it, smoothed by a Gaussian as wide as the caustic of TRT is
//! made: these paths have caustics of their own, at p = 3, 4, ... ever sharper, which a rough fibre blurs.
//! Longitudinally the lobe continues Table 1's series of shifts, α_R, -α_R/2, -3α_R/2, with -5α_R/2 (that of
//! p = 3, which carries nearly all of it) and has TRT's width 2β_R.

use super::azimuth::{CrossSection, Roots};
use super::table::{PHI_STEPS, THETA_STEPS};
use rayon::prelude::*;
use std::f64::consts::PI;

/// The last path that is followed.
const LAST: u32 = 32;
/// Steps over γ_i in [0, π/2].
const GAMMA_STEPS: usize = 600;
const BINS: usize = PHI_STEPS;

/// One entry: N without absorption, mean of the path length in fibre radii, and its variance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub(super) struct Cell {
    pub weight: f32,
    pub length: f32,
    pub variance: f32,
}

/// The fourth lobe's azimuthal term, tabulated over (θ_d, φ).
#[derive(Clone, Debug)]
pub(super) struct Rest {
    /// Indexed [θ_d][φ], as the other lobes' table.
    pub cells: Vec<Cell>,
}

impl Rest {
    /// `width` is the standard deviation of the azimuthal smoothing, radians.
    pub fn new(eta: f64, roots: Roots, width: f64) -> Rest {
        let kernel = kernel(width);
        let cells = (0..=THETA_STEPS)
            .into_par_iter()
            .flat_map_iter(|j| {
                let theta = (0.5 * PI * j as f64 / THETA_STEPS as f64).min(0.5 * PI - 1e-3);
                smooth(&histogram(&CrossSection::new(eta, theta.cos(), roots)), &kernel)
            })
            .collect();
        Rest { cells }
    }

    /// Bilinear look-up at difference angle `theta_d` in [0, π/2] and azimuth `phi` in [0, π].
    #[inline]
    pub fn lookup(&self, theta_d: f32, phi: f32) -> Cell {
        let (j, ty) = super::table::row(theta_d);
        let (i, tx) = super::table::column(phi);
        let at = j * (PHI_STEPS + 1) + i;
        let c = &self.cells[at..at + PHI_STEPS + 3];
        let mix = |a: Cell, b: Cell, t: f32| {
            let m = |x: f32, y: f32| x + (y - x) * t;
            Cell {
                weight: m(a.weight, b.weight),
                length: m(a.length, b.length),
                variance: m(a.variance, b.variance),
            }
        };
        mix(mix(c[0], c[1], tx), mix(c[PHI_STEPS + 1], c[PHI_STEPS + 2], tx), ty)
    }
}

/// Energy, energy times length and energy times length² that leave in each bin of |φ| in [0, π]; the energy of
/// one side of the fibre, which is half of the whole.
fn histogram(section: &CrossSection) -> Vec<[f64; 3]> {
    let mut bins = vec![[0.0; 3]; BINS];
    let step = 0.5 * PI / GAMMA_STEPS as f64;
    for i in 0..GAMMA_STEPS {
        let gamma = (i as f64 + 0.5) * step;
        // Uniform in h = sin γ over [-1, 1].
        let share = 0.5 * gamma.cos() * step;
        let f = section.reflectance(gamma);
        for p in 3..=LAST {
            let (phi, length) = (section.exit(p, gamma).0, section.length(p, gamma));
            let attenuation = if p == LAST {
                // (1-F)² F^(p-1) (1 + F + F² + ...)
                (1.0 - f) * f.powi(p as i32 - 1)
            } else {
                section.attenuation(p, gamma)
            };
            let wrapped = ((phi + PI).rem_euclid(2.0 * PI) - PI).abs();
            let bin = ((wrapped / PI * BINS as f64) as usize).min(BINS - 1);
            let w = share * attenuation;
            for (b, x) in bins[bin].iter_mut().zip([w, w * length, w * length * length]) {
                *b += x;
            }
        }
    }
    bins
}

/// Weight of bin b at node i, indexed [i][b]: a Gaussian in azimuth, folded at 0 and π, whose trapezoidal sum
/// over the nodes is 1 for every bin.
fn kernel(width: f64) -> Vec<Vec<f64>> {
    let cell = PI / PHI_STEPS as f64;
    let w = width.max(cell);
    let gauss = |d: f64| (-0.5 * (d / w).powi(2)).exp();
    let mut k: Vec<Vec<f64>> = (0..=PHI_STEPS)
        .map(|i| {
            let at = i as f64 * cell;
            (0..BINS)
                .map(|b| {
                    let centre = (b as f64 + 0.5) * cell;
                    [centre, -centre, 2.0 * PI - centre].iter().map(|c| gauss(at - c)).sum()
                })
                .collect()
        })
        .collect();
    for b in 0..BINS {
        let ends = 0.5 * (k[0][b] + k[PHI_STEPS][b]);
        let sum = cell * (ends + (1..PHI_STEPS).map(|i| k[i][b]).sum::<f64>());
        k.iter_mut().for_each(|row| row[b] /= sum);
    }
    k
}

fn smooth(bins: &[[f64; 3]], kernel: &[Vec<f64>]) -> Vec<Cell> {
    kernel
        .iter()
        .map(|row| {
            let mut s = [0.0; 3];
            for (w, b) in row.iter().zip(bins) {
                for k in 0..3 {
                    s[k] += w * b[k];
                }
            }
            let mean = if s[0] > 0.0 { s[1] / s[0] } else { 0.0 };
            let variance = if s[0] > 0.0 { (s[2] / s[0] - mean * mean).max(0.0) } else { 0.0 };
            Cell { weight: s[0] as f32, length: mean as f32, variance: variance as f32 }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::fresnel::bravais;
    use super::super::{fresnel, tests::trace_cylinder};
    use super::*;

    const WIDTH: f64 = 15.0 * PI / 180.0;

    /// ∫ N dφ of one row, both sides of the fibre.
    fn energy(rest: &Rest, j: usize) -> f64 {
        let row = &rest.cells[j * (PHI_STEPS + 1)..(j + 1) * (PHI_STEPS + 1)];
        let ends = 0.5 * f64::from(row[0].weight + row[PHI_STEPS].weight);
        let middle: f64 = row[1..PHI_STEPS].iter().map(|c| f64::from(c.weight)).sum();
        2.0 * PI / PHI_STEPS as f64 * (ends + middle)
    }

    #[test]
    fn four_lobes_hold_all_light() {
        for roots in [Roots::Exact, Roots::Cubic] {
            let rest = Rest::new(1.55, roots, WIDTH);
            for j in [0, 32, 64, 100, 120, 127] {
                let theta = 0.5 * PI * j as f64 / THETA_STEPS as f64;
                let (prime, second) = bravais(1.55, theta.cos());
                // Σ over p of (1-F)² F^(p-1) past TRT is (1-F) F².
                let n = 20_000;
                let want: f64 = (0..n)
                    .map(|i| {
                        let gamma = 0.5 * PI * (f64::from(i) + 0.5) / f64::from(n);
                        let f = fresnel::reflectance(gamma.cos(), prime, second);
                        (1.0 - f) * f * f * gamma.cos() * 0.5 * PI / f64::from(n)
                    })
                    .sum();
                // Both are midpoint sums of a smooth function.
                let got = energy(&rest, j);
                assert!((got - want).abs() < 1e-5 * want, "{roots:?}, row {j}: {got}, {want}");
            }
        }
    }

    #[test]
    fn azimuths_and_lengths_are_those_of_rays_followed_through_a_cylinder() {
        let rest = Rest::new(1.55, Roots::Exact, WIDTH);
        for j in [0, 43, 90] {
            let theta = 0.5 * PI * j as f64 / THETA_STEPS as f64;
            // Rays uniform in h; azimuths blurred by the same Gaussian, exactly.
            let rays = 4000;
            let nodes = [0usize, 40, 96, 150, 192];
            let (mut want, mut way) = ([0.0; 5], [0.0; 5]);
            for i in 0..rays {
                let h = 2.0 * (f64::from(i) + 0.5) / f64::from(rays) - 1.0;
                for (phi, energy, length) in trace_cylinder::<128>(h, theta, 1.55).into_iter().skip(3) {
                    for (k, &node) in nodes.iter().enumerate() {
                        let d = PI * node as f64 / PHI_STEPS as f64 - phi;
                        let d = d - 2.0 * PI * (d / (2.0 * PI)).round();
                        let g = (-0.5 * (d / WIDTH).powi(2)).exp() / (WIDTH * (2.0 * PI).sqrt());
                        want[k] += energy * g / f64::from(rays);
                        way[k] += energy * g * length / f64::from(rays);
                    }
                }
            }
            for (k, &node) in nodes.iter().enumerate() {
                let cell = rest.cells[j * (PHI_STEPS + 1) + node];
                let (got, length) = (f64::from(cell.weight), f64::from(cell.length));
                let (want, want_length) = (want[k], way[k] / want[k]);
                // Bins of 0.94° under a kernel of 15°: (0.016 / 0.26)² / 24 of its curvature, which is z² of its
                // value, 20 at most. Past the 32nd path 1e-5 of the light leaves with it, and counts with the
                // length of the 32nd: 1e-4 of 0.05 energy times length.
                let mean = energy(&rest, j) / (2.0 * PI);
                assert!(
                    (got - want).abs() < 3e-3 * want.max(mean),
                    "row {j}, node {node}: {got}, traced {want}"
                );
                assert!(
                    (got * length - way[k]).abs() < 5e-3 * (mean * want_length).max(way[k]),
                    "row {j}, node {node}: length {length}, traced {want_length}"
                );
            }
        }
    }
}
