//! Sub-pixel refinement of labels (Eq. 9).

use crate::grid::Volume;

/// Eq. 9 at one pixel: the label's offset in (-1, 1) from its cost and its neighbours' (label - 1, + 1).
///
/// | costs | offset |
/// |---|---|
/// | e₋ below e₀ and e₊ | -0.5 |
/// | e₊ below e₀ and e₋ | +0.5 |
/// | e₀ below both | vertex of the parabola, 0.5 (e₋ - e₊) / (e₋ + e₊ - 2 e₀), in (-0.5, 0.5) |
///
/// The printed conditions are strict and leave ties open. Where e₀ ties with one neighbour the second row's
/// value, ±0.5, is continuous and taken; where both neighbours tie below e₀ or all three are equal, nothing
/// prefers a side and the label stays.
pub fn offset(e_minus: f32, e_0: f32, e_plus: f32) -> f32 {
    if e_minus < e_0 && e_minus < e_plus {
        return -0.5;
    }
    if e_plus < e_0 && e_plus < e_minus {
        return 0.5;
    }
    let bend = e_minus + e_plus - 2.0 * e_0;
    if bend > 0.0 { (0.5 * (e_minus - e_plus) / bend).clamp(-0.5, 0.5) } else { 0.0 }
}

/// Refined labels: Eq. 9 on aggregated costs. The first and the last label have one neighbour and stay.
pub fn refine(volume: &Volume, labels: &[u16], active: &[bool]) -> Vec<f32> {
    labels
        .iter()
        .zip(active)
        .enumerate()
        .map(|(pixel, (&label, &active))| {
            let (k, costs) = (label as usize, volume.costs(pixel));
            if !active || k == 0 || k + 1 == volume.labels {
                return f32::from(label);
            }
            f32::from(label) + offset(costs[k - 1], costs[k], costs[k + 1])
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Volume;

    #[test]
    fn equation_9_by_hand() {
        // Row 1 and row 3: towards the smaller cost.
        assert_eq!(offset(1.0, 2.0, 3.0), -0.5);
        assert_eq!(offset(3.0, 2.0, 1.0), 0.5);
        assert_eq!(offset(1.0, 4.0, 2.0), -0.5);
        assert_eq!(offset(2.0, 4.0, 1.0), 0.5);
        // Row 2: 0.5 (3 - 2) / (3 + 2 - 2) = 1/6; symmetric: 0; costs below zero alike.
        assert!((offset(3.0, 1.0, 2.0) - 1.0 / 6.0).abs() < 1e-7);
        assert!((offset(-2.0, -4.0, -3.0) - 1.0 / 6.0).abs() < 1e-7);
        assert_eq!(offset(2.0, 1.0, 2.0), 0.0);
        // Row 2 finds the minimum of any parabola: (x - 0.3)² at -1, 0, 1.
        assert!((offset(1.69, 0.09, 0.49) - 0.3).abs() < 1e-6);
        // Ties.
        assert_eq!(offset(1.0, 1.0, 2.0), -0.5);
        assert_eq!(offset(2.0, 1.0, 1.0), 0.5);
        assert_eq!(offset(1.0, 1.0, 1.0), 0.0);
        assert_eq!(offset(1.0, 2.0, 1.0), 0.0);
    }

    #[test]
    fn ends_and_inactive_pixels_stay() {
        let v = Volume { labels: 3, data: [0.0, 1.0, 2.0].repeat(4) };
        let got = refine(&v, &[0, 1, 2, 1], &[true, true, true, false]);
        assert_eq!(got, [0.0, 0.5, 2.0, 1.0]);
    }
}
