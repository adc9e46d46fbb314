//! The scene in Mitsuba's words.

use serde_json::{Value, json};
use std::path::Path;
use strandbench_scenes::Scene;

/// The scene in Mitsuba's words: its camera looks along +z with +x to the left and +y up, its unit rectangle along
/// +z from (-1, -1) to (1, 1).
pub(super) fn scene(scene: &Scene, curve: &str, sampler: &str, folder: &Path) -> Value {
    let camera = &scene.rig.cameras[0];
    let (r, eye) = (camera.camera_from_world.transpose(), camera.centre_mm());
    let column = |axis: usize, sign: f64| r.col(axis).to_array().map(|v| sign * v);
    let (x, y, z, o) = (column(0, -1.0), column(1, -1.0), column(2, 1.0), eye.to_array());
    let rows = |x: [f64; 3], y: [f64; 3], z: [f64; 3], o: [f64; 3]| {
        json!([
            [x[0], y[0], z[0], o[0]],
            [x[1], y[1], z[1], o[1]],
            [x[2], y[2], z[2], o[2]],
            [0.0, 0.0, 0.0, 1.0]
        ])
    };
    let light = &scene.lights[0];
    let (u, v) = (light.half_u_mm.as_dvec3(), light.half_v_mm.as_dvec3());
    let n = u.cross(v).normalize();
    let centre = light.centre_mm.as_dvec3();
    let fov_deg = 2.0 * (f64::from(camera.width) / (2.0 * camera.focal_px.x)).atan().to_degrees();
    let optics = &scene.optics;
    json!({
        "do": "load", "folder": folder, "curve": curve,
        "camera": {
            "width": camera.width, "height": camera.height, "fov_deg": fov_deg, "sampler": sampler,
            "to_world": rows(x, y, z, o),
        },
        "light": {
            "to_world": rows(u.to_array(), v.to_array(), n.to_array(), centre.to_array()),
            "radiance_rgb": light.radiance_rgb,
        },
        "bsdf": {
            "type": "hair", "int_ior": optics.index, "ext_ior": 1.0,
            "longitudinal_roughness": optics.longitudinal_roughness,
            "azimuthal_roughness": optics.azimuthal_roughness, "scale_tilt": optics.scale_tilt_deg,
        },
        "absorption_rgb": scene.pigments[0].absorption_rgb(),
    })
}

#[cfg(test)]
mod tests {
    use super::super::SIZE;
    use super::*;
    use crate::hair;

    #[test]
    fn mitsuba_is_told_the_same_camera_and_light() {
        let scene = hair::scene(hair::wavy(2, 3, 1), SIZE);
        let d = super::scene(&scene, "linearcurve", "independent", Path::new("."));
        let matrix = |v: &Value, row: usize, column: usize| v["to_world"][row][column].as_f64().unwrap();
        // What its camera sees at +z, left and up of it, projects to the middle, left and upper half.
        let at = |x: f64, y: f64, z: f64| {
            let c = &d["camera"];
            let world: [f64; 3] = std::array::from_fn(|r| {
                matrix(c, r, 0) * x + matrix(c, r, 1) * y + matrix(c, r, 2) * z + matrix(c, r, 3)
            });
            scene.rig.cameras[0].to_camera(world.into())
        };
        assert!((at(0.0, 0.0, 5.0) - glam::DVec3::new(0.0, 0.0, 5.0)).length() < 1e-9);
        assert!((at(1.0, 2.0, 5.0) - glam::DVec3::new(-1.0, -2.0, 5.0)).length() < 1e-9);
        let half = (d["camera"]["fov_deg"].as_f64().unwrap() * 0.5).to_radians().tan();
        let camera = &scene.rig.cameras[0];
        assert!((half * camera.focal_px.x - 320.0).abs() < 1e-9);
        // The rectangle's normal looks at the hair.
        let l = &d["light"];
        let towards: f64 = (0..3).map(|r| matrix(l, r, 2) * -matrix(l, r, 3)).sum();
        assert!(towards > 0.0);
    }
}
