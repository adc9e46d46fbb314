//! A4: the envelope's silhouette in every true camera.

use crate::depth::pixel_centre;
use crate::rows::{Asked, Rows};
use crate::subject::{Subject, Surface};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use strandbench_types::{Camera, TriMesh, Truth};

/// What is nearer to the camera's plane than this is cut away, mm.
const NEAR_MM: f64 = 1.0;

/// A pixel whose centre is no farther than this outside a triangle is covered by it, px: vertices are 32-bit
/// numbers, and an edge through a centre must not lose it.
const TOLERANCE_PX: f64 = 1e-3;

/// Pixels (row-major) whose centre is covered by the image of a triangle, from either side.
pub(crate) fn coverage(camera: &Camera, mesh: &TriMesh) -> Vec<bool> {
    let (w, h) = (camera.width as usize, camera.height as usize);
    let mut covered = vec![false; w * h];
    let vertices: Vec<DVec3> = mesh.vertices.iter().map(|v| camera.to_camera(v.as_dvec3())).collect();
    for t in &mesh.triangles {
        let corners = t.map(|i| vertices[i as usize]);
        if corners.iter().all(|c| c.z >= NEAR_MM) {
            fill(&corners.map(|c| project(camera, c)), w, h, &mut covered);
        } else {
            let polygon: Vec<DVec2> = clip(&corners).into_iter().map(|c| project(camera, c)).collect();
            // The part in front is a triangle or a convex quadrilateral.
            for k in 2..polygon.len() {
                fill(&[polygon[0], polygon[k - 1], polygon[k]], w, h, &mut covered);
            }
        }
    }
    covered
}

fn project(camera: &Camera, c: DVec3) -> DVec2 {
    camera.focal_px * c.truncate() / c.z + camera.principal_px
}

/// The part of a triangle at or beyond the near plane (Sutherland and Hodgman).
fn clip(corners: &[DVec3; 3]) -> Vec<DVec3> {
    let mut out = Vec::with_capacity(4);
    for k in 0..3 {
        let (a, b) = (corners[k], corners[(k + 1) % 3]);
        if a.z >= NEAR_MM {
            out.push(a);
        }
        if (a.z >= NEAR_MM) != (b.z >= NEAR_MM) {
            out.push(a.lerp(b, (NEAR_MM - a.z) / (b.z - a.z)));
        }
    }
    out
}

/// Marks the pixels whose centres lie in a triangle, border and tolerance included: in each row, the reach of
/// the part of the triangle within the tolerance of the row's centre line.
fn fill(triangle: &[DVec2; 3], w: usize, h: usize, covered: &mut [bool]) {
    let top = triangle.iter().fold(f64::INFINITY, |m, p| m.min(p.y));
    let bottom = triangle.iter().fold(f64::NEG_INFINITY, |m, p| m.max(p.y));
    for row in span(top, bottom, h) {
        let y = row as f64 + 0.5;
        let (above, below) = (y - TOLERANCE_PX, y + TOLERANCE_PX);
        let (mut left, mut right) = (f64::INFINITY, f64::NEG_INFINITY);
        let mut reach = |x: f64| (left, right) = (left.min(x), right.max(x));
        for k in 0..3 {
            let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
            // From the upper end to the lower, so that the triangles on both sides compute the same point.
            let (a, b) = if (a.y, a.x) <= (b.y, b.x) { (a, b) } else { (b, a) };
            let (from, to) = (a.y.max(above), b.y.min(below));
            if from > to {
                continue;
            }
            for y in [from, to] {
                reach(if y == a.y {
                    a.x
                } else if y == b.y {
                    b.x
                } else {
                    a.x + (b.x - a.x) * ((y - a.y) / (b.y - a.y))
                });
            }
            if a.y == b.y {
                reach(b.x);
            }
        }
        let columns = span(left, right, w);
        if !columns.is_empty() {
            covered[row * w..][columns].fill(true);
        }
    }
}

/// Indices of the pixels among `n` whose centres lie in [lo, hi], with the tolerance; empty if there are none.
fn span(lo: f64, hi: f64, n: usize) -> std::ops::Range<usize> {
    let first = (lo - TOLERANCE_PX - 0.5).ceil().clamp(0.0, n as f64);
    let last = (hi + TOLERANCE_PX - 0.5).floor().clamp(-1.0, n as f64 - 1.0);
    first as usize..(last + 1.0) as usize
}

/// The surface between a depth map's pixels: two triangles for each square of four answered neighbours.
pub(crate) fn mesh_of_depth(camera: &Camera, depth: &[f32]) -> TriMesh {
    let w = camera.width as usize;
    let answered = |i: usize| !depth[i].is_nan();
    let mut mesh = TriMesh::default();
    let mut name = vec![u32::MAX; depth.len()];
    let mut vertex = |i: usize, mesh: &mut TriMesh| {
        if name[i] == u32::MAX {
            name[i] = mesh.vertices.len() as u32;
            let p = camera.unproject(pixel_centre(i as u32, camera.width), f64::from(depth[i]));
            mesh.vertices.push(p.as_vec3());
        }
        name[i]
    };
    for i in 0..depth.len().saturating_sub(w) {
        let square = [i, i + 1, i + w, i + w + 1];
        if i % w + 1 < w && square.iter().all(|&k| answered(k)) {
            let [a, b, c, d] = square.map(|k| vertex(k, &mut mesh));
            mesh.triangles.extend([[a, c, b], [b, c, d]]);
        }
    }
    mesh
}

/// Adds all of A4 for one subject.
pub(crate) fn score(truth: &Truth, s: &Subject, rows: &mut Rows) {
    let empty = TriMesh::default();
    let own;
    let (mesh, answered) = match &s.surface {
        Surface::Absent => (&empty, 0),
        Surface::Mesh(mesh) => (mesh, 1),
        Surface::Depth => {
            own = mesh_of_depth(&truth.rig.cameras[0], &s.depth);
            (&own, 1)
        }
    };
    let of_camera = |c: usize| {
        let covered = coverage(&truth.rig.cameras[c], mesh);
        let (mut both, mut either) = (0u64, 0u64);
        for (&a, &b) in covered.iter().zip(&truth.views[c].mask.data) {
            both += u64::from(a && b);
            either += u64::from(a || b);
        }
        (both, either)
    };
    let counts: Vec<(u64, u64)> = (0..truth.views.len()).into_par_iter().map(of_camera).collect();
    // A camera in which neither hair nor envelope is to be seen has nothing to overlap and is left out.
    let mut ious = Vec::new();
    for (c, &(both, either)) in counts.iter().enumerate() {
        let iou = both as f64 / either as f64;
        let asked = Asked { wanted: either as usize, answered: answered * either as usize };
        rows.push(s.name, &format!("A4.iou.{c}"), iou, asked);
        ious.extend((either > 0).then_some(iou));
    }
    let asked = Asked { wanted: ious.len(), answered: answered * ious.len() };
    rows.push(s.name, "A4.iou.mean", ious.iter().sum::<f64>() / ious.len() as f64, asked);
    rows.push(s.name, "A4.iou.min", ious.iter().copied().fold(f64::INFINITY, f64::min), asked);
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use proptest::prelude::*;
    use strandbench_rng::Rng;

    /// A camera whose pixel (u, v) shows the point (u, v, 100).
    fn camera(w: u32, h: u32) -> Camera {
        let mut c = Camera::look_at("c", (w, h), 100.0, DVec3::ZERO, DVec3::Z, DVec3::Y);
        c.principal_px = DVec2::ZERO;
        c
    }

    fn at(u: f32, v: f32) -> Vec3 {
        Vec3::new(u, v, 100.0)
    }

    fn text(c: &Camera, mesh: &TriMesh) -> String {
        let rows = coverage(c, mesh);
        rows.chunks(c.width as usize)
            .map(|r| r.iter().map(|&c| if c { '#' } else { '.' }).collect::<String>() + "\n")
            .collect()
    }

    #[test]
    fn pixels_are_covered_at_their_centres_borders_included() {
        let c = camera(6, 4);
        let mesh = |v: Vec<Vec3>| TriMesh { vertices: v, triangles: vec![[0, 1, 2]] };
        // Vertices on the centres of pixels (1,0), (4,0) and (1,3): all of them and the diagonal count.
        let corner = mesh(vec![at(1.5, 0.5), at(4.5, 0.5), at(1.5, 3.5)]);
        assert_eq!(text(&c, &corner), ".####.\n.###..\n.##...\n.#....\n");
        let inside = mesh(vec![at(1.6, 0.6), at(4.3, 0.6), at(1.6, 3.3)]);
        assert_eq!(text(&c, &inside), "......\n..#...\n......\n......\n");
        // Larger than the image, seen from the back, and partly behind the camera.
        let all = "######\n".repeat(4);
        assert_eq!(text(&c, &mesh(vec![at(-99.0, -99.0), at(-99.0, 199.0), at(199.0, -99.0)])), all);
        let behind = Vec3::new(0.0, -3000.0, -500.0);
        assert_eq!(text(&c, &mesh(vec![at(-99.0, 99.0), at(99.0, 99.0), behind])), all);
        assert_eq!(text(&c, &mesh(vec![behind, behind + Vec3::X, behind + Vec3::Y])), "......\n".repeat(4));
    }

    #[test]
    fn an_edge_through_centres_survives_rounding() {
        // The upper edge runs along the centres of row 0, its ends a rounding error above and below them.
        let c = camera(6, 2);
        for (l, r) in [(-1e-4, 1e-4), (1e-4, -1e-4), (1e-4, 1e-4)] {
            let vertices = vec![at(1.5, 0.5 + l), at(4.5, 0.5 + r), at(1.5, 9.0)];
            let mesh = TriMesh { vertices, triangles: vec![[0, 1, 2]] };
            assert_eq!(&text(&c, &mesh)[..6], ".####.", "{l} {r}");
        }
    }

    proptest! {
        #[test]
        fn coverage_is_that_of_a_point_in_triangle_test_and_has_no_cracks(seed in any::<u64>()) {
            let c = camera(24, 20);
            let mut r = Rng::keyed(&[seed]);
            let mut v = || at(r.range(-4.0, 28.0), r.range(-4.0, 24.0));
            // A quadrilateral's fan round a point: four triangles that share edges.
            let (a, b, d, e) = (v(), v(), v(), v());
            let middle = (a + b + d + e) * 0.25;
            let fan = TriMesh {
                vertices: vec![a, b, d, e, middle],
                triangles: vec![[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]],
            };
            let covered = coverage(&c, &fan);
            let side = |p: DVec2, q: DVec2, x: DVec2| (q - p).perp_dot(x - p) / (q - p).length();
            for (i, &got) in covered.iter().enumerate() {
                let x = DVec2::new((i % 24) as f64 + 0.5, (i / 24) as f64 + 0.5);
                // Signed distance to each triangle's nearest line, positive inside.
                let depth = fan.triangles.iter().map(|t| {
                    let [p, q, s] = t.map(|k| fan.vertices[k as usize].as_dvec3().truncate());
                    let turn = side(p, q, s).signum();
                    [(p, q), (q, s), (s, p)].iter().map(|&(p, q)| side(p, q, x) * turn).fold(f64::INFINITY, f64::min)
                }).fold(f64::NEG_INFINITY, f64::max);
                if depth >= 0.0 {
                    prop_assert!(got, "pixel {i} is {depth} px inside");
                } else if got {
                    // Outside by the tolerance along x and y, which a sharp corner stretches.
                    prop_assert!(depth > -2.0 * TOLERANCE_PX - 1e-9, "pixel {i} is {depth} px outside");
                }
            }
        }
    }
}
