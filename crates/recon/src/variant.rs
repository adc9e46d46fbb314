//! The method's settings as values: each row of the table states only how it differs.

mod choices;

use crate::{Parameters, ReconError, StrandParameters, TemporalParameters};
pub use choices::{MatchCost, Minimiser, Views};
use serde::Serialize;

/// A named setting of the method; a row of [`VARIANTS`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Variant {
    /// Name on the command line and in reports.
    pub name: &'static str,
    /// The question that this row answers.
    pub asks: &'static str,
    /// What is compared.
    pub cost: MatchCost,
    /// Which cameras are used.
    pub views: Views,
    /// How the energy is minimised.
    pub minimiser: Minimiser,
    /// All numbers of a frame's envelope.
    pub parameters: Parameters,
    /// How frames of a sequence are brought together.
    pub temporal: TemporalParameters,
    /// How strands are grown; `None` for envelopes alone.
    pub strands: Option<StrandParameters>,
}

/// Luo et al. as published, minimised by the better of the minimisers at hand.
pub const LUO: Variant = Variant {
    name: "luo",
    asks: "how close does the paper's method come?",
    cost: MatchCost::Orientation,
    views: Views::All,
    minimiser: Minimiser::CoarseToFine,
    parameters: Parameters::LUO,
    temporal: TemporalParameters::LUO,
    strands: None,
};

const P: Parameters = Parameters::LUO;

/// Every setting that the harness runs and tests.
pub const VARIANTS: &[Variant] = &[
    LUO,
    Variant {
        name: "luo-ncc",
        asks: "does orientation beat NCC? (Fig. 12)",
        cost: MatchCost::Ncc,
        parameters: Parameters { lambda: 0.01, absent_cost: 0.5, ..P },
        ..LUO
    },
    Variant { name: "luo-2cam", asks: "what do cameras 3 and 4 buy? (Fig. 15)", views: Views::Two, ..LUO },
    Variant {
        name: "luo-row",
        asks: "what does the camera out of the row buy? (4.1)",
        views: Views::Subset(0b0111),
        ..LUO
    },
    Variant {
        name: "luo-no-aggregation",
        asks: "what does aggregation buy? (Fig. 12)",
        parameters: Parameters { aggregate: false, ..P },
        ..LUO
    },
    Variant {
        name: "luo-no-refinement",
        asks: "the depth map as the minimiser leaves it (Fig. 6a)",
        parameters: Parameters { refine: false, filter: false, ..P },
        ..LUO
    },
    Variant {
        name: "luo-no-filter",
        asks: "sub-pixel refinement without the depth filter (Fig. 6b)",
        parameters: Parameters { filter: false, ..P },
        ..LUO
    },
    Variant {
        name: "luo-1level",
        asks: "what do the coarse levels buy? (4.3)",
        parameters: Parameters { levels: 1, ..P },
        ..LUO
    },
    Variant {
        name: "luo-gamma1",
        asks: "what does the gamma correction buy? (4.3)",
        parameters: Parameters { gamma: 1.0, ..P },
        ..LUO
    },
    Variant {
        name: "luo-trws",
        asks: "how far is the fast minimiser from a converged one?",
        minimiser: Minimiser::Trws,
        ..LUO
    },
    Variant {
        name: "luo-expansion",
        asks: "the paper's minimiser (graph cuts, 4.4)",
        minimiser: Minimiser::Expansion,
        ..LUO
    },
    Variant {
        name: "luo-no-smoothness",
        asks: "what does the smoothness term buy? (Eq. 3)",
        minimiser: Minimiser::WinnerTakesAll,
        ..LUO
    },
    Variant {
        name: "luo-no-denoise",
        asks: "what does temporal de-noising buy? (Fig. 8; sequences)",
        temporal: TemporalParameters { denoise: false, ..TemporalParameters::LUO },
        ..LUO
    },
    Variant {
        name: "luo-strands",
        asks: "how well do the strands of section 5 follow the hair?",
        strands: Some(StrandParameters::LUO),
        ..LUO
    },
];

impl Variant {
    /// The row of that name.
    ///
    /// # Errors
    /// If there is none; the error lists the names.
    pub fn named(name: &str) -> Result<Variant, ReconError> {
        VARIANTS.iter().find(|v| v.name == name).copied().ok_or_else(|| ReconError::UnknownVariant {
            name: name.to_owned(),
            known: VARIANTS.iter().map(|v| v.name).collect::<Vec<_>>().join(", "),
        })
    }

    /// This row with one value replaced: a parameter by its name, or `cost` (orientation, ncc), `views` (all,
    /// two, or indices such as 0,1,3), `minimiser` (coarse-to-fine, trws, expansion, winner-takes-all), `strands`
    /// (off, on). A parameter of the strands turns them on.
    ///
    /// # Errors
    /// If the key is unknown (the error lists the keys) or the value does not fit.
    pub fn with(mut self, key: &str, value: &str) -> Result<Variant, ReconError> {
        let wrong = |wanted: &str| ReconError::Parameter {
            key: key.to_owned(),
            value: value.to_owned(),
            wanted: wanted.to_owned(),
        };
        match key {
            "cost" => {
                self.cost = match value {
                    "orientation" => MatchCost::Orientation,
                    "ncc" => MatchCost::Ncc,
                    _ => return Err(wrong("orientation or ncc")),
                }
            }
            "views" => {
                self.views =
                    Views::parse(value).ok_or_else(|| wrong("all, two, or camera indices such as 0,1,3"))?;
            }
            "minimiser" => {
                self.minimiser = Minimiser::ALL
                    .iter()
                    .find(|(name, _)| *name == value)
                    .map(|(_, m)| *m)
                    .ok_or_else(|| wrong("coarse-to-fine, trws, expansion or winner-takes-all"))?;
            }
            "strands" => {
                self.strands = match value {
                    "off" => None,
                    "on" => Some(self.strands.unwrap_or(StrandParameters::LUO)),
                    _ => return Err(wrong("off or on")),
                }
            }
            _ => {
                let mut strands = self.strands.unwrap_or(StrandParameters::LUO);
                let own = self.parameters.set(key, value).or_else(|| self.temporal.set(key, value));
                let result = own.or_else(|| {
                    let result = strands.set(key, value)?;
                    self.strands = Some(strands);
                    Some(result)
                });
                match result {
                    Some(Ok(())) => {}
                    Some(Err(wanted)) => return Err(wrong(wanted)),
                    None => {
                        return Err(ReconError::UnknownKey {
                            key: key.to_owned(),
                            known: Variant::keys().join(", "),
                        });
                    }
                }
            }
        }
        self.validate()?;
        Ok(self)
    }

    /// Keys that [`Variant::with`] takes.
    pub fn keys() -> Vec<&'static str> {
        let blocks = [Parameters::KEYS, TemporalParameters::KEYS, StrandParameters::KEYS].concat();
        ["cost", "views", "minimiser", "strands"].into_iter().chain(blocks).collect()
    }

    /// Every choice and parameter as text, by name; those of the strands last, and only if they are grown.
    pub fn entries(&self) -> Vec<(&'static str, String)> {
        let cost = match self.cost {
            MatchCost::Orientation => "orientation",
            MatchCost::Ncc => "ncc",
        };
        let mut all = vec![
            ("cost", cost.to_owned()),
            ("views", self.views.text()),
            ("minimiser", self.minimiser.text().to_owned()),
        ];
        all.extend(self.parameters.entries());
        all.extend(self.temporal.entries());
        all.push(("strands", if self.strands.is_some() { "on" } else { "off" }.to_owned()));
        all.extend(self.strands.iter().flat_map(StrandParameters::entries));
        all
    }

    /// Checks every parameter's range.
    ///
    /// # Errors
    /// The first parameter out of range, and what is wanted.
    pub fn validate(&self) -> Result<(), ReconError> {
        let strands = self.strands.as_ref().and_then(StrandParameters::fault);
        if let Some((key, value, wanted)) = self.parameters.fault().or(self.temporal.fault()).or(strands) {
            return Err(ReconError::Parameter { key: key.into(), value, wanted: wanted.into() });
        }
        let excess = self.strands.as_ref().and_then(StrandParameters::excess);
        if let Some((key, value, wanted)) = self.temporal.disagreement().or(excess) {
            return Err(ReconError::Parameter { key: key.into(), value, wanted });
        }
        let p = &self.parameters;
        if p.sigma_px >= p.sigma_wide_px {
            return Err(ReconError::Parameter {
                key: "sigma_px".into(),
                value: p.sigma_px.to_string(),
                wanted: format!("a value below sigma_wide_px = {}", p.sigma_wide_px),
            });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
