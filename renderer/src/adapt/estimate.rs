//! Errors of means, as far as samples that are stratified tell them.

/// Weight of taking samples for independent before a tile's pixels have told better, in variances that are wanted.
const PRIOR: f64 = 4.0;

/// What is shaded of one kind of hits.
#[derive(Default)]
pub(super) struct Shaded {
    pub sum_rgb: [f64; 3],
    /// Sensor-weighted radiance of each.
    pub values: Vec<f64>,
}

impl Shaded {
    pub fn clear(&mut self) {
        self.sum_rgb = [0.0; 3];
        self.values.clear();
    }

    pub fn mean(&self) -> f64 {
        self.values.iter().sum::<f64>() / self.values.len().max(1) as f64
    }

    pub fn variance(&self) -> Variance {
        if self.values.len() < 2 {
            return Variance::UNKNOWN;
        }
        let (n, mean) = (self.values.len() as f64, self.mean());
        let [first, second] = self.values.split_at(self.values.len() / 2).into();
        let of = |v: &[f64]| v.iter().sum::<f64>() / v.len().max(1) as f64;
        Variance {
            single: self.values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n * (n - 1.0)),
            halves: (of(first) - of(second)).powi(2) * 0.25,
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
