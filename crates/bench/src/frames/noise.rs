//! Noise of images, from the luminance of blocks of pixels over several seeds.

/// Side of the blocks whose variance is taken, pixels. Single pixels of hair are so far from normal that their
/// variance is hard to estimate.
const BLOCK: usize = 8;

/// Luminance of linear RGB (Rec. 709).
fn luminance(rgb: &[f32]) -> f64 {
    0.2126 * f64::from(rgb[0]) + 0.7152 * f64::from(rgb[1]) + 0.0722 * f64::from(rgb[2])
}

/// Mean luminance of each block of 8x8 pixels of one image.
pub(super) struct Image(Vec<f64>);

impl Image {
    /// From rows of RGB.
    pub fn of(rgb: &[f32], width: usize) -> Image {
        let (across, down) = (width / BLOCK, rgb.len() / 3 / width / BLOCK);
        let mut sums = vec![0.0; across * down];
        for (i, pixel) in rgb.chunks_exact(3).enumerate() {
            let (x, y) = (i % width / BLOCK, i / width / BLOCK);
            if x < across && y < down {
                sums[y * across + x] += luminance(pixel) / (BLOCK * BLOCK) as f64;
            }
        }
        Image(sums)
    }
}

/// Noise and mean of images with different seeds.
#[derive(Clone, Copy, Debug)]
pub(super) struct Noise {
    /// Root mean variance of the blocks over the mean.
    pub noise: f64,
    /// Standard error of `noise`: of the spread of variances between blocks, taken as independent.
    pub noise_error: f64,
    pub mean: f64,
    /// Standard error of `mean`.
    pub mean_error: f64,
}

impl Noise {
    /// Of at least two images of one size.
    pub fn of(images: &[Image]) -> Noise {
        let (n, blocks) = (images.len() as f64, images[0].0.len());
        let (mut sum, mut squares, mut mean) = (0.0, 0.0, 0.0);
        for b in 0..blocks {
            let m = images.iter().map(|i| i.0[b]).sum::<f64>() / n;
            let variance = images.iter().map(|i| (i.0[b] - m).powi(2)).sum::<f64>() / (n - 1.0);
            sum += variance;
            squares += variance * variance;
            mean += m / blocks as f64;
        }
        let count = blocks as f64;
        let variance = sum / count;
        let variance_error = ((squares / count - variance * variance) / count).max(0.0).sqrt();
        let noise = variance.sqrt() / mean;
        Noise {
            noise,
            noise_error: noise * 0.5 * variance_error / variance,
            mean,
            mean_error: (variance / count / n).sqrt(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use strandbench_rng::Rng;

    #[test]
    fn noise_is_that_of_the_blocks_over_the_mean() {
        // Grey pixels of mean 2 with independent errors, even in ±0.6: a block's mean varies by 0.12 / 64.
        let image = |seed: u64| -> Vec<f32> {
            let mut rng = Rng::keyed(&[seed]);
            (0..160 * 120).flat_map(|_| [2.0 + rng.range(-0.6, 0.6); 3]).collect()
        };
        let images: Vec<Image> = (0..12).map(|s| Image::of(&image(s), 160)).collect();
        assert_eq!(images[0].0.len(), 20 * 15);
        let n = Noise::of(&images);
        let want = (0.12f64 / 64.0).sqrt() / 2.0;
        // 300 blocks with 11 degrees of freedom each: the standard deviation of the estimate is 1.2 % (a variance's
        // is sqrt(2 / 11 / 300), halved by the root), and that estimate's own a tenth of it.
        let error = 0.5 * (2.0f64 / 11.0 / 300.0).sqrt();
        assert!((n.noise / want - 1.0).abs() < 5.0 * error, "{n:?} against {want}");
        assert!((n.noise_error / n.noise / error - 1.0).abs() < 0.5, "{n:?} against {error}");
        // All pixels of all images.
        let mean_error = (0.12f64 / (160.0 * 120.0 * 12.0)).sqrt();
        assert!((n.mean - 2.0).abs() < 5.0 * mean_error, "{n:?}");
        assert!((n.mean_error / mean_error - 1.0).abs() < 5.0 * error, "{n:?} against {mean_error}");
    }
}
