//! One rig in the conventions of COLMAP, OpenCV and NeRF.

use super::write_text;
use crate::SuiteError;
use glam::{DMat3, DQuat};
use serde_json::json;
use std::fmt::Write as _;
use std::path::Path;
use strandbench_types::{Camera, Rig};

/// One image of one camera at one time.
pub struct Shot {
    /// The picture, from the dataset's folder.
    pub image: String,
    /// The mask, from the dataset's folder.
    pub mask: String,
    /// Time, s; `None` where nothing moves.
    pub time_s: Option<f64>,
    /// The camera.
    pub camera: Camera,
}

/// COLMAP's `cameras.txt`: a PINHOLE camera for each, numbered from 1. COLMAP's top-left pixel has its centre at
/// (0.5, 0.5), as ours.
pub fn colmap_cameras(rig: &Rig) -> String {
    let mut text = String::from(
        "# Camera list with one line of data per camera:\n#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n",
    );
    let _ = writeln!(text, "# Number of cameras: {}", rig.cameras.len());
    for (i, c) in rig.cameras.iter().enumerate() {
        let (f, p) = (c.focal_px, c.principal_px);
        let _ = writeln!(text, "{} PINHOLE {} {} {} {} {} {}", i + 1, c.width, c.height, f.x, f.y, p.x, p.y);
    }
    text
}

/// COLMAP's `images.txt`: an image `<camera>.png` for each camera, without points; translations in mm.
pub fn colmap_images(rig: &Rig) -> String {
    let mut text = String::from(
        "# Image list with two lines of data per image:\n#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n\
         #   POINTS2D[] as (X, Y, POINT3D_ID)\n",
    );
    let _ = writeln!(text, "# Number of images: {}, mean observations per image: 0", rig.cameras.len());
    for (i, c) in rig.cameras.iter().enumerate() {
        let q = DQuat::from_mat3(&c.camera_from_world).normalize();
        let q = if q.w < 0.0 { -q } else { q };
        let t = c.translation_mm;
        let n = i + 1;
        let _ = writeln!(
            text,
            "{n} {} {} {} {} {} {} {} {n} {}.png\n",
            q.w, q.x, q.y, q.z, t.x, t.y, t.z, c.name
        );
    }
    text
}

/// Writes COLMAP's text model, without points.
pub(super) fn write_colmap(dir: &Path, rig: &Rig) -> Result<(), SuiteError> {
    write_text(&dir.join("cameras.txt"), &colmap_cameras(rig))?;
    write_text(&dir.join("images.txt"), &colmap_images(rig))?;
    let points = "# 3D point list: none\n";
    write_text(&dir.join("points3D.txt"), points)
}

/// K, R, t as OpenCV's functions take them: OpenCV's top-left pixel has its centre at (0, 0), so principal points are half
/// a pixel less than ours.
pub fn opencv_json(rig: &Rig) -> String {
    let rows = |m: &DMat3| m.transpose().to_cols_array_2d();
    let cameras: Vec<_> = rig
        .cameras
        .iter()
        .map(|c| {
            let (f, p) = (c.focal_px, c.principal_px);
            json!({
                "name": c.name, "width": c.width, "height": c.height,
                "K": [[f.x, 0.0, p.x - 0.5], [0.0, f.y, p.y - 0.5], [0.0, 0.0, 1.0]],
                "R": rows(&c.camera_from_world),
                "t_mm": c.translation_mm.to_array(),
                "distortion": [0.0, 0.0, 0.0, 0.0, 0.0],
            })
        })
        .collect();
    let file = json!({
        "convention": "x_cam = R x_world + t, mm; +x right, +y down, +z forward; the centre of the top-left pixel is (0, 0)",
        "cameras": cameras,
    });
    pretty(&file)
}

/// Poses as NeRF's programs take them: camera to world in mm, OpenGL's axes (+x right, +y up, +z backward); the
/// top-left pixel's centre is (0.5, 0.5).
pub fn transforms_json(shots: &[Shot]) -> String {
    let frames: Vec<_> = shots
        .iter()
        .map(|shot| {
            let c = &shot.camera;
            let r = c.camera_from_world.transpose();
            let eye = c.centre_mm();
            let row = |k: usize| [r.x_axis[k], -r.y_axis[k], -r.z_axis[k], eye[k]];
            let mut frame = json!({
                "file_path": shot.image, "mask_path": shot.mask, "w": c.width, "h": c.height,
                "fl_x": c.focal_px.x, "fl_y": c.focal_px.y, "cx": c.principal_px.x, "cy": c.principal_px.y,
                "transform_matrix": [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]],
            });
            if let Some(time_s) = shot.time_s {
                frame["time"] = json!(time_s);
            }
            frame
        })
        .collect();
    pretty(&json!({ "camera_model": "OPENCV", "k1": 0.0, "k2": 0.0, "p1": 0.0, "p2": 0.0, "frames": frames }))
}

fn pretty(value: &serde_json::Value) -> String {
    serde_json::to_string_pretty(value).expect("plain data") + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec2, DVec3};
    use serde_json::Value;

    fn rig() -> Rig {
        let eyes =
            [DVec3::new(10.0, 40.0, 900.0), DVec3::new(-700.0, -80.0, 500.0), DVec3::new(30.0, 60.0, -950.0)];
        let names = ["center", "side", "back"];
        let camera = |(eye, name): (DVec3, &str)| Camera {
            focal_px: DVec2::new(1_250.123_456_789, 1249.0),
            principal_px: DVec2::new(321.25, 238.5),
            ..Camera::look_at(
                name,
                (640, 480),
                1.0,
                eye,
                DVec3::new(3.0, 5.0, 7.0),
                DVec3::new(0.3, -1.0, 0.0),
            )
        };
        let cameras = eyes.into_iter().zip(names).map(camera).collect();
        Rig { cameras, near_mm: 700.0, far_mm: 1100.0, frame_rate_hz: 100.0, exposure_s: 0.001 }
    }

    /// Calls `project` with a camera's index and points that it sees, and holds the answer against the camera.
    fn projects(project: impl Fn(usize, DVec3) -> DVec2) {
        for (c, camera) in rig().cameras.iter().enumerate() {
            for i in 0..60u32 {
                let part = |k: u32| f64::from(i * k % 59) / 59.0 - 0.5;
                let p = DVec3::new(300.0 * part(17), 400.0 * part(23), 300.0 * part(41));
                let (want, _) = camera.project(p).unwrap();
                let got = project(c, p);
                assert!((got - want).length() < 1e-6, "camera {c}: {got} for {want}");
            }
        }
    }

    fn numbers(text: &str) -> Vec<Vec<f64>> {
        let lines = text.lines().filter(|l| !l.starts_with('#') && !l.is_empty());
        lines.map(|l| l.split(' ').filter_map(|w| w.parse().ok()).collect()).collect()
    }

    fn number(v: &Value) -> f64 {
        v.as_f64().unwrap()
    }

    #[test]
    fn colmaps_text_projects_as_its_manual_says() {
        let (cameras, images) = (numbers(&colmap_cameras(&rig())), numbers(&colmap_images(&rig())));
        projects(|c, p| {
            let [id, _, _, fx, fy, cx, cy] = cameras[c][..] else { panic!("{:?}", cameras[c]) };
            let [image, w, x, y, z, tx, ty, tz, camera] = images[c][..] else { panic!("{:?}", images[c]) };
            assert_eq!((id, image, camera), (c as f64 + 1.0, c as f64 + 1.0, c as f64 + 1.0));
            // The rotation of a unit quaternion, w + xi + yj + zk: v + 2 u x (u x v + w v).
            let u = DVec3::new(x, y, z);
            let q = p + 2.0 * u.cross(u.cross(p) + w * p) + DVec3::new(tx, ty, tz);
            DVec2::new(fx * q.x / q.z + cx, fy * q.y / q.z + cy)
        });
        assert!(colmap_images(&rig()).contains(" 2 side.png\n\n"), "an image's line, then its points' line");
    }

    #[test]
    fn opencvs_matrices_project_with_pixels_counted_from_their_centres() {
        let file: Value = serde_json::from_str(&opencv_json(&rig())).unwrap();
        projects(|c, p| {
            let (k, r, t) = (&file["cameras"][c]["K"], &file["cameras"][c]["R"], &file["cameras"][c]["t_mm"]);
            let q: [f64; 3] =
                std::array::from_fn(|i| (0..3).map(|j| number(&r[i][j]) * p[j]).sum::<f64>() + number(&t[i]));
            let pixel = |i: usize| (0..3).map(|j| number(&k[i][j]) * q[j]).sum::<f64>() / q[2];
            DVec2::new(pixel(0), pixel(1)) + 0.5
        });
    }

    #[test]
    fn nerfs_poses_look_along_minus_z() {
        let shots: Vec<Shot> = rig()
            .cameras
            .into_iter()
            .map(|camera| Shot { image: "i.png".into(), mask: "m.png".into(), time_s: Some(0.25), camera })
            .collect();
        let file: Value = serde_json::from_str(&transforms_json(&shots)).unwrap();
        projects(|c, p| {
            let f = &file["frames"][c];
            assert_eq!(number(&f["time"]), 0.25);
            let m = |i: usize, j: usize| number(&f["transform_matrix"][i][j]);
            // A rotation's inverse is its transpose.
            let q: [f64; 3] =
                std::array::from_fn(|j| (0..3).map(|i| m(i, j) * (p[i] - m(i, 3))).sum::<f64>());
            let (x, y) = (q[0] / -q[2], q[1] / q[2]);
            DVec2::new(number(&f["cx"]) + number(&f["fl_x"]) * x, number(&f["cy"]) + number(&f["fl_y"]) * y)
        });
    }
}
