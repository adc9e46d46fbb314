//! Everything that one metric says about two variants.

use crate::scenes::{Scene, difference, gather};
use crate::{Options, PairedCell, StatsError, Test, bootstrap, interval, permutation};
use serde::{Deserialize, Serialize};

/// Which side is better.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Winner {
    /// The baseline.
    A,
    /// The other.
    B,
    /// Neither.
    Tie,
}

/// One scene's difference.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SceneDifference {
    /// Name; with its seed where seeds stand alone.
    pub scene: String,
    /// Seeds in it.
    pub seeds: Vec<u64>,
    /// `b - a`, the mean over its seeds; `None` if infinite or undecided between infinities: one side has no answer.
    pub difference: Option<f64>,
    /// Which side is better.
    pub winner: Winner,
}

/// Paired difference `b - a` of one metric over scenes.
///
/// A figure without a value is the worst there is. A scene on which one side has none is won by the other and is infinitely
/// different; if neither has one, they tie with difference 0. With an infinite difference anywhere, mean, interval and
/// effect do not exist ([`Difference::undefined`] says so); median, scenes won, worst scene and p (by ranks) do.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Difference {
    /// Independent observations.
    pub scenes: usize,
    /// Cells in them.
    pub cells: usize,
    /// Cells with raw errors for the levels within a scene.
    pub cells_with_units: usize,
    /// Mean over scenes, in the metric's unit.
    pub mean: Option<f64>,
    /// Interval of the mean by the bootstrap; needs two scenes.
    pub interval: Option<[f64; 2]>,
    /// Why there is no mean or no interval.
    pub undefined: Option<String>,
    /// Middle of the scenes' differences (mean of the two middle ones); `None` if infinite.
    pub median: Option<f64>,
    /// Mean over standard deviation of the scenes' differences (Cohen's d of pairs); needs two scenes that differ.
    pub effect: Option<f64>,
    /// Two-sided p-value of no difference.
    pub p: f64,
    /// How p was found.
    pub test: Test,
    /// Share of scenes on which b is better, 0..1; ties count for neither.
    pub won: f64,
    /// Share of ties.
    pub tied: f64,
    /// Where b does worst against a; the first by name of equals.
    pub worst: SceneDifference,
    /// All scenes by name.
    pub by_scene: Vec<SceneDifference>,
}

/// Compares the figures of cells.
///
/// # Errors
/// If there is no cell, one occurs twice, a figure is not finite, raw errors do not fit, or an option is out of range.
pub fn paired(cells: &[PairedCell], options: &Options) -> Result<Difference, StatsError> {
    check(options)?;
    let scenes = gather(cells, options)?;
    let low = options.lower_is_better;
    let d: Vec<f64> = scenes.iter().map(|s| s.difference(low)).collect();
    let n = d.len();
    let infinite: Vec<&str> = scenes
        .iter()
        .zip(&d)
        .filter(|(s, d)| !d.is_finite() || s.mixed(low))
        .map(|(s, _)| s.name.as_str())
        .collect();
    let finite = infinite.is_empty();
    let mean = finite.then(|| d.iter().sum::<f64>() / n as f64);
    let spread = mean.filter(|_| n > 1).map(|m| {
        let squares: f64 = d.iter().map(|v| (v - m) * (v - m)).sum();
        (squares / (n - 1) as f64).sqrt()
    });
    let interval = mean.filter(|_| n > 1).map(|m| {
        if spread == Some(0.0) {
            return [m, m];
        }
        let means = bootstrap::means(&scenes, &d, options);
        interval::of(options.kind, options.confidence, m, &means, &d)
    });
    let undefined = if !finite {
        Some(format!(
            "one side has no answer on {} of {n} scenes ({}), which is infinitely worse: there is no mean",
            infinite.len(),
            infinite.join(", ")
        ))
    } else {
        (n < 2).then(|| "one scene says nothing about others: no interval".to_owned())
    };
    let (test, p) = permutation::sign_flip(&d, options.seed);
    let by_scene: Vec<SceneDifference> = scenes.iter().zip(&d).map(|(s, &d)| s.named(d, low)).collect();
    let share = |w: Winner| by_scene.iter().filter(|s| s.winner == w).count() as f64 / n as f64;
    let badness = |i: usize| if low { d[i] } else { -d[i] };
    let worst = (1..n).fold(0, |w, i| if badness(i) > badness(w) { i } else { w });
    Ok(Difference {
        scenes: n,
        cells: cells.len(),
        cells_with_units: cells.iter().filter(|c| c.units.is_some()).count(),
        mean,
        interval,
        undefined,
        median: median(&d),
        effect: mean.zip(spread).filter(|(_, s)| *s > 0.0).map(|(m, s)| m / s),
        p,
        test,
        won: share(Winner::B),
        tied: share(Winner::Tie),
        worst: by_scene[worst].clone(),
        by_scene,
    })
}

impl Scene<'_> {
    /// Whether some of its seeds are infinitely better and others infinitely worse.
    fn mixed(&self, lower_is_better: bool) -> bool {
        self.cells.iter().any(|c| !difference(c, lower_is_better).is_finite())
    }

    fn named(&self, d: f64, lower_is_better: bool) -> SceneDifference {
        let winner = match d.partial_cmp(&0.0) {
            Some(std::cmp::Ordering::Less) if lower_is_better => Winner::B,
            Some(std::cmp::Ordering::Greater) if !lower_is_better => Winner::B,
            Some(std::cmp::Ordering::Equal) | None => Winner::Tie,
            _ => Winner::A,
        };
        SceneDifference {
            scene: self.name.clone(),
            seeds: self.cells.iter().map(|c| c.seed).collect(),
            difference: (d.is_finite() && !self.mixed(lower_is_better)).then_some(d),
            winner,
        }
    }
}

fn median(d: &[f64]) -> Option<f64> {
    let mut sorted = d.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let n = sorted.len();
    let middle = (sorted[(n - 1) / 2] + sorted[n / 2]) / 2.0;
    middle.is_finite().then_some(middle)
}

fn check(options: &Options) -> Result<(), StatsError> {
    let wrong = |name, value: String, expected| Err(StatsError::Option { name, value, expected });
    if !(options.confidence > 0.0 && options.confidence < 1.0) {
        return wrong("confidence", options.confidence.to_string(), "between 0 and 1, for example 0.95");
    }
    if !(100..=1_000_000).contains(&options.resamples) {
        return wrong("resamples", options.resamples.to_string(), "100 to 1,000,000; 10,000 is usual");
    }
    Ok(())
}
