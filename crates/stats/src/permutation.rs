//! A two-sided test of paired differences by flipping their signs.

use serde::{Deserialize, Serialize};
use strandbench_rng::Rng;

/// What was permuted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Test {
    /// The mean difference under flips of the scenes' signs.
    SignFlip,
    /// The sum of signed ranks (Wilcoxon) under the same flips: where a difference is infinite, which only ranks
    /// can express.
    SignedRank,
}

/// Numbers of scenes up to which every flip is tried, so that p is exact.
const EXACT: usize = 16;
/// Random flips beyond that; the standard error of p near 0.05 is 0.0007.
const RANDOM: u32 = 100_000;

/// Two-sided p-value of the hypothesis that differences are symmetric about zero: the share of sign patterns whose
/// mean is at least as far from zero. All 2^n patterns for n up to 16, else 100,000 random ones beside the observed one,
/// which counts itself (Phipson and Smyth 2010). Exact whatever the differences' distribution, also of few scenes, where a
/// bootstrap's p is too small; the least that n scenes can give is 2^(1-n). Infinite differences: by ranks.
pub fn sign_flip(differences: &[f64], seed: u64) -> (Test, f64) {
    if differences.iter().all(|d| d.is_finite()) {
        return (Test::SignFlip, p_value(differences, seed));
    }
    (Test::SignedRank, p_value(&signed_ranks(differences), seed))
}

fn p_value(d: &[f64], seed: u64) -> f64 {
    let observed = d.iter().sum::<f64>().abs();
    // Sums of the same numbers in other signs differ by rounding: n sums of at most the sum of magnitudes.
    let slack = d.len() as f64 * f64::EPSILON * d.iter().map(|v| v.abs()).sum::<f64>();
    let extreme = |sum: f64| sum.abs() >= observed - slack;
    if d.len() <= EXACT {
        let flips = 1u32 << d.len();
        let sum =
            |bits: u32| d.iter().enumerate().map(|(i, v)| if bits >> i & 1 == 1 { -v } else { *v }).sum();
        let hits = (0..flips).filter(|&bits| extreme(sum(bits))).count();
        return hits as f64 / f64::from(flips);
    }
    let mut hits = 1u32;
    for round in 0..RANDOM {
        let mut rng = Rng::keyed(&[seed, 0xf11b, u64::from(round)]);
        let (mut bits, mut sum) = (0, 0.0);
        for (i, v) in d.iter().enumerate() {
            if i % 64 == 0 {
                bits = rng.next_u64();
            }
            sum += if bits >> (i % 64) & 1 == 1 { -v } else { *v };
        }
        hits += u32::from(extreme(sum));
    }
    f64::from(hits) / f64::from(RANDOM + 1)
}

/// Ranks of the magnitudes with the differences' signs; equal magnitudes share their mean rank, zeros have none.
fn signed_ranks(d: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..d.len()).filter(|&i| d[i] != 0.0).collect();
    order.sort_by(|&i, &j| d[i].abs().total_cmp(&d[j].abs()));
    let mut ranks = vec![0.0; d.len()];
    let mut below = 0;
    for tied in order.chunk_by(|&i, &j| d[i].abs() == d[j].abs()) {
        let rank = below as f64 + (tied.len() as f64 + 1.0) / 2.0;
        for &i in tied {
            ranks[i] = rank.copysign(d[i]);
        }
        below += tied.len();
    }
    ranks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_by_hand() {
        // Of 8 patterns only +++ and --- reach a sum of 6.
        assert_eq!(sign_flip(&[1.0, 2.0, 3.0], 1), (Test::SignFlip, 0.25));
        // Sum 0: every pattern is as extreme.
        assert_eq!(sign_flip(&[1.0, 2.0, -3.0], 1).1, 1.0);
        // Sums of (1, 1, 1, -1) are 4, 2, 0, -2, -4 with weights 1, 4, 6, 4, 1: 10 of 16 reach 2.
        assert_eq!(sign_flip(&[0.1, 0.1, 0.1, -0.1], 1).1, 0.625);
        assert_eq!(sign_flip(&[0.0; 5], 1).1, 1.0);
    }

    #[test]
    fn infinite_differences_have_the_largest_rank() {
        assert_eq!(signed_ranks(&[-0.5, f64::INFINITY, 0.5, 0.0, -2.0]), [-1.5, 4.0, 1.5, 0.0, -3.0]);
        let (test, p) = sign_flip(&[f64::INFINITY, f64::INFINITY, 1.0, 2.0], 1);
        assert_eq!((test, p), (Test::SignedRank, 0.125));
    }

    #[test]
    fn random_flips_agree_with_all_flips() {
        // 17 scenes are one too many for all patterns. Among 16 equal steps and one of a half, the sum reaches the observed one where
        // at most so many are negative: counted by the binomial distribution.
        let mut d = vec![1.0; 17];
        for v in &mut d[..4] {
            *v = -1.0;
        }
        // |sum| >= 9: at most 4 or at least 13 negative of 17.
        let choose = |k: u64| (0..k).fold(1.0, |c, i| c * (17 - i) as f64 / (i + 1) as f64);
        let exact = 2.0 * (0..=4).map(choose).sum::<f64>() / f64::from(1u32 << 17);
        let p = sign_flip(&d, 3).1;
        let sd = (exact * (1.0 - exact) / f64::from(RANDOM)).sqrt();
        assert!((p - exact).abs() < 4.0 * sd, "{p} {exact}");
        assert_ne!(p, sign_flip(&d, 4).1, "another seed flips otherwise");
        assert_eq!(p, sign_flip(&d, 3).1);
    }
}
