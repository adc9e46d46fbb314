//! From resamples to an interval.

use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

/// How an interval is taken from the resamples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kind {
    /// BCa (Efron 1987) at the expanded level of Hesterberg (2015, What teachers should know about the bootstrap): a
    /// bootstrap of n scenes is too narrow by sqrt((n - 1) / n) and by the difference between Student's and the normal
    /// distribution.
    #[default]
    BcaExpanded,
    /// BCa at the nominal level, as scipy has it.
    Bca,
    /// Quantiles of the resamples at the nominal level.
    Percentile,
}

/// Share below the lower end of an interval of n observations, expanded: Phi(-sqrt(n / (n - 1)) t), t being
/// Student's quantile of n - 1 degrees of freedom that leaves `tail` above it.
pub fn expanded_tail(tail: f64, n: usize) -> f64 {
    let (dof, scale) = ((n - 1) as f64, (n as f64 / (n - 1) as f64).sqrt());
    let t = StudentsT::new(0.0, 1.0, dof).expect("at least one degree of freedom").inverse_cdf(1.0 - tail);
    Normal::standard().cdf(-scale * t)
}

/// The interval around `observed`. `resampled` ascending; `scenes` are the observations of which `observed` is the
/// mean, for the acceleration by the jackknife.
pub(crate) fn of(kind: Kind, confidence: f64, observed: f64, resampled: &[f64], scenes: &[f64]) -> [f64; 2] {
    let nominal = (1.0 - confidence) / 2.0;
    let tail = if kind == Kind::BcaExpanded { expanded_tail(nominal, scenes.len()) } else { nominal };
    if kind == Kind::Percentile {
        return [quantile(resampled, tail), quantile(resampled, 1.0 - tail)];
    }
    let normal = Normal::standard();
    let below = resampled.partition_point(|&v| v < observed) + resampled.partition_point(|&v| v <= observed);
    // A share of 0 or 1, which no mean of its own resamples has but by rounding, would have no quantile.
    let n = resampled.len() as f64;
    let bias = normal.inverse_cdf((below as f64 / (2.0 * n)).clamp(0.5 / n, 1.0 - 0.5 / n));
    let a = acceleration(scenes);
    let level = |z: f64| {
        let shifted = bias + z;
        normal.cdf(bias + shifted / (1.0 - a * shifted))
    };
    let z = normal.inverse_cdf(tail);
    [quantile(resampled, level(z)), quantile(resampled, level(-z))]
}

/// Skewness of the leave-one-out means over six: of a mean, the observations' own third over second moment.
fn acceleration(scenes: &[f64]) -> f64 {
    let n = scenes.len() as f64;
    let mean = scenes.iter().sum::<f64>() / n;
    let moment = |k: i32| scenes.iter().map(|v| ((v - mean) / (n - 1.0)).powi(k)).sum::<f64>();
    let spread = moment(2);
    if spread > 0.0 { moment(3) / (6.0 * spread.powf(1.5)) } else { 0.0 }
}

/// Quantile of ascending values, linear between order statistics (Hyndman and Fan's type 7, numpy's).
pub(crate) fn quantile(ascending: &[f64], q: f64) -> f64 {
    let at = q.clamp(0.0, 1.0) * (ascending.len() - 1) as f64;
    let low = at.floor() as usize;
    let high = (low + 1).min(ascending.len() - 1);
    ascending[low] + (at - low as f64) * (ascending[high] - ascending[low])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn expansion_by_printed_tables() {
        // t of 4, 9, 19, 99 degrees at 2.5 %: 2.776, 2.262, 2.093, 1.984; times sqrt(n / (n - 1)); normal table.
        for (n, want) in [(5, 0.0010), (10, 0.0086), (20, 0.0159), (100, 0.0231)] {
            assert!((expanded_tail(0.025, n) - want).abs() < 5.1e-5, "{n}: {}", expanded_tail(0.025, n));
        }
    }

    #[test]
    fn quantiles_lie_between_their_neighbours() {
        let v = [0.0, 1.0, 3.0, 7.0];
        assert_eq!([0.0, 0.5, 1.0 / 6.0, 1.0].map(|q| quantile(&v, q)), [0.0, 2.0, 0.5, 7.0]);
    }

    #[test]
    fn acceleration_of_a_skewed_sample_by_hand() {
        // 0, 0, 3: deviations -1, -1, 2; sums of squares 6, of cubes 6; a = 6 / (6 x 6^1.5), scale cancels.
        assert!((acceleration(&[0.0, 0.0, 3.0]) - 6.0f64.powf(-1.5)).abs() < 1e-15);
        assert_eq!(acceleration(&[2.0, 2.0]), 0.0);
    }

    #[test]
    fn bias_counts_twice() {
        // 0, 1, ..., 1000, of which 841.5 lie below 841 (a tie counts half): 0.84066, a bias of 0.99717 standard deviations.
        // Symmetric scenes have no acceleration, so levels are Phi(1.99434 -+ 1.95996) = Phi(0.03438), Phi(3.9543).
        let resampled: Vec<f64> = (0..=1000).map(f64::from).collect();
        let [low, high] = of(Kind::Bca, 0.95, 841.0, &resampled, &[-1.0, 0.0, 1.0]);
        assert!((low - 513.71).abs() < 0.02 && (high - 999.96).abs() < 0.02, "{low} {high}");
    }
}
