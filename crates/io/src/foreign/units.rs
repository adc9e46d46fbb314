//! `units.json`: what the numbers of an answer mean.

use crate::error::{IoError, Result};
use crate::read::read_all;
use glam::Vec3;
use serde::{Deserialize, Serialize};
use std::path::Path;
use strandbench_types::{Camera, Estimate};

/// The file's name.
pub(super) const UNITS: &str = "units.json";
/// Largest radius of a point's disc, px: more is no point.
const MAX_RADIUS_PX: f64 = 32.0;

#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Frame {
    #[default]
    World,
    ReferenceCamera,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Units {
    pub mm_per_unit: f64,
    frame: Frame,
    pub depth_png_mm_per_unit: Option<f64>,
    point_radius_px: f64,
}

impl Default for Units {
    fn default() -> Units {
        Units { mm_per_unit: 1.0, frame: Frame::World, depth_png_mm_per_unit: None, point_radius_px: 1.0 }
    }
}

impl Units {
    /// What the folder states; millimetres in the world where it states nothing.
    pub fn read(dir: &Path) -> Result<Units> {
        let path = dir.join(UNITS);
        if !path.exists() {
            return Ok(Units::default());
        }
        let units: Units = serde_json::from_slice(&read_all(&path)?).map_err(|e| {
            IoError::new(&path, format!("cannot be understood: {e}; correct or remove the file"))
        })?;
        for (name, value) in [
            ("mm_per_unit", units.mm_per_unit),
            ("depth_png_mm_per_unit", units.depth_png_mm_per_unit.unwrap_or(1.0)),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return Err(IoError::new(&path, format!("{name} is {value}; give a positive number")));
            }
        }
        Ok(units)
    }

    pub fn point_radius_px(&self, dir: &Path) -> Result<f64> {
        let r = self.point_radius_px;
        if (0.5..=MAX_RADIUS_PX).contains(&r) {
            return Ok(r);
        }
        let fault = format!("point_radius_px is {r}; give 0.5 to {MAX_RADIUS_PX}");
        Err(IoError::new(&dir.join(UNITS), fault))
    }

    /// A point of a file in mm, world.
    pub fn point(&self, p: Vec3, reference: &Camera) -> Vec3 {
        let mm = p.as_dvec3() * self.mm_per_unit;
        match self.frame {
            Frame::World => mm.as_vec3(),
            Frame::ReferenceCamera => {
                (reference.camera_from_world.transpose() * (mm - reference.translation_mm)).as_vec3()
            }
        }
    }

    /// Brings surface, strands and directions of an estimate from file units to mm in the world.
    pub fn place(&self, dir: &Path, e: &mut Estimate, reference: &Camera) -> Result<()> {
        if self.mm_per_unit == 1.0 && self.frame == Frame::World {
            return Ok(());
        }
        let world_from_camera = reference.camera_from_world.transpose();
        if let Some(mesh) = &mut e.envelope {
            mesh.vertices.iter_mut().for_each(|v| *v = self.point(*v, reference));
            mesh.validate().map_err(|fault| IoError::new(dir, format!("{fault} in mm; check {UNITS}")))?;
        }
        if let Some(s) = &mut e.strands {
            s.points.iter_mut().for_each(|p| *p = self.point(*p, reference));
            s.validate().map_err(|fault| IoError::new(dir, format!("in mm, {fault}; check {UNITS}")))?;
        }
        if let (Some(lines), Frame::ReferenceCamera) = (&mut e.orientation_3d, self.frame) {
            lines.data.iter_mut().for_each(|v| *v = (world_from_camera * v.as_dvec3()).as_vec3());
        }
        Ok(())
    }
}
