//! How far each point of a set of strands is from the truth, for pictures.

use super::curves::{Curves, check_lengths};
use super::stairs::cos_squared;
use crate::ScoreError;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use strandbench_types::StrandSet;

/// Distance (mm) of every point of `strands` to the nearest true strand whose line is within `angle_deg` of the strand's
/// there; infinite beyond `reach_mm`. The line at a point is that from the point before it to the one after it.
///
/// # Errors
/// If a set is not valid or a strand absurdly long.
pub fn strand_point_errors_mm(
    truth: &StrandSet,
    strands: &StrandSet,
    angle_deg: f64,
    reach_mm: f64,
) -> Result<Vec<f32>, ScoreError> {
    for (set, whose) in [(truth, "true"), (strands, "estimate's")] {
        set.validate().map_err(|e| ScoreError::Input(format!("the {whose} strands: {e}")))?;
        check_lengths(set, whose)?;
    }
    let curves = Curves::whole(truth, |_| true)?;
    let least = cos_squared(angle_deg);
    let of_strand = |s: usize| -> Vec<f32> {
        let points = strands.strand(s);
        let line = |i: usize| -> DVec3 {
            let (a, b): (Vec3, Vec3) = (points[i.saturating_sub(1)], points[(i + 1).min(points.len() - 1)]);
            (b.as_dvec3() - a.as_dvec3()).normalize_or_zero()
        };
        let error = |i: usize| {
            let hit = curves.nearest(points[i].as_dvec3(), line(i), reach_mm, least);
            hit.map_or(f32::INFINITY, |h| h.distance_mm as f32)
        };
        (0..points.len()).map(error).collect()
    };
    Ok((0..strands.len()).into_par_iter().flat_map_iter(of_strand).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(lines: &[[Vec3; 3]]) -> StrandSet {
        let mut s = StrandSet::new();
        lines.iter().for_each(|l| s.push(l, 0.05));
        s
    }

    #[test]
    fn distance_is_to_a_strand_that_runs_the_same_way() {
        let at = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
        let along_x = [at(0.0, 0.0, 0.0), at(50.0, 0.0, 0.0), at(100.0, 0.0, 0.0)];
        let along_y = [at(50.0, -50.0, 4.0), at(50.0, 0.0, 4.0), at(50.0, 50.0, 4.0)];
        let truth = set(&[along_x, along_y]);
        // Runs along x: 3 mm from the strand along x, and 1 mm from the one that crosses it.
        let shifted = set(&[along_x.map(|p| p + at(0.0, 0.0, 3.0)), along_x.map(|p| p + at(0.0, 0.0, 30.0))]);
        let e = strand_point_errors_mm(&truth, &shifted, 20.0, 10.0).unwrap();
        assert_eq!(e.len(), 6);
        assert!(e[..3].iter().all(|d| (d - 3.0).abs() < 1e-5), "{e:?}");
        assert!(e[3..].iter().all(|d| d.is_infinite()), "{e:?}");
        let any = strand_point_errors_mm(&truth, &shifted, 90.0, 10.0).unwrap();
        assert!((any[1] - 1.0).abs() < 1e-5 && (any[0] - 3.0).abs() < 1e-5, "{any:?}");
    }
}
