//! The table of metrics: what the scorer computes, the report shows and the documentation lists.

use crate::ScoreError;

/// A metric of the protocol.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Metric {
    /// Name in [`crate::Score::metric`]. `A4.iou` stands for one metric a camera: `A4.iou.0`, `A4.iou.1`, ...
    pub id: &'static str,
    /// A few words for a table's head.
    pub title: &'static str,
    /// `mm`, `deg`, `share`, of strands also `count`, `1/m` and `log2` (the binary logarithm of a ratio), and
    /// over time `ms`, `mm/s`, `mm/s²` and `mm/frame²`.
    pub unit: &'static str,
    /// Whether a lower value is better. Of a signed figure the magnitude counts.
    pub lower_is_better: bool,
    /// What the figure says, in one sentence.
    pub meaning: &'static str,
}

/// A metric in some unit that is better when lower.
pub(crate) const fn low(
    id: &'static str,
    title: &'static str,
    unit: &'static str,
    meaning: &'static str,
) -> Metric {
    Metric { id, title, unit, lower_is_better: true, meaning }
}

/// A share that is better when higher.
pub(crate) const fn high(id: &'static str, title: &'static str, meaning: &'static str) -> Metric {
    Metric { id, title, unit: "share", lower_is_better: false, meaning }
}

/// Every metric, in the protocol's order.
#[rustfmt::skip]
pub const METRICS: &[Metric] = &[
    low("A1.median", "depth error, median", "mm", "Half of the inner hair pixels are no farther than this from the depth of 50 % coverage."),
    low("A1.mad", "depth error, spread", "mm", "Median distance of the signed depth error from its own median: the scatter that is left once a common offset is taken away."),
    low("A1.p90", "depth error, 90 %", "mm", "Nine in ten inner hair pixels are no farther than this from the true depth."),
    low("A1.p95", "depth error, 95 %", "mm", "Nineteen in twenty inner hair pixels are no farther than this from the true depth."),
    low("A1.bias_mean", "depth bias, mean", "mm", "Mean signed depth error of the answered inner pixels; positive is too far from the camera."),
    low("A1.bias_median", "depth bias, median", "mm", "Median signed depth error of the answered inner pixels; positive is too far from the camera."),
    low("A1.over_1mm", "beyond 1 mm", "share", "Share of inner hair pixels whose depth is wrong by more than 1 mm or absent."),
    low("A1.over_2mm", "beyond 2 mm", "share", "Share of inner hair pixels whose depth is wrong by more than 2 mm or absent."),
    low("A1.over_5mm", "beyond 5 mm", "share", "Share of inner hair pixels whose depth is wrong by more than 5 mm or absent."),
    low("A1.over_10mm", "beyond 10 mm", "share", "Share of inner hair pixels whose depth is wrong by more than 10 mm or absent."),
    low("A1.over_0.5px", "beyond 0.5 footprints", "share", "Share of inner hair pixels whose depth is wrong by more than half the width of a pixel at that depth, or absent."),
    low("A1.over_1px", "beyond 1 footprint", "share", "Share of inner hair pixels whose depth is wrong by more than the width of a pixel at that depth, or absent."),
    low("A1.over_2px", "beyond 2 footprints", "share", "Share of inner hair pixels whose depth is wrong by more than two pixel widths at that depth, or absent."),
    low("A1.over_4px", "beyond 4 footprints", "share", "Share of inner hair pixels whose depth is wrong by more than four pixel widths at that depth, or absent."),
    high("A1.within_1mm.cc", "within 1 mm, above chance", "How far the share within 1 mm lies on the way from the N1 null (0) to perfection (1)."),
    high("A1.within_2mm.cc", "within 2 mm, above chance", "How far the share within 2 mm lies on the way from the N1 null (0) to perfection (1)."),
    high("A1.within_5mm.cc", "within 5 mm, above chance", "How far the share within 5 mm lies on the way from the N1 null (0) to perfection (1)."),
    high("A1.within_10mm.cc", "within 10 mm, above chance", "How far the share within 10 mm lies on the way from the N1 null (0) to perfection (1)."),
    low("A1.rim.median", "rim: depth error, median", "mm", "As A1.median, over the 2 px along the mask's edge."),
    low("A1.rim.mad", "rim: depth error, spread", "mm", "As A1.mad, over the rim."),
    low("A1.rim.p90", "rim: depth error, 90 %", "mm", "As A1.p90, over the rim."),
    low("A1.rim.p95", "rim: depth error, 95 %", "mm", "As A1.p95, over the rim."),
    low("A1.rim.bias_mean", "rim: depth bias, mean", "mm", "As A1.bias_mean, over the rim."),
    low("A1.rim.bias_median", "rim: depth bias, median", "mm", "As A1.bias_median, over the rim."),
    low("A1.rim.over_1mm", "rim: beyond 1 mm", "share", "As A1.over_1mm, over the rim."),
    low("A1.rim.over_2mm", "rim: beyond 2 mm", "share", "As A1.over_2mm, over the rim."),
    low("A1.rim.over_5mm", "rim: beyond 5 mm", "share", "As A1.over_5mm, over the rim."),
    low("A1.rim.over_10mm", "rim: beyond 10 mm", "share", "As A1.over_10mm, over the rim."),
    low("A1.rim.over_0.5px", "rim: beyond 0.5 footprints", "share", "As A1.over_0.5px, over the rim."),
    low("A1.rim.over_1px", "rim: beyond 1 footprint", "share", "As A1.over_1px, over the rim."),
    low("A1.rim.over_2px", "rim: beyond 2 footprints", "share", "As A1.over_2px, over the rim."),
    low("A1.rim.over_4px", "rim: beyond 4 footprints", "share", "As A1.over_4px, over the rim."),
    low("A1.first.median", "to the first hit, median", "mm", "As A1.median, against the depth of the pixel's first fibre."),
    low("A1.first.mad", "to the first hit, spread", "mm", "As A1.mad, against the depth of the pixel's first fibre."),
    low("A1.first.p90", "to the first hit, 90 %", "mm", "As A1.p90, against the depth of the pixel's first fibre."),
    low("A1.first.p95", "to the first hit, 95 %", "mm", "As A1.p95, against the depth of the pixel's first fibre."),
    low("A1.first.bias_mean", "to the first hit, mean bias", "mm", "As A1.bias_mean, against the depth of the pixel's first fibre."),
    low("A1.first.bias_median", "to the first hit, median bias", "mm", "As A1.bias_median, against the depth of the pixel's first fibre."),
    low("A1.first.over_1mm", "beyond 1 mm of the first hit", "share", "As A1.over_1mm, against the depth of the pixel's first fibre."),
    low("A1.first.over_2mm", "beyond 2 mm of the first hit", "share", "As A1.over_2mm, against the depth of the pixel's first fibre."),
    low("A1.first.over_5mm", "beyond 5 mm of the first hit", "share", "As A1.over_5mm, against the depth of the pixel's first fibre."),
    low("A1.first.over_10mm", "beyond 10 mm of the first hit", "share", "As A1.over_10mm, against the depth of the pixel's first fibre."),
    low("A1.c05.median", "to 5 % coverage, median", "mm", "As A1.median, against the depth of 5 % coverage."),
    low("A1.c05.mad", "to 5 % coverage, spread", "mm", "As A1.mad, against the depth of 5 % coverage."),
    low("A1.c05.p90", "to 5 % coverage, 90 %", "mm", "As A1.p90, against the depth of 5 % coverage."),
    low("A1.c05.p95", "to 5 % coverage, 95 %", "mm", "As A1.p95, against the depth of 5 % coverage."),
    low("A1.c05.bias_mean", "to 5 % coverage, mean bias", "mm", "As A1.bias_mean, against the depth of 5 % coverage."),
    low("A1.c05.bias_median", "to 5 % coverage, median bias", "mm", "As A1.bias_median, against the depth of 5 % coverage."),
    low("A1.c05.over_1mm", "beyond 1 mm of 5 % coverage", "share", "As A1.over_1mm, against the depth of 5 % coverage."),
    low("A1.c05.over_2mm", "beyond 2 mm of 5 % coverage", "share", "As A1.over_2mm, against the depth of 5 % coverage."),
    low("A1.c05.over_5mm", "beyond 5 mm of 5 % coverage", "share", "As A1.over_5mm, against the depth of 5 % coverage."),
    low("A1.c05.over_10mm", "beyond 10 mm of 5 % coverage", "share", "As A1.over_10mm, against the depth of 5 % coverage."),
    low("A1.voxel.median", "per cell: depth error, median", "mm", "As A1.median, every 5 mm cell of true surface weighing the same however many pixels see it."),
    low("A1.voxel.p90", "per cell: depth error, 90 %", "mm", "As A1.p90, every 5 mm cell weighing the same."),
    low("A1.voxel.p95", "per cell: depth error, 95 %", "mm", "As A1.p95, every 5 mm cell weighing the same."),
    low("A1.voxel.over_1mm", "per cell: beyond 1 mm", "share", "As A1.over_1mm, every 5 mm cell weighing the same."),
    low("A1.voxel.over_2mm", "per cell: beyond 2 mm", "share", "As A1.over_2mm, every 5 mm cell weighing the same."),
    low("A1.voxel.over_5mm", "per cell: beyond 5 mm", "share", "As A1.over_5mm, every 5 mm cell weighing the same."),
    low("A1.voxel.over_10mm", "per cell: beyond 10 mm", "share", "As A1.over_10mm, every 5 mm cell weighing the same."),
    high("A2.within_10mm", "within 10 mm of visible hair", "Share of the envelope's area no farther than 10 mm from a strand that the reference camera sees: Luo's own figure."),
    low("A2.median", "distance to visible hair, median", "mm", "Half of the envelope's area is no farther than this from a strand that the reference camera sees."),
    low("A2.p95", "distance to visible hair, 95 %", "mm", "Nineteen twentieths of the envelope's area are no farther than this from visible hair."),
    high("A2.pushed.within_10mm", "the same, pushed 20 mm in", "A2.within_10mm of the envelope pushed 20 mm away from the camera: where this is as good, A2 tells nothing."),
    low("A2.pushed.median", "pushed 20 mm in, median", "mm", "A2.median of the envelope pushed 20 mm away from the camera."),
    high("A2.within_10mm.cc", "within 10 mm, above chance", "How far A2.within_10mm lies on the way from the N1 null (0) to perfection (1)."),
    high("A3.completeness", "answered hair pixels", "Share of the true hair mask for which there is a depth at all."),
    high("A4.iou.mean", "silhouette overlap, mean", "Intersection over union of the envelope's silhouette with the true hair mask, mean over the cameras."),
    high("A4.iou.min", "silhouette overlap, worst camera", "The same in the camera in which it is worst."),
    high("A4.iou", "silhouette overlap of a camera", "The same in one camera."),
    low("A5.median", "3-D orientation error, median", "deg", "Half of the hair pixels have a direction in space no farther than this from the fibres' (as lines)."),
    low("A5.p90", "3-D orientation error, 90 %", "deg", "Nine in ten hair pixels have a direction in space no farther than this from the fibres'."),
    high("A5.within_10deg", "3-D orientation within 10°", "Share of hair pixels whose direction in space is right within 10 degrees."),
    high("A5.within_20deg", "3-D orientation within 20°", "Share of hair pixels whose direction in space is right within 20 degrees."),
    high("A5.within_30deg", "3-D orientation within 30°", "Share of hair pixels whose direction in space is right within 30 degrees."),
    high("A5.within_10deg.cc", "3-D within 10°, above chance", "How far A5.within_10deg lies on the way from the N1 null (0) to perfection (1)."),
    high("A5.within_20deg.cc", "3-D within 20°, above chance", "How far A5.within_20deg lies on the way from the N1 null (0) to perfection (1)."),
    high("A5.within_30deg.cc", "3-D within 30°, above chance", "How far A5.within_30deg lies on the way from the N1 null (0) to perfection (1)."),
    low("B7.median", "2-D orientation error, median", "deg", "Half of the hair pixels have a line in the image no farther than this from the fibres'."),
    low("B7.p90", "2-D orientation error, 90 %", "deg", "Nine in ten hair pixels have a line in the image no farther than this from the fibres'."),
    high("B7.within_10deg", "2-D orientation within 10°", "Share of hair pixels whose line in the image is right within 10 degrees."),
    high("B7.within_20deg", "2-D orientation within 20°", "Share of hair pixels whose line in the image is right within 20 degrees."),
    high("B7.within_30deg", "2-D orientation within 30°", "Share of hair pixels whose line in the image is right within 30 degrees."),
    high("B7.within_10deg.cc", "2-D within 10°, above chance", "How far B7.within_10deg lies on the way from the N1 null (0) to perfection (1)."),
    high("B7.within_20deg.cc", "2-D within 20°, above chance", "How far B7.within_20deg lies on the way from the N1 null (0) to perfection (1)."),
    high("B7.within_30deg.cc", "2-D within 30°, above chance", "How far B7.within_30deg lies on the way from the N1 null (0) to perfection (1)."),
];

/// Shares and their chance-corrected forms; a share that is better when lower counts as its complement.
pub(crate) const CHANCE_CORRECTED: &[(&str, &str)] = &[
    ("A1.over_1mm", "A1.within_1mm.cc"),
    ("A1.over_2mm", "A1.within_2mm.cc"),
    ("A1.over_5mm", "A1.within_5mm.cc"),
    ("A1.over_10mm", "A1.within_10mm.cc"),
    ("A2.within_10mm", "A2.within_10mm.cc"),
    ("A5.within_10deg", "A5.within_10deg.cc"),
    ("A5.within_20deg", "A5.within_20deg.cc"),
    ("A5.within_30deg", "A5.within_30deg.cc"),
    ("B7.within_10deg", "B7.within_10deg.cc"),
    ("B7.within_20deg", "B7.within_20deg.cc"),
    ("B7.within_30deg", "B7.within_30deg.cc"),
];

fn tables() -> impl Iterator<Item = &'static Metric> {
    METRICS.iter().chain(crate::strand_metrics()).chain(crate::motion_metrics())
}

/// Row of the tables, one after the other, that describes `id`.
pub(crate) fn position(id: &str) -> Option<usize> {
    let stem = match id.strip_prefix("A4.iou.") {
        Some(camera) if !camera.is_empty() && camera.bytes().all(|b| b.is_ascii_digit()) => "A4.iou",
        _ => id,
    };
    tables().position(|m| m.id == stem)
}

/// The description of a metric by its name in [`crate::Score::metric`].
///
/// # Errors
/// [`ScoreError::UnknownMetric`] if the protocol has none of that name.
pub fn metric(id: &str) -> Result<&'static Metric, ScoreError> {
    position(id).and_then(|i| tables().nth(i)).ok_or_else(|| ScoreError::UnknownMetric { id: id.to_owned() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_unknown_ones_refused() {
        for (i, m) in tables().enumerate() {
            assert_eq!(position(m.id), Some(i), "{}", m.id);
            let units = ["mm", "deg", "share", "count", "1/m", "log2", "ms", "mm/s", "mm/s²", "mm/frame²"];
            assert!(units.contains(&m.unit) && m.meaning.ends_with('.'), "{}", m.id);
        }
        assert_eq!(metric("A4.iou.3").unwrap().id, "A4.iou");
        for id in ["A4.iou.x", "A4.iou.", "A1", "A1.over_3mm", ""] {
            assert!(matches!(metric(id), Err(ScoreError::UnknownMetric { .. })), "{id:?}");
        }
    }
}
