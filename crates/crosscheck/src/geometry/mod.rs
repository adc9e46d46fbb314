//! Level 1: shared rays against fibres and triangles, every disagreement with its reason.

mod fibres;
mod reason;
mod triangles;

use crate::{Bundle, Case, CrossError, Gate, Size, fixed};
use strandbench_types::{StrandSet, TriMesh};

/// Share of rays that one hits and the other misses.
const MISS_SHARE: f64 = 3e-4;
/// Share of rays that name another segment.
const PRIMITIVE_SHARE: f64 = 1.5e-3;
/// 99th percentile of the difference in distance, mm.
const DISTANCE_MM: f64 = 5e-4;

pub(crate) fn cases(size: Size) -> Result<Vec<Case>, CrossError> {
    let view = fixed::camera(320, 240, 42.0);
    let small = fixed::tuft(200, 24);
    let hair = |name: &str, strands: &StrandSet, camera: u32, each: u32| {
        let rays = fixed::joined(fixed::camera_rays(&view, camera), fixed::scattered_rays(strands, each));
        on_fibres(name, strands, &rays)
    };
    let mesh = |name: &str, mesh: &TriMesh, count: u32| {
        let rays = fixed::joined(fixed::sphere_rays(count), fixed::camera_rays(&view, count / 2));
        on_triangles(name, mesh, &rays)
    };
    let bumpy = fixed::bumpy(120, 60);
    Ok(match size {
        Size::Fixture => vec![hair("tuft", &small, 4_000, 1_500), mesh("bumpy", &bumpy, 4_000)],
        Size::Quick => vec![hair("tuft", &small, 40_000, 20_000), mesh("bumpy", &bumpy, 40_000)],
        Size::Full => {
            let entry = &strandbench_scenes::catalog()[0];
            let ours = |e: strandbench_scenes::SceneError| CrossError::Ours(e.to_string());
            let spec = entry.spec().map_err(ours)?.with_strands(4_000);
            let scene = strandbench_scenes::build(&spec, 1, None).map_err(ours)?;
            let head = &scene.surfaces[0].mesh;
            let view = &scene.rig.cameras[0];
            let hairstyle = fixed::joined(
                fixed::camera_rays(view, 400_000),
                fixed::scattered_rays(&scene.strands, 200_000),
            );
            let around = fixed::joined(fixed::camera_rays(view, 200_000), fixed::sphere_rays(200_000));
            vec![
                hair("tuft", &small, 200_000, 100_000),
                on_fibres("hairstyle", &scene.strands, &hairstyle),
                mesh("bumpy", &bumpy, 200_000),
                on_triangles("head", head, &around),
            ]
        }
    })
}

fn with_rays(input: Bundle, rays: &fixed::Rays) -> Bundle {
    input.with_vec3("origins", &rays.origins).with_vec3("directions", &rays.directions).with(
        "tmax",
        &[rays.tmax.len()],
        rays.tmax.iter().copied(),
    )
}

pub(crate) fn with_strands(input: Bundle, strands: &StrandSet) -> Bundle {
    input
        .with_vec3("points", &strands.points)
        .with("radii", &[strands.radii_mm.len()], strands.radii_mm.iter().copied())
        .with("offsets", &[strands.offsets.len()], strands.offsets.iter().copied())
}

pub(crate) fn strands_of(input: &Bundle) -> Result<StrandSet, CrossError> {
    let set = StrandSet {
        points: input.vec3("points", 0)?,
        radii_mm: input.get("radii", &[0])?,
        offsets: input.get("offsets", &[0])?,
    };
    set.validate().map_err(|e| CrossError::Ours(e.to_string()))?;
    Ok(set)
}

fn on_fibres(name: &str, strands: &StrandSet, rays: &fixed::Rays) -> Case {
    let input = with_rays(with_strands(Bundle::new(name), strands), rays);
    Case { level: 1, name: name.to_owned(), job: "geometry", input }
}

fn on_triangles(name: &str, mesh: &TriMesh, rays: &fixed::Rays) -> Case {
    let input = with_rays(Bundle::new(name), rays).with_vec3("vertices", &mesh.vertices).with(
        "triangles",
        &[mesh.triangles.len(), 3],
        mesh.triangles.iter().flatten().copied(),
    );
    Case { level: 1, name: name.to_owned(), job: "triangles", input }
}

pub(crate) fn judge(case: &Case, answer: &Bundle) -> Result<Vec<Gate>, CrossError> {
    let origins = case.input.vec3("origins", 0)?;
    let n = origins.len();
    let directions = case.input.vec3("directions", n)?;
    let tmax: Vec<f32> = case.input.get("tmax", &[n])?;
    match case.job {
        "triangles" => triangles::judge(case, answer, &origins, &directions),
        _ => fibres::judge(case, answer, &origins, &directions, &tmax),
    }
}
