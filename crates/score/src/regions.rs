//! The pixels that are wanted: true hair of the reference view, its inside and its rim.

use crate::ScoreError;
use strandbench_types::ViewTruth;

/// Row-major pixel indices, ascending.
pub(crate) struct Regions {
    /// The true hair mask: coverage of one half or more.
    pub hair: Vec<u32>,
    /// The mask eroded by 2 px: every pixel whose centre is within 2 px lies in the mask and in the image.
    pub inner: Vec<u32>,
    /// The rest of the mask.
    pub rim: Vec<u32>,
}

impl Regions {
    pub fn of(view: &ViewTruth) -> Result<Regions, ScoreError> {
        let (w, h) = view.mask.size();
        let (w, h) = (w as i64, h as i64);
        let hair = |x: i64, y: i64| {
            (0..w).contains(&x) && (0..h).contains(&y) && view.mask.data[(y * w + x) as usize]
        };
        let disc: Vec<(i64, i64)> = (-2..=2)
            .flat_map(|dy| (-2..=2).map(move |dx| (dx, dy)))
            .filter(|(dx, dy)| dx * dx + dy * dy <= 4)
            .collect();
        let mut regions = Regions { hair: Vec::new(), inner: Vec::new(), rim: Vec::new() };
        for y in 0..h {
            for x in 0..w {
                if hair(x, y) {
                    let i = (y * w + x) as u32;
                    let inside = disc.iter().all(|(dx, dy)| hair(x + dx, y + dy));
                    regions.hair.push(i);
                    if inside { regions.inner.push(i) } else { regions.rim.push(i) }
                }
            }
        }
        if regions.inner.is_empty() {
            return Err(ScoreError::Input(format!(
                "nothing to score: the reference view has {} hair pixels and none of them lies 2 px inside the \
                 mask; check that the reference camera sees the hair",
                regions.hair.len()
            )));
        }
        Ok(regions)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use strandbench_types::{DepthMap, Plane};

    /// A view with this mask, flat hair at 500 mm and vertical fibres.
    fn view_with_mask(w: usize, h: usize, hair: impl Fn(usize, usize) -> bool) -> ViewTruth {
        let pick = |yes: f32, no: f32| {
            let data = (0..w * h).map(|i| if hair(i % w, i / w) { yes } else { no }).collect();
            Plane::from_vec(w, h, data)
        };
        ViewTruth {
            depth_first: DepthMap::from_raw(pick(498.0, f32::NAN)),
            depth_05: DepthMap::from_raw(pick(499.0, f32::NAN)),
            depth_50: DepthMap::from_raw(pick(500.0, f32::NAN)),
            coverage: pick(1.0, 0.0),
            mask: pick(1.0, 0.0).map(|&c| c > 0.5),
            orientation_2d: pick(std::f32::consts::FRAC_PI_2, f32::NAN),
            orientation_agreement: pick(1.0, 0.0),
            orientation_3d: pick(1.0, 0.0).map(|&c| Vec3::Y * c),
        }
    }

    #[test]
    fn erosion_is_by_a_disc_and_the_image_border_is_rim() {
        // A 5x5 square inside a 9x9 image leaves its middle pixel only; a full image loses two rows all round.
        let square = view_with_mask(9, 9, |x, y| (2..7).contains(&x) && (2..7).contains(&y));
        let r = Regions::of(&square).unwrap();
        assert_eq!((r.hair.len(), &r.inner[..], r.rim.len()), (25, &[4 * 9 + 4][..], 24));
        assert_eq!(Regions::of(&view_with_mask(9, 9, |_, _| true)).unwrap().inner.len(), 25);
        // Corners of the 5x5 window do not erode: they are 2.8 px away.
        let cut = view_with_mask(9, 9, |x, y| {
            (2..7).contains(&x) && (2..7).contains(&y) && (x.abs_diff(4), y.abs_diff(4)) != (2, 2)
        });
        assert_eq!(Regions::of(&cut).unwrap().inner, [4 * 9 + 4]);
        let ring =
            view_with_mask(9, 9, |x, y| (x, y) != (4, 4) && (2..7).contains(&x) && (2..7).contains(&y));
        assert!(matches!(Regions::of(&ring), Err(ScoreError::Input(m)) if m.contains("24 hair pixels")));
    }
}
