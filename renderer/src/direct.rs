//! Direct light of point lights over given rays, without a random number: what two renderers can agree on exactly.

use crate::RenderError;
use crate::accel::{Hit, LastBlockers, Skip};
use crate::scene::RenderScene;
use crate::vertex::Vertex;
use glam::Vec3;
use rayon::prelude::*;

/// A light without extent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointLight {
    /// Place, mm, world.
    pub position_mm: Vec3,
    /// Radiant intensity, linear RGB: at distance d it gives the irradiance `intensity / d²`.
    pub intensity_rgb: [f32; 3],
}

/// Where shadow rays start and end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Offsets {
    /// As in every render: from the point itself past the fibre that it is on, up to the light.
    #[default]
    Own,
    /// As Mitsuba 3.9 does in single precision: from p + n·sign(n·d)·(1 + max|p|)·8.94e-5, towards the light from
    /// there, over the distance times 1 - 8.94e-4, and with every fibre in the way; the own one too where the ray
    /// leaves it outward.
    Mitsuba,
}

/// Light that leaves the first hit of a ray.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Direct {
    /// What the ray met.
    pub hit: Option<Hit>,
    /// Sum over the lights that are seen from there, linear RGB; zero without a hit.
    pub radiance_rgb: [f32; 3],
    /// Bit k is set if nothing is between the hit and light k.
    pub visible: u64,
}

/// Mitsuba's epsilons for f32.
const RAY_EPSILON: f32 = 8.94e-5;
const SHADOW_EPSILON: f32 = 8.94e-4;
/// Lights that fit the bits of [`Direct::visible`].
const MOST_LIGHTS: usize = 64;

impl RenderScene<'_> {
    /// For each ray (origin in mm, direction) the light that all point lights send by one scattering from the first
    /// hit towards the ray's origin. Area lights and the environment have no part in it.
    ///
    /// # Errors
    /// If there are more than 64 lights, or a number is not finite, or a direction has no length.
    pub fn direct_from_points(
        &self,
        rays: &[(Vec3, Vec3)],
        lights: &[PointLight],
        offsets: Offsets,
    ) -> Result<Vec<Direct>, RenderError> {
        let fail = |what: String| Err(RenderError::Scene(what));
        if lights.len() > MOST_LIGHTS {
            return fail(format!("{} point lights are more than {MOST_LIGHTS}; ask in parts", lights.len()));
        }
        let bad =
            |l: &PointLight| !(l.position_mm.is_finite() && l.intensity_rgb.iter().all(|v| v.is_finite()));
        if let Some(i) = lights.iter().position(bad) {
            return fail(format!("point light {i} has a number that is not finite"));
        }
        if let Some(i) = rays.iter().position(|(o, d)| !o.is_finite() || d.try_normalize().is_none()) {
            return fail(format!("ray {i} has no direction, or a number that is not finite"));
        }
        let one =
            |&(origin, direction): &(Vec3, Vec3)| self.direct(origin, direction.normalize(), lights, offsets);
        Ok(rays.par_iter().map(one).collect())
    }

    fn direct(&self, origin: Vec3, direction: Vec3, lights: &[PointLight], offsets: Offsets) -> Direct {
        let Some(hit) = self.closest(origin, direction) else { return Direct::default() };
        let vertex = self.vertex(&hit, origin, direction);
        let mut out = Direct { hit: Some(hit), ..Direct::default() };
        for (k, light) in lights.iter().enumerate() {
            let to = light.position_mm - vertex.surface.position_mm;
            let d2 = to.length_squared();
            if d2 == 0.0 || !self.sees(&vertex, light.position_mm, offsets) {
                continue;
            }
            out.visible |= 1 << k;
            let f = vertex.lobe.eval(to / d2.sqrt());
            out.radiance_rgb =
                std::array::from_fn(|c| out.radiance_rgb[c] + f[c] * light.intensity_rgb[c] / d2);
        }
        out
    }

    fn sees(&self, vertex: &Vertex<'_>, light: Vec3, offsets: Offsets) -> bool {
        let (start, skip, shorter) = match offsets {
            Offsets::Own => (vertex.start, vertex.skip, 1.0),
            Offsets::Mitsuba => {
                let (p, n) = (vertex.surface.position_mm, vertex.surface.normal);
                let side = if n.dot(light - p) < 0.0 { -1.0 } else { 1.0 };
                let reach = (1.0 + p.abs().max_element()) * RAY_EPSILON;
                // Within the own fibre nothing stops a ray: it meets back faces alone. Our neighbouring segments
                // would, where their spheres reach inside.
                let skip = vertex.skip.filter(|_| side < 0.0).map(|s| Skip { near_mm: 0.0, ..s });
                (p + n * (side * reach), skip, 1.0 - SHADOW_EPSILON)
            }
        };
        let to = light - start;
        let distance = to.length();
        let mut last = LastBlockers::default();
        distance == 0.0 || !self.accel.occluded(start, to / distance, distance * shorter, skip, &mut last)
    }
}
