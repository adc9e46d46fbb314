//! Gates on made-up results.

use super::*;
use crate::results::CellResult;
use std::collections::BTreeMap;

fn score(metric: &str, value: Option<f64>) -> Score {
    let known = strandbench_score::metric(metric).unwrap();
    Score {
        subject: "method".to_owned(),
        metric: metric.to_owned(),
        value,
        unit: known.unit.to_owned(),
        lower_is_better: known.lower_is_better,
        coverage: 0.9,
        wanted: 10,
    }
}

fn cell(median: f64) -> CellResult {
    let scores =
        vec![score("A1.median", Some(median)), score("A4.iou.mean", Some(0.8)), score("A5.median", None)];
    CellResult { trouble: None, scores, score_dir: None }
}

/// Three scenes with these seeds; the figure is the scene's, plus what `noise` gives for the seed.
fn results(seeds: std::ops::Range<u64>, noise: impl Fn(u64) -> f64) -> Results {
    let cells = (0..3u64).flat_map(|s| seeds.clone().map(move |seed| (s, seed)));
    let cells = cells
        .map(|(s, seed)| ((format!("s{s}"), seed), cell(5.0 + s as f64 + noise(seed * 3 + s))))
        .collect();
    Results { variant: "v".to_owned(), source: "made-up".into(), protocol: "v3 0".to_owned(), cells }
}

fn plan() -> Plan {
    Plan {
        scenes: vec!["s".to_owned()],
        variants: vec!["v".to_owned()],
        seeds: vec![1],
        settings: Vec::new(),
        tolerance: BTreeMap::from([("mm".to_owned(), 1e-9)]),
        margin: BTreeMap::from([("A1.median".to_owned(), 0.5)]),
    }
}

fn good() -> Results {
    results(0..2, |_| 0.0)
}

fn change(f: impl Fn(&mut CellResult)) -> Held {
    let mut now = good();
    f(now.cells.get_mut(&("s1".to_owned(), 1)).unwrap());
    hold(&[good()], &[now], &plan())
}

#[test]
fn what_did_not_change_passes() {
    let held = hold(&[good()], &[good()], &plan());
    assert!(held.passes() && (held.cells, held.figures) == (6, 18), "{held:?}");
    assert!(change(|c| c.scores[0].value = Some(6.0 + 1e-10)).passes(), "within the tolerance");
}

#[test]
fn any_change_shuts_the_gate_improvements_included() {
    for (value, better) in [(Some(5.9), true), (Some(6.0 + 2e-9), false), (None, false)] {
        let held = change(|c| c.scores[0].value = value);
        assert!(!held.passes());
        let c = &held.changes[0];
        assert_eq!(
            (c.scene.as_str(), c.seed, c.reference, c.now, c.better),
            ("s1", 1, Some(6.0), value, better)
        );
    }
    assert!(change(|c| c.scores[1].value = Some(0.81)).changes[0].better, "higher is better");
    assert!(change(|c| c.scores[2].value = Some(3.0)).changes[0].better, "an answer where there was none");
    let covered = change(|c| c.scores[0].coverage = 0.91);
    assert_eq!((covered.changes.len(), covered.changes[0].metric.as_str()), (1, "A1.median (coverage)"));
}

#[test]
fn it_fails_closed() {
    let faults = |reference: &[Results], now: &[Results]| {
        let held = hold(reference, now, &plan());
        assert!(!held.passes());
        held.faults.join("; ")
    };
    assert!(faults(&[], &[]).contains("nothing was evaluated"));
    assert!(faults(&[good()], &[]).contains("variant v of the reference was not run"));
    let mut fewer = good();
    fewer.cells.pop_last();
    assert_eq!(faults(&[good()], std::slice::from_ref(&fewer)), "s2 by v, seed 1: not run");
    assert_eq!(faults(&[fewer], &[good()]), "s2 by v, seed 1: not in the reference");
    let other = Results { protocol: "v9".to_owned(), ..good() };
    assert!(faults(&[good()], &[other]).contains("protocol \"v9\" now"));
    let fault = |f: fn(&mut CellResult)| change(f).faults.join("; ");
    let failed =
        fault(|c| *c = CellResult { trouble: Some("timed out".to_owned()), scores: vec![], score_dir: None });
    assert_eq!(failed, "s1 by v, seed 1: timed out");
    assert!(fault(|c| drop(c.scores.remove(0))).contains("has no A1.median any more"));
    assert!(fault(|c| c.scores.push(score("A1.p90", Some(1.0)))).contains("A1.p90 is not in the reference"));
}

#[test]
fn an_accepted_run_passes_and_a_failed_one_is_not_accepted() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("gate.csv");
    // A third is no decimal fraction: the shortest text that reads back to the same bits is written.
    let now = results(0..2, |i| i as f64 / 3.0);
    assert_eq!(accept(std::slice::from_ref(&now), &file).unwrap(), 18);
    let reference = Results::read(&file).unwrap();
    let exact = Plan { tolerance: BTreeMap::new(), ..plan() };
    assert!(hold(&reference, std::slice::from_ref(&now), &exact).passes());
    let before = std::fs::read(&file).unwrap();
    let mut bad = now;
    bad.cells.first_entry().unwrap().get_mut().trouble = Some("failed".to_owned());
    assert!(accept(&[bad], &file).unwrap_err().to_string().contains("s0 by v, seed 0: failed"));
    assert!(accept(&[], &file).unwrap_err().to_string().contains("nothing was evaluated"));
    assert_eq!(std::fs::read(&file).unwrap(), before);
    for (text, want) in [
        ("scene,variant\na,b\n", "missing field"),
        ("scene,variant,seed,metric,unit,value,coverage,protocol\n", "holds no cell"),
        ("scene,variant,seed,metric,unit,value,coverage,protocol\na,b,1,A9.x,mm,1,1,v3\n", "A9.x"),
        (
            "scene,variant,seed,metric,unit,value,coverage,protocol\na,b,1,A1.median,px,1,1,v3\n",
            "in px, not in mm",
        ),
        (
            "scene,variant,seed,metric,unit,value,coverage,protocol\na,b,1,A1.median,mm,NaN,1,v3\n",
            "not a figure",
        ),
        (
            "scene,variant,seed,metric,unit,value,coverage,protocol\na,b,1,A1.median,mm,1,7,v3\n",
            "not a figure",
        ),
        (
            "scene,variant,seed,metric,unit,value,coverage,protocol\na,b,1,A1.median,mm,1,1,v3\na,b,1,A1.median,mm,1,1,v3\n",
            "occurs twice",
        ),
        (
            "scene,variant,seed,metric,unit,value,coverage,protocol\na,b,1,A1.median,mm,1,1,v3\na,b,1,A1.p90,mm,1,1,v2\n",
            "two protocols",
        ),
    ] {
        std::fs::write(&file, text).unwrap();
        let error = Results::read(&file).unwrap_err().to_string();
        assert!(error.contains(want) && error.contains("gate.csv"), "{error} does not say {want}");
    }
}

#[test]
fn a_plan_that_says_nothing_or_nonsense_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("gate.toml");
    let read = |text: &str| {
        std::fs::write(&file, text).unwrap();
        Plan::read(&file)
    };
    let start = "scenes = ['a']\nvariants = ['luo']\nseeds = [1]\n";
    let plan = read(&format!("{start}[tolerance]\nmm = 0.1\n'A1.median' = 0.2\n")).unwrap();
    assert_eq!(
        [("A1.median", "mm"), ("A1.p90", "mm"), ("A5.median", "deg")].map(|(m, u)| plan.tolerance_of(m, u)),
        [0.2, 0.1, 0.0]
    );
    for (text, want) in [
        (format!("{start}colour = 1\n"), "colour"),
        (start.replace("['a']", "[]"), "evaluate nothing"),
        (start.replace("[1]", "[1, 2, 1]"), "seed twice"),
        (format!("{start}[tolerance]\n'A1.medium' = 1.0\n"), "A1.medium"),
        (format!("{start}[margin]\n'A1.median' = -1.0\n"), "zero or a positive"),
        (format!("{start}[margin]\nmm = 1.0\n"), "\"mm\""),
        (format!("{start}[tolerance]\nmm = nan\n"), "zero or a positive"),
    ] {
        let error = read(&text).unwrap_err().to_string();
        assert!(error.contains(want), "{error} does not say {want}");
    }
}

/// Normal by the sum of twelve uniforms, sd 0.2.
fn noise(key: u64) -> impl Fn(u64) -> f64 {
    move |i| {
        let mut rng = strandbench_rng::Rng::keyed(&[key, i]);
        0.2 * ((0..12).map(|_| rng.f64()).sum::<f64>() - 6.0)
    }
}

#[test]
fn fresh_seeds_pass_within_the_margin_and_a_loss_does_not() {
    let reference = results(0..6, noise(1));
    let same = fresh(std::slice::from_ref(&reference), &[results(100..106, noise(2))], &plan()).unwrap();
    assert!(same[0].passes, "{same:?}");
    let worse = |i: u64| noise(2)(i) + 0.5;
    assert!(
        !fresh(std::slice::from_ref(&reference), &[results(100..106, worse)], &plan()).unwrap()[0].passes
    );
    let better = |i: u64| noise(2)(i) - 3.0;
    assert!(
        fresh(std::slice::from_ref(&reference), &[results(100..106, better)], &plan()).unwrap()[0].passes
    );
    let fails = |now: Results, plan: &Plan| {
        fresh(std::slice::from_ref(&reference), &[now], plan).unwrap_err().to_string()
    };
    assert!(fails(results(100..101, noise(2)), &plan()).contains("1 seeds"));
    assert!(fails(good(), &Plan { margin: BTreeMap::new(), ..plan() }).contains("no margin"));
    let mut absent = results(100..106, noise(2));
    absent.cells.first_entry().unwrap().get_mut().scores.clear();
    assert!(fails(absent, &plan()).contains("no answer"));
    assert!(
        fresh(&[], &[], &plan()).is_err() && fresh(std::slice::from_ref(&reference), &[], &plan()).is_err()
    );
}

#[test]
fn false_alarms_are_as_rare_as_the_interval_says() {
    // Independent normal values: a margin of the interval's width makes a failure rare, a margin of 0 makes it the rule; intervals leave out
    // zero in 5 % (Welch's are close to exact). 400 splits of one pool share it: the tolerance is four standard deviations of
    // 400 draws, 4.4 %, and as much again for the pool's own sample.
    let pool = [results(0..40, noise(3))];
    let found = a_a(&pool, &plan(), [6, 6], 400, 1).unwrap();
    assert!((found.intervals_without_zero - 0.05).abs() < 0.088, "{found:?}");
    assert!(found.alarms <= 20, "{found:?}");
    let none = Plan { margin: BTreeMap::from([("A1.median".to_owned(), 0.0)]), ..plan() };
    assert!(a_a(&pool, &none, [6, 6], 400, 1).unwrap().alarms > 350);
    assert_eq!(a_a(&pool, &plan(), [6, 6], 400, 1).unwrap(), found, "the same seed, the same splits");
    for (sizes, rounds) in [([1, 6], 10), ([6, 35], 10), ([6, 6], 0)] {
        assert!(a_a(&pool, &plan(), sizes, rounds, 1).is_err());
    }
}
