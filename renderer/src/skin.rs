//! Skin and other solid surfaces: Lambert's law under a rough dielectric coat.

use glam::Vec3;
use std::f32::consts::{PI, TAU};
use strandbench_scenes::SkinOptics;

/// Skin's scattering function.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Skin {
    f0: f32,
    a2: f32,
    /// Factor of the coat's reflectance.
    coat: f32,
}

impl Skin {
    /// Prepares the optics.
    ///
    /// # Errors
    /// Names the parameter that is out of its range.
    pub fn new(optics: &SkinOptics) -> Result<Skin, String> {
        let (f0, roughness) = (optics.coat_reflectance, optics.coat_roughness);
        if !(0.0..=0.5).contains(&f0) {
            return Err(format!("skin: coat_reflectance is {f0}; it must lie in 0..0.5"));
        }
        if !(0.02..=1.0).contains(&roughness) {
            return Err(format!("skin: coat_roughness is {roughness}; it must lie in 0.02..1"));
        }
        if !(0.0..=10.0).contains(&optics.scatter_mm) {
            return Err(format!("skin: scatter_mm is {}; it must lie in 0..10", optics.scatter_mm));
        }
        Ok(Skin { f0, a2: roughness * roughness, coat: 1.0 })
    }

    /// The same skin where the coat reflects by `coat` as much and is by `roughness` as rough.
    #[must_use]
    pub fn varied(&self, coat: f32, roughness: f32) -> Skin {
        Skin { f0: self.f0, a2: (self.a2 * roughness * roughness).max(1e-4), coat }
    }

    /// Schlick's reflectance of the coat; none at all without a coat.
    #[inline]
    fn schlick(&self, cos: f32) -> f32 {
        if self.f0 == 0.0 {
            return 0.0;
        }
        let m = (1.0 - cos).clamp(0.0, 1.0);
        self.coat * (self.f0 + (1.0 - self.f0) * m * m * m * m * m)
    }

    /// The share of light that the coat lets through at this cosine.
    #[inline]
    pub fn through(&self, cos: f32) -> f32 {
        1.0 - self.schlick(cos)
    }

    /// GGX's density of half vectors (Walter et al. 2007) by their cosine.
    #[inline]
    fn density(&self, cos: f32) -> f32 {
        let q = cos * cos * (self.a2 - 1.0) + 1.0;
        self.a2 / (PI * q * q)
    }

    #[inline]
    fn slope(&self, cos: f32) -> f32 {
        (self.a2 + (1.0 - self.a2) * cos * cos).sqrt()
    }

    /// The scattering function per steradian, linear RGB: diffuse albedo/π, weakened by what the coat reflects
    /// both ways, and a GGX highlight (Walter et al. 2007) with Schlick's reflectance. Symmetric in its
    /// directions. All vectors are unit and point away from the surface.
    pub fn scatter(&self, normal: Vec3, to_light: Vec3, to_camera: Vec3, albedo_rgb: [f32; 3]) -> [f32; 3] {
        let (ci, co) = (normal.dot(to_light), normal.dot(to_camera));
        if ci <= 0.0 || co <= 0.0 {
            return [0.0; 3];
        }
        if self.f0 == 0.0 {
            return albedo_rgb.map(|a| a / PI);
        }
        let half = (to_light + to_camera).normalize_or_zero();
        let d = self.density(normal.dot(half).clamp(0.0, 1.0));
        // Smith's height-correlated shadowing with the 4 cos cos of the denominator.
        let visible = 0.5 / (co * self.slope(ci) + ci * self.slope(co));
        let specular = d * visible * self.schlick(half.dot(to_light));
        let through = (1.0 - self.schlick(ci)) * (1.0 - self.schlick(co)) / PI;
        albedo_rgb.map(|a| a * through + specular)
    }

    /// Everything that depends on the camera direction. `face` is the mesh's own normal on the camera's side:
    /// nothing scatters below it.
    pub fn toward(&self, normal: Vec3, face: Vec3, to_camera: Vec3, albedo_rgb: [f32; 3]) -> SkinToward {
        let co = normal.dot(to_camera);
        let through = (1.0 - self.schlick(co)) * albedo_rgb.iter().sum::<f32>() / 3.0;
        let reflected = self.schlick(co);
        // Any share samples without bias; this one is about what each part reflects.
        let gloss = if self.f0 == 0.0 { 0.0 } else { (reflected / (reflected + through)).max(0.1) };
        SkinToward { skin: *self, normal, face, to_camera, albedo_rgb, co, gloss, matte: false }
    }

    /// What the coat lets in, spread evenly over the directions: [`SkinToward::eval`] is the transmitted irradiance of
    /// unit radiance over π, white.
    pub fn receiver(&self, normal: Vec3, face: Vec3) -> SkinToward {
        let white = [1.0 / self.through(1.0).max(1e-3); 3];
        SkinToward { gloss: 0.0, matte: true, ..self.toward(normal, face, normal, white) }
    }
}

/// Skin seen from one direction.
#[derive(Clone, Copy, Debug)]
pub struct SkinToward {
    skin: Skin,
    normal: Vec3,
    face: Vec3,
    to_camera: Vec3,
    albedo_rgb: [f32; 3],
    co: f32,
    /// Share of the samples that goes to the coat.
    gloss: f32,
    /// Whether the coat's reflection is left out.
    matte: bool,
}

impl SkinToward {
    /// The albedo below the coat.
    pub(crate) fn albedo_rgb(&self) -> [f32; 3] {
        self.albedo_rgb
    }

    /// The share of light from below that the coat lets out towards the camera.
    pub(crate) fn through_out(&self) -> f32 {
        if self.co <= 0.0 { 0.0 } else { self.skin.through(self.co) }
    }

    /// The same with another albedo.
    pub(crate) fn with_albedo(self, albedo_rgb: [f32; 3]) -> SkinToward {
        SkinToward { albedo_rgb, ..self }
    }

    /// The part of [`SkinToward::eval`] that has been below the coat and has lost its polarisation there.
    #[inline]
    pub fn depolarised(&self, to_light: Vec3) -> [f32; 3] {
        let ci = self.normal.dot(to_light);
        if self.face.dot(to_light) <= 0.0 || ci <= 0.0 || self.co <= 0.0 {
            return [0.0; 3];
        }
        let through = self.skin.through(ci) * self.skin.through(self.co) * ci / PI;
        self.albedo_rgb.map(|a| a * through)
    }

    /// f(ω_i, ω_r) · cos θ_i, linear RGB per steradian.
    #[inline]
    pub fn eval(&self, to_light: Vec3) -> [f32; 3] {
        if self.face.dot(to_light) <= 0.0 {
            return [0.0; 3];
        }
        if self.matte {
            return self.depolarised(to_light);
        }
        let cos = self.normal.dot(to_light);
        self.skin.scatter(self.normal, to_light, self.to_camera, self.albedo_rgb).map(|f| f * cos)
    }

    /// Density of [`SkinToward::sample`] per steradian: a cosine for the diffuse part, the visible normals of GGX
    /// (Heitz 2018, Eq. 3 over the 4 cos of reflection) for the coat.
    #[inline]
    pub fn pdf(&self, to_light: Vec3) -> f32 {
        let ci = self.normal.dot(to_light);
        if self.co <= 0.0 {
            return 0.0;
        }
        let diffuse = ci.max(0.0) / PI;
        if self.gloss == 0.0 {
            return diffuse;
        }
        let half = (to_light + self.to_camera).normalize_or_zero();
        let ch = self.normal.dot(half);
        let coat = if ch > 0.0 && half.dot(self.to_camera) > 0.0 {
            self.skin.density(ch.min(1.0)) * 0.5 / (self.co + self.skin.slope(self.co))
        } else {
            0.0
        };
        self.gloss * coat + (1.0 - self.gloss) * diffuse
    }

    /// A direction, `eval / pdf` and the density, from numbers uniform in [0, 1): the choice of the part and two
    /// for the direction. `None` where nothing scatters.
    #[inline]
    pub fn sample(&self, u: [f32; 3]) -> Option<(Vec3, [f32; 3], f32)> {
        if self.co <= 0.0 {
            return None;
        }
        let (x, y) = self.normal.any_orthonormal_pair();
        let world = |v: Vec3| x * v.x + y * v.y + self.normal * v.z;
        let (sin, cos) = libm::sincosf(TAU * u[1]);
        let to_light = if u[0] < self.gloss {
            // Visible normals as the normals of a spherical cap (Dupuy and Benyoub 2023).
            let a = self.skin.a2.sqrt();
            let view = Vec3::new(self.to_camera.dot(x), self.to_camera.dot(y), self.co);
            let stretched = Vec3::new(view.x * a, view.y * a, view.z).normalize();
            let z = (1.0 - u[2]) * (1.0 + stretched.z) - stretched.z;
            let flat = (1.0 - z * z).max(0.0).sqrt();
            let h = Vec3::new(flat * cos, flat * sin, z) + stretched;
            let half = world(Vec3::new(h.x * a, h.y * a, h.z.max(0.0)).normalize_or(Vec3::Z));
            half * (2.0 * half.dot(self.to_camera)) - self.to_camera
        } else {
            let flat = u[2].sqrt();
            world(Vec3::new(flat * cos, flat * sin, (1.0 - u[2]).max(0.0).sqrt()))
        };
        let to_light = to_light.normalize();
        let pdf = self.pdf(to_light);
        let eval = self.eval(to_light);
        (pdf > 0.0 && eval != [0.0; 3]).then(|| (to_light, eval.map(|f| f / pdf), pdf))
    }
}

#[cfg(test)]
mod tests;
