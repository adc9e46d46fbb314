//! Comparisons with known outcomes.

use strandbench_stats::{
    Kind, Levels, Options, PairedCell, Statistic, StatsError, Test, Unit, Units, Verdict, Winner, paired,
    verdict,
};

fn cell(scene: &str, seed: u64, a: impl Into<Option<f64>>, b: impl Into<Option<f64>>) -> PairedCell {
    PairedCell { scene: scene.to_owned(), seed, a: a.into(), b: b.into(), units: None }
}

/// Scenes with these differences `b - a`.
fn cells(differences: &[f64]) -> Vec<PairedCell> {
    differences.iter().zip(0..).map(|(&d, i)| cell(&format!("s{i:02}"), 1, 5.0, 5.0 + d)).collect()
}

#[test]
fn figures_of_a_comparison_by_hand() {
    let d = paired(&cells(&[-1.0, -2.0, -3.0, 0.5, 0.0]), &Options::default()).unwrap();
    assert_eq!((d.scenes, d.cells, d.cells_with_units), (5, 5, 0));
    assert!((d.mean.unwrap() + 1.1).abs() < 1e-12);
    assert!((d.median.unwrap() + 1.0).abs() < 1e-12);
    // Squares about -1.1: 0.01 + 0.81 + 3.61 + 2.56 + 1.21 = 8.2; sd sqrt(2.05).
    assert!((d.effect.unwrap() + 1.1 / 2.05f64.sqrt()).abs() < 1e-12);
    assert_eq!((d.won, d.tied), (0.6, 0.2));
    assert_eq!((d.worst.scene.as_str(), d.worst.winner, d.test), ("s03", Winner::A, Test::SignFlip));
    // Sums of +-1 +-2 +-3 +-0.5 (and 0) of 5.5 or more: of the 16 patterns 6.5 and 5.5 either way.
    assert_eq!(d.p, 0.25);
    let [low, high] = d.interval.unwrap();
    assert!(low < -1.1 && high > -1.1 && low > -3.1, "{low} {high}");

    let higher = Options { lower_is_better: false, ..Options::default() };
    let d = paired(&cells(&[-1.0, -2.0, -3.0, 0.5, 0.0]), &higher).unwrap();
    assert_eq!((d.won, d.tied, d.worst.scene.as_str()), (0.2, 0.2, "s02"));
}

#[test]
fn a_missing_answer_is_the_worst_and_never_dropped() {
    let all =
        [cell("x", 1, 2.0, 1.0), cell("y", 1, 2.0, None), cell("z", 1, None, None), cell("w", 1, None, 9.0)];
    let d = paired(&all, &Options::default()).unwrap();
    assert_eq!((d.scenes, d.mean, d.interval, d.effect), (4, None, None, None));
    assert!(d.undefined.as_ref().unwrap().contains("2 of 4 scenes (w, y)"), "{:?}", d.undefined);
    assert_eq!((d.won, d.tied, d.test), (0.5, 0.25, Test::SignedRank));
    assert_eq!((d.worst.scene.as_str(), d.worst.difference, d.worst.winner), ("y", None, Winner::A));
    // -inf, -1, 0, inf: the middle two are -1 and 0.
    assert_eq!(d.median, Some(-0.5));
    assert_eq!(verdict(&d, true, 100.0).unwrap(), Verdict::Undecided, "no interval, no verdict");

    let worse_everywhere: Vec<_> = (0..6).map(|i| cell(&i.to_string(), 1, 2.0, None)).collect();
    let d = paired(&worse_everywhere, &Options::default()).unwrap();
    assert_eq!((d.won, d.p, d.median), (0.0, 2.0 / 64.0, None));
    let higher = Options { lower_is_better: false, ..Options::default() };
    let d = paired(&[cell("x", 1, 0.5, None), cell("y", 1, 0.5, 0.6)], &higher).unwrap();
    assert_eq!((d.worst.scene.as_str(), d.won), ("x", 0.5));
    // One seed infinitely better, one infinitely worse: undecided, and no mean.
    let d = paired(
        &[cell("x", 1, None, 1.0), cell("x", 2, 1.0, None), cell("y", 1, 1.0, 2.0)],
        &Options::default(),
    );
    let d = d.unwrap();
    assert_eq!((d.by_scene[0].winner, d.by_scene[0].difference, d.mean), (Winner::Tie, None, None));
}

#[test]
fn seeds_of_a_scene_are_one_observation() {
    let all = [cell("x", 1, 1.0, 2.0), cell("x", 2, 1.0, 4.0), cell("y", 1, 1.0, 1.0)];
    let d = paired(&all, &Options::default()).unwrap();
    assert_eq!((d.scenes, d.cells, d.mean, d.by_scene[0].seeds.as_slice()), (2, 3, Some(1.0), &[1, 2][..]));
    let apart = paired(&all, &Options { unit: Unit::SceneSeed, ..Options::default() }).unwrap();
    assert_eq!((apart.scenes, apart.mean.map(|m| (m * 3.0).round())), (3, Some(4.0)));
    // Five copies of the same two scenes under other seeds say no more than the two scenes.
    let copies: Vec<_> = (0..5).flat_map(|s| [cell("x", s, 1.0, 2.0), cell("y", s, 1.0, 1.5)]).collect();
    let few = paired(&copies, &Options::default()).unwrap();
    assert_eq!((few.scenes, few.p), (2, 0.5));
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let fails = |cells: &[PairedCell], options: &Options| paired(cells, options).unwrap_err();
    let usual = Options::default();
    assert_eq!(fails(&[], &usual), StatsError::Nothing);
    let twice = [cell("x", 1, 1.0, 1.0), cell("x", 1, 2.0, 1.0)];
    assert!(fails(&twice, &usual).to_string().contains("scene x, seed 1 occurs twice"));
    for bad in [f64::NAN, f64::INFINITY] {
        let error = fails(&[cell("x", 3, bad, 1.0)], &usual).to_string();
        assert!(error.contains("scene x, seed 3: the figure of a is not a number"), "{error}");
    }
    let one = cells(&[1.0, 2.0]);
    for confidence in [0.0, 1.0, f64::NAN, -3.0] {
        assert!(fails(&one, &Options { confidence, ..usual.clone() }).to_string().contains("confidence"));
    }
    for resamples in [0, 99, u32::MAX] {
        assert!(fails(&one, &Options { resamples, ..usual.clone() }).to_string().contains("resamples"));
    }
    let d = paired(&one, &usual).unwrap();
    assert!(verdict(&d, true, -1.0).is_err() && verdict(&d, true, f64::NAN).is_err());
}

#[test]
fn one_scene_and_equal_scenes() {
    let d = paired(&cells(&[1.5]), &Options::default()).unwrap();
    assert_eq!((d.mean, d.interval, d.effect, d.p), (Some(1.5), None, None, 1.0));
    assert!(d.undefined.unwrap().contains("one scene"));
    let same = paired(&cells(&[0.0; 7]), &Options::default()).unwrap();
    assert_eq!((same.interval, same.p, same.tied, same.effect), (Some([0.0, 0.0]), 1.0, 1.0, None));
    assert_eq!(verdict(&same, true, 0.0).unwrap(), Verdict::Equivalent);
}

#[test]
fn verdicts_follow_the_interval() {
    let mut d = paired(&cells(&[-1.0, -2.0]), &Options::default()).unwrap();
    for (interval, low, high) in [
        // Interval of b - a; the verdict where lower is better, and where higher is.
        ([-2.0, -1.0], Verdict::Better, Verdict::Worse),
        ([1.0, 2.0], Verdict::Worse, Verdict::Better),
        ([-0.4, 0.3], Verdict::Equivalent, Verdict::Equivalent),
        ([0.1, 0.3], Verdict::Equivalent, Verdict::Equivalent),
        ([-2.0, 0.3], Verdict::NotInferior, Verdict::Undecided),
        ([-0.3, 2.0], Verdict::Undecided, Verdict::NotInferior),
        ([-2.0, 0.5], Verdict::Undecided, Verdict::Undecided),
    ] {
        d.interval = Some(interval);
        assert_eq!(verdict(&d, true, 0.5).unwrap(), low, "{interval:?}");
        assert_eq!(verdict(&d, false, 0.5).unwrap(), high, "{interval:?}");
    }
    d.interval = Some([-0.4, 0.3]);
    assert_eq!(verdict(&d, true, 0.0).unwrap(), Verdict::Undecided, "without a margin nothing is equivalent");
}

/// Scenes without differences of their own whose pixels come in clumps.
fn clumped() -> Vec<PairedCell> {
    use strandbench_rng::Rng;
    (0..6u64)
        .map(|j| {
            let mut rng = Rng::keyed(&[9, j]);
            let clump: Vec<u32> = (0..600).map(|i| i / 50).collect();
            let strand: Vec<u32> = (0..600).map(|i| i / 10).collect();
            let shift: Vec<f32> = (0..12).map(|_| rng.range(0.0, 2.0)).collect();
            let a: Vec<f32> = (0..600).map(|_| rng.range(1.0, 3.0)).collect();
            let b = a.iter().zip(&clump).map(|(a, &c)| a + shift[c as usize]).collect();
            let units = Units { clump, strand, a, b, statistic: Statistic::Mean };
            let [a, b] = units.figures();
            PairedCell { scene: j.to_string(), seed: 1, a: Some(a), b: Some(b), units: Some(units) }
        })
        .collect()
}

#[test]
fn levels_within_scenes_are_counted_once() {
    let all = clumped();
    let width = |options: &Options, cells: &[PairedCell]| {
        let [low, high] = paired(cells, options).unwrap().interval.unwrap();
        high - low
    };
    let usual = Options { kind: Kind::Percentile, ..Options::default() };
    let mut bare = all.clone();
    bare.iter_mut().for_each(|c| c.units = None);
    let (matched, alone) = (width(&usual, &all), width(&usual, &bare));
    let plain = width(&Options { levels: Levels::Plain, ..usual.clone() }, &all);
    // The same variance in either; widths differ by shape and by 10,000 draws, some per cent.
    assert!((matched / alone - 1.0).abs() < 0.1, "{matched} {alone}");
    // All of the scenes' variance stems from clumps: drawn plainly it counts twice, sqrt(2) in width, less what six scenes happen to
    // differ by.
    assert!(plain / matched > 1.2, "{plain} {matched}");
    assert_eq!(paired(&all, &usual).unwrap().cells_with_units, 6);
}

#[test]
fn the_same_seed_gives_the_same_bits_whatever_the_threads_and_the_order() {
    // Two seeds a scene.
    let mut all = clumped();
    all.iter_mut().zip(0..).for_each(|(cell, i)| (cell.scene, cell.seed) = ((i / 2).to_string(), i % 2));
    let run = |threads: usize, cells: &[PairedCell], seed: u64| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| paired(cells, &Options { seed, ..Options::default() }).unwrap())
    };
    let mut reversed = all.clone();
    reversed.reverse();
    let one = run(1, &all, 1);
    assert_eq!(one, run(3, &all, 1));
    assert_eq!(one, run(2, &reversed, 1));
    assert_ne!(one.interval, run(1, &all, 2).interval);
}
