//! A scene prepared for rendering: acceleration structure, fibre tables, lights, normals.

use crate::RenderError;
use crate::accel::Accel;
use crate::environment::Sky;
use crate::fibre::FibreModel;
use crate::light::Lights;
use crate::shadows::{ShadowKey, Shadows};
use crate::skin::Skin;
use crate::skin_light::{GlowKey, SkinLight};
use glam::Vec3;
use rayon::prelude::*;
use std::sync::{Arc, Mutex};
use strandbench_scenes::Scene;
use strandbench_types::StrandSet;

/// A scene with its acceleration structure, shared by all views.
pub struct RenderScene<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) accel: Accel,
    pub(crate) fibre: FibreModel,
    /// Whether fibres are elliptical, so that their major axis matters.
    pub(crate) elliptic: bool,
    /// Whether a segment's own direction is its tangent.
    pub(crate) flat: bool,
    pub(crate) skin: Skin,
    pub(crate) lights: Lights,
    /// Absorption per fibre radius, indexed [strand].
    pub(crate) absorption: Vec<[f32; 3]>,
    /// Vertex normals, indexed [surface][vertex].
    pub(crate) normals: Vec<Vec<Vec3>>,
    /// The light below the skin, once a view has asked for it.
    pub(crate) glow: Mutex<Option<(GlowKey, Arc<SkinLight>)>>,
    /// Shadows that are kept, once a view has asked for them.
    pub(crate) shadows: Mutex<Option<(ShadowKey, Arc<Shadows>)>>,
}

impl<'a> RenderScene<'a> {
    /// Builds the acceleration structure.
    ///
    /// # Errors
    /// If the strands are invalid or there is nothing to render; also a mesh, light, pigment, fibre parameter
    /// or camera that is not usable, each named.
    pub fn new(scene: &'a Scene) -> Result<RenderScene<'a>, RenderError> {
        let fail = |what: String| RenderError::Scene(format!("scene {}: {what}", scene.name));
        scene.strands.validate().map_err(|e| fail(e.to_string()))?;
        scene.rig.validate().map_err(&fail)?;
        if scene.pigments.len() != scene.strands.len() {
            return Err(fail(format!(
                "{} strands have {} pigments; each strand needs one",
                scene.strands.len(),
                scene.pigments.len()
            )));
        }
        let absorption: Vec<[f32; 3]> = scene.pigments.iter().map(|p| p.absorption_rgb()).collect();
        if let Some(i) = absorption.iter().position(|a| a.iter().any(|&v| !(v >= 0.0 && v.is_finite()))) {
            return Err(fail(format!("the pigment of strand {i} is negative or not finite")));
        }
        for (i, s) in scene.surfaces.iter().enumerate() {
            s.mesh.validate().map_err(|e| fail(format!("surface {i}: {e}")))?;
            if s.albedo_rgb.iter().any(|a| !(0.0..=1.0).contains(a)) {
                return Err(fail(format!("surface {i}: its albedo must lie in 0..1")));
            }
            if let Some(d) = &s.detail {
                d.check(s.mesh.vertices.len()).map_err(|e| fail(format!("surface {i}: {e}")))?;
            }
        }
        let (filters, cameras) = (scene.polarised.len(), scene.rig.cameras.len());
        if filters != 0 && filters != cameras {
            return Err(fail(format!("polarised names {filters} cameras of {cameras}; name all or none")));
        }
        if scene.background_rgb.iter().any(|&b| !(b >= 0.0 && b.is_finite())) {
            return Err(fail("the background's radiance is negative or not finite".into()));
        }
        let s = &scene.sensor;
        if !(s.full_scale_radiance > 0.0 && s.full_scale_radiance.is_finite()) {
            return Err(fail("the sensor's full_scale_radiance must be positive".into()));
        }
        if s.response_rgb.iter().any(|&w| !(w >= 0.0 && w.is_finite())) {
            return Err(fail("the sensor's response_rgb is negative or not finite".into()));
        }
        if let Some(l) = &scene.lens
            && !(l.aperture_radius_mm >= 0.0
                && l.aperture_radius_mm < 1e4
                && l.focus_mm > 0.0
                && l.focus_mm < 1e9)
        {
            return Err(fail(format!(
                "the lens has an aperture radius of {} mm and focuses at {} mm; the first lies in 0..1e4, the second \
                 above 0",
                l.aperture_radius_mm, l.focus_mm
            )));
        }
        let m = &scene.motion;
        let exposure = scene.rig.exposure_s;
        let far = |v: &f64| {
            let reach = v.abs() * exposure.max(1e-6);
            reach.is_nan() || reach > 1e6
        };
        if m.velocity_mm_s.iter().chain(&m.turn_deg_s).any(far) {
            return Err(fail("the rig's motion or exposure time is not finite, or without bounds".into()));
        }
        let sky = match &scene.environment {
            None => None,
            Some(map) => Sky::new(map).map_err(&fail)?,
        };
        let meshes: Vec<_> = scene.surfaces.iter().map(|s| &s.mesh).collect();
        Ok(RenderScene {
            scene,
            accel: Accel::new(&scene.strands, &meshes)?,
            fibre: FibreModel::new(&scene.optics).map_err(&fail)?,
            elliptic: scene.optics.eccentricity != 1.0,
            flat: false,
            skin: Skin::new(&scene.skin).map_err(&fail)?,
            lights: Lights::new(&scene.lights).map_err(&fail)?.with_sky(sky),
            absorption,
            normals: meshes.iter().map(|m| m.vertex_normals()).collect(),
            glow: Mutex::new(None),
            shadows: Mutex::new(None),
        })
    }

    /// The acceleration structure, for tests and measurements.
    pub fn accel(&self) -> &Accel {
        &self.accel
    }

    /// The same scene with each segment's own direction as its tangent, as renderers without a fibre's
    /// neighbourhood take it, instead of the interpolated one.
    #[must_use]
    pub fn flat_tangents(self) -> RenderScene<'a> {
        RenderScene { flat: true, ..self }
    }

    /// How many segments hold the point.
    pub(crate) fn fibres_around(&self, point: Vec3) -> u64 {
        let strands = &self.scene.strands;
        let inside = |i: usize| segment_holds(strands, i, point);
        let count = |strand: usize| {
            let range = strands.range(strand);
            (range.start..range.end.saturating_sub(1)).filter(|&i| inside(i)).count() as u64
        };
        (0..strands.len()).into_par_iter().map(count).sum()
    }
}

/// Whether a point lies inside the hull of the two spheres of a segment.
fn segment_holds(strands: &StrandSet, i: usize, point: Vec3) -> bool {
    let (p, r) = (&strands.points, &strands.radii_mm);
    let (axis, to) = (p[i + 1] - p[i], point - p[i]);
    let length = axis.length();
    let narrowing = r[i] - r[i + 1];
    if length <= narrowing.abs() || length == 0.0 {
        return to.length() < r[i] || point.distance(p[i + 1]) < r[i + 1];
    }
    let along = to.dot(axis) / length;
    let across = (to.length_squared() - along * along).max(0.0).sqrt();
    // The sphere whose surface is nearest stands off the foot of the perpendicular by the cone's slope.
    let slope = narrowing / length;
    let at = ((along - across * slope / (1.0 - slope * slope).sqrt()) / length).clamp(0.0, 1.0);
    point.distance(p[i].lerp(p[i + 1], at)) < r[i] - narrowing * at
}

/// The fibre's unit tangent (root to tip) at a position along the segment that starts at `point` (index in
/// the strand set): the bisectors of neighbouring segments at both ends, interpolated. Segments without length
/// have no say; a strand without any yields +x.
pub fn fibre_tangent(strands: &StrandSet, strand: u32, point: u32, along: f32) -> Vec3 {
    let range = strands.range(strand as usize);
    let i = point as usize;
    let unit = |k: usize| (strands.points[k + 1] - strands.points[k]).normalize_or_zero();
    let here = unit(i);
    let before = if i > range.start { unit(i - 1) } else { Vec3::ZERO };
    let after = if i + 2 < range.end { unit(i + 1) } else { Vec3::ZERO };
    let bisector = |a: Vec3, b: Vec3| (a + b).try_normalize().unwrap_or(here);
    let (start, end) = (bisector(before, here), bisector(here, after));
    start.lerp(end, along.clamp(0.0, 1.0)).try_normalize().or(here.try_normalize()).unwrap_or(Vec3::X)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_in_segments_are_told_from_points_outside() {
        let mut strands = StrandSet::new();
        strands.push(&[Vec3::ZERO, Vec3::X * 3.0, Vec3::X * 3.0], 0.5);
        strands.radii_mm = vec![0.5, 0.2, 0.7];
        let holds = |i: usize, x: f32, y: f32| segment_holds(&strands, i, Vec3::new(x, y, 0.0));
        // Half way the cone is 0.35 / sqrt(1 - 0.1²) = 0.3518 thick.
        assert!(holds(0, 1.5, 0.3515) && !holds(0, 1.5, 0.352));
        assert!(holds(0, -0.49, 0.0) && !holds(0, -0.51, 0.0) && holds(0, 3.19, 0.0) && !holds(0, 3.21, 0.0));
        assert!(holds(1, 3.0, 0.69) && !holds(1, 3.0, 0.71), "a segment without length is its larger sphere");
    }

    #[test]
    fn tangents_of_an_arc_follow_the_circle_between_its_points() {
        // Points every 5 degrees: a segment's own direction is off by up to 2.5 degrees, the interpolated one by
        // the third order of half the step.
        let step = 5.0f32.to_radians();
        let at = |a: f32| Vec3::new(20.0 * a.cos(), 20.0 * a.sin(), 3.0);
        let mut strands = StrandSet::new();
        strands.push(&[Vec3::ZERO, Vec3::X], 0.04);
        strands.push(&(0..12).map(|i| at(step * i as f32)).collect::<Vec<_>>(), 0.04);
        for i in 1..10 {
            for along in [0.0, 0.2, 0.5, 0.9, 1.0] {
                let a = step * (i as f32 + along);
                let off =
                    fibre_tangent(&strands, 1, 2 + i, along).angle_between(Vec3::new(-a.sin(), a.cos(), 0.0));
                assert!(off.to_degrees() < 0.05, "segment {i}, {along}: {} degrees off", off.to_degrees());
            }
        }
    }
}
