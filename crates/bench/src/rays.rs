//! The rays that every tracer gets.

use glam::{DVec2, Vec3};
use strandbench_renderer::accel::{Accel, Hit};
use strandbench_rng::Rng;
use strandbench_scenes::AreaLight;
use strandbench_types::{Camera, StrandSet, TriMesh};

/// A ray with unit direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start, mm.
    pub origin: Vec3,
    /// Unit direction.
    pub direction: Vec3,
    /// End, mm along the ray.
    pub tmax: f32,
}

/// What is asked of a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// First hits of camera rays, pixel by pixel in rows.
    Primary,
    /// Whether the light is hidden, from the first hits of the camera rays.
    Shadow,
    /// First hits in random directions from the same points.
    Bounce,
}

impl Kind {
    /// All of them.
    pub const ALL: [Kind; 3] = [Kind::Primary, Kind::Shadow, Kind::Bounce];

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Primary => "primary",
            Kind::Shadow => "shadow",
            Kind::Bounce => "bounce",
        }
    }
}

/// The rays of one run.
#[derive(Clone, Debug, Default)]
pub struct RaySets {
    /// Indexed `[kind]`.
    pub sets: [Vec<Ray>; 3],
}

/// Rays start this far outside the fibre that they leave, mm: beyond the rounding of any of the tracers.
const OFFSET_MM: f32 = 0.01;

impl RaySets {
    /// About `count` camera rays, evenly over the camera's view, and a shadow and a bounce ray for each of
    /// them that meets a fibre. Directions of bounce rays are even over the sphere's half that faces away from
    /// the fibre's axis at the hit.
    pub fn new(
        strands: &StrandSet,
        view: (&Camera, &AreaLight),
        accel: &Accel,
        count: usize,
        seed: u64,
    ) -> RaySets {
        let normal = |hit: &Hit, at: Vec3, direction: Vec3| match *hit {
            Hit::Fibre { point, along, .. } => {
                let k = point as usize;
                let axis = strands.points[k].lerp(strands.points[k + 1], along);
                (at - axis).normalize_or(-direction)
            }
            Hit::Mesh { .. } => -direction,
        };
        RaySets::from_view(view, accel, (count, seed), normal)
    }

    /// The same on a mesh, with bounce rays over the half that its facet faces.
    pub fn on_mesh(
        mesh: &TriMesh,
        view: (&Camera, &AreaLight),
        accel: &Accel,
        count: usize,
        seed: u64,
    ) -> RaySets {
        let normal = |hit: &Hit, _: Vec3, direction: Vec3| match *hit {
            Hit::Mesh { triangle, .. } => {
                let [a, b, c] = mesh.triangles[triangle as usize].map(|k| mesh.vertices[k as usize]);
                let n = (b - a).cross(c - a).normalize_or(-direction);
                if n.dot(direction) > 0.0 { -n } else { n }
            }
            Hit::Fibre { .. } => -direction,
        };
        RaySets::from_view(view, accel, (count, seed), normal)
    }

    fn from_view(
        (camera, light): (&Camera, &AreaLight),
        accel: &Accel,
        (count, seed): (usize, u64),
        normal: impl Fn(&Hit, Vec3, Vec3) -> Vec3,
    ) -> RaySets {
        let (width, height) = (f64::from(camera.width), f64::from(camera.height));
        let step = (width * height / count.max(1) as f64).sqrt();
        let eye = camera.centre_mm().as_vec3();
        let mut sets: [Vec<Ray>; 3] = Default::default();
        let (across, down) = (((width / step) as u64).max(1), ((height / step) as u64).max(1));
        for i in 0..across * down {
            let mut rng = Rng::keyed(&[seed, 0x7261_7973, i]);
            let pixel = DVec2::new(
                ((i % across) as f64 + f64::from(rng.f32())) * step,
                ((i / across) as f64 + f64::from(rng.f32())) * step,
            );
            let direction = camera.ray_direction(pixel).normalize().as_vec3();
            sets[0].push(Ray { origin: eye, direction, tmax: f32::INFINITY });
            let Some(hit) = accel.closest(eye, direction) else { continue };
            let (Hit::Fibre { t, .. } | Hit::Mesh { t, .. }) = hit;
            let at = eye + direction * t;
            let normal = normal(&hit, at, direction);
            let origin = at + normal * OFFSET_MM;
            let on = light.centre_mm
                + light.half_u_mm * rng.range(-1.0, 1.0)
                + light.half_v_mm * rng.range(-1.0, 1.0);
            let to = on - origin;
            sets[1].push(Ray { origin, direction: to.normalize(), tmax: to.length() });
            let z = rng.range(-1.0, 1.0);
            let phi = rng.range(0.0, std::f32::consts::TAU);
            let flat = (1.0 - z * z).sqrt();
            let d = Vec3::new(flat * libm::cosf(phi), flat * libm::sinf(phi), z);
            let direction = if d.dot(normal) < 0.0 { -d } else { d };
            sets[2].push(Ray { origin, direction, tmax: f32::INFINITY });
        }
        RaySets { sets }
    }

    /// The rays of a kind.
    pub fn of(&self, kind: Kind) -> &[Ray] {
        &self.sets[kind as usize]
    }
}
