//! Errors of means, as far as samples that are stratified tell them.

/// Weight of taking samples for independent before a tile's pixels have told better, in variances that are wanted.
const PRIOR: f64 = 4.0;

/// What is shaded of one kind of hits.
#[derive(Default)]
pub(super) struct Shaded {
    sum_rgb: [f64; 3],
    /// Level of each.
    values: Vec<f64>,
}

impl Shaded {
    pub fn clear(&mut self) {
        self.sum_rgb = [0.0; 3];
        self.values.clear();
    }

    pub fn add(&mut self, rgb: [f32; 3], level: f64) {
        (0..3).for_each(|c| self.sum_rgb[c] += f64::from(rgb[c]));
        self.values.push(level);
    }

    pub fn count(&self) -> u32 {
        self.values.len() as u32
    }

    pub fn mean(&self) -> f64 {
        self.values.iter().sum::<f64>() / self.values.len().max(1) as f64
    }

    pub fn mean_rgb(&self) -> [f64; 3] {
        self.sum_rgb.map(|s| s / self.values.len().max(1) as f64)
    }

    /// Of the mean times the `share` that the pixel has of it.
    pub fn variance_of(&self, share: f64) -> Variance {
        if share == 0.0 {
            return Variance::default();
        }
        if self.values.len() < 2 {
            return Variance::UNKNOWN;
        }
        let (n, mean) = (self.values.len() as f64, self.mean());
        let [first, second] = self.values.split_at(self.values.len() / 2).into();
        let of = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
        let variance = Variance {
            single: self.values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n * (n - 1.0)),
            halves: (of(first) - of(second)).powi(2) * 0.25,
        };
        variance.times(share * share)
    }
}

/// What camera rays meet, each in the mean of its kind: how much the pixel's mean errs for where the rays go.
pub(super) struct Between {
    rays: u32,
    background: f64,
    sum: f64,
    squares: f64,
    halves: [f64; 2],
}

impl Between {
    pub fn new(rays: u32, background: f64) -> Between {
        Between { rays, background, sum: 0.0, squares: 0.0, halves: [0.0; 2] }
    }

    /// Adds the camera rays that met something of this radiance.
    pub fn add(&mut self, radiance: f64, rays: impl Iterator<Item = u32>) {
        let value = radiance - self.background;
        let mut counts = [0u32; 2];
        rays.for_each(|n| counts[usize::from(n >= self.rays / 2)] += 1);
        self.sum += value * f64::from(counts[0] + counts[1]);
        self.squares += value * value * f64::from(counts[0] + counts[1]);
        (0..2).for_each(|k| self.halves[k] += value * f64::from(counts[k]));
    }

    pub fn mean(&self) -> f64 {
        self.background + self.sum / f64::from(self.rays)
    }

    pub fn variance(&self) -> Variance {
        if self.rays < 2 {
            return Variance::UNKNOWN;
        }
        let n = f64::from(self.rays);
        Variance {
            single: (self.squares - self.sum * self.sum / n).max(0.0) / (n * (n - 1.0)),
            halves: ((self.halves[0] - self.halves[1]) / n).powi(2),
        }
    }
}

/// Variance of a mean.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Variance {
    /// As if its samples were independent.
    pub single: f64,
    /// By the two halves, each stratified in itself: about right, on the mean over many pixels.
    pub halves: f64,
}

impl Variance {
    /// Of fewer than two samples.
    pub const UNKNOWN: Variance = Variance { single: f64::INFINITY, halves: f64::INFINITY };

    pub fn times(self, factor: f64) -> Variance {
        Variance { single: self.single * factor, halves: self.halves * factor }
    }
}

/// How much less than independent samples stratified ones err: on the mean over the pixels of a tile that are done.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stratified(Variance);

impl Default for Stratified {
    fn default() -> Stratified {
        Stratified(Variance { single: PRIOR, halves: PRIOR })
    }
}

impl Stratified {
    pub fn share(&self) -> f64 {
        (self.0.halves / self.0.single).min(1.0)
    }

    pub fn learn(&mut self, v: Variance) {
        if v.single.is_finite() && v.halves.is_finite() {
            self.0 = Variance { single: self.0.single + v.single, halves: self.0.halves + v.halves };
        }
    }
}
