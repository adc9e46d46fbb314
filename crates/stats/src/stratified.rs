//! Two samples without pairs, stratum by stratum.

use crate::StatsError;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Values of both samples in one stratum (a scene), each of two or more seeds.
#[derive(Clone, Debug, PartialEq)]
pub struct Stratum {
    /// Name, for errors.
    pub name: String,
    /// Baseline.
    pub a: Vec<f64>,
    /// The other.
    pub b: Vec<f64>,
}

/// Mean over strata of the difference of means `b - a`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stratified {
    /// The mean difference.
    pub mean: f64,
    /// Its interval.
    pub interval: [f64; 2],
    /// Degrees of freedom; none where nothing varies.
    pub dof: Option<f64>,
}

/// The mean difference with Welch's interval: variances of all samples apart, degrees of freedom by Welch and Satterthwaite. It
/// speaks of new seeds on just these strata, not of other scenes.
///
/// # Errors
/// If there is no stratum, a sample has fewer than two values or one that is not finite.
pub fn stratified(strata: &[Stratum], confidence: f64) -> Result<Stratified, StatsError> {
    if strata.is_empty() {
        return Err(StatsError::Nothing);
    }
    let k = strata.len() as f64;
    let (mut mean, mut variance, mut spread) = (0.0, 0.0, 0.0);
    for s in strata {
        let [a, b] = [&s.a, &s.b].map(|v| moments(v));
        for (values, side) in [(&s.a, "baseline"), (&s.b, "other")] {
            if values.len() < 2 || values.iter().any(|v| !v.is_finite()) {
                let problem = format!(
                    "the {side} has {} seeds, or one without an answer; two with one are needed",
                    values.len()
                );
                return Err(StatsError::Stratum { name: s.name.clone(), problem });
            }
        }
        mean += (b.0 - a.0) / k;
        for (part, n) in [(a.1, s.a.len()), (b.1, s.b.len())] {
            let part = part / n as f64 / (k * k);
            variance += part;
            spread += part * part / (n as f64 - 1.0);
        }
    }
    if variance <= 0.0 {
        return Ok(Stratified { mean, interval: [mean; 2], dof: None });
    }
    let dof = variance * variance / spread;
    let t = StudentsT::new(0.0, 1.0, dof).expect("positive").inverse_cdf(0.5 + confidence / 2.0);
    let half = t * variance.sqrt();
    Ok(Stratified { mean, interval: [mean - half, mean + half], dof: Some(dof) })
}

/// Mean and unbiased variance.
fn moments(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / (n - 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stratum(a: &[f64], b: &[f64]) -> Stratum {
        Stratum { name: "x".to_owned(), a: a.to_vec(), b: b.to_vec() }
    }

    #[test]
    fn equal_sizes_and_variances_are_the_pooled_test() {
        // Means 2 and 5, variances 1 and 1 of three values each: standard error sqrt(2 / 3), 4 degrees, t 2.776445.
        let got = stratified(&[stratum(&[1.0, 2.0, 3.0], &[4.0, 5.0, 6.0])], 0.95).unwrap();
        assert!((got.mean - 3.0).abs() < 1e-12 && (got.dof.unwrap() - 4.0).abs() < 1e-12);
        assert!((got.interval[1] - 3.0 - 2.776_445 * (2.0f64 / 3.0).sqrt()).abs() < 1e-5, "{got:?}");
        // A second stratum of the same kind halves the variance of the mean; 8 degrees, t 2.306004.
        let one = stratum(&[1.0, 2.0, 3.0], &[4.0, 5.0, 6.0]);
        let two = stratum(&[11.0, 12.0, 13.0], &[12.0, 13.0, 14.0]);
        let got = stratified(&[one, two], 0.95).unwrap();
        assert!((got.mean - 2.0).abs() < 1e-12 && (got.dof.unwrap() - 8.0).abs() < 1e-12);
        assert!((got.interval[1] - 2.0 - 2.306_004 * (1.0f64 / 3.0).sqrt()).abs() < 1e-5, "{got:?}");
    }

    #[test]
    fn too_little_is_an_error() {
        assert_eq!(stratified(&[], 0.95), Err(StatsError::Nothing));
        for (a, b) in [(&[1.0][..], &[1.0, 2.0][..]), (&[1.0, 2.0], &[1.0, f64::INFINITY]), (&[], &[])] {
            assert!(stratified(&[stratum(a, b)], 0.95).unwrap_err().to_string().contains("seeds"));
        }
        let same = stratified(&[stratum(&[1.0, 1.0], &[1.0, 1.0])], 0.95).unwrap();
        assert_eq!((same.mean, same.interval), (0.0, [0.0; 2]));
    }
}
