//! Which ablations there are: a row each.

use crate::SuiteError;

/// One side of a comparison: a row of the variants table with values replaced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Arm {
    /// Name in tables and captions.
    pub label: &'static str,
    /// Row of the variants table.
    pub variant: &'static str,
    /// Values replaced in it.
    pub changes: &'static [(&'static str, &'static str)],
}

const fn arm(label: &'static str, variant: &'static str) -> Arm {
    Arm { label, variant, changes: &[] }
}

const fn cameras(label: &'static str, views: &'static [(&'static str, &'static str)]) -> Arm {
    Arm { label, variant: "luo", changes: views }
}

/// A question that the paper answers with pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ablation {
    /// Name on the command line.
    pub name: &'static str,
    /// Where the paper answers it.
    pub source: &'static str,
    /// What the paper says, in our words.
    pub claim: &'static str,
    /// What the paper argues for.
    pub with: Arm,
    /// What it argues against, or leaves out.
    pub without: &'static [Arm],
    /// The metric on which the claim is judged.
    pub primary: &'static str,
    /// Other metrics, for exploration.
    pub others: &'static [&'static str],
    /// Whether it takes frames of moving hair.
    pub moving: bool,
    /// Whether each arm gets a weight of smoothness of its own.
    pub tuned: bool,
}

const STILL: Ablation = Ablation {
    name: "",
    source: "",
    claim: "",
    with: arm("the paper's", "luo"),
    without: &[],
    primary: "A1.median",
    others: &["A1.p90", "A1.over_10mm", "A5.median"],
    moving: false,
    tuned: true,
};

/// Every ablation.
pub const ABLATIONS: &[Ablation] = &[
    Ablation {
        name: "cameras",
        source: "Luo et al., Fig. 15",
        claim: "four cameras reconstruct better than two",
        with: cameras("4 cameras", &[("views", "0,1,2,3")]),
        without: &[
            cameras("cameras 0, 1", &[("views", "0,1")]),
            cameras("cameras 0, 2", &[("views", "0,2")]),
            cameras("cameras 0, 3", &[("views", "0,3")]),
            cameras("cameras 0, 1, 2", &[("views", "0,1,2")]),
            cameras("cameras 0, 1, 3", &[("views", "0,1,3")]),
            cameras("cameras 0, 2, 3", &[("views", "0,2,3")]),
        ],
        ..STILL
    },
    Ablation {
        name: "metric",
        source: "Luo et al., Fig. 12, left",
        claim: "matching orientation fields resolves hair better than correlating grey values",
        with: arm("orientation", "luo"),
        without: &[arm("NCC", "luo-ncc")],
        ..STILL
    },
    Ablation {
        name: "aggregation",
        source: "Luo et al., Fig. 12, centre",
        claim: "without bilateral aggregation of the data term noise is more evident",
        with: arm("aggregated", "luo"),
        without: &[arm("not aggregated", "luo-no-aggregation")],
        ..STILL
    },
    Ablation {
        name: "refinement",
        source: "Luo et al., Fig. 6",
        claim: "sub-pixel refinement removes steps, the bilateral filter after it helps modestly",
        with: arm("sub-pixel and filter", "luo"),
        without: &[arm("none", "luo-no-refinement"), arm("sub-pixel alone", "luo-no-filter")],
        ..STILL
    },
    Ablation {
        name: "levels",
        source: "Luo et al., section 4.3",
        claim: "coarser levels of the orientation pyramid help where fine orientation is unreliable",
        with: arm("2 levels", "luo"),
        without: &[
            Arm { label: "1 level", variant: "luo", changes: &[("levels", "1")] },
            Arm { label: "3 levels", variant: "luo", changes: &[("levels", "3")] },
            Arm { label: "4 levels", variant: "luo", changes: &[("levels", "4")] },
        ],
        ..STILL
    },
    Ablation {
        name: "gamma",
        source: "Luo et al., section 4.3",
        claim: "a gamma of 0.5 on the filter's response lets weak orientation count",
        with: arm("gamma 0.5", "luo"),
        without: &[arm("gamma 1", "luo-gamma1")],
        ..STILL
    },
    Ablation {
        name: "denoise",
        source: "Luo et al., Fig. 8",
        claim: "averaging depth over neighbouring frames reduces noise and keeps features",
        with: arm("de-noised", "luo"),
        without: &[arm("frame by frame", "luo-no-denoise")],
        primary: "C3.flicker.p50",
        others: &[
            "C3.flicker.p95",
            "A1.median",
            "A1.p90",
            "C5.depth.lag_2hz",
            "C5.depth.log2_gain_2hz",
            "C5.depth.lag_4hz",
            "C5.depth.log2_gain_4hz",
        ],
        moving: true,
        // It works on finished depth maps: a weight of the energy has no part in it.
        tuned: false,
    },
];

impl Ablation {
    /// The row of that name.
    ///
    /// # Errors
    /// If there is none; the error lists the names.
    pub fn named(name: &str) -> Result<&'static Ablation, SuiteError> {
        ABLATIONS.iter().find(|a| a.name == name).ok_or_else(|| {
            let names: Vec<&str> = ABLATIONS.iter().map(|a| a.name).collect();
            SuiteError::Variant(format!("no ablation {name:?}; there are {}", names.join(", ")))
        })
    }

    /// Both sides, the paper's first.
    pub fn arms(&self) -> impl Iterator<Item = &Arm> {
        std::iter::once(&self.with).chain(self.without)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use strandbench_recon::Variant;

    #[test]
    fn every_arm_is_a_variant_and_no_two_are_the_same() {
        for (i, a) in ABLATIONS.iter().enumerate() {
            assert_eq!(Ablation::named(a.name).unwrap(), a);
            assert!(ABLATIONS[..i].iter().all(|b| b.name != a.name));
            let mut seen: Vec<Vec<(&str, String)>> = Vec::new();
            for arm in a.arms() {
                let base = Variant::named(arm.variant).unwrap();
                let v = arm.changes.iter().fold(base, |v, (key, value)| v.with(key, value).unwrap());
                assert!(!seen.contains(&v.entries()), "{}: {} is another arm again", a.name, arm.label);
                seen.push(v.entries());
            }
            let known = |m: &str| {
                strandbench_score::METRICS
                    .iter()
                    .chain(strandbench_score::motion_metrics())
                    .any(|k| k.id == m)
            };
            for metric in a.others.iter().chain([&a.primary]) {
                assert!(known(metric), "{}: {metric}", a.name);
            }
        }
        assert!(Ablation::named("camera").unwrap_err().to_string().contains("cameras"));
    }
}
