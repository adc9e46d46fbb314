//! What lies beneath a cell's figures: raw errors with the strand and the clump that they share.

use rayon::prelude::*;
use strandbench_rng::Rng;

/// A figure as a function of raw errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Statistic {
    /// The ceil(percent n / 100)-th smallest error, 0 < percent <= 100.
    Percentile(u32),
    /// Share of errors above a limit.
    ShareOver(f64),
    /// Mean error.
    Mean,
}

/// Raw errors of both sides at the same places (pixels or samples), and who shares them. All of one length.
#[derive(Clone, Debug, PartialEq)]
pub struct Units {
    /// Clump of each place: any number, equal for places of one clump.
    pub clump: Vec<u32>,
    /// Strand of each place: any number, equal for places of one strand; a strand belongs to one clump.
    pub strand: Vec<u32>,
    /// |error| of the baseline, +inf where it has no answer.
    pub a: Vec<f32>,
    /// |error| of the other, +inf where it has no answer.
    pub b: Vec<f32>,
    /// Which figure of the errors is compared.
    pub statistic: Statistic,
}

/// Replicates drawn once for each cell; the outer bootstrap draws from them.
pub(crate) const POOL: usize = 400;

/// Largest relative difference between a figure and the same figure from errors kept as 32-bit floats.
const ROUNDING: f64 = 1e-6;

impl Units {
    /// Errors of both sides' figures.
    pub fn figures(&self) -> [f64; 2] {
        let all = vec![1; self.a.len()];
        [&self.a, &self.b].map(|errors| figure(self.statistic, &ascending(errors), errors, &all))
    }

    /// Checks lengths, numbers, that a strand has one clump, and that the errors give the figures.
    pub(crate) fn check(&self, a: Option<f64>, b: Option<f64>) -> Result<(), String> {
        let n = self.clump.len();
        if n == 0 || [self.strand.len(), self.a.len(), self.b.len()] != [n; 3] {
            return Err(format!(
                "raw errors of {} and {} places with {} strands and {n} clumps: all must be as many, and not none",
                self.a.len(),
                self.b.len(),
                self.strand.len()
            ));
        }
        if self.a.iter().chain(&self.b).any(|e| e.is_nan() || *e < 0.0) {
            return Err("a raw error is negative or not a number".to_owned());
        }
        let mut pairs: Vec<(u32, u32)> =
            self.strand.iter().copied().zip(self.clump.iter().copied()).collect();
        pairs.sort_unstable();
        pairs.dedup();
        if let Some(w) = pairs.windows(2).find(|w| w[0].0 == w[1].0) {
            return Err(format!("strand {} belongs to clumps {} and {}", w[0].0, w[0].1, w[1].1));
        }
        let [of_a, of_b] = self.figures();
        for (side, given, found) in [("a", a, of_a), ("b", b, of_b)] {
            let same = match given {
                None => !found.is_finite(),
                Some(v) => (v - found).abs() <= ROUNDING * v.abs().max(found.abs()),
            };
            if !same {
                return Err(format!("the raw errors give {found} for {side}, whose figure is {given:?}"));
            }
        }
        Ok(())
    }

    /// `b - a` of [`POOL`] resamples: clumps with replacement, then strands within each, every place of a strand
    /// together and both sides at the same places. `None` if one of them has no value.
    pub(crate) fn pool(&self, key: [u64; 2]) -> Option<Vec<f64>> {
        let orders = [ascending(&self.a), ascending(&self.b)];
        let tree = Tree::new(self);
        let draw = |i: usize| {
            let weights = tree.resample(&mut Rng::keyed(&[key[0], 0x57ab, key[1], i as u64]));
            let [a, b] = [(&orders[0], &self.a), (&orders[1], &self.b)]
                .map(|(order, errors)| figure(self.statistic, order, errors, &weights));
            b - a
        };
        let pool: Vec<f64> = (0..POOL).into_par_iter().map(draw).collect();
        pool.iter().all(|d| d.is_finite()).then_some(pool)
    }
}

/// Places by clump and strand.
struct Tree {
    /// Index into `strands` of each place.
    strand_of: Vec<u32>,
    /// Strands (as ranks) of each clump: ranges.
    clumps: Vec<std::ops::Range<u32>>,
}

impl Tree {
    fn new(units: &Units) -> Tree {
        let mut names: Vec<(u32, u32)> =
            units.clump.iter().copied().zip(units.strand.iter().copied()).collect();
        let wanted = names.clone();
        names.sort_unstable();
        names.dedup();
        let strand_of = wanted.iter().map(|name| names.partition_point(|n| n < name) as u32).collect();
        let mut start = 0;
        let clumps = names
            .chunk_by(|a, b| a.0 == b.0)
            .map(|of| {
                let range = start..start + of.len() as u32;
                start = range.end;
                range
            })
            .collect();
        Tree { strand_of, clumps }
    }

    /// How often each place is drawn.
    fn resample(&self, rng: &mut Rng) -> Vec<u32> {
        let strands = self.clumps.last().map_or(0, |c| c.end) as usize;
        let mut times = vec![0u32; strands];
        for _ in 0..self.clumps.len() {
            let clump = &self.clumps[rng.below(self.clumps.len() as u64) as usize];
            let size = u64::from(clump.end - clump.start);
            for _ in 0..size {
                times[clump.start as usize + rng.below(size) as usize] += 1;
            }
        }
        self.strand_of.iter().map(|&s| times[s as usize]).collect()
    }
}

fn ascending(errors: &[f32]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..errors.len() as u32).collect();
    order.sort_unstable_by(|&i, &j| errors[i as usize].total_cmp(&errors[j as usize]));
    order
}

/// The figure of errors that count `weights` times each; +inf of none.
fn figure(statistic: Statistic, order: &[u32], errors: &[f32], weights: &[u32]) -> f64 {
    let total: u64 = weights.iter().map(|&w| u64::from(w)).sum();
    let share = |sum: f64| if total == 0 { f64::INFINITY } else { sum / total as f64 };
    match statistic {
        Statistic::Percentile(percent) => {
            let rank = (total * u64::from(percent)).div_ceil(100).max(1);
            let mut seen = 0;
            let at = order.iter().find(|&&i| {
                seen += u64::from(weights[i as usize]);
                seen >= rank
            });
            at.map_or(f64::INFINITY, |&i| f64::from(errors[i as usize]))
        }
        Statistic::ShareOver(limit) => {
            let over = errors.iter().zip(weights).filter(|(e, _)| f64::from(**e) > limit);
            share(over.map(|(_, &w)| f64::from(w)).sum())
        }
        Statistic::Mean => {
            let of = errors.iter().zip(weights).filter(|(_, w)| **w > 0);
            share(of.map(|(&e, &w)| f64::from(e) * f64::from(w)).sum())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn units() -> Units {
        Units {
            clump: vec![7, 7, 7, 3, 3],
            strand: vec![1, 1, 2, 9, 9],
            a: vec![1.0, 2.0, 3.0, 4.0, f32::INFINITY],
            b: vec![2.0, 3.0, 4.0, 5.0, 6.0],
            statistic: Statistic::Percentile(50),
        }
    }

    #[test]
    fn figures_with_weights_are_those_of_repeated_errors() {
        let errors = [4.0f32, 1.0, 3.0, 2.0];
        let order = ascending(&errors);
        let of = |s, w: &[u32]| figure(s, &order, &errors, w);
        // Repeated: 4, 4, 1, 2 -> 1 2 4 4.
        assert_eq!(of(Statistic::Percentile(50), &[2, 1, 0, 1]), 2.0);
        assert_eq!(of(Statistic::Percentile(51), &[2, 1, 0, 1]), 4.0);
        assert_eq!(of(Statistic::ShareOver(2.0), &[2, 1, 0, 1]), 0.5);
        assert_eq!(of(Statistic::Mean, &[2, 1, 0, 1]), 2.75);
        assert_eq!(of(Statistic::Percentile(50), &[0; 4]), f64::INFINITY);
    }

    #[test]
    fn a_resample_draws_clumps_then_strands_and_keeps_strands_whole() {
        let units = units();
        let tree = Tree::new(&units);
        let mut seen = std::collections::BTreeSet::new();
        for i in 0..2000 {
            let w = tree.resample(&mut Rng::keyed(&[i]));
            assert!(w[0] == w[1] && w[3] == w[4], "{w:?}");
            // Clump 7 holds two strands, clump 3 one: two draws of a clump.
            assert!([2, 3, 4].contains(&(w[0] + w[2] + w[3])), "{w:?}");
            seen.insert((w[0], w[2], w[3]));
        }
        // Clump 3 twice; once each with three outcomes in 7; clump 7 twice with five.
        assert_eq!(seen.len(), 1 + 3 + 5, "{seen:?}");
    }

    #[test]
    fn errors_that_do_not_fit_are_refused() {
        let good = units();
        assert_eq!(good.check(Some(3.0), Some(4.0)), Ok(()));
        assert!(good.check(Some(3.1), Some(4.0)).unwrap_err().contains("give 3 for a"));
        assert!(good.check(None, Some(4.0)).unwrap_err().contains("None"));
        let short = Units { strand: vec![1], ..good.clone() };
        assert!(short.check(Some(3.0), Some(4.0)).unwrap_err().contains("1 strands"));
        let nan = Units { a: vec![1.0, f32::NAN, 3.0, 4.0, 5.0], ..good.clone() };
        assert!(nan.check(Some(3.0), Some(4.0)).unwrap_err().contains("not a number"));
        let torn = Units { clump: vec![7, 3, 7, 3, 3], ..good };
        assert!(torn.check(Some(3.0), Some(4.0)).unwrap_err().contains("strand 1 belongs to clumps 3 and 7"));
    }
}
