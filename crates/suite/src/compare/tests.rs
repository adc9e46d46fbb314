//! Comparisons of made-up results with a known outcome.

use super::*;
use strandbench_score::Score;
use strandbench_types::Silent;

fn score(subject: &str, metric: &str, value: impl Into<Option<f64>>) -> Score {
    let known = strandbench_score::metric(metric).unwrap();
    Score {
        subject: subject.to_owned(),
        metric: metric.to_owned(),
        value: value.into(),
        unit: known.unit.to_owned(),
        lower_is_better: known.lower_is_better,
        coverage: 1.0,
        wanted: 100,
    }
}

fn scored(scores: Vec<Score>) -> CellResult {
    CellResult { trouble: None, scores, score_dir: None }
}

fn failed() -> CellResult {
    CellResult {
        trouble: Some("failed in reconstruct: it fell over".to_owned()),
        scores: Vec::new(),
        score_dir: None,
    }
}

fn results(variant: &str, cells: Vec<CellResult>) -> Results {
    let cells = cells.into_iter().zip(0..).map(|(c, i)| ((format!("scene-{i}"), 1), c)).collect();
    Results { variant: variant.to_owned(), source: "made-up".into(), protocol: "v3 0".to_owned(), cells }
}

fn medians(variant: &str, values: &[f64]) -> Results {
    results(variant, values.iter().map(|&v| scored(vec![score("method", "A1.median", v)])).collect())
}

fn ask(a: &Results, b: &Results) -> Comparison {
    compare(a, b, &Question::default(), &Silent).unwrap()
}

fn refusal(a: &Results, b: &Results, question: &Question) -> String {
    compare(a, b, question, &Silent).unwrap_err().to_string()
}

#[test]
fn worse_everywhere_fails_the_rule_and_better_everywhere_does_not() {
    let a = medians("a", &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
    let b = medians("b", &[1.5, 2.6, 3.4, 4.7, 5.5, 6.6, 7.4]);
    let worse = ask(&a, &b);
    assert_eq!((worse.scenes, worse.cells, worse.smallest_p), (7, 7, 1.0 / 64.0));
    assert_eq!((worse.primary[0].p_holm, worse.primary[0].verdict), (Some(1.0 / 64.0), Verdict::Worse));
    assert_eq!(worse.faults(FailIf::Worse).len(), 1);
    assert_eq!(worse.faults(FailIf::Different).len(), 1);
    assert_eq!(worse.faults(FailIf::Inferior).len(), 1);
    assert!(worse.faults(FailIf::Never).is_empty());
    let better = ask(&b, &a);
    assert!(better.faults(FailIf::Worse).is_empty() && better.faults(FailIf::Inferior).is_empty());
    assert_eq!(better.faults(FailIf::Different).len(), 1);
    let margin = Question { margins: [("A1.median".to_owned(), 1.0)].into(), ..Question::default() };
    let within = compare(&a, &b, &margin, &Silent).unwrap();
    assert_eq!(within.primary[0].verdict, Verdict::Equivalent);
    assert!(within.faults(FailIf::Inferior).is_empty());
}

#[test]
fn a_metric_where_higher_is_better_wins_the_other_way() {
    let of =
        |v: &[f64]| results("x", v.iter().map(|&v| scored(vec![score("method", "B3.idf1", v)])).collect());
    let c = ask(&of(&[0.5, 0.6, 0.7, 0.5, 0.4, 0.5]), &of(&[0.4, 0.5, 0.65, 0.44, 0.2, 0.4]));
    assert_eq!((c.primary[0].verdict, c.primary[0].difference.won), (Verdict::Worse, 0.0));
    assert_eq!(c.faults(FailIf::Worse).len(), 1);
}

#[test]
fn failed_cells_are_the_worst_answer() {
    let good = |f: f64| {
        let figures = [("A1.median", 1.0), ("A1.over_2mm", 0.25), ("B1.f_2mm", 0.5), ("B1.f_2mm.cc", f)];
        let null = [("A1.over_2mm", 0.9), ("B1.f_2mm", 0.2)];
        let of = figures.map(|(m, v)| score("method", m, v)).into_iter();
        scored(of.chain(null.map(|(m, v)| score("N1", m, v))).collect())
    };
    let a = results("a", vec![good(0.375), good(0.375), good(0.375)]);
    let b = results("b", vec![good(0.375), failed(), good(0.375)]);
    let c = ask(&a, &b);
    let of = |m: &str| c.primary.iter().chain(&c.exploratory).find(|x| x.metric == m).unwrap();
    // Millimetres have no worst value, shares do: beyond 2 mm lies everything (1 - 0.25), F is 0, and above chance
    // (0 - 0.2) / (1 - 0.2) = -0.25.
    let median = of("A1.median");
    assert_eq!(
        (median.difference.mean, median.difference.won, median.difference.tied),
        (None, 0.0, 2.0 / 3.0)
    );
    let worst = |m: &str| of(m).difference.worst.difference.unwrap();
    assert!((worst("A1.over_2mm") - 0.75).abs() < 1e-12, "{}", worst("A1.over_2mm"));
    assert!((worst("B1.f_2mm") + 0.5).abs() < 1e-12 && (worst("B1.f_2mm.cc") + 0.625).abs() < 1e-12);
    assert_eq!(c.b.failed, ["scene-1, seed 1: failed in reconstruct: it fell over"]);
    // Whatever p says of three scenes, a cell that only b failed on fails the comparison.
    assert_eq!(c.faults(FailIf::Worse), ["b failed on scene-1, seed 1: failed in reconstruct: it fell over"]);
    assert!(ask(&b, &a).faults(FailIf::Worse).is_empty());
    assert_eq!(ask(&b, &a).faults(FailIf::Different).len(), 1);
    assert!(ask(&b, &b).faults(FailIf::Different).is_empty(), "both failed on it: a tie");
    let none = results("none", vec![failed(), failed(), failed()]);
    let c = ask(&a, &none);
    assert!(c.one_sided.is_empty(), "a method that answers nothing still claims what the other has");
    assert_eq!(c.primary[0].difference.won, 0.0);
    assert!(refusal(&none, &none, &Question::default()).contains("no primary metric"));
    let unscored = Results { protocol: String::new(), ..none };
    assert!(refusal(&unscored, &unscored, &Question::default()).contains("nothing to compare"));
}

#[test]
fn sets_protocols_and_margins_that_do_not_fit_are_refused() {
    let (three, two) = (medians("three", &[1.0, 2.0, 3.0]), medians("two", &[1.0, 2.5]));
    let error = refusal(&three, &two, &Question::default());
    assert!(error.contains("scene-2, seed 1 (only three") && error.contains("--allow-unequal"), "{error}");
    let allowed = Question { allow_unequal: true, ..Question::default() };
    let c = compare(&three, &two, &allowed, &Silent).unwrap();
    assert_eq!((c.cells, c.left_out.len()), (2, 1));
    assert!(table(&c).contains("Left out") && markdown(&c).contains("scene-2, seed 1"));
    let other = Results { protocol: "v2 9".to_owned(), ..three.clone() };
    assert!(refusal(&three, &other, &Question::default()).contains("different protocols"));
    let elsewhere =
        Results { cells: two.cells.iter().map(|(k, v)| ((k.0.clone(), 7), v.clone())).collect(), ..two };
    assert!(refusal(&three, &elsewhere, &allowed).contains("no scene and seed in common"));
    let stray = Question { margins: [("A1.p90".to_owned(), 1.0)].into(), ..Question::default() };
    assert!(refusal(&three, &three, &stray).contains("A1.p90"));
    let strands = results("s", vec![scored(vec![score("method", "A1.p90", 3.0)])]);
    let same = results("t", vec![scored(vec![score("method", "A1.p90", 3.0)])]);
    assert!(refusal(&strands, &same, &Question::default()).contains("no primary metric"));
}

#[test]
fn what_one_side_does_not_claim_is_named_and_not_compared() {
    let a = medians("a", &[1.0, 2.0]);
    let both = |v: f64| scored(vec![score("method", "A1.median", v), score("method", "B3.idf1", 0.3)]);
    let b = results("b", vec![both(1.0), both(2.0)]);
    let c = ask(&a, &b);
    assert_eq!((c.primary.len(), c.one_sided.as_slice()), (1, &["B3.idf1".to_owned()][..]));
    assert!(table(&c).contains("B3.idf1"));
}

#[test]
fn holm_corrects_for_the_primary_metrics_and_no_others() {
    let cell = |v: f64| {
        let all = [("A1.median", v), ("B3.idf1", 0.5), ("A1.p90", v), ("A1.p95", v)];
        scored(all.map(|(m, v)| score("method", m, v)).to_vec())
    };
    let of = |v: [f64; 6]| results("x", v.map(cell).to_vec());
    let c = ask(&of([1.0; 6]), &of([2.0, 3.0, 2.5, 2.1, 2.2, 4.0]));
    assert_eq!((c.primary.len(), c.exploratory.len()), (2, 2));
    assert_eq!((c.primary[0].difference.p, c.primary[0].p_holm), (1.0 / 32.0, Some(1.0 / 16.0)));
    assert!(c.exploratory.iter().all(|m| m.p_holm.is_none()));
    assert!(c.faults(FailIf::Worse).is_empty(), "1/16 is no difference at 5 %");
}
