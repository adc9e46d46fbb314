//! The table of metrics over time.

use crate::Metric;
use crate::metrics::{high, low};

/// Every metric over time, in the protocol's order.
#[rustfmt::skip]
const TABLE: &[Metric] = &[
    low("C1.jitter.mean", "jitter, mean", "mm/frame²", "Mean second difference of tracked strands over three frames, once the true motion is taken away."),
    low("C1.jitter.median", "jitter, median", "mm/frame²", "Half of the tracked points jitter no more than this."),
    low("C1.jitter.p95", "jitter, 95 %", "mm/frame²", "Nineteen in twenty tracked points jitter no more than this."),
    low("C1.acceleration", "jitter as an acceleration", "mm/s²", "C1.jitter.mean times the square of the frame rate."),
    low("C1.noise_sd", "jitter as noise", "mm", "Standard deviation, in each coordinate, of independent noise that would jitter as much."),
    low("C2.regrown.mean", "change between frames, mean", "mm", "Mean distance between a frame's strands, carried by the true motion, and the next frame's, both ways; no identity is needed."),
    low("C2.regrown.median", "change between frames, median", "mm", "Half of the points lie no farther than this from the other frame's strands."),
    low("C2.above_floor", "change above the flicker floor", "mm", "C2.regrown.mean less what two answers of the method differ by to the same hair at rest, seen with other noise."),
    low("C3.flicker.p50", "envelope flicker, median", "mm", "Half of the material points have a depth error that varies over time by no more than this (standard deviation)."),
    low("C3.flicker.p95", "envelope flicker, 95 %", "mm", "Nineteen in twenty material points have a depth error that varies over time by no more than this (standard deviation)."),
    low("C4.drift.median", "drift at the end", "mm", "Half of the first frame's tracked points have moved no farther than this from the true strands they started at."),
    low("C4.drift.rate", "drift rate", "mm/s", "C4.drift.median over the sequence's duration."),
    low("C4.loop.median", "drift when the loop closes", "mm", "The same at the frame of the second half in which the true hair is nearest to where it started."),
    low("C5.log2_gain_1hz", "motion followed, 1 Hz", "log2", "log2 of estimated over true amplitude around 1 Hz; negative is too little, as blurring over time makes it."),
    low("C5.lag_1hz", "lag, 1 Hz", "ms", "Time by which the estimated motion follows the true one around 1 Hz."),
    low("C5.log2_gain_2hz", "motion followed, 2 Hz", "log2", "As C5.log2_gain_1hz, around 2 Hz."),
    low("C5.lag_2hz", "lag, 2 Hz", "ms", "As C5.lag_1hz, around 2 Hz."),
    low("C5.log2_gain_4hz", "motion followed, 4 Hz", "log2", "As C5.log2_gain_1hz, around 4 Hz."),
    low("C5.lag_4hz", "lag, 4 Hz", "ms", "As C5.lag_1hz, around 4 Hz."),
    low("C5.log2_gain_8hz", "motion followed, 8 Hz", "log2", "As C5.log2_gain_1hz, around 8 Hz."),
    low("C5.lag_8hz", "lag, 8 Hz", "ms", "As C5.lag_1hz, around 8 Hz."),
    low("C5.depth.log2_gain_1hz", "depth followed, 1 Hz", "log2", "As C5.log2_gain_1hz, of the depth map where true hair is seen."),
    low("C5.depth.lag_1hz", "depth lag, 1 Hz", "ms", "As C5.lag_1hz, of the depth map where true hair is seen."),
    low("C5.depth.log2_gain_2hz", "depth followed, 2 Hz", "log2", "As C5.depth.log2_gain_1hz, around 2 Hz."),
    low("C5.depth.lag_2hz", "depth lag, 2 Hz", "ms", "As C5.depth.lag_1hz, around 2 Hz."),
    low("C5.depth.log2_gain_4hz", "depth followed, 4 Hz", "log2", "As C5.depth.log2_gain_1hz, around 4 Hz."),
    low("C5.depth.lag_4hz", "depth lag, 4 Hz", "ms", "As C5.depth.lag_1hz, around 4 Hz."),
    low("C5.depth.log2_gain_8hz", "depth followed, 8 Hz", "log2", "As C5.depth.log2_gain_1hz, around 8 Hz."),
    low("C5.depth.lag_8hz", "depth lag, 8 Hz", "ms", "As C5.depth.lag_1hz, around 8 Hz."),
    low("C6.flow.mean", "error of the motion, mean", "mm", "Mean end-point error of tracked points' motion from one frame to the next against the true motion there."),
    low("C6.flow.median", "error of the motion, median", "mm", "Half of the tracked points' motions are wrong by no more than this from one frame to the next."),
    low("C6.flow.p90", "error of the motion, 90 %", "mm", "Nine in ten tracked points' motions are wrong by no more than this from one frame to the next."),
    high("C7.survival_1s", "survival after 1 s", "Share of the first frame's points on true strands that after one second are still within 2 mm and 20 degrees of the same true strand."),
    high("C7.survival_2s", "survival after 2 s", "Share of the first frame's points on true strands that after two seconds are still within 2 mm and 20 degrees of the same true strand."),
];

/// Every metric over time, in the protocol's order.
pub fn motion_metrics() -> &'static [Metric] {
    TABLE
}
