//! A1 and A3: depth along the reference camera's rays.

use crate::regions::Regions;
use crate::rows::{Asked, Rows};
use crate::sheet::{ScoreSheet, WorstRegion};
use crate::stats::{Weighted, percentile, share_within, sorted};
use crate::subject::Subject;
use rayon::prelude::*;
use strandbench_types::{DepthMap, Truth};

/// Tolerances in mm.
const OVER_MM: [f64; 4] = [1.0, 2.0, 5.0, 10.0];

/// Tolerances in pixel footprints, and their names.
const OVER_PX: [(f64, &str); 4] = [(0.5, "0.5"), (1.0, "1"), (2.0, "2"), (4.0, "4")];

/// Edge of the cells of the voxel-normalised figures, mm.
const CELL_MM: f64 = 5.0;

/// Side of the blocks among which the worst is sought, px.
const BLOCK_PX: usize = 32;

/// Signed errors (estimate less truth, mm) at `pixels`; +inf where the estimate is absent.
pub(crate) fn errors(truth: &DepthMap, estimate: &[f32], pixels: &[u32]) -> Vec<f64> {
    let at = |&i: &u32| {
        let z = truth.get_index(i as usize).expect("checked: hair pixels have a depth");
        let e = f64::from(estimate[i as usize]) - f64::from(z);
        if e.is_nan() { f64::INFINITY } else { e }
    };
    pixels.iter().map(at).collect()
}

/// Weight of each inner pixel under which every 5 mm cell of the true surface counts the same: the mean
/// over eight grids, shifted by half a cell along each subset of the axes, of 1 / (cells x pixels of the
/// cell). Cells are aligned with the reference camera, so that moving the world changes nothing.
pub(crate) struct Cells(Vec<f64>);

impl Cells {
    pub fn new(truth: &Truth, regions: &Regions) -> Cells {
        let camera = &truth.rig.cameras[0];
        let points: Vec<[f64; 3]> = regions
            .inner
            .iter()
            .map(|&i| {
                let (p, z) = (pixel_centre(i, camera.width), depth_50(truth, i));
                let xy = (p - camera.principal_px) / camera.focal_px * z;
                [xy.x, xy.y, z]
            })
            .collect();
        let grids: Vec<Vec<f64>> =
            (0..8u32).into_par_iter().map(|shift| cell_weights(&points, shift)).collect();
        Cells((0..points.len()).map(|i| grids.iter().map(|g| g[i]).sum::<f64>() / 8.0).collect())
    }
}

pub(crate) fn cell_weights(points: &[[f64; 3]], shift: u32) -> Vec<f64> {
    let cell = |p: &[f64; 3]| -> [i32; 3] {
        std::array::from_fn(|k| (p[k] / CELL_MM + 0.5 * f64::from(shift >> k & 1)).floor() as i32)
    };
    let mut keyed: Vec<([i32; 3], u32)> = points.iter().zip(0..).map(|(p, i)| (cell(p), i)).collect();
    keyed.sort_unstable();
    let cells = keyed.chunk_by(|a, b| a.0 == b.0).count();
    let mut weights = vec![0.0; points.len()];
    for of_cell in keyed.chunk_by(|a, b| a.0 == b.0) {
        for &(_, i) in of_cell {
            weights[i as usize] = 1.0 / (cells as f64 * of_cell.len() as f64);
        }
    }
    weights
}

/// Position of a pixel's centre by row-major index, px.
pub(crate) fn pixel_centre(i: u32, width: u32) -> glam::DVec2 {
    glam::DVec2::new(f64::from(i % width) + 0.5, f64::from(i / width) + 0.5)
}

/// True depth at a hair pixel of the reference view, mm.
pub(crate) fn depth_50(truth: &Truth, i: u32) -> f64 {
    f64::from(truth.views[0].depth_50.get_index(i as usize).expect("checked: hair pixels have a depth"))
}

/// Adds all of A1 and A3 for one subject, and its raw errors to the sheet.
pub(crate) fn score(
    truth: &Truth,
    regions: &Regions,
    cells: &Cells,
    s: &Subject,
    rows: &mut Rows,
    sheet: &mut ScoreSheet,
) {
    let view = &truth.views[0];
    let inner = errors(&view.depth_50, &s.depth, &regions.inner);
    let ascending = table(rows, s.name, "A1", &inner);
    footprints(truth, rows, s.name, "A1", &inner, &regions.inner);
    let rim = errors(&view.depth_50, &s.depth, &regions.rim);
    table(rows, s.name, "A1.rim", &rim);
    footprints(truth, rows, s.name, "A1.rim", &rim, &regions.rim);
    table(rows, s.name, "A1.first", &errors(&view.depth_first, &s.depth, &regions.inner));
    table(rows, s.name, "A1.c05", &errors(&view.depth_05, &s.depth, &regions.inner));
    voxels(rows, s.name, &inner, cells);

    let hair = errors(&view.depth_50, &s.depth, &regions.hair);
    let asked = Asked::of(&hair);
    rows.push(s.name, "A3.completeness", asked.coverage(), asked);

    sheet.depth_error_curves.push((s.name.to_owned(), ascending.iter().map(|&e| e as f32).collect()));
    if s.name == "method" {
        for (&i, &e) in regions.hair.iter().zip(&hair) {
            sheet.depth_error_mm.data[i as usize] = e as f32;
        }
        sheet.worst_region = worst_region(sheet);
    }
}

/// Quantiles, bias and shares of one region against one reference depth; returns ascending |e|.
fn table(rows: &mut Rows, subject: &str, prefix: &str, signed: &[f64]) -> Vec<f64> {
    let asked = Asked::of(signed);
    let mut push = |name: &str, v: f64| rows.push(subject, &format!("{prefix}.{name}"), v, asked);
    let ascending = sorted(signed.iter().map(|e| e.abs()).collect());
    let answered = sorted(signed.iter().copied().filter(|e| e.is_finite()).collect());
    let bias = percentile(&answered, 50);
    let spread = |e: &f64| if e.is_finite() { (e - bias).abs() } else { f64::INFINITY };
    push("median", percentile(&ascending, 50));
    push("mad", percentile(&sorted(signed.iter().map(spread).collect()), 50));
    push("p90", percentile(&ascending, 90));
    push("p95", percentile(&ascending, 95));
    push("bias_mean", answered.iter().sum::<f64>() / answered.len() as f64);
    push("bias_median", bias);
    for limit in OVER_MM {
        push(&format!("over_{limit}mm"), 1.0 - share_within(&ascending, limit));
    }
    ascending
}

/// Shares beyond multiples of a pixel's footprint z/f, f the geometric mean of the focal lengths.
fn footprints(truth: &Truth, rows: &mut Rows, subject: &str, prefix: &str, signed: &[f64], pixels: &[u32]) {
    let camera = &truth.rig.cameras[0];
    let focal_px = (camera.focal_px.x * camera.focal_px.y).sqrt();
    let in_px = |(e, &i): (&f64, &u32)| e.abs() * focal_px / depth_50(truth, i);
    let ascending = sorted(signed.iter().zip(pixels).map(in_px).collect());
    for (limit, name) in OVER_PX {
        let over = 1.0 - share_within(&ascending, limit);
        rows.push(subject, &format!("{prefix}.over_{name}px"), over, Asked::of(signed));
    }
}

fn voxels(rows: &mut Rows, subject: &str, signed: &[f64], cells: &Cells) {
    let asked = Asked::of(signed);
    let mut push = |name: &str, v: f64| rows.push(subject, &format!("A1.voxel.{name}"), v, asked);
    let magnitudes: Vec<f64> = signed.iter().map(|e| e.abs()).collect();
    let weighted = Weighted::new(&magnitudes, &cells.0);
    push("median", weighted.quantile(0.5));
    push("p90", weighted.quantile(0.9));
    push("p95", weighted.quantile(0.95));
    for limit in OVER_MM {
        push(&format!("over_{limit}mm"), weighted.share_over(limit));
    }
}

/// The block with the largest median error among those with at least a quarter of wanted pixels; the first
/// of equals in reading order.
fn worst_region(sheet: &ScoreSheet) -> Option<WorstRegion> {
    let map = &sheet.depth_error_mm;
    let mut worst: Option<(f64, WorstRegion)> = None;
    for y in (0..map.height).step_by(BLOCK_PX) {
        for x in (0..map.width).step_by(BLOCK_PX) {
            let rows = y..(y + BLOCK_PX).min(map.height);
            let columns = x..(x + BLOCK_PX).min(map.width);
            let errors: Vec<f64> = rows
                .flat_map(|v| &map.data[v * map.width + columns.start..v * map.width + columns.end])
                .filter(|e| !e.is_nan())
                .map(|&e| f64::from(e.abs()))
                .collect();
            if errors.len() * 4 < BLOCK_PX * BLOCK_PX {
                continue;
            }
            let wanted = errors.len() as u64;
            let median = percentile(&sorted(errors), 50);
            if worst.as_ref().is_none_or(|(m, _)| median > *m) {
                let median_mm = median.is_finite().then_some(median);
                let (x, y) = (x as u32, y as u32);
                worst = Some((median, WorstRegion { x, y, size: BLOCK_PX as u32, wanted, median_mm }));
            }
        }
    }
    worst.map(|(_, region)| region)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_weigh_the_same_whatever_they_hold() {
        let points = [[1.0, 1.0, 501.0], [2.0, 1.0, 501.0], [1.0, 4.9, 504.9], [5.1, 1.0, 501.0]];
        assert_eq!(cell_weights(&points, 0), [1.0 / 6.0, 1.0 / 6.0, 1.0 / 6.0, 0.5]);
        // Half a cell along x leaves who is with whom as it is.
        assert_eq!(cell_weights(&points, 1), [1.0 / 6.0, 1.0 / 6.0, 1.0 / 6.0, 0.5]);
        // Half a cell along y parts 1.0 from 4.9, along z 501.0 from 504.9.
        assert_eq!(cell_weights(&points, 2), [1.0 / 6.0, 1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0]);
        assert_eq!(cell_weights(&points, 4), [1.0 / 6.0, 1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0]);
        assert_eq!(cell_weights(&[[-0.1, 0.0, 1.0], [0.1, 0.0, 1.0]], 0), [0.5, 0.5]);
        assert_eq!(cell_weights(&[[-0.1, 0.0, 1.0], [0.1, 0.0, 1.0]], 1), [0.5, 0.5]);
    }
}
