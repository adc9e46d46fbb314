//! The envelope mesh and the 3-D orientation on it (first paragraph of 5.1).

use glam::{DVec2, DVec3, Vec3};
use strandbench_types::{Camera, DepthMap, OrientationField, Plane, TriMesh};

/// A mesh over the pixel centres of a depth map, and which vertex is which pixel's.
#[derive(Clone, Debug)]
pub struct Envelope {
    /// Triangles in mm, world, wound towards the camera.
    pub mesh: TriMesh,
    /// Vertex of each pixel that belongs to a triangle, `u32::MAX` elsewhere.
    pub vertex: Plane<u32>,
}

const NONE: u32 = u32::MAX;

/// Triangulates a depth map: each square of four neighbouring pixels gives two triangles, split along the
/// diagonal with the smaller depth step, or one if a corner has no depth. Triangles with a depth step of more
/// than `cut_mm` between neighbouring corners (√2 times that along the diagonal) are left out; nothing is
/// invented in holes.
pub fn triangulate(camera: &Camera, depth: &DepthMap, cut_mm: f32) -> Envelope {
    let (w, h) = depth.size();
    let mut corners: Vec<[u32; 3]> = Vec::new();
    for y in 1..h {
        for x in 1..w {
            // Clockwise on the image, whose y points down: counter-clockwise seen by the camera is a, d, c, b.
            let index = [(x - 1, y - 1), (x, y - 1), (x, y), (x - 1, y)].map(|(x, y)| y * w + x);
            let z = index.map(|i| depth.get_index(i));
            let mut push = |t: [usize; 3]| {
                let (Some(a), Some(b), Some(c)) = (z[t[0]], z[t[1]], z[t[2]]) else { return };
                // t[1] is the corner opposite to the diagonal.
                let step = (a - b).abs().max((b - c).abs()).max((a - c).abs() / std::f32::consts::SQRT_2);
                if step <= cut_mm {
                    corners.push([t[0], t[1], t[2]].map(|k| index[k] as u32));
                }
            };
            let diagonal = |a: usize, b: usize| match (z[a], z[b]) {
                (Some(a), Some(b)) => (a - b).abs(),
                _ => f32::INFINITY,
            };
            if diagonal(0, 2) <= diagonal(1, 3) && diagonal(0, 2).is_finite() {
                push([2, 1, 0]);
                push([0, 3, 2]);
            } else if diagonal(1, 3).is_finite() {
                push([1, 0, 3]);
                push([3, 2, 1]);
            }
        }
    }
    let mut vertex = Plane::filled(w, h, NONE);
    let mut mesh = TriMesh::default();
    for t in &corners {
        for &i in t {
            vertex.data[i as usize] = 0;
        }
    }
    for i in 0..w * h {
        if vertex.data[i] == 0
            && let Some(z) = depth.get_index(i)
        {
            vertex.data[i] = mesh.vertices.len() as u32;
            mesh.vertices.push(camera.unproject(centre(i, w), f64::from(z)).as_vec3());
        }
    }
    mesh.triangles = corners.iter().map(|t| t.map(|i| vertex.data[i as usize])).collect();
    Envelope { mesh, vertex }
}

fn centre(i: usize, width: usize) -> DVec2 {
    DVec2::new((i % width) as f64 + 0.5, (i / width) as f64 + 0.5)
}

/// Unit line direction in the world per pixel, l = n_l × n_p: n_l is the normal of the plane through the
/// camera's centre and the pixel's 2-D line, n_p the surface normal at the pixel's vertex. Zero where the 2-D
/// field is zero, the pixel has no vertex, or the plane touches the surface (n_l parallel to n_p).
pub fn orientation_3d(camera: &Camera, field: &OrientationField, envelope: &Envelope) -> Plane<Vec3> {
    let (w, h) = field.size();
    let normals = envelope.mesh.vertex_normals();
    let data = (0..w * h).map(|i| {
        let (v, Some((angle, _))) = (envelope.vertex.data[i], field.line(i)) else { return Vec3::ZERO };
        if v == NONE {
            return Vec3::ZERO;
        }
        line_on_surface(camera, centre(i, w), f64::from(angle), normals[v as usize].as_dvec3())
    });
    Plane::from_vec(w, h, data.collect())
}

fn line_on_surface(camera: &Camera, pixel: DVec2, angle: f64, normal: DVec3) -> Vec3 {
    let (sin, cos) = libm::sincos(angle);
    let plane = camera.ray_direction(pixel).cross(camera.ray_direction(pixel + DVec2::new(cos, sin)));
    plane.normalize_or_zero().cross(normal).try_normalize().map_or(Vec3::ZERO, |l| l.as_vec3())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera::look_at(
            "c",
            (40, 30),
            60.0,
            DVec3::new(30.0, -20.0, 500.0),
            DVec3::new(3.0, 2.0, 1.0),
            DVec3::NEG_Y,
        )
    }

    fn depths(z: impl Fn(usize, usize) -> Option<f32>) -> DepthMap {
        let mut d = DepthMap::empty(40, 30);
        for y in 0..30 {
            for x in 0..40 {
                d.set(x, y, z(x, y));
            }
        }
        d
    }

    #[test]
    fn triangles_face_the_camera_and_cover_all_squares() {
        let c = camera();
        let e = triangulate(&c, &depths(|x, y| Some(480.0 + 2.0 * x as f32 - 3.0 * (y % 2) as f32)), 10.0);
        assert_eq!((e.mesh.vertices.len(), e.mesh.triangles.len()), (1200, 2 * 39 * 29));
        e.mesh.validate().unwrap();
        for t in &e.mesh.triangles {
            let [a, b, d] = t.map(|i| e.mesh.vertices[i as usize]);
            let towards = c.centre_mm().as_vec3() - a;
            assert!((b - a).cross(d - a).dot(towards) > 0.0, "{t:?} faces away");
        }
    }

    #[test]
    fn steps_and_holes_stay_open() {
        let c = camera();
        let step = |mm: f32| {
            let d = depths(|x, _| Some(if x < 20 { 480.0 } else { 480.0 + mm }));
            triangulate(&c, &d, 10.0).mesh.triangles.len()
        };
        assert_eq!(step(9.9), 2 * 39 * 29);
        assert_eq!(step(10.1), 2 * 38 * 29);
        // One missing pixel: its four squares keep one triangle each.
        let hole = triangulate(&c, &depths(|x, y| ((x, y) != (7, 9)).then_some(480.0)), 10.0);
        assert_eq!(hole.mesh.triangles.len(), 2 * 39 * 29 - 4);
        assert_eq!((hole.mesh.vertices.len(), *hole.vertex.at(7, 9)), (1199, NONE));
        let lone = triangulate(&c, &depths(|x, y| ((x, y) == (7, 9)).then_some(480.0)), 10.0);
        assert!(lone.mesh.vertices.is_empty());
    }

    /// A mesh of one square of pixels with corner depths (top left, top right, bottom right, bottom left), and
    /// its triangles as pixels.
    fn square(z: [Option<f32>; 4]) -> (Envelope, Vec<[(usize, usize); 3]>) {
        let at = [(7, 9), (8, 9), (8, 10), (7, 10)];
        let d = depths(|x, y| at.iter().position(|p| *p == (x, y)).and_then(|k| z[k]));
        let e = triangulate(&camera(), &d, 10.0);
        let pixel = |v: u32| at.into_iter().find(|&(x, y)| *e.vertex.at(x, y) == v).unwrap();
        let triangles = e.mesh.triangles.iter().map(|t| t.map(pixel)).collect();
        (e, triangles)
    }

    #[test]
    fn vertices_lie_on_the_rays_of_pixel_centres_at_their_depths() {
        let (e, _) = square([Some(480.0), Some(483.0), Some(481.5), Some(479.0)]);
        for ((x, y), z) in [((7, 9), 480.0), ((8, 9), 483.0), ((8, 10), 481.5), ((7, 10), 479.0)] {
            let p = e.mesh.vertices[*e.vertex.at(x, y) as usize].as_dvec3();
            let (pixel, depth) = camera().project(p).unwrap();
            assert!(pixel.distance(DVec2::new(x as f64 + 0.5, y as f64 + 0.5)) < 1e-4, "{pixel}");
            assert!((depth - z).abs() < 1e-3, "{depth} for {z}");
        }
    }

    #[test]
    fn squares_are_split_along_the_smaller_step() {
        let (falling, rising) = ([(7, 9), (8, 10)], [(8, 9), (7, 10)]);
        // One corner stands out: the diagonal beside it is level, and both triangles share it.
        for (corner, shared) in [(0, rising), (1, falling), (2, rising), (3, falling)] {
            let mut z = [Some(480.0); 4];
            z[corner] = Some(484.0);
            let (_, triangles) = square(z);
            assert_eq!(triangles.len(), 2);
            for t in triangles {
                assert!(shared.iter().all(|p| t.contains(p)), "corner {corner}: {t:?} lacks {shared:?}");
            }
        }
    }

    #[test]
    fn a_diagonal_may_step_by_the_root_of_two_times_the_cut() {
        // Steps of 6 and 7 along the sides; 13 and 15 along the diagonal, which is allowed 14.1.
        let count = |z2: f32| square([Some(484.0), Some(490.0), Some(z2), None]).1.len();
        assert_eq!((count(497.0), count(499.0)), (1, 0));
    }

    #[test]
    fn lines_on_a_tilted_plane_are_found_in_space() {
        let c = camera();
        let normal = DVec3::new(0.3, -0.2, 1.0).normalize();
        let hit = |p: DVec2| {
            let (o, d) = (c.centre_mm(), c.ray_direction(p));
            -o.dot(normal) / d.dot(normal)
        };
        let d = depths(|x, y| Some(hit(DVec2::new(x as f64 + 0.5, y as f64 + 0.5)) as f32));
        let e = triangulate(&c, &d, 1e3);
        for (k, want) in [DVec3::X, DVec3::Y, DVec3::new(1.0, 2.0, 0.0)].into_iter().enumerate() {
            let want = (want - normal * want.dot(normal)).normalize();
            let (mut re, mut im) = (Plane::filled(40, 30, 0.0), Plane::filled(40, 30, 0.0));
            for i in 0..1200 {
                let p = c.unproject(centre(i, 40), hit(centre(i, 40)));
                let q = c.project(p + want * 1e-3).unwrap().0 - centre(i, 40);
                let angle = 2.0 * q.y.atan2(q.x);
                (re.data[i], im.data[i]) = (angle.cos() as f32, angle.sin() as f32);
            }
            re.data[77] = 0.0;
            im.data[77] = 0.0;
            let got = orientation_3d(&c, &OrientationField { re, im }, &e);
            assert_eq!(got.data[77], Vec3::ZERO);
            for i in (0..1200).filter(|i| *i != 77) {
                let l = got.data[i].as_dvec3();
                assert!((l.length() - 1.0).abs() < 1e-6 && l.dot(want).abs() > 0.9999, "{k}, {i}: {l}");
            }
        }
    }
}
