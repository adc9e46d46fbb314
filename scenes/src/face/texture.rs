//! What skin looks like close by: a pattern in space that moves with the skin.

mod eye;
mod noise;
mod regions;
pub(super) use regions::lips;
mod skin;
#[cfg(test)]
mod tests;

use super::FaceError;
use glam::Vec3;
use serde::{Deserialize, Serialize};

/// Appearance of one person's skin: a function of the place on the mean neutral face, so that it has no seam, any
/// resolution, and the same pattern in every pose. The table `[skin_texture]` of a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SkinTexture {
    /// Seed of the pattern: where freckles, moles, pores and blotches are.
    pub seed: u64,
    /// Mean albedo of the skin, linear RGB in 0..0.95.
    pub tone_rgb: [f32; 3],
    /// Blotches of 3 to 15 mm: standard deviation relative to the albedo, 0 to 0.3.
    pub mottling: f32,
    /// Blood in cheeks, nose, ears and chin, 0 to 1.
    pub redness: f32,
    /// Colour of the lips, 0 (as the skin) to 1.
    pub lips: f32,
    /// Grain of 0.15 to 0.6 mm: standard deviation relative to the albedo, 0 to 0.2.
    pub grain: f32,
    /// Distance between pores, mm, 0.3 to 3.
    pub pore_mm: f32,
    /// How much darker a pore's middle is, 0 to 0.9.
    pub pores: f32,
    /// Freckles per square centimetre where there are most of them, 0 to 9.
    pub freckles_per_cm2: f32,
    /// Moles per square decimetre, 0 to 50.
    pub moles_per_dm2: f32,
    /// Albedo of hair roots beneath the skin, linear RGB in 0..0.95.
    pub stubble_rgb: [f32; 3],
    /// Depth of pores and fine lines, mm, 0 to 0.3.
    pub relief_mm: f32,
    /// Albedo of the iris, linear RGB in 0..0.95.
    pub iris_rgb: [f32; 3],
}

impl Default for SkinTexture {
    /// Fair skin without make-up.
    fn default() -> SkinTexture {
        SkinTexture {
            seed: 0,
            tone_rgb: [0.52, 0.33, 0.24],
            mottling: 0.045,
            redness: 0.5,
            lips: 0.7,
            grain: 0.05,
            pore_mm: 0.7,
            pores: 0.35,
            freckles_per_cm2: 1.5,
            moles_per_dm2: 4.0,
            stubble_rgb: [0.16, 0.14, 0.14],
            relief_mm: 0.035,
            iris_rgb: [0.12, 0.16, 0.2],
        }
    }
}

/// What a [`SkinDetail`] covers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tissue {
    /// Skin and lips.
    Skin,
    /// Both eyeballs, by their middles on the mean neutral face, mm: the subject's left one, then the right one.
    Eyes([Vec3; 2]),
}

/// A surface's look close by.
#[derive(Clone, Debug, PartialEq)]
pub struct SkinDetail {
    /// The pattern.
    pub texture: SkinTexture,
    /// Place of each vertex on the mean neutral face, mm, indexed `[vertex]`: the pattern's coordinates, the same for
    /// all identities, poses and frames.
    pub rest: Vec<Vec3>,
    /// How much hair roots darken the skin, 0..1, indexed `[vertex]`.
    pub stubble: Vec<f32>,
    /// What it is.
    pub tissue: Tissue,
}

/// A texture's answer at one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkinLook {
    /// Diffuse albedo, linear RGB in 0..1.
    pub albedo_rgb: [f32; 3],
    /// How the height of the relief changes with the rest position, mm per mm.
    pub slope: Vec3,
    /// Factor of the coat's reflectance, 0..1.
    pub coat: f32,
    /// Factor of the coat's roughness, 0..1.
    pub roughness: f32,
}

impl SkinDetail {
    /// Skin of this pattern.
    pub fn skin(texture: SkinTexture, rest: Vec<Vec3>, stubble: Vec<f32>) -> SkinDetail {
        SkinDetail { texture, rest, stubble, tissue: Tissue::Skin }
    }

    /// Eyeballs, told apart by the sign of x; both must be there.
    pub fn eyes(texture: SkinTexture, rest: Vec<Vec3>) -> SkinDetail {
        let middle = |side: f32| {
            let of = rest.iter().filter(|p| p.x * side > 0.0);
            let (low, high) = of.fold((Vec3::MAX, Vec3::MIN), |(a, b), &p| (a.min(p), b.max(p)));
            (low + high) * 0.5
        };
        let tissue = Tissue::Eyes([middle(1.0), middle(-1.0)]);
        SkinDetail { stubble: vec![0.0; rest.len()], texture, rest, tissue }
    }

    /// What a place looks like: `rest` on the mean neutral face, mm, and the stubble there. About 0.4 µs.
    #[inline]
    pub fn look(&self, rest: Vec3, stubble: f32) -> SkinLook {
        match &self.tissue {
            Tissue::Skin => skin::look(&self.texture, rest, stubble),
            Tissue::Eyes(middles) => eye::look(&self.texture, rest - middles[usize::from(rest.x < 0.0)]),
        }
    }

    /// Says what is wrong, if anything is; `vertices` is how many the surface has.
    ///
    /// # Errors
    /// [`FaceError::Value`] with the key at fault.
    pub fn check(&self, vertices: usize) -> Result<(), FaceError> {
        self.texture.check()?;
        let n = vertices as f64;
        for (key, count) in
            [("skin_texture.rest", self.rest.len()), ("skin_texture.stubble", self.stubble.len())]
        {
            if count != vertices {
                return Err(FaceError::Value { key, value: count as f64, low: n, high: n });
            }
        }
        let far = |p: &Vec3| !p.is_finite() || p.abs().max_element() > 1e4;
        if let Some(p) = self.rest.iter().find(|p| far(p)) {
            let value = f64::from(p.abs().max_element());
            return Err(FaceError::Value { key: "skin_texture.rest", value, low: -1e4, high: 1e4 });
        }
        if let Some(&s) = self.stubble.iter().find(|s| !(0.0..=1.0).contains(*s)) {
            let value = f64::from(s);
            return Err(FaceError::Value { key: "skin_texture.stubble", value, low: 0.0, high: 1.0 });
        }
        Ok(())
    }
}

impl SkinTexture {
    /// Says what is out of range, if anything is.
    ///
    /// # Errors
    /// [`FaceError::Value`] with the key at fault.
    pub fn check(&self) -> Result<(), FaceError> {
        let colours = [self.tone_rgb, self.stubble_rgb, self.iris_rgb];
        let names = ["skin_texture.tone_rgb", "skin_texture.stubble_rgb", "skin_texture.iris_rgb"];
        let colours = names.into_iter().zip(colours).flat_map(|(n, c)| c.map(|v| (n, v, 0.0, 0.95)));
        let numbers = [
            ("skin_texture.mottling", self.mottling, 0.0, 0.3),
            ("skin_texture.redness", self.redness, 0.0, 1.0),
            ("skin_texture.lips", self.lips, 0.0, 1.0),
            ("skin_texture.grain", self.grain, 0.0, 0.2),
            ("skin_texture.pore_mm", self.pore_mm, 0.3, 3.0),
            ("skin_texture.pores", self.pores, 0.0, 0.9),
            ("skin_texture.freckles_per_cm2", self.freckles_per_cm2, 0.0, 9.0),
            ("skin_texture.moles_per_dm2", self.moles_per_dm2, 0.0, 50.0),
            ("skin_texture.relief_mm", self.relief_mm, 0.0, 0.3),
        ];
        for (key, value, low, high) in colours.chain(numbers) {
            if !(low..=high).contains(&value) {
                return Err(FaceError::Value {
                    key,
                    value: value.into(),
                    low: low.into(),
                    high: high.into(),
                });
            }
        }
        Ok(())
    }
}
