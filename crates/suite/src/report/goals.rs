//! What the project asks of the method, and whether a result reaches it.

use super::tables::format_value;
use maud::{Markup, html};
use strandbench_score::Score;

/// Largest median depth error, mm.
const MEDIAN_MM: f64 = 2.0;
/// Least share of hair pixels within 10 mm.
const WITHIN_10MM: f64 = 0.95;
/// Least share of hair pixels answered.
const ANSWERED: f64 = 0.95;
/// How many times better than the best null the median must be.
const NULL_FACTOR: f64 = 3.0;

/// A goal: what is measured, what is wanted, what was reached.
pub(crate) struct Goal {
    pub what: &'static str,
    pub wanted: String,
    pub got: String,
    pub met: bool,
}

fn find<'a>(scores: &'a [Score], metric: &str) -> Option<&'a Score> {
    scores.iter().find(|s| s.metric == metric && s.subject == "method")
}

/// The null that comes closest to the method in a metric, with its value.
pub(crate) fn best_null<'a>(scores: &'a [Score], metric: &str) -> Option<(&'a str, f64)> {
    let nulls = scores.iter().filter(|s| s.metric == metric && s.subject.starts_with('N'));
    let values = nulls.filter_map(|s| Some((s.subject.as_str(), s.value?, s.lower_is_better)));
    values.reduce(|a, b| if (a.1 <= b.1) == a.2 { a } else { b }).map(|(subject, value, _)| (subject, value))
}

/// The four goals, in the order in which they are told. What was not answered reaches none.
pub(crate) fn goals(scores: &[Score]) -> Vec<Goal> {
    let median = find(scores, "A1.median").and_then(|s| s.value);
    let within = find(scores, "A1.over_10mm").and_then(|s| s.value).map(|v| 1.0 - v);
    let answered = find(scores, "A3.completeness").and_then(|s| s.value);
    let factor = median.zip(best_null(scores, "A1.median")).map(|(own, (_, null))| null / own.max(1e-9));
    vec![
        Goal {
            what: "median depth error",
            wanted: format!("at most {MEDIAN_MM} mm"),
            got: format_value(median, "mm"),
            met: median.is_some_and(|v| v <= MEDIAN_MM),
        },
        Goal {
            what: "hair pixels within 10 mm",
            wanted: format!("at least {:.0} %", WITHIN_10MM * 100.0),
            got: format_value(within, "share"),
            met: within.is_some_and(|v| v >= WITHIN_10MM),
        },
        Goal {
            what: "hair pixels answered",
            wanted: format!("at least {:.0} %", ANSWERED * 100.0),
            got: format_value(answered, "share"),
            met: answered.is_some_and(|v| v >= ANSWERED),
        },
        Goal {
            what: "median, against the best null’s",
            wanted: format!("{NULL_FACTOR} times better"),
            got: factor.map_or("none".into(), |f| format!("{f:.1} times better")),
            met: factor.is_some_and(|f| f >= NULL_FACTOR),
        },
    ]
}

/// "reaches all four goals", or which it misses and by how much.
pub(crate) fn sentence(goals: &[Goal]) -> String {
    let missed: Vec<String> = goals
        .iter()
        .filter(|g| !g.met)
        .map(|g| format!("{} ({}, wanted {})", g.what, g.got, g.wanted))
        .collect();
    match missed.len() {
        0 => format!("It reaches all {} goals.", goals.len()),
        n if n == goals.len() => {
            format!("It reaches none of the {n} goals: it misses {}.", missed.join("; "))
        }
        n => format!(
            "It reaches {} of {} goals and misses {}.",
            goals.len() - n,
            goals.len(),
            missed.join("; ")
        ),
    }
}

/// Metrics in which the method is expected to beat what never looked at an image, and their names.
const AGAINST_NULLS: &[(&str, &str)] = &[
    ("A1.median", "depth (A1)"),
    ("A4.iou.mean", "silhouettes (A4)"),
    ("A5.within_20deg", "lines in space (A5, within 20°)"),
    ("B7.within_20deg", "lines in the image (B7, within 20°)"),
];

/// Where a null does as well as the method or better; empty if nowhere.
pub(crate) fn not_better_than_nulls(scores: &[Score]) -> String {
    let mut names = Vec::new();
    for (metric, name) in AGAINST_NULLS {
        let (Some(own), Some((null, of_null))) = (find(scores, metric), best_null(scores, metric)) else {
            continue;
        };
        let better = own.value.is_some_and(|v| if own.lower_is_better { v < of_null } else { v > of_null });
        if !better {
            let [own, of_null] = [own.value, Some(of_null)].map(|v| format_value(v, &own.unit));
            names.push(format!("{name}: {own}, {null} {of_null}"));
        }
    }
    if names.is_empty() {
        String::new()
    } else {
        format!("A null does as well or better in {}.", names.join("; "))
    }
}

/// The goals as a table.
pub(crate) fn table(goals: &[Goal]) -> Markup {
    html! {
        table.goals {
            tr { th { "goal" } th.n { "wanted" } th.n { "reached" } th {} }
            @for g in goals {
                tr {
                    td { (g.what) } td.n { (g.wanted) } td.n.method { (g.got) }
                    @if g.met { td.met { "✓ met" } } @else { td.missed { "✗ missed" } }
                }
            }
        }
        p.note {
            "The goals are set for the easy and middle straight and wavy scenes with four cameras; elsewhere they are a yardstick. "
            "The first, second and fourth are taken over the true hair mask less 2 px along its edge, the third over the whole mask."
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scores(median: Option<f64>, over: f64, complete: f64, null: f64) -> Vec<Score> {
        let make = |subject: &str, metric: &str, value: Option<f64>, unit: &str| Score {
            subject: subject.into(),
            metric: metric.into(),
            value,
            unit: unit.into(),
            lower_is_better: metric != "A3.completeness",
            coverage: 1.0,
            wanted: 10,
        };
        vec![
            make("method", "A1.median", median, "mm"),
            make("N0", "A1.median", Some(null * 2.0), "mm"),
            make("N2", "A1.median", Some(null), "mm"),
            make("C", "A1.median", Some(0.0), "mm"),
            make("method", "A1.over_10mm", Some(over), "share"),
            make("method", "A3.completeness", Some(complete), "share"),
        ]
    }

    fn met(s: &[Score]) -> Vec<bool> {
        goals(s).iter().map(|g| g.met).collect()
    }

    #[test]
    fn each_goal_is_met_at_its_limit_and_missed_beyond() {
        assert_eq!(met(&scores(Some(2.0), 0.05, 0.95, 6.0)), [true; 4]);
        assert_eq!(met(&scores(Some(2.01), 0.05, 0.95, 7.0)), [false, true, true, true]);
        assert_eq!(met(&scores(Some(1.0), 0.051, 0.95, 3.0)), [true, false, true, true]);
        assert_eq!(met(&scores(Some(1.0), 0.0, 0.94, 3.0)), [true, true, false, true]);
        assert_eq!(met(&scores(Some(1.0), 0.0, 1.0, 2.9)), [true, true, true, false]);
        assert_eq!(met(&[]), [false; 4]);
    }

    #[test]
    fn the_sentence_says_what_is_missed_and_by_how_much() {
        assert_eq!(sentence(&goals(&scores(Some(1.0), 0.0, 1.0, 9.0))), "It reaches all 4 goals.");
        let one = sentence(&goals(&scores(Some(2.97), 0.0, 1.0, 81.0)));
        assert_eq!(
            one,
            "It reaches 3 of 4 goals and misses median depth error (2.97 mm, wanted at most 2 mm)."
        );
        assert!(
            sentence(&goals(&scores(None, 1.0, 0.0, 81.0))).starts_with("It reaches none of the 4 goals")
        );
    }

    #[test]
    fn a_null_that_does_as_well_is_named() {
        assert_eq!(not_better_than_nulls(&scores(Some(1.0), 0.0, 1.0, 9.0)), "");
        let none = not_better_than_nulls(&scores(None, 0.0, 1.0, 9.0));
        assert_eq!(none, "A null does as well or better in depth (A1): none, N2 9.00 mm.");
        assert!(not_better_than_nulls(&scores(Some(9.0), 0.0, 1.0, 9.0)).contains("depth"));
    }
}
