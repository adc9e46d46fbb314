//! Settings with names: what is compared, which cameras are looked at, how the energy is minimised.

use crate::ReconError;
use serde::Serialize;

/// What is compared between views.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum MatchCost {
    /// Correlation of orientation fields (Eq. 6).
    Orientation,
    /// Negative normalised cross-correlation of image windows (section 6, Fig. 12).
    Ncc,
}

/// Which cameras the method may look at; camera 0, the reference, always belongs to them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Views {
    /// Every camera of the rig.
    All,
    /// Cameras 0 and 1 (Fig. 15).
    Two,
    /// Camera c takes part if bit c is set.
    Subset(u32),
}

impl Views {
    /// Cameras of a rig of `cameras` that are compared with the reference, in rig order.
    pub(crate) fn others(self, cameras: usize) -> Result<Vec<usize>, ReconError> {
        let others: Vec<usize> = match self {
            Views::All => (1..cameras).collect(),
            Views::Two => (1..cameras.min(2)).collect(),
            Views::Subset(bits) => {
                let last = 31 - bits.leading_zeros().min(31) as usize;
                if bits & 1 == 0 || last >= cameras {
                    return Err(ReconError::Views { views: self.text(), cameras });
                }
                (1..cameras.min(32)).filter(|&c| bits >> c & 1 == 1).collect()
            }
        };
        if others.is_empty() {
            return Err(ReconError::Views { views: self.text(), cameras });
        }
        Ok(others)
    }

    pub(super) fn parse(text: &str) -> Option<Views> {
        match text {
            "all" => Some(Views::All),
            "two" => Some(Views::Two),
            list => {
                let mut bits = 0u32;
                for c in list.split(',') {
                    bits |= 1u32.checked_shl(c.trim().parse().ok()?)?;
                }
                Some(Views::Subset(bits))
            }
        }
    }

    /// `all`, `two`, or camera indices with commas between.
    pub fn text(self) -> String {
        match self {
            Views::All => "all".into(),
            Views::Two => "two".into(),
            Views::Subset(bits) => {
                let list: Vec<String> =
                    (0..32).filter(|c| bits >> c & 1 == 1).map(|c: u32| c.to_string()).collect();
                list.join(",")
            }
        }
    }
}

/// How the energy of Eq. 2 is minimised.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Minimiser {
    /// Message passing from coarse grids to fine ones, finished by local moves.
    CoarseToFine,
    /// Sequential tree-reweighted message passing on the full grid.
    Trws,
    /// Alpha-expansion by graph cuts (Boykov et al. 2001), the paper's.
    Expansion,
    /// The cheapest label of each pixel; no smoothness.
    WinnerTakesAll,
}

impl Minimiser {
    pub(super) const ALL: [(&'static str, Minimiser); 4] = [
        ("coarse-to-fine", Minimiser::CoarseToFine),
        ("trws", Minimiser::Trws),
        ("expansion", Minimiser::Expansion),
        ("winner-takes-all", Minimiser::WinnerTakesAll),
    ];

    /// Name in tables and on the command line.
    pub fn text(self) -> &'static str {
        Minimiser::ALL.iter().find(|(_, m)| *m == self).map_or("", |(name, _)| name)
    }
}
