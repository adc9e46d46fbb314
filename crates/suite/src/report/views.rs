//! Cut-outs through the hair.

use super::chart::{Chart, ticks};
use super::data::Data;
use glam::{DVec3, Vec3};
use strandbench_types::{Rig, StrandSet, TriMesh, Truth};

/// Axes of the drawings: the reference camera's right and forward made horizontal, and up (+y).
pub(super) struct Axes {
    pub right: DVec3,
    pub forward: DVec3,
}

impl Axes {
    pub fn of(rig: &Rig) -> Axes {
        let reference = &rig.cameras[0];
        let z = reference.ray_direction(reference.principal_px);
        let flat = DVec3::new(z.x, 0.0, z.z);
        // A reference that looks straight down has no horizontal forward; its own right still is one.
        let forward = if flat.length() > 1e-6 {
            flat.normalize()
        } else {
            let right = reference.camera_from_world.row(0);
            DVec3::Y.cross(right).normalize_or(DVec3::Z)
        };
        Axes { right: forward.cross(DVec3::Y), forward }
    }
}

/// A horizontal cut: height (mm), and the picture as SVG.
pub(crate) struct Cut {
    pub height_mm: f64,
    pub svg: String,
}

/// Cuts through the visible hair at three heights: strands where they pass the plane, the envelope as a line.
pub(crate) fn cuts(data: &Data) -> Vec<Cut> {
    let Some(envelope) = data.estimate.envelope.as_ref().filter(|e| !e.triangles.is_empty()) else {
        return Vec::new();
    };
    let axes = Axes::of(&data.truth.rig);
    let mut heights: Vec<f32> = envelope.vertices.iter().map(|v| v.y).collect();
    heights.sort_by(f32::total_cmp);
    [0.8, 0.5, 0.2]
        .iter()
        .map(|share| {
            let height = heights[((heights.len() - 1) as f64 * share) as usize];
            Cut { height_mm: f64::from(height), svg: draw_cut(data, envelope, &axes, height) }
        })
        .collect()
}

fn draw_cut(data: &Data, envelope: &TriMesh, axes: &Axes, height: f32) -> String {
    let flat = |p: Vec3| {
        let p = p.as_dvec3();
        (p.dot(axes.right), -p.dot(axes.forward))
    };
    let (seen, hidden) = crossings(&data.truth, height);
    let line: Vec<_> = mesh_cut(envelope, height).into_iter().map(|(a, b)| (flat(a), flat(b))).collect();
    let head: Vec<_> =
        data.truth.head.iter().flat_map(|h| mesh_cut(h, height)).map(|(a, _)| flat(a)).collect();
    let thin = |points: &[Vec3], most: usize| -> Vec<(f64, f64)> {
        points.iter().step_by(points.len().div_ceil(most).max(1)).map(|&p| flat(p)).collect()
    };
    let (hidden, seen) = (thin(&hidden, 3500), thin(&seen, 3500));
    let all: Vec<(f64, f64)> =
        hidden.iter().chain(&seen).copied().chain(line.iter().flat_map(|l| [l.0, l.1])).collect();
    let bound =
        |f: fn(f64, f64) -> f64, pick: fn(&(f64, f64)) -> f64| all.iter().map(pick).reduce(f).unwrap_or(0.0);
    let (mut x, mut y) = (
        (bound(f64::min, |p| p.0) - 8.0, bound(f64::max, |p| p.0) + 8.0),
        (bound(f64::min, |p| p.1) - 8.0, bound(f64::max, |p| p.1) + 8.0),
    );
    // One millimetre is as long on both axes.
    let (width, height_px) = (420.0, 340.0);
    let (plot_w, plot_h) = (width - 72.0, height_px - 56.0);
    let scale = ((x.1 - x.0) / plot_w).max((y.1 - y.0) / plot_h).max(1e-3);
    let widen = |r: &mut (f64, f64), px: f64| {
        let (middle, half) = (0.5 * (r.0 + r.1), 0.5 * scale * px);
        *r = (middle - half, middle + half);
    };
    widen(&mut x, plot_w);
    widen(&mut y, plot_h);
    let chart = Chart {
        x,
        y,
        x_title: "to the right, mm",
        y_title: "towards the camera, mm",
        x_ticks: ticks(x.0, x.1, 5),
        y_ticks: ticks(y.0, y.1, 5),
        size: (width, height_px),
    };
    chart.scatter(&[("#c9c4ba", 0.9, hidden), ("#b8860b", 1.1, head), ("#c4441c", 1.2, seen)], &line)
}

/// Where strands cross a height, those that the reference camera sees there apart from the rest.
fn crossings(truth: &Truth, height: f32) -> (Vec<Vec3>, Vec<Vec3>) {
    let (mut seen, mut hidden) = (Vec::new(), Vec::new());
    let strands: &StrandSet = &truth.strands;
    for s in 0..strands.len() {
        let first = truth.visibility.offsets.get(s).copied().unwrap_or(0) as usize;
        let last = truth.visibility.offsets.get(s + 1).copied().unwrap_or(0) as usize;
        let mut along_mm = 0.0f32;
        for pair in strands.strand(s).windows(2) {
            let length = pair[0].distance(pair[1]);
            if (pair[0].y - height) * (pair[1].y - height) < 0.0 {
                let t = (height - pair[0].y) / (pair[1].y - pair[0].y);
                let sample = ((along_mm + t * length) / strandbench_types::VISIBILITY_STEP_MM) as usize;
                let bits =
                    if last > first { truth.visibility.seen_by[(first + sample).min(last - 1)] } else { 0 };
                let to = if bits & 1 == 1 { &mut seen } else { &mut hidden };
                to.push(pair[0].lerp(pair[1], t));
            }
            along_mm += length;
        }
    }
    (seen, hidden)
}

/// Segments in which a mesh meets a height.
fn mesh_cut(mesh: &TriMesh, height: f32) -> Vec<(Vec3, Vec3)> {
    let mut segments = Vec::new();
    for t in &mesh.triangles {
        let corners = t.map(|i| mesh.vertices[i as usize]);
        let mut ends = Vec::new();
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            if (a.y >= height) != (b.y >= height) {
                ends.push(a.lerp(b, (height - a.y) / (b.y - a.y)));
            }
        }
        if let [a, b] = ends[..] {
            segments.push((a, b));
        }
    }
    segments
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_cut_at_half_height_is_its_outline() {
        let vertices: Vec<Vec3> = (0..8)
            .map(|i| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2 & 1) as f32) * 10.0)
            .collect();
        let triangles = vec![[0, 4, 6], [0, 6, 2], [1, 3, 7], [1, 7, 5], [0, 1, 5], [0, 5, 4]];
        let cut = mesh_cut(&TriMesh { vertices, triangles }, 5.0);
        let length: f32 = cut.iter().map(|(a, b)| a.distance(*b)).sum();
        assert!((length - 20.0).abs() < 1e-4, "two walls of 10 mm, the floor not at all: {length}");
        assert!(cut.iter().all(|(a, b)| (a.y - 5.0).abs() < 1e-5 && (b.y - 5.0).abs() < 1e-5));
    }

    #[test]
    fn crossings_know_what_the_reference_sees() {
        let mut truth = Truth {
            rig: Rig { cameras: vec![], near_mm: 1.0, far_mm: 2.0, frame_rate_hz: 100.0, exposure_s: 0.001 },
            views: vec![],
            strands: StrandSet::new(),
            visibility: strandbench_types::Visibility { offsets: vec![0, 8, 16], seen_by: vec![0; 16] },
            head: None,
        };
        for x in [0.0, 5.0] {
            truth.strands.push(&[Vec3::new(x, 0.0, 0.0), Vec3::new(x, 4.0, 0.0)], 0.04);
        }
        truth.visibility.seen_by[5] = 1;
        let (seen, hidden) = crossings(&truth, 2.75);
        assert_eq!((seen.len(), hidden.len()), (1, 1));
        assert_eq!((seen[0].x, hidden[0].x), (0.0, 5.0));
        assert_eq!(crossings(&truth, 3.25).0.len(), 0, "the next half millimetre is not seen");
    }
}
