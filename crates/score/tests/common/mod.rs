//! A scene whose truth is written down from formulas: hair wound round a cylinder, seen by three cameras.
#![allow(dead_code, reason = "each test binary uses its own part")]

pub mod splat;
pub mod strands;

use glam::{DMat3, DVec2, DVec3, Vec3};
use std::f64::consts::{PI, TAU};
use std::process::{Command, Stdio};
use strandbench_rng::Rng;
use strandbench_score::{Score, ScoreSheet, score};
use strandbench_types::{
    Camera, DepthMap, Estimate, OrientationField, Plane, Rig, Silent, StrandSet, TriMesh, Truth,
    VISIBILITY_STEP_MM, ViewTruth, Visibility,
};

pub const RADIUS: f64 = 60.0;
const HALF_HEIGHT: f64 = 70.0;
/// Turn of the hair about the axis, radians per mm of height.
const TWIST: f64 = 0.012;

/// A motion of the whole world.
#[derive(Clone, Copy)]
pub struct Motion {
    pub rotation: DMat3,
    pub shift: DVec3,
}

pub const STILL: Motion = Motion { rotation: DMat3::IDENTITY, shift: DVec3::ZERO };

impl Motion {
    fn point(&self, p: DVec3) -> DVec3 {
        self.rotation * p + self.shift
    }
}

/// Where the ray enters the cylinder about the y axis, and the fibre direction there; before any motion.
fn hit(eye: DVec3, d: DVec3) -> Option<(f64, DVec3)> {
    let (a, b) = (d.x * d.x + d.z * d.z, eye.x * d.x + eye.z * d.z);
    let c = eye.x * eye.x + eye.z * eye.z - RADIUS * RADIUS;
    let root = b * b - a * c;
    if root < 0.0 {
        return None;
    }
    let z = (-b - root.sqrt()) / a;
    let p = eye + d * z;
    (p.y.abs() <= HALF_HEIGHT).then(|| (z, tangent(p)))
}

fn tangent(p: DVec3) -> DVec3 {
    (DVec3::Y + DVec3::new(p.z, 0.0, -p.x) * TWIST).normalize()
}

fn at(turn: f64, y: f64, radius: f64) -> DVec3 {
    let a = turn + TWIST * (y + HALF_HEIGHT);
    DVec3::new(radius * a.sin(), y, radius * a.cos())
}

fn cameras() -> Vec<Camera> {
    let eyes = [(0.0, 0.0), (-230.0, 0.0), (0.0, -200.0)];
    let look = |(i, &(x, y)): (usize, &(f64, f64))| {
        let eye = DVec3::new(x, y, 700.0);
        Camera::look_at(&format!("c{i}"), (72, 64), 240.0, eye, DVec3::new(0.0, 0.0, 20.0), DVec3::NEG_Y)
    };
    eyes.iter().enumerate().map(look).collect()
}

fn view(camera: &Camera, motion: &Motion) -> ViewTruth {
    let (w, h) = (camera.width as usize, camera.height as usize);
    let centre = |i: usize| DVec2::new((i % w) as f64 + 0.5, (i / w) as f64 + 0.5);
    let hits: Vec<Option<(f64, DVec3)>> =
        (0..w * h).map(|i| hit(camera.centre_mm(), camera.ray_direction(centre(i)))).collect();
    let depth = |nearer: f64| {
        let z = |h: &Option<(f64, DVec3)>| h.map_or(f32::NAN, |(z, _)| (z - nearer) as f32);
        DepthMap::from_raw(Plane::from_vec(w, h, hits.iter().map(z).collect()))
    };
    let angle = |(i, hit): (usize, &Option<(f64, DVec3)>)| {
        hit.map_or(f32::NAN, |(z, t)| {
            let p = camera.unproject(centre(i), z);
            let d = camera.project(p + t * 1e-3).unwrap().0 - camera.project(p - t * 1e-3).unwrap().0;
            let a = d.y.atan2(d.x).rem_euclid(PI) as f32;
            if a >= PI as f32 { 0.0 } else { a }
        })
    };
    let axis = |hit: &Option<(f64, DVec3)>| hit.map_or(Vec3::ZERO, |(_, t)| (motion.rotation * t).as_vec3());
    ViewTruth {
        depth_first: depth(3.0),
        depth_05: depth(2.0),
        depth_50: depth(0.0),
        coverage: Plane::from_vec(w, h, hits.iter().map(|h| if h.is_some() { 1.0 } else { 0.0 }).collect()),
        mask: Plane::from_vec(w, h, hits.iter().map(Option::is_some).collect()),
        orientation_2d: Plane::from_vec(w, h, hits.iter().enumerate().map(angle).collect()),
        orientation_agreement: Plane::filled(w, h, 1.0),
        orientation_3d: Plane::from_vec(w, h, hits.iter().map(axis).collect()),
    }
}

/// The scene's truth; `radii` of the layers of hair, the outermost at [`RADIUS`]. Every strand sample that
/// faces a camera counts as seen by it, whatever layer it lies in.
pub fn scene(motion: &Motion, radii: &[f64]) -> Truth {
    let still = cameras();
    let views = still.iter().map(|c| view(c, motion)).collect();
    let mut strands = StrandSet::new();
    for (layer, &radius) in radii.iter().enumerate() {
        for k in 0..90 {
            let turn = (f64::from(k) + 0.37 * layer as f64) / 90.0 * 2.0 * PI;
            let points: Vec<Vec3> = (0..=20)
                .map(|j| motion.point(at(turn, -HALF_HEIGHT + 7.0 * f64::from(j), radius)).as_vec3())
                .collect();
            strands.push(&points, 0.04);
        }
    }
    let visibility = facing(&strands, &still, motion);
    let moved = still
        .into_iter()
        .map(|mut c| {
            let eye = motion.point(c.centre_mm());
            c.camera_from_world *= motion.rotation.transpose();
            c.translation_mm = -(c.camera_from_world * eye);
            c
        })
        .collect();
    let rig = Rig { cameras: moved, near_mm: 500.0, far_mm: 860.0, frame_rate_hz: 100.0, exposure_s: 0.001 };
    Truth { rig, views, strands, visibility, head: None }
}

fn facing(strands: &StrandSet, still: &[Camera], motion: &Motion) -> Visibility {
    let mut v = Visibility { offsets: vec![0], seen_by: Vec::new() };
    for s in 0..strands.len() {
        let points = strands.strand(s);
        let (mut k, mut start) = (0, 0.0);
        for i in 0..Visibility::samples_on(strands.length_mm(s)) {
            let arc = (i as f64 + 0.5) * f64::from(VISIBILITY_STEP_MM);
            let mut length = f64::from(points[k].distance(points[k + 1]));
            while start + length < arc && k + 2 < points.len() {
                start += length;
                k += 1;
                length = f64::from(points[k].distance(points[k + 1]));
            }
            let moved = points[k].as_dvec3().lerp(points[k + 1].as_dvec3(), (arc - start) / length);
            let p = motion.rotation.transpose() * (moved - motion.shift);
            let outward = DVec3::new(p.x, 0.0, p.z);
            let bits = still.iter().enumerate().filter(|(_, c)| (c.centre_mm() - p).dot(outward) > 0.0);
            v.seen_by.push(bits.fold(0, |b, (c, _)| b | 1 << c));
        }
        v.offsets.push(v.seen_by.len() as u32);
    }
    v
}

/// The truth as a method would have to submit it, its envelope the mesh between its pixels.
pub fn submission(truth: &Truth) -> Estimate {
    let v = &truth.views[0];
    let line = |f: fn(f32) -> f32| v.orientation_2d.map(|&a| if a.is_nan() { 0.0 } else { f(2.0 * a) });
    Estimate {
        depth: Some(v.depth_50.clone()),
        envelope: Some(mesh(&truth.rig.cameras[0], &v.depth_50)),
        orientation: Some(OrientationField { re: line(f32::cos), im: line(f32::sin) }),
        orientation_3d: Some(v.orientation_3d.clone()),
        strands: None,
        strand_ids: None,
    }
}

pub fn mesh(camera: &Camera, depth: &DepthMap) -> TriMesh {
    let (w, h) = depth.size();
    let mut mesh = TriMesh::default();
    let mut names = vec![0; w * h];
    for i in 0..w * h {
        let Some(z) = depth.get_index(i) else { continue };
        names[i] = mesh.vertices.len() as u32;
        let p = DVec2::new((i % w) as f64 + 0.5, (i / w) as f64 + 0.5);
        mesh.vertices.push(camera.unproject(p, f64::from(z)).as_vec3());
    }
    for i in 0..w * (h - 1) {
        let square = [i, i + 1, i + w, i + w + 1];
        if i % w + 1 < w && square.iter().all(|&k| depth.get_index(k).is_some()) {
            let [a, b, c, d] = square.map(|k| names[k]);
            mesh.triangles.extend([[a, c, b], [b, c, d]]);
        }
    }
    mesh
}

/// A depth map with every answer changed; `None` withdraws it.
pub fn remapped(depth: &DepthMap, f: impl Fn(usize, f32) -> Option<f32>) -> DepthMap {
    let (w, h) = depth.size();
    let at = |i: usize| depth.get_index(i).and_then(|z| f(i, z)).unwrap_or(f32::NAN);
    DepthMap::from_raw(Plane::from_vec(w, h, (0..w * h).map(at).collect()))
}

pub fn sheet(truth: &Truth, estimate: &Estimate) -> ScoreSheet {
    score(truth, estimate, 7, &Silent).unwrap()
}

pub fn row<'a>(sheet: &'a ScoreSheet, id: &str) -> &'a Score {
    sheet.get("method", id).unwrap()
}

/// The method's value, which must be there.
pub fn value(sheet: &ScoreSheet, id: &str) -> f64 {
    row(sheet, id).value.unwrap_or_else(|| panic!("{id} has no value"))
}

/// A normal deviate of this key.
pub fn normal(key: &[u64]) -> f64 {
    let mut r = Rng::keyed(key);
    let (a, b) = (1.0 - r.f64(), r.f64());
    (-2.0 * a.ln()).sqrt() * (TAU * b).cos()
}

/// The Python of the oracles, if it has numpy: `STRANDBENCH_PYTHON`, else `python3`. Says so if not.
pub fn numpy() -> Option<String> {
    let python = std::env::var("STRANDBENCH_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let there = Command::new(&python).args(["-c", "import numpy"]).stderr(Stdio::null()).status();
    if there.is_ok_and(|s| s.success()) {
        return Some(python);
    }
    println!("ignored, no numpy: install it for python3 or set STRANDBENCH_PYTHON");
    None
}

/// What an oracle (a script beside the tests) prints for a case.
pub fn ask(python: &str, script: &str, case: &serde_json::Value) -> serde_json::Value {
    let script = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests").join(script);
    let mut child = Command::new(python)
        .arg(script)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("python started a moment ago");
    let mut input = child.stdin.take().unwrap();
    std::io::Write::write_all(&mut input, case.to_string().as_bytes()).unwrap();
    drop(input);
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "the oracle failed");
    serde_json::from_slice(&output.stdout).expect("the oracle prints JSON")
}
