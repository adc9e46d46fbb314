//! Intervals hold the truth as often as they say: the quick version of `examples/coverage.rs`, whose table is committed
//! in `reports/statistics.md`.

#[path = "simulation/model.rs"]
mod model;

use model::{Model, scene_mm, within_variance};
use strandbench_stats::{Kind, Options, paired};

const TRUE_MM: f64 = 0.3;
const DRAWS: u64 = 400;

/// How many of [`DRAWS`] intervals hold the truth.
fn held(model: &Model, kind: Kind) -> f64 {
    let hit = |draw: u64| {
        let options = Options { kind, seed: draw, resamples: 2000, ..Options::default() };
        let [low, high] = paired(&model.draw(&[3, draw]), &options).unwrap().interval.unwrap();
        f64::from(u8::from(low <= TRUE_MM && TRUE_MM <= high))
    };
    (0..DRAWS).map(hit).sum()
}

#[test]
fn eight_scenes_that_share_strands_and_clumps() {
    let model = Model {
        scenes: 8,
        scene_mm: scene_mm(0.5, within_variance()),
        skewed: false,
        difference_mm: TRUE_MM,
    };
    // Four standard deviations of a binomial count at 95 %: 380 +- 17.4. Plain BCa holds the truth in 89 %: 356, beyond them.
    let (n, p) = (DRAWS as f64, 0.95);
    let (want, slack) = (n * p, 4.0 * (n * p * (1.0 - p)).sqrt());
    let got = held(&model, Kind::BcaExpanded);
    assert!((got - want).abs() <= slack, "{got} of {DRAWS} intervals hold the truth");
    let plain = held(&model, Kind::Bca);
    assert!(plain < want - slack, "without the expansion {plain} of {DRAWS}: the test sees the difference");
}
