//! Input that is refused.

use super::*;
use crate::GroundTruthError;
use strandbench_types::{Cancelled, FirstHit, Monitor, Sight};

struct Everything;

impl Sight for Everything {
    fn sees(&self, _: &Camera, _: DVec3, _: strandbench_types::Element) -> bool {
        true
    }
}

struct Stopped;

impl Monitor for Stopped {
    fn begin(&self, _: &str, _: u64) {}
    fn advance(&self, _: u64) {}
    fn cancelled(&self) -> bool {
        true
    }
}

fn small() -> (StrandSet, TriMesh, Vec<Mat3>) {
    let mut strands = StrandSet::new();
    strands.push(&[Vec3::ZERO, Vec3::Z, Vec3::new(0.0, 1.0, 2.0)], 0.05);
    let vertices = vec![Vec3::new(-5.0, -5.0, 0.0), Vec3::new(5.0, -5.0, 0.0), Vec3::new(0.0, 5.0, 0.0)];
    (strands, TriMesh { vertices, triangles: vec![[0, 1, 2]] }, vec![Mat3::IDENTITY])
}

fn said(e: Result<impl Sized, GroundTruthError>) -> String {
    e.err().map_or_else(|| "accepted".into(), |e| e.to_string())
}

#[test]
fn moments_that_do_not_fit_are_refused_and_named() {
    let good = small();
    let check = |change: fn(&mut (StrandSet, TriMesh, Vec<Mat3>))| {
        let mut other = small();
        change(&mut other);
        let (a, b) = ([&good.1], [&other.1]);
        let now = Moment { strands: &good.0, meshes: &a, follicle_axes: &good.2 };
        let then = Moment { strands: &other.0, meshes: &b, follicle_axes: &other.2 };
        said(check_moments(&now, &then))
    };
    assert_eq!(check(|_| ()), "accepted");
    for (got, want) in [
        (check(|o| o.0.push(&[Vec3::X, Vec3::Y], 0.1)), "(1 and 2) differ in number"),
        (check(|o| o.0.points[1].x = f32::NAN), "not finite"),
        (check(|o| o.2.clear()), "1 strands have 0 axes"),
        (check(|o| o.2[0].x_axis *= 1.1), "follicle of strand 0 are not orthonormal"),
        (check(|o| o.2[0].x_axis.x = f32::NAN), "not orthonormal"),
        (check(|o| o.1.triangles[0] = [0, 2, 1]), "surface 0 differs in topology"),
        (check(|o| o.1.vertices[0].z = f32::INFINITY), "surface 0: vertex 0 is not finite"),
    ] {
        assert!(got.contains(want), "{got:?} does not say {want:?}");
    }
}

#[test]
fn hits_that_are_not_there_are_refused_and_named() {
    let (strands, mesh, axes) = small();
    let meshes = [&mesh];
    let m = Moment { strands: &strands, meshes: &meshes, follicle_axes: &axes };
    let camera = Camera::look_at("c", (9, 9), 100.0, DVec3::new(0.0, 0.0, 90.0), DVec3::ZERO, DVec3::NEG_Y);
    let plane = Probe::new(&strands, &meshes).unwrap().first_hits(&camera, &Silent).unwrap();
    let run = |change: &dyn Fn(&mut HitPlane)| {
        let mut p = plane.clone();
        change(&mut p);
        said(flow(&camera, &p, (&m, &m), &Everything, &Silent))
    };
    assert_eq!(run(&|_| ()), "accepted");
    let bad = FirstHit::Fibre { strand: 0, segment: 2, along: 0.5 };
    assert!(run(&|p| p.hits.data[40] = bad).contains("pixel (4, 4)"));
    let bad = FirstHit::Mesh { surface: 1, triangle: 0, uv: [0.1; 2] };
    assert!(run(&|p| p.hits.data[40] = bad).contains("which is not there"));
    assert!(run(&|p| p.depth.set(4, 4, None)).contains("pixel (4, 4) has a hit without depth"));
    assert!(run(&|p| p.hits.width = 3).contains("first hits are (3, 9) px"));
    let stopped = flow(&camera, &plane, (&m, &m), &Everything, &Stopped);
    assert_eq!(stopped.unwrap_err(), GroundTruthError::Cancelled(Cancelled));
    let kinds = |kinds: &[u8], seen: HitPlane, bare: HitPlane| {
        let frames = Frames { now: m, reference: m, kinds, sight: &Everything, bare_sight: &Everything };
        said(face_view(&frames, &camera, seen, bare, &Silent))
    };
    let none = StrandSet::new();
    let bare = Probe::new(&none, &meshes).unwrap().behind_hair(&camera, &plane, &Silent).unwrap();
    assert_eq!(kinds(&[3], plane.clone(), bare.clone()), "accepted");
    assert!(kinds(&[], plane.clone(), bare.clone()).contains("1 strands have 0 kinds"));
    assert!(kinds(&[240], plane.clone(), bare.clone()).contains("kind 240; labels have room for 239"));
    assert!(kinds(&[0], plane.clone(), plane.clone()).contains("hair without hair"));
}

#[test]
fn fields_and_indices_without_sense_are_refused() {
    let (strands, mesh, _) = small();
    assert!(said(HairIndex::new(&strands, |_| false)).contains("no strand is included"));
    let index = HairIndex::new(&strands, |_| true).unwrap();
    for (voxel, margin) in [(0.0, 1.0), (-1.0, 1.0), (f32::NAN, 1.0), (1.0, -1.0), (1.0, f32::INFINITY)] {
        assert!(said(hair_field(&index, voxel, margin, &Silent)).contains("give positive lengths"));
    }
    assert!(said(hair_field(&index, 1e-3, 10.0, &Silent)).contains("take larger"));
    assert!(said(hair_field(&index, 1e-38, 10.0, &Silent)).contains("take larger"));
    let stopped = hair_field(&index, 1.0, 10.0, &Stopped);
    assert_eq!(stopped.unwrap_err(), GroundTruthError::Cancelled(Cancelled));
    let follicles = Follicles { triangles: &[0], barycentrics: &[], kinds: &[0] };
    assert!(said(hair_roots(&strands, &follicles)).contains("1 strands have [1, 0, 1] triangles"));
    let sightings = SkinSightings::new(2);
    assert!(said(skin_cover(&mesh, None, &sightings)).contains("3 vertices of the skin have 2"));
}
