//! Keyed image pyramids (4.3): each level halves the one before.
//!
//! The filter is the binomial 1-3-3-1, which keeps pixel centres in place: a position x at the finest level is
//! x / 2^l at level l. Pixels outside the hair mask have no weight, and what is then unknown is filled
//! smoothly from the coarser levels, so that the silhouette is no edge that a filter could answer to.

use strandbench_types::Plane;

/// One level of a pyramid.
#[derive(Clone, Debug, PartialEq)]
pub struct PyramidLevel {
    /// Intensity; inside the hair the weighted mean of hair pixels, outside a smooth continuation.
    pub image: Plane<f32>,
    /// Share of the pixel that is hair, 0..1; 0 or 1 at the finest level.
    pub weight: Plane<f32>,
}

impl PyramidLevel {
    /// Whether at least half of the pixel is hair.
    #[inline]
    pub fn is_hair(&self, i: usize) -> bool {
        self.weight.data[i] >= 0.5
    }
}

const BINOMIAL: [f32; 4] = [0.125, 0.375, 0.375, 0.125];

/// The pyramid of an image under its mask, finest level first; `levels` of them, fewer if the image has
/// shrunk to one pixel before.
pub fn pyramid(image: &Plane<f32>, mask: &Plane<bool>, levels: usize) -> Vec<PyramidLevel> {
    let weight = mask.map(|&m| if m { 1.0 } else { 0.0 });
    let mut all = vec![PyramidLevel { image: image.clone(), weight }];
    while all[all.len() - 1].image.size() != (1, 1) {
        let next = halve(&all[all.len() - 1]);
        all.push(next);
    }
    for l in (0..all.len() - 1).rev() {
        let (fine, coarse) = all.split_at_mut(l + 1);
        fill(&mut fine[l], &coarse[0].image);
    }
    all.truncate(levels);
    all
}

fn halve(fine: &PyramidLevel) -> PyramidLevel {
    let (w, h) = fine.image.size();
    let (cw, ch) = (w.div_ceil(2), h.div_ceil(2));
    let mut image = Plane::filled(cw, ch, 0.0f32);
    let mut weight = Plane::filled(cw, ch, 0.0f32);
    for y in 0..ch {
        for x in 0..cw {
            let (mut sum, mut hair, mut all) = (0.0, 0.0, 0.0);
            for (j, ky) in BINOMIAL.iter().enumerate() {
                let Some(fy) = (2 * y + j).checked_sub(1).filter(|&v| v < h) else { continue };
                for (i, kx) in BINOMIAL.iter().enumerate() {
                    let Some(fx) = (2 * x + i).checked_sub(1).filter(|&v| v < w) else { continue };
                    let (k, m) = (ky * kx, *fine.weight.at(fx, fy));
                    all += k;
                    hair += k * m;
                    sum += k * m * fine.image.at(fx, fy);
                }
            }
            *weight.at_mut(x, y) = hair / all;
            if hair > 0.0 {
                *image.at_mut(x, y) = sum / hair;
            }
        }
    }
    PyramidLevel { image, weight }
}

/// Blends the part of each pixel that is not hair with the coarser level.
fn fill(fine: &mut PyramidLevel, coarse: &Plane<f32>) {
    let (w, h) = fine.image.size();
    for y in 0..h {
        for x in 0..w {
            let m = *fine.weight.at(x, y);
            if m < 1.0 {
                let v = bilinear(coarse, (x as f32 + 0.5) * 0.5, (y as f32 + 0.5) * 0.5);
                let own = fine.image.at_mut(x, y);
                *own = m * *own + (1.0 - m) * v;
            }
        }
    }
}

/// Bilinear value at a position (pixel centres at one half), clamped to the border.
pub(crate) fn bilinear(p: &Plane<f32>, x: f32, y: f32) -> f32 {
    let fx = (x - 0.5).clamp(0.0, (p.width - 1) as f32);
    let fy = (y - 0.5).clamp(0.0, (p.height - 1) as f32);
    let (x0, y0) = (fx as usize, fy as usize);
    let (x1, y1) = ((x0 + 1).min(p.width - 1), (y0 + 1).min(p.height - 1));
    let (u, v) = (fx - x0 as f32, fy - y0 as f32);
    let top = p.at(x0, y0) * (1.0 - u) + p.at(x1, y0) * u;
    let low = p.at(x0, y1) * (1.0 - u) + p.at(x1, y1) * u;
    top * (1.0 - v) + low * v
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_keep_positions_and_means() {
        let ramp = Plane::from_vec(37, 22, (0..37 * 22).map(|i| (i % 37) as f32 + 0.5).collect());
        let mask = ramp.map(|_| true);
        let p = pyramid(&ramp, &mask, 3);
        assert_eq!(p.iter().map(|l| l.image.size()).collect::<Vec<_>>(), [(37, 22), (19, 11), (10, 6)]);
        for (l, level) in p.iter().enumerate() {
            for x in 2..level.image.width - 2 {
                let want = (x as f32 + 0.5) * (1 << l) as f32;
                let got = *level.image.at(x, 2);
                assert!((got - want).abs() < 1e-3, "level {l}, column {x}: {got} for {want}");
            }
        }
    }

    #[test]
    fn background_never_leaks_in_and_is_continued() {
        let (w, h) = (32, 24);
        let mask = Plane::from_vec(w, h, (0..w * h).map(|i| (8..20).contains(&(i % w))).collect());
        let image = mask.map(|&m| if m { 0.25 } else { 1e6 });
        for (l, level) in pyramid(&image, &mask, 4).iter().enumerate() {
            for v in &level.image.data {
                assert!((v - 0.25).abs() < 1e-6, "level {l}: {v}");
            }
        }
        let weights = &pyramid(&image, &mask, 2)[1].weight;
        // Column 3 covers fine columns 6 and 7; its filter reaches 5..=8, and 8 is hair.
        assert!((weights.at(3, 5) - 0.125).abs() < 1e-6 && *weights.at(5, 5) == 1.0);
    }
}
