//! A2: Luo et al.'s own figure (their Fig. 13), distance from the envelope to the visible hair.

use crate::depth::pixel_centre;
use crate::rows::{Asked, Rows};
use crate::stats::{percentile, share_within, sorted};
use crate::subject::{Subject, Surface};
use glam::{DVec2, DVec3};
use strandbench_types::nearest::SegmentIndex;
use strandbench_types::{TriMesh, Truth};

/// Points taken of each envelope, equal in area.
pub(crate) const SURFACE_SAMPLES: usize = 16_384;

/// Luo's "within 1 cm".
const NEAR_MM: f64 = 10.0;

/// How far the control pushes the envelope away from the camera, along the rays.
const PUSH_MM: f64 = 20.0;

/// The members of which `SURFACE_SAMPLES` equal parts of the total weight have their middles: an index for
/// each part, ascending. Empty if nothing weighs anything.
fn systematic(weights: impl Iterator<Item = f64>) -> Vec<usize> {
    let mut sum = 0.0;
    let cumulative: Vec<f64> = weights
        .map(|w| {
            sum += w;
            sum
        })
        .collect();
    if !(sum > 0.0 && sum.is_finite()) {
        return Vec::new();
    }
    let middle = |k: usize| (k as f64 + 0.5) / SURFACE_SAMPLES as f64 * sum;
    (0..SURFACE_SAMPLES)
        .map(|k| cumulative.partition_point(|&c| c <= middle(k)).min(cumulative.len() - 1))
        .collect()
}

/// Points spread evenly over the mesh's area: systematic over the triangles in their order, and within a
/// triangle by the additive recurrence of the plastic number (Roberts' R2 sequence), folded at the diagonal.
fn mesh_points(mesh: &TriMesh) -> Vec<DVec3> {
    let corner = |t: &[u32; 3]| t.map(|i| mesh.vertices[i as usize].as_dvec3());
    let area = |t: &[u32; 3]| {
        let [a, b, c] = corner(t);
        0.5 * (b - a).cross(c - a).length()
    };
    const PLASTIC: f64 = 1.324_717_957_244_746;
    let point = |(k, t): (usize, usize)| {
        let [a, b, c] = corner(&mesh.triangles[t]);
        let (u, v) = ((k as f64 / PLASTIC).fract(), (k as f64 / (PLASTIC * PLASTIC)).fract());
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        a + (b - a) * u + (c - a) * v
    };
    systematic(mesh.triangles.iter().map(area)).into_iter().enumerate().map(point).collect()
}

/// Points of a depth map's pixels, each weighing the area z² of its footprint.
fn depth_points(truth: &Truth, depth: &[f32]) -> Vec<DVec3> {
    let camera = &truth.rig.cameras[0];
    let area = |z: &f32| if z.is_nan() { 0.0 } else { f64::from(*z).powi(2) };
    let point = |i: usize| {
        let p: DVec2 = pixel_centre(i as u32, camera.width);
        camera.unproject(p, f64::from(depth[i]))
    };
    systematic(depth.iter().map(area)).into_iter().map(point).collect()
}

/// Adds all of A2 for one subject.
pub(crate) fn score(truth: &Truth, index: &SegmentIndex, s: &Subject, rows: &mut Rows) {
    let points = match &s.surface {
        Surface::Absent => Vec::new(),
        Surface::Mesh(mesh) => mesh_points(mesh),
        Surface::Depth => depth_points(truth, &s.depth),
    };
    let asked = Asked { wanted: SURFACE_SAMPLES, answered: points.len() };
    let eye = truth.rig.cameras[0].centre_mm();
    let pushed: Vec<DVec3> = points.iter().map(|&p| p + (p - eye).normalize_or_zero() * PUSH_MM).collect();
    let distances = sorted(index.distances(&points));
    rows.push(s.name, "A2.within_10mm", share_within(&distances, NEAR_MM), asked);
    rows.push(s.name, "A2.median", percentile(&distances, 50), asked);
    rows.push(s.name, "A2.p95", percentile(&distances, 95), asked);
    let distances = sorted(index.distances(&pushed));
    rows.push(s.name, "A2.pushed.within_10mm", share_within(&distances, NEAR_MM), asked);
    rows.push(s.name, "A2.pushed.median", percentile(&distances, 50), asked);
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn points_follow_the_area_and_not_the_vertices() {
        // Two squares side by side, the right one cut into far more triangles.
        let mut mesh = TriMesh::default();
        let mut square = |x: f32, n: u32| {
            let base = mesh.vertices.len() as u32;
            for j in 0..=n {
                for i in 0..=n {
                    mesh.vertices.push(Vec3::new(x + i as f32 / n as f32, j as f32 / n as f32, 7.0));
                }
            }
            for j in 0..n {
                for i in 0..n {
                    let a = base + j * (n + 1) + i;
                    mesh.triangles.extend([[a, a + 1, a + n + 1], [a + 1, a + n + 2, a + n + 1]]);
                }
            }
        };
        square(0.0, 1);
        square(1.0, 9);
        let points = mesh_points(&mesh);
        assert_eq!(points.len(), SURFACE_SAMPLES);
        let n = SURFACE_SAMPLES as f64;
        // Every quarter of the area holds its quarter of the points, wherever it lies.
        for (x, y) in [(0.0, 0.0), (0.5, 0.5), (1.0, 0.5), (1.25, 0.25)] {
            let inside = |p: &&DVec3| (x..x + 0.5).contains(&p.x) && (y..y + 0.5).contains(&p.y);
            let share = points.iter().filter(inside).count() as f64 / n;
            assert!((share - 0.125).abs() < 2e-3, "{share} at {x}, {y}");
        }
        let mean = points.iter().sum::<DVec3>() / n;
        assert!((mean - DVec3::new(1.0, 0.5, 7.0)).length() < 1e-3, "{mean}");
    }

    #[test]
    fn nothing_is_sampled_as_nothing() {
        assert!(mesh_points(&TriMesh::default()).is_empty());
        let flat = TriMesh { vertices: vec![Vec3::ONE; 3], triangles: vec![[0, 1, 2]] };
        assert!(mesh_points(&flat).is_empty());
    }
}
