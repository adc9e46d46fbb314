//! The grid of tolerances: within which distances and angles there is a strand.

use super::cones::Cone;
use super::curves::Hit;
use glam::Vec3;
use std::sync::LazyLock;
use strandbench_types::nearest::Limit;

/// Distances of the grid, mm.
pub(crate) const GRID_MM: [f64; 7] = [0.25, 0.5, 1.0, 2.0, 3.0, 4.0, 5.0];

/// Angles of the grid, degrees.
pub(crate) const GRID_DEG: [f64; 6] = [5.0, 10.0, 20.0, 30.0, 40.0, 90.0];

/// Square of the cosine from which on two lines are within an angle; every pair of lines is within 90 degrees.
pub(crate) fn cos_squared(deg: f64) -> f64 {
    if deg >= 90.0 { 0.0 } else { deg.to_radians().cos().powi(2) }
}

/// [`cos_squared`] of [`GRID_DEG`].
pub(super) static GRID_COS2: LazyLock<[f64; 6]> = LazyLock::new(|| GRID_DEG.map(cos_squared));

/// At each distance of the grid, the place of the smallest angle of the grid that something there is within; 6 where there is
/// nothing.
pub(crate) type Stairs = [u8; 7];

/// Nothing at any distance.
pub(crate) const NOTHING: Stairs = [6; 7];

impl Hit {
    /// What this piece alone amounts to.
    pub fn stairs(&self) -> Stairs {
        let angle = GRID_COS2.iter().position(|&c| self.cos2 >= c).unwrap_or(6) as u8;
        GRID_MM.map(|mm| if self.distance_mm <= mm { angle } else { 6 })
    }
}

/// Squares of [`GRID_MM`].
const GRID2: [f64; 7] = [0.0625, 0.25, 1.0, 4.0, 9.0, 16.0, 25.0];

/// The same numbers; their number is padded to what one instruction compares.
const GRID2_F32: [f32; 8] = [0.0625, 0.25, 1.0, 4.0, 9.0, 16.0, 25.0, f32::INFINITY];

pub(super) struct Staircase<'a> {
    pub stairs: Stairs,
    /// Squared cosine that makes a better step at each distance of the grid, ascending, and beyond all of them.
    pub need: [f64; 8],
    /// First distance of the grid at which there can be a step.
    pub lowest: usize,
    /// Of the grid's angles.
    pub cos2: &'a [f64; 6],
    pub line: Vec3,
    pub cones: &'a [Cone],
}

impl Staircase<'_> {
    pub fn improve_at(&mut self, distance_squared: f64, cos2: f64) {
        if let Some(level) = GRID2.iter().position(|&g| distance_squared <= g) {
            self.improve(level, cos2);
        }
    }

    pub fn improve(&mut self, level: usize, cos2: f64) {
        if cos2 < self.need[level] {
            return;
        }
        let angle = self.cos2.iter().position(|&c| cos2 >= c).unwrap_or(6);
        let need = if angle == 0 { f64::INFINITY } else { self.cos2[angle - 1] };
        for l in level..7 {
            if usize::from(self.stairs[l]) <= angle {
                break;
            }
            self.stairs[l] = angle as u8;
            self.need[l] = need;
        }
    }
}

impl Limit for Staircase<'_> {
    fn matters(&self, node: u32, distance_squared: f32) -> bool {
        let level: usize = GRID2_F32.iter().map(|&g| usize::from(g < distance_squared)).sum();
        let need = self.need[level.max(self.lowest)];
        need <= 0.0 || need <= 1.0 && need <= self.cones[node as usize].most_cos2(self.line)
    }
}
