//! The table of strand metrics.

use super::alignment::PAIRS;
use crate::Metric;
use std::sync::OnceLock;

/// Shares and their chance-corrected forms.
pub(crate) const CHANCE_CORRECTED: &[(&str, &str)] = &[
    ("B1.f_1mm", "B1.f_1mm.cc"),
    ("B1.f_2mm", "B1.f_2mm.cc"),
    ("B1.f_3mm", "B1.f_3mm.cc"),
    ("B1.f_4mm", "B1.f_4mm.cc"),
    ("B1.f_auc", "B1.f_auc.cc"),
    ("B3.idf1", "B3.idf1.cc"),
];

/// Variants of B1: prefix, words for a table's head, words for the meaning.
#[rustfmt::skip]
const VARIANTS: [(&str, &str, &str); 8] = [
    ("", "", "over hair that two cameras or more see (V2)"),
    ("nearest.", "nearest: ", "over V2, the nearest neighbour alone being asked"),
    ("voxel.", "per cell: ", "over V2, every 5 mm cell weighing the same however much hair it holds"),
    ("v1.", "V1: ", "over hair that one camera or more sees"),
    ("v1.nearest.", "V1, nearest: ", "over hair that one camera or more sees, the nearest neighbour alone being asked"),
    ("full.", "all hair: ", "over all hair, seen or not"),
    ("full.nearest.", "all hair, nearest: ", "over all hair, seen or not, the nearest neighbour alone being asked"),
    ("legacy-vertex.", "vertices: ", "over all hair, both sides reduced to their vertices as published code does: for comparison only"),
];

fn own(text: String) -> &'static str {
    Box::leak(text.into_boxed_str())
}

fn build() -> Vec<Metric> {
    let mut all = Vec::new();
    let mut add = |id: &str, title: &str, unit: &'static str, lower_is_better: bool, meaning: &str| {
        let (id, title, meaning) = (own(id.to_owned()), own(title.to_owned()), own(meaning.to_owned()));
        all.push(Metric { id, title, unit, lower_is_better, meaning });
    };
    for (prefix, head, over) in VARIANTS {
        for (name, mm, deg) in PAIRS {
            let within = format!("{mm} mm, {deg}°");
            for (what, says) in [
                ("precision", "Share of observed estimated length that lies within"),
                ("recall", "Share of true length that lies within"),
                ("f", "Harmonic mean of precision and recall within"),
            ] {
                let of = match what {
                    "precision" => " of a true strand",
                    "recall" => " of an estimated strand",
                    _ => "",
                };
                add(
                    &format!("B1.{prefix}{what}_{name}"),
                    &format!("{head}{} ({within})", if what == "f" { "F" } else { what }),
                    "share",
                    false,
                    &format!("{says} {mm} mm and {deg} degrees{of}, {over}."),
                );
            }
        }
        if prefix.is_empty() {
            add(
                "B1.f_auc",
                "F, area",
                "share",
                false,
                "Mean of F over tolerances from 0.25 to 4 mm at 20 degrees, on V2.",
            );
            add(
                "B1.unobserved",
                "unobserved",
                "share",
                true,
                "Share of estimated length that no camera can judge at 2 mm and 20 degrees: neither hair that two cameras see nor free space. It counts neither for nor against the method.",
            );
            for (name, mm, deg) in PAIRS {
                add(
                    &format!("B1.f_{name}.cc"),
                    &format!("F ({mm} mm, {deg}°), above chance"),
                    "share",
                    false,
                    &format!("How far B1.f_{name} lies on the way from the N1 null (0) to perfection (1)."),
                );
            }
            add(
                "B1.f_auc.cc",
                "F, area, above chance",
                "share",
                false,
                "How far B1.f_auc lies on the way from the N1 null (0) to perfection (1).",
            );
        }
    }
    for (way, from, to) in [
        ("to_estimate", "true hair (V2)", "the nearest estimated strand"),
        ("to_truth", "observed estimated hair", "the nearest true strand"),
    ] {
        for (what, unit, quantity) in [("distance", "mm", "Distance"), ("angle", "deg", "Angle (as lines)")] {
            for (q, share) in [("median", "half"), ("p90", "nine tenths"), ("p95", "nineteen twentieths")] {
                add(
                    &format!("B2.{way}.{what}.{q}"),
                    &format!("{what} {}, {q}", way.replace('_', " ")),
                    unit,
                    true,
                    &format!("{quantity} from {from} to {to} that {share} of the length do not exceed."),
                );
            }
        }
    }
    add(
        "B3.idp",
        "identity precision",
        "share",
        false,
        "Share of observed estimated length on which an estimated strand follows the one true strand that it was matched with.",
    );
    add(
        "B3.idr",
        "identity recall",
        "share",
        false,
        "Share of true length (V2) on which a true strand is followed by the one estimated strand that it was matched with.",
    );
    add(
        "B3.idf1",
        "identity F1",
        "share",
        false,
        "Length on which matched strands follow each other, over the mean of true and observed estimated length.",
    );
    add(
        "B3.idf1.cc",
        "identity F1, above chance",
        "share",
        false,
        "How far B3.idf1 lies on the way from the N1 null (0) to perfection (1).",
    );
    add(
        "B3.fragmentation",
        "estimated strands per true one",
        "count",
        true,
        "Effective number of estimated strands among which a true strand's confirmed length is divided.",
    );
    add(
        "B3.merging",
        "true strands per estimated one",
        "count",
        true,
        "Effective number of true strands that an estimated strand follows.",
    );
    add(
        "B4.direction",
        "runs from root to tip",
        "share",
        false,
        "Share of the matched length on which the estimated strand runs from root to tip as the true one does; a coin scores 0.5.",
    );
    add(
        "B4.rooted_2mm",
        "rooted within 2 mm",
        "share",
        false,
        "Share of estimated strands whose first point lies within 2 mm of the head.",
    );
    add(
        "B4.rooted_5mm",
        "rooted within 5 mm",
        "share",
        false,
        "Share of estimated strands whose first point lies within 5 mm of the head.",
    );
    add(
        "B4.root_error.median",
        "root error, median",
        "mm",
        true,
        "Half of the estimated strands begin no farther than this from a true root.",
    );
    add(
        "B4.root_error.p90",
        "root error, 90 %",
        "mm",
        true,
        "Nine in ten estimated strands begin no farther than this from a true root.",
    );
    add(
        "B5.length_w1",
        "length distribution",
        "mm",
        true,
        "Length by which strands would have to be changed on average for their lengths to be distributed as the true ones (Wasserstein-1).",
    );
    add(
        "B5.curvature_w1",
        "curvature distribution",
        "1/m",
        true,
        "Curvature by which strands would have to be changed on average for it to be distributed as the truth's (Wasserstein-1).",
    );
    add(
        "B6.log2_ratio.median",
        "density, log2 of ratio",
        "log2",
        true,
        "Half of the visible 5 mm cells hold no more than 2 to this power times their true length of hair; 0 is right, 1 is twice as much.",
    );
    add(
        "B6.log2_ratio.error_median",
        "density error, median",
        "log2",
        true,
        "Median over visible 5 mm cells of the size of log2 (estimated over true length of hair).",
    );
    add(
        "B6.log2_ratio.error_p90",
        "density error, 90 %",
        "log2",
        true,
        "The same that nine cells in ten do not exceed.",
    );
    add(
        "B6.log2_total",
        "amount of hair, log2 of ratio",
        "log2",
        true,
        "log2 of all estimated over all true length of hair.",
    );
    add(
        "B6.outside",
        "outside the hair",
        "share",
        true,
        "Share of estimated length in 5 mm cells without any true hair.",
    );
    all
}

/// Every strand metric, in the protocol's order.
pub fn strand_metrics() -> &'static [Metric] {
    static TABLE: OnceLock<Vec<Metric>> = OnceLock::new();
    TABLE.get_or_init(build)
}
