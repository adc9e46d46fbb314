//! Small scenes and shared rays made by code that nothing else uses, so that committed references stay true
//! while the groomer changes. Bits are the same on every machine: `libm` and IEEE arithmetic only.

use glam::{DVec2, DVec3, Vec3};
use strandbench_rng::Rng;
use strandbench_types::{Camera, StrandSet, TriMesh};

/// Stream of each use of random numbers.
const TUFT: u64 = 0x7466_7401;
const RAYS: u64 = 0x7466_7402;

/// A tuft of wavy, tapering strands (0.05 mm to 0.03 mm), 50 to 70 mm long, hanging from a disc around the
/// origin that grows with their number.
pub fn tuft(strands: u32, points: u32) -> StrandSet {
    let mut set = StrandSet::new();
    let spread = 0.35 * f64::from(strands).sqrt();
    for s in 0..strands {
        let mut rng = Rng::keyed(&[TUFT, u64::from(s)]);
        let mut u = || rng.f64() * 2.0 - 1.0;
        let (x, z) = (spread * u(), spread * u());
        let (length, lean_x, lean_z) = (60.0 + 10.0 * u(), 8.0 * u(), 8.0 * u());
        let (amplitude, turns, phase) = (1.2 + 0.8 * u(), 3.0 + u(), 3.0 * u());
        let at = |k: u32| {
            let t = f64::from(k) / f64::from(points - 1);
            let angle = phase + std::f64::consts::TAU * turns * t;
            let wave = amplitude * t.sqrt();
            DVec3::new(
                x + lean_x * t + wave * libm::cos(angle),
                30.0 - length * t,
                z + lean_z * t + wave * libm::sin(angle),
            )
            .as_vec3()
        };
        let radius = |k: u32| (0.05 - 0.02 * f64::from(k) / f64::from(points - 1)) as f32;
        set.push_tapered(
            &(0..points).map(at).collect::<Vec<_>>(),
            &(0..points).map(radius).collect::<Vec<_>>(),
        );
    }
    set
}

/// One straight fibre of 0.6 mm radius, leaning to the side and towards the camera.
pub fn single() -> StrandSet {
    let mut set = StrandSet::new();
    let at = |k: i32| Vec3::new(1.0, 5.0, 1.5) * (k as f32 * 0.8);
    set.push(&(-4..=4).map(at).collect::<Vec<_>>(), 0.6);
    set
}

/// Two fibres of 0.5 mm radius that cross 1.2 mm apart, and a third that runs into one of them. Their ends lie outside
/// the view: ours are spheres and Mitsuba's open.
pub fn crossing() -> StrandSet {
    let mut set = StrandSet::new();
    let line = |from: Vec3, to: Vec3| (0..7).map(|k| from.lerp(to, k as f32 / 6.0)).collect::<Vec<_>>();
    set.push(&line(Vec3::new(-28.0, -18.0, 0.0), Vec3::new(28.0, 18.0, 0.0)), 0.5);
    set.push(&line(Vec3::new(-28.0, 18.0, 1.2), Vec3::new(28.0, -18.0, 1.2)), 0.5);
    set.push(&line(Vec3::new(3.0, -24.0, -4.5), Vec3::new(-2.0, 24.0, 5.25)), 0.4);
    set
}

/// A closed, bumpy surface of about 40 mm radius with `2 * around * down` triangles, wound outward.
pub fn bumpy(around: u32, down: u32) -> TriMesh {
    let mut mesh = TriMesh::default();
    for j in 0..=down {
        for i in 0..around {
            let (polar, turn) = (
                std::f64::consts::PI * f64::from(j) / f64::from(down),
                std::f64::consts::TAU * f64::from(i) / f64::from(around),
            );
            let direction = DVec3::new(
                libm::sin(polar) * libm::cos(turn),
                libm::cos(polar),
                libm::sin(polar) * libm::sin(turn),
            );
            let bump =
                libm::sin(7.0 * direction.x) * libm::cos(5.0 * direction.y) * libm::sin(6.0 * direction.z);
            mesh.vertices.push((direction * (40.0 + 6.0 * bump)).as_vec3());
        }
    }
    let at = |i: u32, j: u32| j * around + i % around;
    for j in 0..down {
        for i in 0..around {
            if j > 0 {
                mesh.triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            }
            if j + 1 < down {
                mesh.triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }
    mesh
}

/// A camera 400 mm from the origin that looks at it, slightly from above and from the side; a circle of
/// `radius_mm` around the origin fills the image's height.
pub fn camera(width: u32, height: u32, radius_mm: f64) -> Camera {
    let eye = DVec3::new(90.0, 60.0, 385.0);
    let focal = 0.5 * f64::from(height) * eye.length() / radius_mm;
    let mut camera = Camera::look_at("fixed", (width, height), focal, eye, DVec3::ZERO, DVec3::NEG_Y);
    // Off the image's middle, so that its sign matters.
    camera.principal_px += DVec2::new(3.25, -2.5);
    camera
}

/// Rays that both renderers trace.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rays {
    /// Where they start, mm.
    pub origins: Vec<Vec3>,
    /// Unit directions.
    pub directions: Vec<Vec3>,
    /// How far a shadow ray goes, mm; infinite for all others.
    pub tmax: Vec<f32>,
}

impl Rays {
    fn push(&mut self, origin: DVec3, direction: DVec3, tmax: f32) {
        self.origins.push(origin.as_vec3());
        self.directions.push(direction.normalize().as_vec3().normalize());
        self.tmax.push(tmax);
    }
}

/// `count` camera rays through random places of the image.
pub fn camera_rays(camera: &Camera, count: u32) -> Rays {
    let mut rays = Rays::default();
    let eye = camera.centre_mm();
    for i in 0..count {
        let mut rng = Rng::keyed(&[RAYS, 0, u64::from(i)]);
        let pixel = DVec2::new(rng.f64() * f64::from(camera.width), rng.f64() * f64::from(camera.height));
        rays.push(eye, camera.ray_direction(pixel), f32::INFINITY);
    }
    rays
}

/// `count` rays from the camera towards places on the fibres, some of them just past.
pub fn rays_at_fibres(camera: &Camera, strands: &StrandSet, count: u32) -> Rays {
    let mut rays = Rays::default();
    let eye = camera.centre_mm();
    for i in 0..count {
        let mut rng = Rng::keyed(&[RAYS, 3, u64::from(i)]);
        let (place, _) = on_a_fibre(strands, &mut rng);
        rays.push(eye, place - eye, f32::INFINITY);
    }
    rays
}

/// A uniformly distributed unit vector.
fn unit(rng: &mut Rng) -> DVec3 {
    let (z, turn) = (rng.f64() * 2.0 - 1.0, rng.f64() * std::f64::consts::TAU);
    let r = (1.0 - z * z).max(0.0).sqrt();
    DVec3::new(r * libm::cos(turn), r * libm::sin(turn), z)
}

/// A random place of a random fibre's surface, and the normal there.
fn on_a_fibre(strands: &StrandSet, rng: &mut Rng) -> (DVec3, DVec3) {
    let strand = rng.below(strands.len() as u64) as usize;
    let range = strands.range(strand);
    let i = range.start + rng.below(range.len() as u64 - 1) as usize;
    let (p, q) = (strands.points[i].as_dvec3(), strands.points[i + 1].as_dvec3());
    let along = rng.f64();
    let radius = f64::from(strands.radii_mm[i]).max(f64::from(strands.radii_mm[i + 1]));
    let axis = (q - p).normalize_or(DVec3::Y);
    let random = unit(rng);
    let normal = (random - axis * random.dot(axis)).normalize_or(axis.any_orthonormal_vector());
    // Off the surface by a twentieth of a radius: clear of rounding, close enough to meet neighbours.
    (p.lerp(q, along) + normal * (radius * 1.05), normal)
}

/// `count` each of: rays from a sphere of 150 mm towards the strands; rays that leave a fibre's surface in a
/// random direction; shadow rays from there to one of three distant places or to a place on another fibre, so that
/// there is something to meet shortly before and shortly beyond their end. The kinds take turns.
pub fn scattered_rays(strands: &StrandSet, count: u32) -> Rays {
    let mut rays = Rays::default();
    let lights =
        [DVec3::new(300.0, 250.0, 300.0), DVec3::new(-350.0, 50.0, 250.0), DVec3::new(0.0, 400.0, -200.0)];
    for i in 0..count {
        let mut rng = Rng::keyed(&[RAYS, 1, u64::from(i)]);
        let from = unit(&mut rng) * 150.0;
        let (near, _) = on_a_fibre(strands, &mut rng);
        rays.push(from, near + unit(&mut rng) * (0.1 * rng.f64()) - from, f32::INFINITY);
        let (start, normal) = on_a_fibre(strands, &mut rng);
        let away = unit(&mut rng);
        rays.push(start, if away.dot(normal) < 0.0 { -away } else { away }, f32::INFINITY);
        let (start, _) = on_a_fibre(strands, &mut rng);
        let (place, _) = on_a_fibre(strands, &mut rng);
        let to = lights.get(i as usize % 4).unwrap_or(&place) - start;
        rays.push(start, to, to.length() as f32);
    }
    rays
}

/// `count` rays from a sphere of 150 mm towards random places within 45 mm of the origin.
pub fn sphere_rays(count: u32) -> Rays {
    let mut rays = Rays::default();
    for i in 0..count {
        let mut rng = Rng::keyed(&[RAYS, 2, u64::from(i)]);
        let from = unit(&mut rng) * 150.0;
        let to = unit(&mut rng) * (45.0 * rng.f64());
        rays.push(from, to - from, f32::INFINITY);
    }
    rays
}

/// All of both.
pub fn joined(mut a: Rays, b: Rays) -> Rays {
    a.origins.extend(b.origins);
    a.directions.extend(b.directions);
    a.tmax.extend(b.tmax);
    a
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_are_valid_and_the_mesh_is_closed_and_wound_outward() {
        for set in [tuft(200, 24), single(), crossing()] {
            set.validate().unwrap();
        }
        let mesh = bumpy(60, 30);
        mesh.validate().unwrap();
        // Divergence theorem: the volume is near that of the sphere, and positive if wound outward. The poles'
        // vertices are repeated, so that closedness shows in the volume alone.
        let volume: f64 = mesh
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|k| mesh.vertices[k as usize].as_dvec3());
                a.dot(b.cross(c)) / 6.0
            })
            .sum();
        let sphere = 4.0 / 3.0 * std::f64::consts::PI * 40f64.powi(3);
        assert!((volume / sphere - 1.0).abs() < 0.1, "{volume} mm3 against {sphere}");
    }
}
