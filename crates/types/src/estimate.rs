//! What a reconstruction method returns.

use crate::{Plane, StrandSet, TriMesh};
use glam::Vec3;

/// Depth along +z of the reference camera in mm, or nothing, per pixel.
#[derive(Clone, Debug)]
pub struct DepthMap {
    raw: Plane<f32>,
}

impl DepthMap {
    /// A map without any answer.
    pub fn empty(width: usize, height: usize) -> DepthMap {
        DepthMap { raw: Plane::filled(width, height, f32::NAN) }
    }

    /// A map from raw values; whatever is not finite and positive counts as no answer.
    pub fn from_raw(mut raw: Plane<f32>) -> DepthMap {
        for v in &mut raw.data {
            if !(v.is_finite() && *v > 0.0) {
                *v = f32::NAN;
            }
        }
        DepthMap { raw }
    }

    /// Width and height in pixels.
    pub fn size(&self) -> (usize, usize) {
        self.raw.size()
    }

    /// Depth at column `x`, row `y`, mm.
    #[inline]
    pub fn get(&self, x: usize, y: usize) -> Option<f32> {
        self.get_index(y * self.raw.width + x)
    }

    /// Depth at a row-major index, mm.
    #[inline]
    pub fn get_index(&self, i: usize) -> Option<f32> {
        let v = self.raw.data[i];
        (!v.is_nan()).then_some(v)
    }

    /// Sets or clears the depth at column `x`, row `y`.
    ///
    /// # Panics
    /// If the depth is not finite and positive.
    pub fn set(&mut self, x: usize, y: usize, depth_mm: Option<f32>) {
        let v = depth_mm.unwrap_or(f32::NAN);
        assert!(depth_mm.is_none() || (v.is_finite() && v > 0.0), "depth {v} mm is not finite and positive");
        *self.raw.at_mut(x, y) = v;
    }

    /// Number of answered pixels.
    pub fn answered(&self) -> usize {
        self.raw.data.iter().filter(|v| !v.is_nan()).count()
    }

    /// The raw plane, NaN where there is no answer; for files.
    pub fn raw(&self) -> &Plane<f32> {
        &self.raw
    }
}

impl PartialEq for DepthMap {
    /// Bit equality, so that two absent answers are equal.
    fn eq(&self, other: &DepthMap) -> bool {
        self.size() == other.size()
            && self.raw.data.iter().zip(&other.raw.data).all(|(a, b)| a.to_bits() == b.to_bits())
    }
}

/// O = F exp(2iΘ) per pixel (Luo et al. Eq. 1): an undirected line with a strength. Θ is measured from +x
/// towards +y (image coordinates, y down) in [0, π).
#[derive(Clone, Debug, PartialEq)]
pub struct OrientationField {
    /// Real part, F cos 2Θ.
    pub re: Plane<f32>,
    /// Imaginary part, F sin 2Θ.
    pub im: Plane<f32>,
}

impl OrientationField {
    /// Line angle in [0, π) and strength at a row-major index; `None` where the field is zero.
    pub fn line(&self, i: usize) -> Option<(f32, f32)> {
        let (re, im) = (self.re.data[i], self.im.data[i]);
        let strength = re.hypot(im);
        if strength == 0.0 {
            return None;
        }
        let angle = 0.5 * im.atan2(re);
        Some((if angle < 0.0 { angle + std::f32::consts::PI } else { angle }, strength))
    }

    /// Width and height in pixels.
    pub fn size(&self) -> (usize, usize) {
        self.re.size()
    }
}

/// Everything a method can say about one frame; what it does not say is absent and scored as absent.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Estimate {
    /// Depth in the reference camera.
    pub depth: Option<DepthMap>,
    /// Envelope of the visible hair, mm, world.
    pub envelope: Option<TriMesh>,
    /// 2-D orientation in the reference camera, at full resolution.
    pub orientation: Option<OrientationField>,
    /// Unit line direction in the world at each pixel of the reference camera; zero where absent.
    pub orientation_3d: Option<Plane<Vec3>>,
    /// Hair strands.
    pub strands: Option<StrandSet>,
    /// Identity of each strand from frame to frame, as long as `strands` and without repetition; `None` where
    /// the method keeps none.
    pub strand_ids: Option<Vec<u64>>,
}

impl Estimate {
    /// Says what is wrong with the strands' identities, if anything is: identities without strands, another
    /// number of them, or one that two strands share.
    pub fn validate_strand_ids(&self) -> Result<(), String> {
        let Some(ids) = &self.strand_ids else { return Ok(()) };
        let Some(strands) = &self.strands else {
            return Err(format!("{} strand identities but no strands", ids.len()));
        };
        if ids.len() != strands.len() {
            return Err(format!("{} strand identities for {} strands", ids.len(), strands.len()));
        }
        let mut sorted = ids.clone();
        sorted.sort_unstable();
        if let Some(w) = sorted.windows(2).find(|w| w[0] == w[1]) {
            return Err(format!("two strands have the identity {}", w[0]));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn identities_fit_the_strands_and_do_not_repeat() {
        let mut strands = StrandSet::new();
        strands.push(&[Vec3::ZERO, Vec3::X], 0.04);
        strands.push(&[Vec3::ZERO, Vec3::Y], 0.04);
        let with = |ids: &[u64], strands: Option<&StrandSet>| {
            let e =
                Estimate { strands: strands.cloned(), strand_ids: Some(ids.to_vec()), ..Estimate::default() };
            e.validate_strand_ids()
        };
        assert_eq!(with(&[7, u64::MAX], Some(&strands)), Ok(()));
        assert_eq!(Estimate::default().validate_strand_ids(), Ok(()));
        assert!(with(&[7], Some(&strands)).unwrap_err().contains("1 strand identities for 2"));
        assert!(with(&[7, 7], Some(&strands)).unwrap_err().contains("the identity 7"));
        assert!(with(&[7, 8], None).unwrap_err().contains("no strands"));
    }
}
