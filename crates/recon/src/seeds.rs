//! Where strands begin (5.2), and how interior seeds follow the template (5.3).

use crate::StrandParameters;
use crate::layer::SignedDistance;
use crate::surface::FrameSurface;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use strandbench_rng::Rng;
use strandbench_solve::deform::{Skinning, sample_uniformly};

/// Streams of random numbers, apart from each other.
const SURFACE: u64 = 1;
const INTERIOR: u64 = 2;

/// Draws below which a place for an interior seed must be found; the layer fills more than a hundredth of its voxels.
const DRAWS: usize = 1000;

/// Seeds on the envelope, uniform by area over the triangles whose corners all have a 2-D strength |O| of at least
/// `seed_strength`. `strength` is indexed `[vertex]`. Empty if there is no such triangle.
pub fn surface_seeds(surface: &FrameSurface, strength: &[f32], p: &StrandParameters) -> Vec<Vec3> {
    let mesh = &surface.envelope.mesh;
    let strong = mesh.triangles.iter().filter(|t| t.iter().all(|&i| strength[i as usize] >= p.seed_strength));
    let mut sum = 0.0f64;
    let places: Vec<([Vec3; 3], f64)> = strong
        .map(|t| {
            let corners = t.map(|i| mesh.vertices[i as usize]);
            sum += f64::from((corners[1] - corners[0]).cross(corners[2] - corners[0]).length());
            (corners, sum)
        })
        .collect();
    if sum <= 0.0 {
        return Vec::new();
    }
    (0..p.surface_seeds as u64)
        .into_par_iter()
        .map(|i| {
            let mut rng = Rng::keyed(&[p.seed, SURFACE, u64::from(surface.frame), i]);
            let wanted = rng.f64() * sum;
            let place = places.partition_point(|t| t.1 <= wanted).min(places.len() - 1);
            let ([a, b, c], _) = places[place];
            let (mut u, mut v) = (rng.f32(), rng.f32());
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            a + (b - a) * u + (c - a) * v
        })
        .collect()
}

/// Seeds uniform in the volume between the template and `layer_mm` below it. Fewer than asked for only if there is no
/// such volume.
pub fn interior_seeds(template: &SignedDistance, p: &StrandParameters) -> Vec<Vec3> {
    let grid = template.grid;
    let reach = grid.voxel_mm * 1.8;
    let near: Vec<u32> = (0..grid.count() as u32)
        .filter(|&i| {
            let d = template.distance_mm[i as usize];
            d >= -p.layer_mm - reach && d <= reach
        })
        .collect();
    if near.is_empty() {
        return Vec::new();
    }
    let draw_one = |i: u64| {
        let mut rng = Rng::keyed(&[p.seed, INTERIOR, i]);
        (0..DRAWS).find_map(|_| {
            let voxel = near[rng.below(near.len() as u64) as usize] as usize;
            let [nx, ny, _] = grid.size;
            let centre = grid.centre([voxel % nx, voxel / nx % ny, voxel / (nx * ny)]);
            let offset = Vec3::new(rng.f32(), rng.f32(), rng.f32()) - 0.5;
            let at = centre + offset * grid.voxel_mm;
            template.at(at).is_some_and(|d| d <= 0.0 && d >= -p.layer_mm).then_some(at)
        })
    };
    let found: Vec<Option<Vec3>> = (0..p.interior_seeds as u64).into_par_iter().map(draw_one).collect();
    found.into_iter().flatten().collect()
}

/// Nodes on the template that carry points along: the displacement of a point is the mean of its nodes', weighed by
/// the inverse of their distance in the first frame.
#[derive(Clone, Debug)]
pub struct Cage {
    /// Template vertex of each node.
    vertices: Vec<usize>,
    rest: Vec<DVec3>,
    points: Vec<Vec3>,
    skin: Skinning,
}

impl Cage {
    /// Samples nodes from the template's vertices in the first frame and binds points (mm) to them.
    pub fn new(template: &[DVec3], points: Vec<Vec3>, p: &StrandParameters) -> Cage {
        let vertices = sample_uniformly(template, f64::from(p.cage_spacing_mm));
        let rest: Vec<DVec3> = vertices.iter().map(|&i| template[i]).collect();
        let at: Vec<DVec3> = points.iter().map(|p| p.as_dvec3()).collect();
        let skin = Skinning::new(&at, &rest, p.cage_nodes);
        Cage { vertices, rest, points, skin }
    }

    /// The points in the first frame, mm.
    pub(crate) fn points(&self) -> &[Vec3] {
        &self.points
    }

    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.vertices.len()
    }

    /// Where the points are once the template's vertices are at `template`.
    pub fn advect(&self, template: &[DVec3]) -> Vec<Vec3> {
        let moved: Vec<DVec3> =
            self.vertices.iter().zip(&self.rest).map(|(&i, r)| template[i] - *r).collect();
        let carry = |i: usize| {
            let by: DVec3 = self.skin.of(i).map(|(node, w)| moved[node] * w).sum();
            (self.points[i].as_dvec3() + by).as_vec3()
        };
        (0..self.points.len()).into_par_iter().map(carry).collect()
    }
}
