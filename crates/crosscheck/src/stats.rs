//! Order statistics and Welch's test.

/// The value that a share `q` of the values stays below (nearest rank); 0 of none. Sorts.
pub(crate) fn quantile(values: &mut [f64], q: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    match values.len() {
        0 => 0.0,
        n => values[((n as f64 * q).ceil() as usize).clamp(1, n) - 1],
    }
}

/// Mean and unbiased variance.
pub(crate) fn moments(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / (n - 1.0))
}

/// Welch's t, its degrees of freedom (Welch-Satterthwaite) and its two-sided p-value, from two samples'
/// (mean, unbiased variance, number). Two samples without variance differ with p 0 or agree with p 1.
pub(crate) fn welch(a: (f64, f64, usize), b: (f64, f64, usize)) -> (f64, f64, f64) {
    let (ea, eb) = (a.1 / a.2 as f64, b.1 / b.2 as f64);
    let e = ea + eb;
    if e <= 0.0 {
        let same = a.0 == b.0;
        return (if same { 0.0 } else { f64::INFINITY }, 1.0, if same { 1.0 } else { 0.0 });
    }
    let t = (a.0 - b.0) / e.sqrt();
    let dof = e * e / (ea * ea / (a.2 as f64 - 1.0) + eb * eb / (b.2 as f64 - 1.0));
    (t, dof, regularised_beta(0.5 * dof, 0.5, dof / (dof + t * t)))
}

/// The regularised incomplete beta function I_x(a, b) by its continued fraction (DLMF 8.17.22), evaluated from
/// the back.
pub(crate) fn regularised_beta(a: f64, b: f64, x: f64) -> f64 {
    /// Far more terms than the fraction needs below the mean for the a, b < 10^4 that occur here.
    const TERMS: u32 = 600;
    if x <= 0.0 || x >= 1.0 {
        return if x <= 0.0 { 0.0 } else { 1.0 };
    }
    // It converges fast below the mean; the other side follows by symmetry.
    if x > (a + 1.0) / (a + b + 2.0) {
        return 1.0 - regularised_beta(b, a, 1.0 - x);
    }
    let coefficient = |k: u32| {
        let m = f64::from(k / 2);
        if k.is_multiple_of(2) {
            m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m))
        } else {
            -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0))
        }
    };
    let tail = (1..=TERMS).rev().fold(1.0, |tail, k| 1.0 + coefficient(k) / tail);
    let log_beta = libm::lgamma(a) + libm::lgamma(b) - libm::lgamma(a + b);
    libm::exp(a * libm::log(x) + b * libm::log1p(-x) - log_beta) / (a * tail)
}

#[cfg(test)]
mod tests {
    use super::*;
    use strandbench_rng::Rng;

    #[test]
    fn p_values_of_the_tables() {
        // Two-sided 5 % and 1 % points of Student's distribution (any table): t, degrees of freedom, p.
        for (t, dof, p) in
            [(12.706, 1.0, 0.05), (2.228, 10.0, 0.05), (3.169, 10.0, 0.01), (2.704, 40.0, 0.01)]
        {
            let got = regularised_beta(0.5 * dof, 0.5, dof / (dof + t * t));
            assert!((got / p - 1.0).abs() < 2e-3, "{t} {dof}: {got} {p}");
        }
        // Welch's degrees of freedom of equal samples are those of the pooled test.
        let (t, dof, _) = welch((1.0, 2.0, 10), (0.0, 2.0, 10));
        assert!((dof - 18.0).abs() < 1e-12 && (t - 1.0 / 0.4f64.sqrt()).abs() < 1e-12);
        assert_eq!(welch((1.0, 0.0, 5), (1.0, 0.0, 5)).2, 1.0);
        assert_eq!(welch((1.0, 0.0, 5), (1.1, 0.0, 5)).2, 0.0);
    }

    #[test]
    fn p_values_of_equal_means_are_uniform() {
        let mut rng = Rng::keyed(&[5]);
        // Sums of uniforms, near enough to normal; different variances and sizes.
        let mut draw = |scale: f64| scale * ((0..12).map(|_| rng.f64()).sum::<f64>() - 6.0);
        let n = 4000;
        let mut small = [0u32; 3];
        for _ in 0..n {
            let a: Vec<f64> = (0..24).map(|_| draw(1.0)).collect();
            let b: Vec<f64> = (0..12).map(|_| draw(2.0)).collect();
            let ((ma, va), (mb, vb)) = (moments(&a), moments(&b));
            let p = welch((ma, va, 24), (mb, vb, 12)).2;
            for (count, level) in small.iter_mut().zip([0.5, 0.1, 0.01]) {
                *count += u32::from(p < level);
            }
        }
        for (count, level) in small.iter().zip([0.5, 0.1, 0.01]) {
            let (want, sd) = (f64::from(n) * level, (f64::from(n) * level * (1.0 - level)).sqrt());
            assert!((f64::from(*count) - want).abs() < 4.0 * sd, "{level}: {count} of {want}");
        }
    }

    #[test]
    fn quantiles_by_rank() {
        assert_eq!(quantile(&mut [3.0, 1.0, 2.0, 4.0], 0.5), 2.0);
        assert_eq!(quantile(&mut [3.0, 1.0], 0.99), 3.0);
        assert_eq!(quantile(&mut [], 0.99), 0.0);
    }
}
