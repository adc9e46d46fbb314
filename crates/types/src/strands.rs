//! Hair fibres as polylines.

use glam::Vec3;
use rayon::prelude::*;

/// Why a strand set is not usable.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StrandError {
    /// Offsets do not start at 0, do not ascend, or do not end at the number of points.
    #[error("strand offsets are inconsistent at strand {strand}")]
    Offsets {
        /// First strand affected.
        strand: usize,
    },
    /// A coordinate or radius is NaN or infinite.
    #[error("strand {strand}, point {point}: a coordinate or radius is not finite")]
    NotFinite {
        /// Strand index.
        strand: usize,
        /// Point index within the strand.
        point: usize,
    },
    /// A radius is zero or negative.
    #[error("strand {strand}, point {point}: radius {radius_mm} mm is not positive")]
    Radius {
        /// Strand index.
        strand: usize,
        /// Point index within the strand.
        point: usize,
        /// The offending radius.
        radius_mm: f32,
    },
    /// A strand has fewer than two points.
    #[error("strand {strand} has {points} points; a strand needs two")]
    TooShort {
        /// Strand index.
        strand: usize,
        /// Number of points.
        points: usize,
    },
}

/// All points of all strands in one array; strand `i` is `points[offsets[i]..offsets[i + 1]]`, root first
/// where a root is known. World coordinates, mm.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct StrandSet {
    /// Points of all strands, mm.
    pub points: Vec<Vec3>,
    /// Start of each strand, and the number of points as the last entry: one more than there are strands.
    pub offsets: Vec<u32>,
    /// Fibre radius at each point, mm; as long as `points`.
    pub radii_mm: Vec<f32>,
}

impl StrandSet {
    /// An empty set.
    pub fn new() -> StrandSet {
        StrandSet { points: Vec::new(), offsets: vec![0], radii_mm: Vec::new() }
    }

    /// Number of strands.
    pub fn len(&self) -> usize {
        self.offsets.len().saturating_sub(1)
    }

    /// Whether there are no strands.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Appends a strand with one radius (mm) throughout.
    pub fn push(&mut self, points: &[Vec3], radius_mm: f32) {
        self.push_tapered(points, &vec![radius_mm; points.len()]);
    }

    /// Appends a strand with a radius (mm) per point.
    pub fn push_tapered(&mut self, points: &[Vec3], radii_mm: &[f32]) {
        assert_eq!(points.len(), radii_mm.len(), "one radius a point");
        if self.offsets.is_empty() {
            self.offsets.push(0);
        }
        self.points.extend_from_slice(points);
        self.radii_mm.extend_from_slice(radii_mm);
        self.offsets.push(u32::try_from(self.points.len()).expect("under 2^32 points"));
    }

    /// Point range of strand `i`.
    pub fn range(&self, i: usize) -> std::ops::Range<usize> {
        self.offsets[i] as usize..self.offsets[i + 1] as usize
    }

    /// Points of strand `i`, mm.
    pub fn strand(&self, i: usize) -> &[Vec3] {
        &self.points[self.range(i)]
    }

    /// All strands in order.
    pub fn iter(&self) -> impl Iterator<Item = &[Vec3]> {
        (0..self.len()).map(|i| self.strand(i))
    }

    /// Arc length of strand `i`, mm.
    pub fn length_mm(&self, i: usize) -> f64 {
        self.strand(i).windows(2).map(|w| f64::from(w[0].distance(w[1]))).sum()
    }

    /// Checks offsets, finiteness, radii and that each strand has at least two points.
    ///
    /// # Errors
    /// The first fault found, with its strand and point.
    pub fn validate(&self) -> Result<(), StrandError> {
        if self.offsets.first() != Some(&0)
            || self.offsets.last().map(|&o| o as usize) != Some(self.points.len())
            || self.radii_mm.len() != self.points.len()
        {
            return Err(StrandError::Offsets { strand: 0 });
        }
        match (0..self.len()).into_par_iter().find_map_first(|strand| self.fault_of(strand)) {
            Some(fault) => Err(fault),
            None => Ok(()),
        }
    }

    fn fault_of(&self, strand: usize) -> Option<StrandError> {
        let (a, b) = (self.offsets[strand], self.offsets[strand + 1]);
        if b < a || b as usize > self.points.len() {
            return Some(StrandError::Offsets { strand });
        }
        if b - a < 2 {
            return Some(StrandError::TooShort { strand, points: (b - a) as usize });
        }
        self.range(strand).enumerate().find_map(|(point, i)| {
            let radius_mm = self.radii_mm[i];
            if !self.points[i].is_finite() || !radius_mm.is_finite() {
                return Some(StrandError::NotFinite { strand, point });
            }
            (radius_mm <= 0.0).then_some(StrandError::Radius { strand, point, radius_mm })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_ranges_and_faults() {
        let mut s = StrandSet::new();
        s.push(&[Vec3::ZERO, Vec3::X, Vec3::new(1.0, 2.0, 0.0)], 0.04);
        s.push(&[Vec3::Y, Vec3::Z], 0.04);
        assert_eq!((s.len(), s.range(1)), (2, 3..5));
        assert!((s.length_mm(0) - 3.0).abs() < 1e-6);
        assert_eq!(s.validate(), Ok(()));
        let mut nan = s.clone();
        nan.points[4].x = f32::NAN;
        assert_eq!(nan.validate(), Err(StrandError::NotFinite { strand: 1, point: 1 }));
        let mut negative = s.clone();
        negative.radii_mm[0] = -1.0;
        assert!(matches!(negative.validate(), Err(StrandError::Radius { strand: 0, point: 0, .. })));
        let mut order = s.clone();
        order.offsets[1] = 9;
        assert!(matches!(order.validate(), Err(StrandError::Offsets { .. })));
        s.push(&[Vec3::ZERO], 0.04);
        assert_eq!(s.validate(), Err(StrandError::TooShort { strand: 2, points: 1 }));
    }
}
