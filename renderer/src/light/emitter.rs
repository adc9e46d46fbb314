//! One rectangle that shines.

use glam::Vec3;
use strandbench_scenes::AreaLight;

/// Area over squared distance below which `Strategy::Both` leaves a light to points on it: lobes of hair and skin
/// rarely exceed a density of a few per steradian, so the other way's weight there would be small. Of lights of 0.10
/// and 0.19 sr on 20,000 wavy strands, direct light that weighs both ways takes 1.3 to 1.45 times the time times
/// variance of points alone, with Chiang's model of roughness 0.3 as with Marschner's of 7.5 degrees.
const SMALL_SR: f32 = 0.2;

/// A point on a light as seen from a shading point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSample {
    /// Unit direction towards the light.
    pub direction: Vec3,
    /// Distance, mm.
    pub distance: f32,
    /// Radiance times the light's cosine over squared distance, over the probability density: multiplied with
    /// the scattering function and the receiver's cosine it estimates the reflected radiance.
    pub weight_rgb: [f32; 3],
    /// Density of the direction, per steradian.
    pub pdf: f32,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Emitter {
    pub centre: Vec3,
    half_u: Vec3,
    half_v: Vec3,
    /// Reciprocal basis of the half edges.
    across_u: Vec3,
    across_v: Vec3,
    pub normal: Vec3,
    /// Radiance times area.
    pub power_rgb: [f32; 3],
    pub area: f32,
    /// This light's share of [0, 1).
    pub start: f32,
    pub end: f32,
}

impl Emitter {
    /// Its share of the choice is still to be given. `None` without area or radiance.
    pub fn of(l: &AreaLight) -> Option<Emitter> {
        let across = l.half_u_mm.cross(l.half_v_mm);
        let area = 4.0 * across.length();
        let across2 = across.length_squared();
        // Also edges so short or so parallel that their product is lost to rounding.
        if area * l.radiance_rgb.iter().sum::<f32>() <= 0.0 || !across2.is_normal() {
            return None;
        }
        Some(Emitter {
            centre: l.centre_mm,
            half_u: l.half_u_mm,
            half_v: l.half_v_mm,
            across_u: l.half_v_mm.cross(across) / across2,
            across_v: across.cross(l.half_u_mm) / across2,
            normal: across.normalize(),
            power_rgb: l.radiance_rgb.map(|r| r * area),
            area,
            end: 1.0,
            start: 0.0,
        })
    }

    #[inline]
    pub fn sample(&self, u: [f32; 2], point: Vec3) -> Option<LightSample> {
        let on = self.centre + self.half_u * (2.0 * u[0] - 1.0) + self.half_v * (2.0 * u[1] - 1.0);
        let to = on - point;
        let d2 = to.length_squared();
        if d2 < 1e-12 {
            return None;
        }
        let distance = d2.sqrt();
        let direction = to / distance;
        let cos = -self.normal.dot(direction);
        if cos <= 0.0 {
            return None;
        }
        let w = cos / d2;
        let pdf = 1.0 / (self.area * w);
        Some(LightSample { direction, distance, weight_rgb: self.power_rgb.map(|p| p * w), pdf })
    }

    /// Distance, and density of [`Emitter::sample`], where a ray meets the side that shines.
    #[inline]
    pub fn meet(&self, origin: Vec3, direction: Vec3) -> Option<(f32, f32)> {
        let cos = -self.normal.dot(direction);
        if cos <= 0.0 {
            return None;
        }
        let distance = (origin - self.centre).dot(self.normal) / cos;
        if distance <= 0.0 {
            return None;
        }
        let on = origin + direction * distance - self.centre;
        // Edges need not be perpendicular: coordinates by the reciprocal basis.
        let (u, v) = (on.dot(self.across_u), on.dot(self.across_v));
        if u.abs() > 1.0 || v.abs() > 1.0 {
            return None;
        }
        Some((distance, distance * distance / (self.area * cos)))
    }

    #[inline]
    pub fn is_small(&self, point: Vec3) -> bool {
        self.area < SMALL_SR * (self.centre - point).length_squared()
    }
}
