//! The tracking template (5.3): a sheet larger than the visible hair, warped onto the first frame and then followed.

mod detail;

use crate::surface::FrameSurface;
use crate::{Checkpoint, ReconError, StrandParameters, TemporalParameters};
use detail::DetailSolver;
use glam::{DVec2, DVec3, Vec3};
use strandbench_solve::deform::{Aim, DeformError, RegisterOptions, Registered, Registration, Surface};
use strandbench_types::{Camera, Monitor, TriMesh};

/// Most vertices of a template.
const MOST_VERTICES: usize = 200_000;

/// Rounds of detail on the first frame. Each leaves λ (2π s / w)² or less of a wave of length w, s being the vertices'
/// spacing; later frames go on where the last one stopped.
const FIRST_DETAIL_ROUNDS: usize = 3;

/// A mesh that covers more than any single frame shows, and follows all of them.
#[derive(Debug)]
pub struct Template {
    columns: usize,
    triangles: Vec<[u32; 3]>,
    registration: Registration,
    /// Vertices in the first frame.
    first: Vec<DVec3>,
    rest: Vec<DVec3>,
    detail: DetailSolver,
    points: Vec<DVec3>,
    normals: Vec<DVec3>,
}

impl Template {
    /// Builds a sheet parallel to the reference image around the hair, larger by `template_margin` on each side, and
    /// warps it onto the frame's envelope: each vertex whose viewing ray meets the envelope aims there, and the graph's
    /// smoothness carries the rest along; then the detail along normals. The tracking graph is laid on the result.
    ///
    /// # Errors
    /// If the graph cannot be made or fitted, or the work is cancelled.
    pub fn new(
        camera: &Camera,
        surface: &FrameSurface,
        p: &StrandParameters,
        temporal: &TemporalParameters,
        monitor: &dyn Monitor,
    ) -> Result<Template, ReconError> {
        let (sheet, columns) = sheet(camera, surface, p)?;
        let triangles = triangles(sheet.len(), columns);
        let make = || {
            // A plane takes the shape of a head: as soft in the end as Li et al. have it.
            let soft = RegisterOptions::default();
            let options =
                RegisterOptions { rigid: soft.rigid, smooth: soft.smooth, ..temporal.registration() };
            let normals = mesh_normals(&sheet, &triangles);
            let aims: Vec<Option<Aim>> = sheet.iter().map(|&at| aim_along_ray(camera, surface, at)).collect();
            let mut warp = Registration::new(sheet.clone(), normals, options)?;
            let stop = || monitor.cancelled();
            warp.fit(&aims, &stop)?;
            let mut points = warp.carried().0;
            let mut normals = mesh_normals(&points, &triangles);
            let mut detail = DetailSolver::new(points.len(), &triangles, p)?;
            for _ in 0..FIRST_DETAIL_ROUNDS {
                let displacement = detail.solve(camera, surface, &points, &normals)?;
                for ((at, n), d) in points.iter_mut().zip(&normals).zip(&displacement) {
                    *at += *n * *d;
                }
                normals = mesh_normals(&points, &triangles);
            }
            let registration = Registration::new(points.clone(), normals.clone(), tracking(p, temporal))?;
            Ok((registration, detail, points, normals))
        };
        let (registration, detail, points, normals) = make().map_err(|e| fault(surface.frame, e))?;
        let first = points.clone();
        Ok(Template { columns, triangles, registration, rest: first.clone(), first, detail, points, normals })
    }

    /// The template as [`Template::state`] gave it, with `c`'s seeds and frame left out.
    ///
    /// # Errors
    /// If the graph cannot be made, or is not the one that `c` was taken from.
    pub(crate) fn restore(
        c: &Checkpoint,
        p: &StrandParameters,
        temporal: &TemporalParameters,
    ) -> Result<Template, ReconError> {
        let triangles = triangles(c.first.len(), c.columns as usize);
        let make = || {
            let normals = mesh_normals(&c.first, &triangles);
            let mut registration = Registration::new(c.first.clone(), normals, tracking(p, temporal))?;
            Ok((registration.graph().len() == c.linear.len()).then(|| {
                registration.graph_mut().linear.clone_from(&c.linear);
                registration.graph_mut().offset.clone_from(&c.offset);
                registration.set_rest(c.rest.clone(), mesh_normals(&c.rest, &triangles));
                registration
            }))
        };
        let detail = DetailSolver::new(c.first.len(), &triangles, p);
        let registration = make().map_err(|e| fault(c.frame, e))?;
        let registration = registration.ok_or_else(|| {
            ReconError::Input(format!(
                "the checkpoint after frame {} is of a graph of {} nodes; begin the sequence anew",
                c.frame,
                c.linear.len()
            ))
        })?;
        Ok(Template {
            columns: c.columns as usize,
            registration,
            first: c.first.clone(),
            rest: c.rest.clone(),
            detail: detail.map_err(|e| fault(c.frame, e.into()))?,
            points: c.points.clone(),
            normals: mesh_normals(&c.points, &triangles),
            triangles,
        })
    }

    /// All that tracking goes on from.
    pub(crate) fn state(&self, frame: u32, seeds: &[Vec3]) -> Checkpoint {
        let graph = self.registration.graph();
        Checkpoint {
            frame,
            columns: self.columns as u32,
            first: self.first.clone(),
            rest: self.rest.clone(),
            points: self.points.clone(),
            linear: graph.linear.clone(),
            offset: graph.offset.clone(),
            seeds: seeds.to_vec(),
        }
    }

    /// Vertices in the first frame, mm.
    pub(crate) fn first(&self) -> &[DVec3] {
        &self.first
    }

    /// Follows the template to the next frame: the graph goes on from where it is, with constant weights, and then each
    /// vertex is displaced along its normal.
    ///
    /// # Errors
    /// If no vertex has a partner on the frame's envelope, or the work is cancelled.
    pub fn track(
        &mut self,
        camera: &Camera,
        surface: &FrameSurface,
        monitor: &dyn Monitor,
    ) -> Result<Registered, ReconError> {
        let frame = surface.frame;
        let stop = || monitor.cancelled();
        let target = surface.target().map_err(|e| fault(frame, e))?;
        let registered = self.registration.track(&target, &stop).map_err(|e| fault(frame, e))?;
        let (points, _) = self.registration.carried();
        let normals = mesh_normals(&points, &self.triangles);
        let displacement =
            self.detail.solve(camera, surface, &points, &normals).map_err(|e| fault(frame, e.into()))?;
        // The detail moves into the rest shape, along the rest shape's normals: the graph's maps are near rotations.
        let rest_normals = mesh_normals(&self.rest, &self.triangles);
        for ((at, n), d) in self.rest.iter_mut().zip(&rest_normals).zip(&displacement) {
            *at += *n * *d;
        }
        let rest_normals = mesh_normals(&self.rest, &self.triangles);
        self.registration.set_rest(self.rest.clone(), rest_normals);
        self.points = self.registration.carried().0;
        self.normals = mesh_normals(&self.points, &self.triangles);
        Ok(registered)
    }

    /// Vertices in the last frame seen, mm.
    pub fn points(&self) -> &[DVec3] {
        &self.points
    }

    /// The template as a surface that distances are taken to.
    ///
    /// # Errors
    /// If a vertex is not finite.
    pub fn surface(&self, frame: u32) -> Result<Surface, ReconError> {
        Surface::new(self.points.clone(), self.normals.clone(), self.triangles.clone())
            .map_err(|e| fault(frame, e))
    }

    /// The template as a mesh.
    pub fn mesh(&self) -> TriMesh {
        let vertices = self.points.iter().map(|p| p.as_vec3()).collect();
        TriMesh { vertices, triangles: self.triangles.clone() }
    }
}

fn fault(frame: u32, e: DeformError) -> ReconError {
    match e {
        DeformError::Cancelled => ReconError::Cancelled(strandbench_types::Cancelled),
        source => ReconError::Deform { frame, stage: "template", source },
    }
}

/// Options of tracking: weights stay what they are.
fn tracking(p: &StrandParameters, temporal: &TemporalParameters) -> RegisterOptions {
    RegisterOptions {
        rigid: (f64::from(p.track_rigid), f64::from(p.track_rigid)),
        smooth: (f64::from(p.track_smooth), f64::from(p.track_smooth)),
        ..temporal.registration()
    }
}

/// A sheet at the hair's median depth that covers what the envelope covers and a margin: points row by row, and how
/// many there are in a row.
fn sheet(
    camera: &Camera,
    surface: &FrameSurface,
    p: &StrandParameters,
) -> Result<(Vec<DVec3>, usize), ReconError> {
    let mut depths: Vec<f64> = Vec::with_capacity(surface.len());
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for v in 0..surface.len() {
        let q = surface.centre_px(v);
        low = low.min(q);
        high = high.max(q);
        depths.push(camera.to_camera(surface.envelope.mesh.vertices[v].as_dvec3()).z);
    }
    depths.sort_unstable_by(f64::total_cmp);
    let depth = depths[depths.len() / 2];
    let margin = (high - low) * f64::from(p.template_margin);
    let (low, high) = (low - margin, high + margin);
    let step = DVec2::splat(f64::from(p.template_spacing_mm)) * camera.focal_px / depth;
    let counts = ((high - low) / step).ceil().max(DVec2::ONE) + 1.0;
    if counts.x * counts.y > MOST_VERTICES as f64 {
        return Err(ReconError::Parameter {
            key: "template_spacing_mm".into(),
            value: p.template_spacing_mm.to_string(),
            wanted: format!(
                "a spacing that leaves at most {MOST_VERTICES} vertices on a sheet of {:.0}",
                counts.x * counts.y
            ),
        });
    }
    let (nx, ny) = (counts.x as usize, counts.y as usize);
    let points = (0..nx * ny)
        .map(|i| camera.unproject(low + step * DVec2::new((i % nx) as f64, (i / nx) as f64), depth))
        .collect();
    Ok((points, nx))
}

/// Triangles of a sheet of `points` points in rows of `nx`, wound towards the camera.
fn triangles(points: usize, nx: usize) -> Vec<[u32; 3]> {
    let ny = points / nx;
    let mut triangles = Vec::with_capacity(2 * (nx - 1) * (ny - 1));
    for y in 1..ny {
        for x in 1..nx {
            let [a, b, c, d] =
                [(x - 1, y - 1), (x, y - 1), (x, y), (x - 1, y)].map(|(x, y)| (y * nx + x) as u32);
            triangles.extend([[c, b, a], [a, d, c]]);
        }
    }
    triangles
}

fn aim_along_ray(camera: &Camera, surface: &FrameSurface, at: DVec3) -> Option<Aim> {
    let (q, _) = camera.project(at)?;
    let v = surface.vertex_at(q)?;
    let z = surface.depth_at(q, f32::INFINITY)?;
    Some(Aim { point: camera.unproject(q, z), normal: surface.normals[v].as_dvec3() })
}

fn mesh_normals(points: &[DVec3], triangles: &[[u32; 3]]) -> Vec<DVec3> {
    let mut n = vec![DVec3::ZERO; points.len()];
    for t in triangles {
        let [a, b, c] = t.map(|i| points[i as usize]);
        let area = (b - a).cross(c - a);
        t.iter().for_each(|&i| n[i as usize] += area);
    }
    n.iter().map(|v| v.normalize_or_zero()).collect()
}
