//! The multi-resolution orientation field (4.3, Eq. 1).

use crate::kernel::FilterBank;
use crate::pyramid::PyramidLevel;
use rayon::prelude::*;
use strandbench_types::{OrientationField, Plane};

/// The strongest filter response at each pixel of one level, before gamma and scale.
#[derive(Clone, Debug, PartialEq)]
pub struct Response {
    /// Direction of the line in [0, π) from +x towards +y, radians.
    pub angle: Plane<f32>,
    /// Signed response K_Θ * I at that angle, in units of the image; 0 outside the hair.
    pub value: Plane<f32>,
}

/// Filters one level. Rows are independent, so threads change no bit.
pub fn respond(level: &PyramidLevel, bank: &FilterBank) -> Response {
    let (w, h) = level.image.size();
    let r = bank.radius();
    let (pw, ph) = (w + 2 * r, h + 2 * r);
    // Clamped copy: the filled image is continued flat beyond its border.
    let mut padded = vec![0.0f32; pw * ph];
    for y in 0..ph {
        let row = y.saturating_sub(r).min(h - 1) * w;
        for x in 0..pw {
            padded[y * pw + x] = level.image.data[row + x.saturating_sub(r).min(w - 1)];
        }
    }
    let mut angle = Plane::filled(w, h, 0.0f32);
    let mut value = Plane::filled(w, h, 0.0f32);
    angle.data.par_chunks_mut(w).zip(value.data.par_chunks_mut(w)).enumerate().for_each(
        |(y, (angles, values))| {
            let mut scratch = bank.scratch();
            for x in (0..w).filter(|x| level.is_hair(y * w + x)) {
                bank.responses(&padded, pw, x + r, y + r, &mut scratch);
                (angles[x], values[x]) = bank.peak(&scratch.responses);
            }
        },
    );
    Response { angle, value }
}

/// The response that `quantile` of the positive responses do not exceed; `None` if none is positive.
pub fn unit_response(response: &Response, quantile: f32) -> Option<f32> {
    let mut positive: Vec<f32> = response.value.data.iter().copied().filter(|&v| v > 0.0).collect();
    positive.sort_unstable_by(f32::total_cmp);
    let last = positive.len().checked_sub(1)?;
    Some(positive[(f64::from(quantile) * last as f64).round() as usize])
}

/// O of Eq. 1: (response / unit)^γ exp(2iΘ) where the response is positive, and zero elsewhere.
pub fn field(response: &Response, unit: f32, gamma: f32) -> OrientationField {
    let (w, h) = response.value.size();
    let mut re = Plane::filled(w, h, 0.0f32);
    let mut im = Plane::filled(w, h, 0.0f32);
    let rows = re.data.par_chunks_mut(w).zip(im.data.par_chunks_mut(w)).enumerate();
    rows.for_each(|(y, (re, im))| {
        for x in 0..w {
            let value = response.value.data[y * w + x];
            if value > 0.0 {
                let share = value / unit;
                let f = if gamma == 0.5 { share.sqrt() } else { libm::powf(share, gamma) };
                let (sin, cos) = libm::sincosf(2.0 * response.angle.data[y * w + x]);
                (re[x], im[x]) = (f * cos, f * sin);
            }
        }
    });
    OrientationField { re, im }
}
