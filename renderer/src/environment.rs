//! Light from all around: a lat-long map with constant texels, sampled by what each texel sends.

use glam::Vec3;
use std::f32::consts::TAU;

/// A direction drawn towards the environment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkySample {
    /// Unit direction.
    pub direction: Vec3,
    /// Radiance over the density.
    pub weight_rgb: [f32; 3],
    /// Density per steradian.
    pub pdf: f32,
}

/// An environment ready for sampling.
///
/// A texel is drawn in proportion to its mean radiance times its solid angle, then a direction uniformly in its
/// solid angle: the density is constant within a texel and known exactly.
#[derive(Clone, Debug)]
pub struct Sky {
    width: usize,
    height: usize,
    texels: Vec<[f32; 3]>,
    /// Probability that a row is at most this one, indexed [row].
    rows: Vec<f32>,
    /// Probability within the row that a column is at most this one, indexed [row][column].
    columns: Vec<f32>,
    /// Mean radiance over all directions, of the channels' mean; densities are relative to it.
    mean: f64,
    turn: f32,
}

impl Sky {
    /// Prepares a map; `None` if it is black.
    ///
    /// # Errors
    /// If the map is empty, or a radiance is negative or not finite.
    pub fn new(map: &strandbench_scenes::Environment) -> Result<Option<Sky>, String> {
        let (width, height) = map.radiance_rgb.size();
        let texels = map.radiance_rgb.data.clone();
        if width == 0 || height == 0 || width > 16_384 || height > 16_384 {
            return Err(format!("the environment's map is {width}x{height} px; sides lie in 1..16384"));
        }
        if let Some(i) = texels.iter().position(|t| t.iter().any(|&v| !(0.0..=1e12).contains(&v))) {
            return Err(format!(
                "the environment's texel ({}, {}) is {:?}; radiance lies in 0..1e12",
                i % width,
                i / width,
                texels[i]
            ));
        }
        if !map.azimuth_deg.is_finite() {
            return Err("the environment's azimuth_deg is not finite".into());
        }
        let (mut rows, mut columns) = (Vec::with_capacity(height), Vec::with_capacity(width * height));
        let mut total = 0.0f64;
        for (row, line) in texels.chunks_exact(width).enumerate() {
            let share = solid_share(row, height);
            let sum: f64 = line.iter().map(mean).sum();
            let mut before = 0.0;
            columns.extend(line.iter().map(|t| {
                before += mean(t);
                (before / sum.max(f64::MIN_POSITIVE)) as f32
            }));
            total += sum / width as f64 * share;
            rows.push(total);
        }
        if total <= 0.0 {
            return Ok(None);
        }
        let rows = rows.into_iter().map(|r| (r / total) as f32).collect();
        Ok(Some(Sky {
            width,
            height,
            texels,
            rows,
            columns,
            mean: total,
            turn: map.azimuth_deg.to_radians(),
        }))
    }

    /// Radiance from a direction, and the density of [`Sky::sample`] there.
    #[inline]
    pub fn radiance_pdf(&self, direction: Vec3) -> ([f32; 3], f32) {
        let i = self.texel(direction);
        (self.texels[i], self.pdf(i))
    }

    #[inline]
    fn pdf(&self, texel: usize) -> f32 {
        (mean(&self.texels[texel]) / (4.0 * std::f64::consts::PI * self.mean)) as f32
    }

    fn texel(&self, d: Vec3) -> usize {
        if self.texels.len() == 1 {
            return 0;
        }
        let u = ((libm::atan2f(d.x, -d.z) + self.turn) / TAU).rem_euclid(1.0);
        let v = libm::acosf(d.y.clamp(-1.0, 1.0)) / std::f32::consts::PI;
        let column = ((u * self.width as f32) as usize).min(self.width - 1);
        let row = ((v * self.height as f32) as usize).min(self.height - 1);
        row * self.width + column
    }

    /// A direction from two numbers uniform in [0, 1).
    #[inline]
    pub fn sample(&self, u: [f32; 2]) -> SkySample {
        let (row, up) = draw(&self.rows, u[1]);
        let (column, along) = draw(&self.columns[row * self.width..(row + 1) * self.width], u[0]);
        let edge = |k: usize| libm::cosf(std::f32::consts::PI * k as f32 / self.height as f32);
        let y = (edge(row) + (edge(row + 1) - edge(row)) * up).clamp(-1.0, 1.0);
        let flat = (1.0 - y * y).max(0.0).sqrt();
        let (sin, cos) = libm::sincosf(TAU * (column as f32 + along) / self.width as f32 - self.turn);
        let texel = row * self.width + column;
        let pdf = self.pdf(texel);
        SkySample {
            direction: Vec3::new(flat * sin, y, -flat * cos).normalize(),
            weight_rgb: self.texels[texel].map(|l| l / pdf),
            pdf,
        }
    }
}

fn mean(t: &[f32; 3]) -> f64 {
    t.iter().map(|&v| f64::from(v)).sum::<f64>() / 3.0
}

/// Share of the sphere's solid angle that a row covers.
fn solid_share(row: usize, height: usize) -> f64 {
    let edge = |k: usize| libm::cos(std::f64::consts::PI * k as f64 / height as f64);
    0.5 * (edge(row) - edge(row + 1))
}

/// The first entry of a running sum above `u`, and how far into its share `u` is, in [0, 1).
#[inline]
fn draw(sums: &[f32], u: f32) -> (usize, f32) {
    let mut i = sums.partition_point(|&s| s <= u).min(sums.len() - 1);
    // Rounding may leave the last sum below one: take the last entry that has a share.
    while i > 0 && sums[i] <= sums[i - 1] {
        i -= 1;
    }
    let before = if i == 0 { 0.0 } else { sums[i - 1] };
    (i, ((u - before) / (sums[i] - before)).clamp(0.0, 0.999_999_9))
}

#[cfg(test)]
mod tests;
