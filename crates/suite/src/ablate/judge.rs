//! Whether a claim holds: paired differences, their intervals, and what may be said.

use super::{Ablation, ArmRow};
use crate::SuiteError;
use crate::compare::text::{estimate, p_text, signed};
use crate::compare::{Compared, Pair, by_metric, raw_errors};
use crate::results::CellResult;
use serde::Serialize;
use std::path::Path;
use strandbench_stats::{Options, Unit, Verdict, holm};

/// The paper's arm against another by one metric.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// The other arm.
    pub against: String,
    /// Whether the claim is judged on it; all else is exploration.
    pub primary: bool,
    /// Whether each arm has its tuned weight, or the variant's own.
    pub tuned: bool,
    /// Whether all cells are of one scene: what is said is said of it alone, and what counts as a scene is a seed.
    pub of_seeds: bool,
    /// The paper's arm less the other; p is corrected over the primary comparisons.
    #[serde(flatten)]
    pub compared: Compared,
}

impl Comparison {
    /// What the interval says about the paper's claim: it is reproduced if the interval excludes zero in the
    /// paper's direction, contradicted if in the other.
    pub fn claim(&self) -> &'static str {
        match self.compared.verdict {
            Verdict::Better => "Reproduced",
            Verdict::Worse => "Contradicted",
            _ => "Not decided",
        }
    }
}

/// Every other arm against the paper's, by every metric, with tuned weights and with the variants' own.
///
/// # Errors
/// If raw errors cannot be read, or a comparison cannot be made: a figure that is not a number.
pub(super) fn compare(
    ablation: &Ablation,
    tunes: bool,
    rows: &[ArmRow],
) -> Result<Vec<Comparison>, SuiteError> {
    let mut all = Vec::new();
    let settings: &[bool] = if tunes { &[true, false] } else { &[false] };
    for &tuned in settings {
        let of = |arm: &str| -> Vec<((String, u64), CellResult)> {
            let own = rows.iter().filter(|r| r.arm == arm && r.tuned == tuned);
            own.map(|r| ((r.scene_name.clone(), r.row.seed), CellResult::from(&r.row))).collect()
        };
        let with = of(ablation.with.label);
        for arm in ablation.without {
            let without = of(arm.label);
            let pairs: Vec<Pair<'_>> =
                without.iter().zip(&with).map(|((key, a), (_, b))| (key, a, b)).collect();
            let units = raw_errors(&pairs)?;
            // Seeds of the only scene are observations of their own: of that scene alone something can be said.
            let of_seeds = pairs.iter().all(|(key, ..)| key.0 == pairs[0].0.0);
            let unit = if of_seeds { Unit::SceneSeed } else { Unit::Scene };
            let options = Options { unit, ..Options::default() };
            // What a sequence is too short for is left out.
            let told = |id: &&&str| pairs.iter().any(|(_, a, b)| a.score(id).or(b.score(id)).is_some());
            let others = ablation.others.iter().filter(told);
            for &id in std::iter::once(&ablation.primary).chain(others) {
                let compared = by_metric(&pairs, &units, id, &options, 0.0).map_err(|e| {
                    SuiteError::file(Path::new("ablation"), format!("comparing with {}: {e}", arm.label))
                })?;
                let primary = id == ablation.primary && tuned == tunes;
                all.push(Comparison { against: arm.label.to_owned(), primary, tuned, of_seeds, compared });
            }
        }
    }
    let judged: Vec<usize> = (0..all.len()).filter(|&i| all[i].primary).collect();
    let p: Vec<f64> = judged.iter().map(|&i| all[i].compared.difference.p).collect();
    for (i, p) in judged.into_iter().zip(holm(&p)) {
        all[i].compared.p_holm = Some(p);
    }
    Ok(all)
}

/// A sentence an arm: reproduced or not, by how much, and where not.
pub(super) fn sentences(ablation: &Ablation, comparisons: &[Comparison]) -> Vec<String> {
    comparisons.iter().filter(|c| c.primary).map(|c| sentence(ablation, c)).collect()
}

fn sentence(ablation: &Ablation, c: &Comparison) -> String {
    let (m, d) = (&c.compared, &c.compared.difference);
    let (mean, interval) = estimate(m);
    let lost: Vec<String> = d
        .by_scene
        .iter()
        .filter(|s| s.difference.is_none_or(|v| if m.lower_is_better { v > 0.0 } else { v < 0.0 }))
        .map(|s| match s.difference {
            Some(v) => format!("{} ({})", s.scene, signed(v, &m.unit)),
            None => format!("{} (one side has no answer)", s.scene),
        })
        .collect();
    let scenes = if c.of_seeds { "seeds of one scene" } else { "scenes" };
    let not = if lost.is_empty() { String::new() } else { format!(", not on {}", lost.join(", ")) };
    format!(
        "{}: {} less {} is {mean} in {} (95 % interval {interval}), over {} {scenes} and {} cells; better on {:.0} % of \
         them{not}. p {}, {} with Holm's correction.",
        c.claim(),
        ablation.with.label,
        c.against,
        m.metric,
        d.scenes,
        d.cells,
        d.won * 100.0,
        p_text(d.p),
        p_text(m.p_holm.unwrap_or(d.p))
    )
}

#[cfg(test)]
mod tests {
    use super::super::table::ABLATIONS;
    use super::*;
    use crate::cell::{Outcome, Row};
    use std::collections::BTreeMap;
    use strandbench_score::Score;

    fn row(arm: &str, scene: &str, value: Option<f64>) -> ArmRow {
        let scores = ["A1.median", "A1.p90", "A1.over_10mm", "A5.median"]
            .map(|metric| Score {
                subject: "method".into(),
                metric: metric.into(),
                value,
                unit: "mm".into(),
                lower_is_better: true,
                coverage: 1.0,
                wanted: 1,
            })
            .to_vec();
        let row = Row {
            scene: scene.into(),
            variant: arm.into(),
            seed: 1,
            outcome: Outcome::Ok,
            protocol: "p".into(),
            scores,
            costs: BTreeMap::new(),
            reused: Vec::new(),
            report: None,
            score_dir: None,
        };
        ArmRow { arm: arm.into(), tuned: true, condition: "as it is".into(), scene_name: scene.into(), row }
    }

    fn judged(with: [f64; 6], without: [Option<f64>; 6]) -> Comparison {
        let metric = ABLATIONS.iter().find(|a| a.name == "metric").unwrap();
        let mut rows = Vec::new();
        for (i, (w, o)) in with.into_iter().zip(without).enumerate() {
            for tuned in [true, false] {
                for (arm, v) in [("orientation", Some(w)), ("NCC", o)] {
                    rows.push(ArmRow { tuned, ..row(arm, &format!("scene {i}"), v) });
                }
            }
        }
        let all = compare(metric, true, &rows).unwrap();
        assert_eq!(all.len(), 8);
        assert_eq!(all.iter().filter(|c| c.primary).count(), 1);
        let said = sentences(metric, &all);
        assert_eq!(said.len(), 1);
        assert!(said[0].starts_with(&format!("{}: orientation less NCC is ", all[0].claim())), "{}", said[0]);
        all.into_iter().next().unwrap()
    }

    #[test]
    fn seeds_of_the_only_scene_speak_of_it_alone() {
        let metric = ABLATIONS.iter().find(|a| a.name == "metric").unwrap();
        let mut rows = Vec::new();
        for (seed, less) in (1..).zip([0.5, 0.6, 0.4, 0.5, 0.7, 0.55]) {
            for (arm, v) in [("orientation", 2.0), ("NCC", 2.0 + less)] {
                let mut r = ArmRow { tuned: false, ..row(arm, "the only one", Some(v)) };
                r.row.seed = seed;
                rows.push(r);
            }
        }
        let all = compare(metric, false, &rows).unwrap();
        let d = &all[0].compared.difference;
        assert!(all[0].of_seeds && d.interval.is_some_and(|[_, high]| high < 0.0), "{d:?}");
        let said = sentences(metric, &all).remove(0);
        assert!(said.starts_with("Reproduced") && said.contains("over 6 seeds of one scene"), "{said}");
    }

    #[test]
    fn a_claim_is_reproduced_contradicted_or_left_open() {
        let base = [2.0, 3.0, 4.0, 5.0, 6.0, 7.0];
        let plus = |by: [f64; 6]| std::array::from_fn(|i| Some(base[i] + by[i]));
        let c = judged(base, plus([0.5, 0.6, 0.4, 0.5, 0.7, 0.55]));
        assert_eq!(c.claim(), "Reproduced");
        assert!(
            (c.compared.difference.mean.unwrap() + 3.25 / 6.0).abs() < 1e-12,
            "the paper's arm less the other"
        );
        assert_eq!(judged(base, plus([-0.5, -0.6, -0.4, -0.5, -0.7, -0.55])).claim(), "Contradicted");
        assert_eq!(judged(base, plus([0.5, -0.6, 0.4, -0.5, 0.7, -0.55])).claim(), "Not decided");
        let mut failed = plus([0.5; 6]);
        failed[3] = None;
        let c = judged(base, failed);
        assert_eq!(
            (c.claim(), c.compared.difference.won),
            ("Not decided", 1.0),
            "a failure is lost, not left out"
        );
    }
}
