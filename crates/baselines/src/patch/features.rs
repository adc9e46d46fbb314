//! Features to start from: Harris corners and extrema of differences of Gaussians, the strongest of each block.

use super::view::View;
use glam::DVec2;
use strandbench_types::Plane;

/// Standard deviation of the Harris detector's derivatives and of its window, px.
const HARRIS_PX: (f32, f32) = (1.0, 2.0);
/// Weight of the squared trace in the Harris response.
const HARRIS_K: f32 = 0.06;
/// Standard deviations of the Gaussians, px; neighbours are subtracted.
const GAUSSIANS_PX: [f32; 4] = [1.0, 1.414, 2.0, 2.828];
/// Weakest response, of the image's strongest: flat areas have none.
const LEAST_SHARE: f32 = 1e-4;

/// Which detector found a feature; only features of one kind are matched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Harris,
    Gaussians,
}

/// A feature of a view.
#[derive(Clone, Copy, Debug)]
pub(super) struct Feature {
    pub kind: Kind,
    pub pixel: DVec2,
}

/// The `best` strongest local maxima of each detector in every block of `block_px` by `block_px`, inside the mask, block
/// by block.
pub(super) fn detect(view: &View, block_px: usize, best: usize) -> Vec<Feature> {
    let mut found = Vec::new();
    for (kind, response) in [(Kind::Harris, harris(&view.image)), (Kind::Gaussians, differences(&view.image))]
    {
        let (w, h) = response.size();
        let strongest = response.data.iter().copied().fold(0.0, f32::max);
        let mut maxima: Vec<(usize, f32, usize)> = Vec::new();
        for y in 1..h.saturating_sub(1) {
            for x in 1..w.saturating_sub(1) {
                let v = *response.at(x, y);
                let around = (0..9).filter(|k| *k != 4).map(|k| *response.at(x + k % 3 - 1, y + k / 3 - 1));
                let top = v > LEAST_SHARE * strongest && around.into_iter().all(|n| n <= v);
                if top && *view.mask.at(x, y) {
                    maxima.push((y / block_px * w.div_ceil(block_px) + x / block_px, v, y * w + x));
                }
            }
        }
        maxima.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)).then(a.2.cmp(&b.2)));
        for block in maxima.chunk_by(|a, b| a.0 == b.0) {
            found.extend(block.iter().take(best).map(|&(_, _, i)| Feature {
                kind,
                pixel: DVec2::new((i % w) as f64 + 0.5, (i / w) as f64 + 0.5),
            }));
        }
    }
    found
}

fn harris(image: &Plane<f32>) -> Plane<f32> {
    let smooth = blur(image, HARRIS_PX.0);
    let (w, h) = image.size();
    let products = |f: fn(f32, f32) -> f32| {
        let data = (0..w * h).map(|i| {
            let (x, y) = (i % w, i / w);
            let dx = smooth.at((x + 1).min(w - 1), y) - smooth.at(x.saturating_sub(1), y);
            let dy = smooth.at(x, (y + 1).min(h - 1)) - smooth.at(x, y.saturating_sub(1));
            f(dx, dy)
        });
        blur(&Plane::from_vec(w, h, data.collect()), HARRIS_PX.1)
    };
    let (xx, yy, xy) = (products(|x, _| x * x), products(|_, y| y * y), products(|x, y| x * y));
    let data = (0..w * h).map(|i| {
        let (a, b, c) = (xx.data[i], yy.data[i], xy.data[i]);
        a * b - c * c - HARRIS_K * (a + b) * (a + b)
    });
    Plane::from_vec(w, h, data.collect())
}

/// The largest difference between neighbouring Gaussians, whatever its sign.
fn differences(image: &Plane<f32>) -> Plane<f32> {
    let blurred = GAUSSIANS_PX.map(|s| blur(image, s));
    let of_pixel =
        |i: usize| blurred.windows(2).map(|b| (b[0].data[i] - b[1].data[i]).abs()).fold(0.0, f32::max);
    Plane::from_vec(image.width, image.height, (0..image.data.len()).map(of_pixel).collect())
}

/// A Gaussian of a standard deviation in pixels; borders are repeated.
fn blur(image: &Plane<f32>, sigma: f32) -> Plane<f32> {
    let radius = (3.0 * sigma).ceil() as isize;
    let mut kernel: Vec<f32> =
        (-radius..=radius).map(|d| libm::expf(-((d * d) as f32) / (2.0 * sigma * sigma))).collect();
    let sum: f32 = kernel.iter().sum();
    kernel.iter_mut().for_each(|k| *k /= sum);
    let (w, h) = image.size();
    let pass = |from: &Plane<f32>, dx: isize, dy: isize| {
        let data = (0..w * h).map(|i| {
            let at = |c: usize, d: isize, n: usize| (c as isize + d).clamp(0, n as isize - 1) as usize;
            let steps = kernel.iter().zip(-radius..);
            steps.map(|(k, d)| k * from.at(at(i % w, d * dx, w), at(i / w, d * dy, h))).sum()
        });
        Plane::from_vec(w, h, data.collect())
    };
    pass(&pass(image, 1, 0), 0, 1)
}
