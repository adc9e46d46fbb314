//! Pinhole cameras and rigs.

use glam::{DMat3, DVec2, DVec3};
use serde::{Deserialize, Serialize};

/// A pinhole camera without distortion, in OpenCV's convention.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// Short name, unique in its rig.
    pub name: String,
    /// Image width in pixels.
    pub width: u32,
    /// Image height in pixels.
    pub height: u32,
    /// Focal lengths in pixels (x, y).
    pub focal_px: DVec2,
    /// Principal point in pixels; the image's centre is (width/2, height/2).
    pub principal_px: DVec2,
    /// Rotation part of camera-from-world (column-major, orthonormal, determinant +1).
    pub camera_from_world: DMat3,
    /// Translation part of camera-from-world in mm: x_cam = R x_world + t.
    pub translation_mm: DVec3,
}

impl Camera {
    /// A camera at `eye` (mm) that looks at `target` with `down` as near to +y of the image as it can be.
    pub fn look_at(
        name: &str,
        (width, height): (u32, u32),
        focal_px: f64,
        eye: DVec3,
        target: DVec3,
        down: DVec3,
    ) -> Camera {
        let z = (target - eye).normalize();
        let x = down.cross(z).normalize();
        let y = z.cross(x);
        let rotation = DMat3::from_cols(x, y, z).transpose();
        Camera {
            name: name.to_owned(),
            width,
            height,
            focal_px: DVec2::splat(focal_px),
            principal_px: DVec2::new(f64::from(width) * 0.5, f64::from(height) * 0.5),
            camera_from_world: rotation,
            translation_mm: -(rotation * eye),
        }
    }

    /// The optical centre in world coordinates, mm.
    pub fn centre_mm(&self) -> DVec3 {
        -(self.camera_from_world.transpose() * self.translation_mm)
    }

    /// The point in camera coordinates, mm.
    pub fn to_camera(&self, world_mm: DVec3) -> DVec3 {
        self.camera_from_world * world_mm + self.translation_mm
    }

    /// The pixel position and the depth along +z (mm) of a world point; `None` at or behind the camera.
    pub fn project(&self, world_mm: DVec3) -> Option<(DVec2, f64)> {
        let c = self.to_camera(world_mm);
        if c.z <= 0.0 {
            return None;
        }
        Some((self.focal_px * DVec2::new(c.x, c.y) / c.z + self.principal_px, c.z))
    }

    /// The world point (mm) seen at `pixel` at depth `z_mm` along +z.
    pub fn unproject(&self, pixel: DVec2, z_mm: f64) -> DVec3 {
        let xy = (pixel - self.principal_px) / self.focal_px * z_mm;
        self.camera_from_world.transpose() * (DVec3::new(xy.x, xy.y, z_mm) - self.translation_mm)
    }

    /// The unnormalised world direction of the ray through `pixel`; its camera-space z is 1, so a ray
    /// parameter along it is a depth in mm.
    pub fn ray_direction(&self, pixel: DVec2) -> DVec3 {
        let xy = (pixel - self.principal_px) / self.focal_px;
        self.camera_from_world.transpose() * DVec3::new(xy.x, xy.y, 1.0)
    }

    /// Whether `pixel` lies inside the image.
    pub fn contains(&self, pixel: DVec2) -> bool {
        pixel.x >= 0.0
            && pixel.y >= 0.0
            && pixel.x < f64::from(self.width)
            && pixel.y < f64::from(self.height)
    }

    /// Says what is wrong with the camera's numbers, if anything is.
    pub fn validate(&self) -> Result<(), String> {
        let r = &self.camera_from_world;
        let finite = self.focal_px.is_finite()
            && self.principal_px.is_finite()
            && r.is_finite()
            && self.translation_mm.is_finite();
        if !finite {
            return Err(format!("camera {}: a parameter is NaN or infinite", self.name));
        }
        if self.width == 0 || self.height == 0 || self.width > 16_384 || self.height > 16_384 {
            return Err(format!(
                "camera {}: image size {}x{} is outside 1..16384",
                self.name, self.width, self.height
            ));
        }
        if self.focal_px.min_element() <= 0.0 {
            return Err(format!("camera {}: focal length must be positive", self.name));
        }
        let off = (*r * r.transpose() - DMat3::IDENTITY)
            .to_cols_array()
            .iter()
            .fold(0.0, |m: f64, v| m.max(v.abs()));
        if off > 1e-6 || (r.determinant() - 1.0).abs() > 1e-6 {
            return Err(format!("camera {}: camera_from_world is not a rotation", self.name));
        }
        Ok(())
    }
}

/// Cameras in fixed order, 0 being the reference, and the working volume in front of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rig {
    /// The cameras; index 0 is the reference view.
    pub cameras: Vec<Camera>,
    /// Nearest depth (mm, +z of the reference) that a reconstruction may consider: Luo's d_near.
    pub near_mm: f64,
    /// Farthest depth (mm): Luo's d_far.
    pub far_mm: f64,
    /// Frames a second.
    pub frame_rate_hz: f64,
    /// Exposure time in seconds.
    pub exposure_s: f64,
}

impl Rig {
    /// Says what is wrong with the rig, if anything is: no cameras, a bad camera, a name used twice, an
    /// empty working volume.
    pub fn validate(&self) -> Result<(), String> {
        if self.cameras.is_empty() {
            return Err("the rig has no cameras".to_owned());
        }
        for (i, c) in self.cameras.iter().enumerate() {
            c.validate()?;
            if self.cameras[..i].iter().any(|o| o.name == c.name) {
                return Err(format!("camera name {} is used twice", c.name));
            }
        }
        if !(self.near_mm > 0.0 && self.far_mm > self.near_mm && self.far_mm.is_finite()) {
            return Err(format!(
                "the working volume {}..{} mm is empty or not positive",
                self.near_mm, self.far_mm
            ));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn camera() -> Camera {
        Camera::look_at(
            "c",
            (640, 480),
            1200.0,
            DVec3::new(100.0, 50.0, 900.0),
            DVec3::new(0.0, 10.0, 0.0),
            DVec3::NEG_Y,
        )
    }

    #[test]
    fn target_projects_to_the_principal_point_and_up_is_up() {
        let c = camera();
        let (p, z) = c.project(DVec3::new(0.0, 10.0, 0.0)).unwrap();
        assert!((p - c.principal_px).length() < 1e-9);
        assert!((z - DVec3::new(100.0, 40.0, 900.0).length()).abs() < 1e-9);
        let (above, _) = c.project(DVec3::new(0.0, 30.0, 0.0)).unwrap();
        assert!(above.y < p.y, "world up must be image up");
        let right = c.camera_from_world.transpose() * DVec3::X;
        assert!(right.x > 0.9, "a camera on +z looking at the origin has world +x on its right");
        c.validate().unwrap();
    }

    proptest! {
        #[test]
        fn project_inverts_unproject(x in 0.0..640.0f64, y in 0.0..480.0f64, z in 1.0..2000.0f64) {
            let c = camera();
            let w = c.unproject(DVec2::new(x, y), z);
            let (p, d) = c.project(w).unwrap();
            prop_assert!((p - DVec2::new(x, y)).length() < 1e-7);
            prop_assert!((d - z).abs() < 1e-8);
            let along = c.centre_mm() + c.ray_direction(DVec2::new(x, y)) * z;
            prop_assert!((along - w).length() < 1e-8);
        }
    }
}
