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
