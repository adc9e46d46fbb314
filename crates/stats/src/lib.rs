//! Paired comparison of two variants over the same scenes: mean difference with an interval, effect size, scenes
//! won, worst scene, a test, and verdicts with a margin.
//!
//! The unit of replication is the scene, never the pixel: pixels share their errors along a strand and a clump of
//! strands. [`paired`] takes a cell for each scene and seed; cells of one scene make one unit (see [`Unit`]).
//! A difference is always `b - a`. A figure without a value is the worst answer: see [`Difference`] for how it counts.

mod bootstrap;
mod difference;
mod error;
mod holm;
mod interval;
mod permutation;
mod scenes;
mod stratified;
mod units;
mod verdict;

pub use difference::{Difference, SceneDifference, Winner, paired};
pub use error::StatsError;
pub use holm::holm;
pub use interval::{Kind, expanded_tail};
pub use permutation::{Test, sign_flip};
pub use stratified::{Stratified, Stratum, stratified};
pub use units::{Statistic, Units};
pub use verdict::{Verdict, verdict};

/// One scene and seed, with the figure of either side.
#[derive(Clone, Debug, PartialEq)]
pub struct PairedCell {
    /// Name of the scene.
    pub scene: String,
    /// Seed of the cell.
    pub seed: u64,
    /// Figure of the baseline; `None` is the worst answer: absent, infinite, or of a failed cell.
    pub a: Option<f64>,
    /// Figure of the other; `None` is the worst answer.
    pub b: Option<f64>,
    /// What lies beneath the two figures, for the levels within a scene.
    pub units: Option<Units>,
}

/// What counts as one independent observation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Unit {
    /// A scene by name: the differences of its seeds are averaged. Right for statements about scenes in general,
    /// since seeds of one scene share the scene's peculiarities.
    #[default]
    Scene,
    /// Every scene and seed by itself: for statements about new draws of just these scenes, or where each seed
    /// changes the hairstyle altogether.
    SceneSeed,
}

/// How what varies within a scene enters the bootstrap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Levels {
    /// Both levels, scaled so that together they vary as the scenes' differences do.
    #[default]
    Matched,
    /// Both levels as drawn: counts twice what varies within scenes, for comparison only.
    Plain,
}

/// How to compare.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Seed of the bootstrap and of random sign flips.
    pub seed: u64,
    /// Bootstrap resamples.
    pub resamples: u32,
    /// Coverage asked of the interval, for example 0.95.
    pub confidence: f64,
    /// How the interval is taken from the resamples.
    pub kind: Kind,
    /// How the levels within a scene enter.
    pub levels: Levels,
    /// What counts as one observation.
    pub unit: Unit,
    /// Whether a lower figure is better.
    pub lower_is_better: bool,
}

impl Default for Options {
    /// 95 % by 10,000 resamples of scenes, seed 1, lower is better.
    fn default() -> Options {
        Options {
            seed: 1,
            resamples: 10_000,
            confidence: 0.95,
            kind: Kind::default(),
            levels: Levels::default(),
            unit: Unit::default(),
            lower_is_better: true,
        }
    }
}
