//! Pairs of cells by one metric.

use super::Compared;
use crate::SuiteError;
use crate::results::CellResult;
use crate::score::read_places;
use std::path::Path;
use strandbench_stats::{Options, PairedCell, Statistic, StatsError, Units, paired, verdict};

/// Scene and seed, the baseline's cell and the other's.
pub(crate) type Pair<'a> = (&'a (String, u64), &'a CellResult, &'a CellResult);

/// Compares pairs of cells, whose raw errors are `units`, by one metric.
pub(crate) fn by_metric(
    pairs: &[Pair<'_>],
    units: &[Option<Units>],
    metric: &str,
    options: &Options,
    margin: f64,
) -> Result<Compared, String> {
    let known = strandbench_score::metric(metric).map_err(|e| e.to_string())?;
    let cells: Vec<PairedCell> = pairs
        .iter()
        .zip(units)
        .map(|((key, a, b), units)| PairedCell {
            scene: key.0.clone(),
            seed: key.1,
            a: value(a, b, metric),
            b: value(b, a, metric),
            units: (metric == "A1.median").then(|| units.clone()).flatten(),
        })
        .collect();
    let lower_is_better = known.lower_is_better;
    let options = Options { lower_is_better, ..options.clone() };
    let stats = |e: StatsError| format!("{metric}: {e}");
    let difference = paired(&cells, &options).map_err(stats)?;
    let verdict = verdict(&difference, lower_is_better, margin).map_err(stats)?;
    let (metric, unit) = (metric.to_owned(), known.unit.to_owned());
    Ok(Compared { metric, unit, lower_is_better, difference, p_holm: None, margin, verdict })
}

/// A cell's figure. One that failed has the worst: of a share 0 or 1, of a share above chance what 0 gives beside the other cell's
/// null, of any other figure infinity (none).
fn value(cell: &CellResult, other: &CellResult, metric: &str) -> Option<f64> {
    if let Some(score) = cell.score(metric) {
        // Of a signed figure the magnitude counts.
        return score.value.map(|v| if score.lower_is_better { v.abs() } else { v });
    }
    let score = other.score(metric)?;
    if score.unit != "share" {
        return None;
    }
    if !metric.ends_with(".cc") {
        return Some(f64::from(u8::from(score.lower_is_better)));
    }
    // Above chance: (S - chance) / (1 - chance), S = 0. Shares within a tolerance stand in the table as those beyond it.
    let null = |name: &str| other.scores.iter().find(|s| s.subject == "N1" && s.metric == name)?.value;
    let plain = metric.trim_end_matches(".cc");
    let chance = null(plain).or_else(|| null(&plain.replace("within", "over")).map(|over| 1.0 - over))?;
    (chance < 1.0).then(|| -chance / (1.0 - chance))
}

/// Raw A1 errors of both cells of each pair, where both have them for the same pixels.
pub(crate) fn raw_errors(pairs: &[Pair<'_>]) -> Result<Vec<Option<Units>>, SuiteError> {
    let read = |cell: &CellResult| match &cell.score_dir {
        Some(dir) if dir.join(crate::PLACES).is_file() => read_places(dir).map(Some),
        _ => Ok(None),
    };
    let mut all = Vec::new();
    for (key, a, b) in pairs {
        let (Some(of_a), Some(of_b)) = (read(a)?, read(b)?) else {
            all.push(None);
            continue;
        };
        let places = |of: &[(strandbench_score::Place, f32)]| of.iter().map(|p| p.0).collect::<Vec<_>>();
        if places(&of_a) != places(&of_b) {
            let problem = format!(
                "scores other pixels of scene {}, seed {} than its counterpart: the two were rendered differently and make no pair",
                key.0, key.1
            );
            return Err(SuiteError::file(b.score_dir.as_deref().unwrap_or(Path::new("b")), problem));
        }
        all.push(Some(Units {
            clump: of_a.iter().map(|p| p.0.clump).collect(),
            strand: of_a.iter().map(|p| p.0.strand).collect(),
            a: of_a.iter().map(|p| p.1).collect(),
            b: of_b.iter().map(|p| p.1).collect(),
            statistic: Statistic::Percentile(50),
        }));
    }
    Ok(all)
}
