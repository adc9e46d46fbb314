//! Order statistics with one convention: the q-quantile of n values is the ceil(q n)-th smallest.

/// Ascending order; infinite values last. NaN cannot occur in errors, absent answers are +inf.
pub(crate) fn sorted(mut values: Vec<f64>) -> Vec<f64> {
    assert!(!values.iter().any(|v| v.is_nan()), "an error is NaN");
    values.sort_unstable_by(f64::total_cmp);
    values
}

/// The `percent`-th percentile of ascending values; +inf for none.
pub(crate) fn percentile(ascending: &[f64], percent: usize) -> f64 {
    let rank = (ascending.len() * percent).div_ceil(100).max(1);
    ascending.get(rank - 1).copied().unwrap_or(f64::INFINITY)
}

/// Share of ascending values at most `limit`; 0 for none.
pub(crate) fn share_within(ascending: &[f64], limit: f64) -> f64 {
    if ascending.is_empty() {
        return 0.0;
    }
    ascending.partition_point(|&v| v <= limit) as f64 / ascending.len() as f64
}

/// Values with weights that sum to one, ascending by value.
pub(crate) struct Weighted(Vec<(f64, f64)>);

impl Weighted {
    pub fn new(values: &[f64], weights: &[f64]) -> Weighted {
        assert_eq!(values.len(), weights.len(), "one weight a value");
        let mut pairs: Vec<(f64, f64)> = values.iter().copied().zip(weights.iter().copied()).collect();
        // Ties are ordered by weight, so that sums do not depend on the order of equal values.
        pairs.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        Weighted(pairs)
    }

    /// The smallest value at which the weights so far reach `q`, up to rounding of their sum.
    pub fn quantile(&self, q: f64) -> f64 {
        let mut sum = 0.0;
        for &(v, w) in &self.0 {
            sum += w;
            if sum >= q - 1e-12 {
                return v;
            }
        }
        f64::INFINITY
    }

    /// Weight of the values above `limit`.
    pub fn share_over(&self, limit: f64) -> f64 {
        // Starts from 0: the sum of no numbers is -0.
        self.0.iter().filter(|(v, _)| *v > limit).fold(0.0, |sum, (_, w)| sum + w)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_members_and_absence_is_last() {
        let v = sorted(vec![3.0, f64::INFINITY, 1.0, 2.0]);
        assert_eq!((percentile(&v, 50), percentile(&v, 75), percentile(&v, 76)), (2.0, 3.0, f64::INFINITY));
        assert_eq!(
            (percentile(&v, 0), percentile(&v, 1), percentile(&v, 25), percentile(&v, 26)),
            (1.0, 1.0, 1.0, 2.0)
        );
        assert_eq!(
            (share_within(&v, 2.0), share_within(&v, 1.9), share_within(&v, 1e300)),
            (0.5, 0.25, 0.75)
        );
        assert_eq!((percentile(&[], 50), share_within(&[], 1.0)), (f64::INFINITY, 0.0));
    }

    #[test]
    fn equal_weights_agree_with_the_unweighted_convention() {
        let v: Vec<f64> = (1..=40).map(f64::from).collect();
        let w = Weighted::new(&v, &[1.0 / 40.0; 40]);
        for percent in 1..=100 {
            assert_eq!(w.quantile(percent as f64 / 100.0), percentile(&v, percent), "{percent} %");
        }
        assert!((w.share_over(30.0) - 0.25).abs() < 1e-12);
        assert!(w.share_over(40.0).is_sign_positive());
        let uneven = Weighted::new(&[5.0, 1.0, f64::INFINITY], &[0.2, 0.5, 0.3]);
        assert_eq!(
            (uneven.quantile(0.5), uneven.quantile(0.6), uneven.quantile(0.71)),
            (1.0, 5.0, f64::INFINITY)
        );
    }

    #[test]
    #[should_panic(expected = "NaN")]
    fn nan_is_a_bug() {
        sorted(vec![f64::NAN]);
    }
}
