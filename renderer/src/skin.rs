//! Skin and other solid surfaces: Lambert's law under a rough dielectric coat.

use glam::Vec3;
use std::f32::consts::PI;

/// Reflectance at normal incidence of the coat (index 1.4, skin).
const F0: f32 = 0.028;
/// Roughness α of the coat's GGX distribution.
const ALPHA: f32 = 0.35;

fn schlick(cos: f32) -> f32 {
    let m = (1.0 - cos).clamp(0.0, 1.0);
    F0 + (1.0 - F0) * m * m * m * m * m
}

/// The scattering function per steradian, linear RGB: diffuse albedo/π, weakened by what the coat reflects
/// both ways, and a GGX highlight (Walter et al. 2007) with Schlick's reflectance. Symmetric in its directions.
/// All vectors are unit and point away from the surface.
pub fn scatter(normal: Vec3, to_light: Vec3, to_camera: Vec3, albedo_rgb: [f32; 3]) -> [f32; 3] {
    let (ci, co) = (normal.dot(to_light), normal.dot(to_camera));
    if ci <= 0.0 || co <= 0.0 {
        return [0.0; 3];
    }
    let half = (to_light + to_camera).normalize_or_zero();
    let ch = normal.dot(half).clamp(0.0, 1.0);
    let a2 = ALPHA * ALPHA;
    let q = ch * ch * (a2 - 1.0) + 1.0;
    let d = a2 / (PI * q * q);
    let lambda = |c: f32| (a2 + (1.0 - a2) * c * c).sqrt();
    // Smith's height-correlated shadowing with the 4 cos cos of the denominator.
    let visible = 0.5 / (co * lambda(ci) + ci * lambda(co));
    let specular = d * visible * schlick(half.dot(to_light));
    let through = (1.0 - schlick(ci)) * (1.0 - schlick(co)) / PI;
    albedo_rgb.map(|a| a * through + specular)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_skin_gives_back_less_than_it_gets_and_is_symmetric() {
        let n = Vec3::Z;
        for deg in [0.0f32, 30.0, 60.0, 80.0] {
            let wo = Vec3::new(deg.to_radians().sin(), 0.0, deg.to_radians().cos());
            let (steps_c, steps_p) = (400, 400);
            let mut energy = 0.0f64;
            for i in 0..steps_c {
                let c = (i as f32 + 0.5) / steps_c as f32;
                let s = (1.0 - c * c).sqrt();
                for j in 0..steps_p {
                    let phi = 2.0 * PI * (j as f32 + 0.5) / steps_p as f32;
                    let wi = Vec3::new(s * phi.cos(), s * phi.sin(), c);
                    let f = scatter(n, wi, wo, [1.0; 3])[0];
                    let back = scatter(n, wo, wi, [1.0; 3])[0];
                    assert!((f - back).abs() <= 1e-5 * f.max(1e-3), "{f} {back}");
                    energy += f64::from(f * c) * 2.0 * std::f64::consts::PI / f64::from(steps_c * steps_p);
                }
            }
            assert!(energy < 1.0 && energy > 0.6, "{deg}°: {energy}");
        }
        assert_eq!(scatter(n, -n, n, [1.0; 3]), [0.0; 3]);
    }
}
