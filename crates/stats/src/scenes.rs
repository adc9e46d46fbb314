//! Cells gathered into independent observations.

use crate::{Options, PairedCell, StatsError, Unit};
use std::collections::BTreeMap;

/// One observation: a scene with its seeds, or a single cell.
pub(crate) struct Scene<'a> {
    pub name: String,
    pub cells: Vec<&'a PairedCell>,
}

/// `b - a`: 0 if neither has a value (both are as bad as can be), else infinite on the side of the worse one.
pub(crate) fn difference(cell: &PairedCell, lower_is_better: bool) -> f64 {
    let worst = if lower_is_better { f64::INFINITY } else { f64::NEG_INFINITY };
    match (cell.a, cell.b) {
        (Some(a), Some(b)) => b - a,
        (None, None) => 0.0,
        (Some(_), None) => worst,
        (None, Some(_)) => -worst,
    }
}

impl Scene<'_> {
    /// Mean over the scene's seeds; infinite if any of them is, undecided (0) if they are so in both directions.
    pub fn difference(&self, lower_is_better: bool) -> f64 {
        let sum: f64 = self.cells.iter().map(|c| difference(c, lower_is_better)).sum();
        if sum.is_nan() { 0.0 } else { sum / self.cells.len() as f64 }
    }
}

/// The observations in order of name and seed, whatever the order of the cells.
pub(crate) fn gather<'a>(cells: &'a [PairedCell], options: &Options) -> Result<Vec<Scene<'a>>, StatsError> {
    if cells.is_empty() {
        return Err(StatsError::Nothing);
    }
    let mut scenes: BTreeMap<(&str, u64), Vec<&PairedCell>> = BTreeMap::new();
    for cell in cells {
        let at = || (cell.scene.clone(), cell.seed);
        for (what, value) in [("the figure of a", cell.a), ("the figure of b", cell.b)] {
            if value.is_some_and(|v| !v.is_finite()) {
                let (scene, seed) = at();
                return Err(StatsError::NotANumber { scene, seed, what });
            }
        }
        if let Some(Err(problem)) = cell.units.as_ref().map(|u| u.check(cell.a, cell.b)) {
            let (scene, seed) = at();
            return Err(StatsError::Units { scene, seed, problem });
        }
        let seed = if options.unit == Unit::Scene { 0 } else { cell.seed };
        scenes.entry((&cell.scene, seed)).or_default().push(cell);
    }
    let mut found = Vec::new();
    for ((name, seed), mut cells) in scenes {
        cells.sort_by_key(|c| c.seed);
        if let Some(w) = cells.windows(2).find(|w| w[0].seed == w[1].seed) {
            return Err(StatsError::Twice { scene: name.to_owned(), seed: w[0].seed });
        }
        let name = if options.unit == Unit::Scene { name.to_owned() } else { format!("{name}, seed {seed}") };
        found.push(Scene { name, cells });
    }
    Ok(found)
}
