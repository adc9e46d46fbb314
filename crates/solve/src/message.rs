//! Messages of quadratic smoothness: the min-plus convolution of a cost vector with a parabola.

/// Stands above every legal cost; labels that pad a vector to whole blocks carry it.
pub(crate) const BIG: f32 = 1e35;

/// Vectors of label costs are padded to a multiple of this many entries.
pub(crate) const BLOCK: usize = 16;

/// Taps between two tests of whether further ones can matter.
const TAPS: usize = 4;

/// Entries of a label vector in memory, for this many labels.
pub(crate) fn stride_of(labels: usize) -> usize {
    labels.next_multiple_of(BLOCK)
}

/// Runs `f` compiled for the widest vectors that the processor has. Results do not depend on the choice: no
/// operation is fused or re-ordered, lanes only run side by side.
#[inline(always)]
pub(crate) fn vectorised<R>(f: impl FnOnce() -> R) -> R {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2")]
        fn with_avx2<R>(f: impl FnOnce() -> R) -> R {
            f()
        }
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor was just found to have AVX2.
            return unsafe { with_avx2(f) };
        }
    }
    f()
}

/// Minimum without the care for NaN that keeps `f32::min` from being one instruction.
#[inline(always)]
pub(crate) fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// Maximum, likewise.
#[inline(always)]
pub(crate) fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// Entries of the widest vector register counted on.
const LANES: usize = 8;

/// Folds a vector with `f`, which must be associative and commutative: side by side first, then by halves, so
/// that no step waits for more than three others.
#[inline(always)]
pub(crate) fn fold(v: &[f32], start: f32, f: impl Fn(f32, f32) -> f32) -> f32 {
    let mut lanes = [start; LANES];
    let chunks = v.chunks_exact(LANES);
    let rest = chunks.remainder();
    for c in chunks {
        for i in 0..LANES {
            lanes[i] = f(lanes[i], c[i]);
        }
    }
    for (lane, &r) in lanes.iter_mut().zip(rest) {
        *lane = f(*lane, r);
    }
    let [a, b, c, d, e, g, h, i] = lanes;
    f(f(f(a, e), f(c, h)), f(f(b, g), f(d, i)))
}

/// Least entry.
#[inline(always)]
pub(crate) fn least(v: &[f32]) -> f32 {
    fold(v, f32::INFINITY, lesser)
}

/// Largest magnitude.
#[inline(always)]
pub(crate) fn largest(v: &[f32]) -> f32 {
    fold(v, 0.0, |a, b| greater(a, b.abs()))
}

/// A cost vector with room on both sides, so that shifted reads need no bounds.
#[derive(Debug)]
pub(crate) struct Padded {
    data: Vec<f32>,
    stride: usize,
}

impl Padded {
    pub fn new(stride: usize) -> Padded {
        Padded { data: vec![BIG; 3 * stride + 2 * TAPS], stride }
    }

    /// The vector itself.
    #[inline(always)]
    pub fn values(&mut self) -> &mut [f32] {
        let at = self.stride + TAPS;
        &mut self.data[at..at + self.stride]
    }

    /// out[j] = min_i h[i] + weight (i - j)², less its minimum, which is returned.
    ///
    /// Exact: every pair (i, j) is looked at unless weight (i - j)² alone exceeds the spread that is left, in
    /// which case the pair cannot win. Costs about √(spread / weight) vector operations per block of outputs,
    /// at most one per label; no division and no branch inside, unlike the lower envelope of parabolas
    /// (Felzenszwalb and Huttenlocher 2012), which it equals.
    #[inline(always)]
    pub fn min_convolve(&self, weight: f32, out: &mut [f32]) -> f32 {
        let floor = least(&self.data[self.stride + TAPS..2 * self.stride + TAPS]);
        if self.stride.is_multiple_of(2 * BLOCK) {
            self.blocks::<{ 2 * BLOCK }>(weight, floor, out);
        } else {
            self.blocks::<BLOCK>(weight, floor, out);
        }
        let min = least(out);
        for v in out.iter_mut() {
            *v -= min;
        }
        min
    }

    #[inline(always)]
    fn blocks<const B: usize>(&self, weight: f32, floor: f32, out: &mut [f32]) {
        for (b, o) in out.chunks_exact_mut(B).enumerate() {
            let at = self.stride + TAPS + b * B;
            let mut acc = [0f32; B];
            acc.copy_from_slice(&self.data[at..at + B]);
            let mut k = 1;
            while k < self.stride {
                let top = fold(&acc, f32::NEG_INFINITY, greater);
                if floor + weight * ((k * k) as f32) >= top {
                    break;
                }
                for step in 0..TAPS {
                    let k = k + step;
                    let rise = weight * ((k * k) as f32);
                    let before = &self.data[at - k..at - k + B];
                    let after = &self.data[at + k..at + k + B];
                    for i in 0..B {
                        acc[i] = lesser(acc[i], lesser(before[i], after[i]) + rise);
                    }
                }
                k += TAPS;
            }
            o.copy_from_slice(&acc);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn brute(h: &[f32], weight: f32) -> Vec<f64> {
        let at = |i: usize, j: usize| f64::from(h[i]) + f64::from(weight) * (i as f64 - j as f64).powi(2);
        (0..h.len()).map(|j| (0..h.len()).map(|i| at(i, j)).fold(f64::INFINITY, f64::min)).collect()
    }

    fn convolve(h: &[f32], weight: f32) -> (Vec<f32>, f32) {
        let stride = stride_of(h.len());
        let mut padded = Padded::new(stride);
        padded.values()[..h.len()].copy_from_slice(h);
        let mut out = vec![0.0; stride];
        let min = vectorised(
            #[inline(always)]
            || padded.min_convolve(weight, &mut out),
        );
        out.truncate(h.len());
        (out, min)
    }

    proptest! {
        #[test]
        fn equals_brute_force(
            h in prop::collection::vec(-100i32..100, 1..150),
            weight in prop::sample::select(vec![0u32, 1, 2, 7, 40, 1000]),
            scale in prop::sample::select(vec![0i32, -9, 6]),
        ) {
            // Whole numbers times a power of two: f32 holds every sum exactly, so equality is exact.
            let scale = 2f32.powi(scale);
            let h: Vec<f32> = h.iter().map(|&v| v as f32 * scale).collect();
            let (out, min) = convolve(&h, weight as f32 * scale);
            for (j, want) in brute(&h, weight as f32 * scale).into_iter().enumerate() {
                prop_assert_eq!(f64::from(out[j]) + f64::from(min), want, "label {}", j);
            }
        }

        #[test]
        fn near_brute_force_for_real_numbers(
            h in prop::collection::vec(-50f32..50.0, 1..150), log in -9f32..4.0,
        ) {
            let weight = 10f32.powf(log);
            let (out, min) = convolve(&h, weight);
            for (j, want) in brute(&h, weight).into_iter().enumerate() {
                // Three roundings at magnitude 100 at most: 3 * 2^-24 * 100 < 2e-5.
                prop_assert!((f64::from(out[j]) + f64::from(min) - want).abs() < 2e-5, "label {}", j);
            }
        }
    }

    #[test]
    fn huge_weights_change_nothing() {
        let h = [3.0, -1.0, 2.0, 7.5];
        let (out, min) = convolve(&h, crate::MAX_MAGNITUDE);
        assert_eq!(min, -1.0);
        assert_eq!(out, [4.0, 0.0, 3.0, 8.5]);
    }
}
