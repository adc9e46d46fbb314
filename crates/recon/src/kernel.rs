//! The oriented filters K_θ of 4.3.
//!
//! K_0(x, y) = (G_σ(x) - G_σ'(x)) G_σ'(y) answers to bright lines along y. Filters are sampled at pixel
//! centres on a square of half-width 3σ' (13x13 for σ' = 2), where what is cut off is below 0.3 % of the mass.
//! Sampling and cutting leave a small sum; a multiple of the isotropic Gaussian G_σ'G_σ' takes it away, and
//! what rounding then leaves is put on the centre tap, so that a constant image answers zero.

use crate::simd::simd_fn;
use std::f32::consts::PI;

/// K_θ at equally spaced θ, as tables over the half plane (K is even: K(-x, -y) = K(x, y)).
#[derive(Clone, Debug)]
pub struct FilterBank {
    radius: usize,
    angles: usize,
    /// Angles rounded up to whole vectors, extra ones zero.
    lanes: usize,
    /// Taps, indexed [tap * lanes + angle]; the first tap is the centre.
    taps: Vec<f32>,
    /// Offset (x, y) of each tap; its mirror image belongs to it.
    offsets: Vec<(isize, isize)>,
}

/// Working memory of [`FilterBank::responses`].
#[derive(Clone, Debug)]
pub struct Scratch {
    sums: Vec<f32>,
    /// Response at each angle, indexed `[angle]`; longer than there are angles.
    pub responses: Vec<f32>,
}

const LANES: usize = 16;

impl FilterBank {
    /// Filters for `angles` line directions k π / angles, with σ and σ' in pixels.
    pub fn new(angles: usize, sigma_px: f32, sigma_wide_px: f32) -> FilterBank {
        let radius = (3.0 * sigma_wide_px).ceil() as isize;
        let (s, t) = (f64::from(sigma_px), f64::from(sigma_wide_px));
        let gauss =
            |v: f64, s: f64| libm::exp(-v * v / (2.0 * s * s)) / (s * (2.0 * std::f64::consts::PI).sqrt());
        let mut offsets = vec![(0, 0)];
        for y in 0..=radius {
            for x in -radius..=radius {
                if y > 0 || x > 0 {
                    offsets.push((x, y));
                }
            }
        }
        let lanes = angles.next_multiple_of(LANES);
        let mut taps = vec![0.0f32; offsets.len() * lanes];
        for a in 0..angles {
            // Line direction (cos, sin); K_0's y axis lies along the line.
            let (sin, cos) = libm::sincos(std::f64::consts::PI * a as f64 / angles as f64);
            let mut kernel = Vec::with_capacity(offsets.len());
            let mut blob = Vec::with_capacity(offsets.len());
            for &(x, y) in &offsets {
                let (x, y) = (x as f64, y as f64);
                let (across, along) = (y * cos - x * sin, x * cos + y * sin);
                kernel.push((gauss(across, s) - gauss(across, t)) * gauss(along, t));
                blob.push(gauss(x, t) * gauss(y, t));
            }
            let total = |v: &[f64]| v[0] + 2.0 * v[1..].iter().sum::<f64>();
            let excess = total(&kernel) / total(&blob);
            let mut rest = 0.0f64;
            for (i, (k, b)) in kernel.iter().zip(&blob).enumerate().skip(1) {
                let tap = (k - excess * b) as f32;
                taps[i * lanes + a] = tap;
                rest += 2.0 * f64::from(tap);
            }
            taps[a] = -rest as f32;
        }
        FilterBank { radius: radius as usize, angles, lanes, taps, offsets }
    }

    /// Half-width of the filters, pixels.
    pub fn radius(&self) -> usize {
        self.radius
    }

    /// Working memory of the right size.
    pub fn scratch(&self) -> Scratch {
        Scratch { sums: vec![0.0; self.offsets.len()], responses: vec![0.0; self.lanes] }
    }

    /// All responses at (x, y) of an image of row length `stride`, at least [`FilterBank::radius`] from its
    /// border.
    pub fn responses(&self, image: &[f32], stride: usize, x: usize, y: usize, scratch: &mut Scratch) {
        let centre = (y * stride + x) as isize;
        scratch.sums[0] = image[centre as usize];
        for (sum, &(dx, dy)) in scratch.sums.iter_mut().zip(&self.offsets).skip(1) {
            let d = dy * stride as isize + dx;
            *sum = image[(centre + d) as usize] + image[(centre - d) as usize];
        }
        for base in (0..self.lanes).step_by(LANES) {
            accumulate(&self.taps, self.lanes, base, &scratch.sums, &mut scratch.responses);
        }
    }

    /// Line angle in [0, π) and signed response where |response| is largest, refined by the parabola through
    /// the largest magnitude and its two neighbours.
    pub fn peak(&self, responses: &[f32]) -> (f32, f32) {
        let n = self.angles;
        let mut best = 0;
        for a in 1..n {
            if responses[a].abs() > responses[best].abs() {
                best = a;
            }
        }
        let (l, c, r) =
            (responses[(best + n - 1) % n].abs(), responses[best].abs(), responses[(best + 1) % n].abs());
        let bend = l + r - 2.0 * c;
        let shift = if bend < 0.0 { (0.5 * (l - r) / bend).clamp(-0.5, 0.5) } else { 0.0 };
        let peak = c - 0.25 * (l - r) * shift;
        let mut angle = (best as f32 + shift) * PI / n as f32;
        if angle < 0.0 {
            angle += PI;
        }
        (if angle >= PI { 0.0 } else { angle }, if responses[best] < 0.0 { -peak } else { peak })
    }
}

simd_fn! {
    fn accumulate(taps: &[f32], lanes: usize, base: usize, sums: &[f32], out: &mut [f32]) {
        let mut acc = [0.0f32; LANES];
        for (s, row) in sums.iter().zip(taps.chunks_exact(lanes)) {
            let row: &[f32; LANES] = row[base..base + LANES].try_into().unwrap_or(&[0.0; LANES]);
            for (a, t) in acc.iter_mut().zip(row) {
                *a += s * t;
            }
        }
        out[base..base + LANES].copy_from_slice(&acc);
    }
}
