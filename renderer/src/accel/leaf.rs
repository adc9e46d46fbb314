//! Leaves: up to eight fibre segments or triangles side by side.

use super::node::WIDTH;
use crate::cone::{RoundCone, Triangle};
use glam::Vec3;

/// A primitive's identity: which strand and point, or which surface and triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Name {
    /// Strand, or surface.
    pub owner: u32,
    /// Start point of the segment, or triangle.
    pub item: u32,
}

/// Up to eight round cones; absent ones are NaN, which no ray meets.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Cones {
    /// Indexed [axis][lane].
    pub middle: [[f32; WIDTH]; 3],
    pub radius: [f32; WIDTH],
    /// Indexed [axis][lane].
    pub half: [[f32; WIDTH]; 3],
    pub half_delta: [f32; WIDTH],
    pub names: [Name; WIDTH],
}

impl Default for Cones {
    fn default() -> Cones {
        let absent = [f32::NAN; WIDTH];
        Cones {
            middle: [absent; 3],
            radius: absent,
            half: [absent; 3],
            half_delta: absent,
            names: [Name { owner: u32::MAX, item: u32::MAX }; WIDTH],
        }
    }
}

impl Cones {
    pub(super) fn set(&mut self, lane: usize, cone: &RoundCone, name: Name) {
        for axis in 0..3 {
            self.middle[axis][lane] = cone.middle[axis];
            self.half[axis][lane] = cone.half[axis];
        }
        self.radius[lane] = cone.radius;
        self.half_delta[lane] = cone.half_delta;
        self.names[lane] = name;
    }

    #[inline(always)]
    pub(super) fn get(&self, lane: usize) -> RoundCone {
        let vector = |v: &[[f32; WIDTH]; 3]| Vec3::new(v[0][lane], v[1][lane], v[2][lane]);
        RoundCone {
            middle: vector(&self.middle),
            radius: self.radius[lane],
            half: vector(&self.half),
            half_delta: self.half_delta[lane],
        }
    }
}

/// Up to eight triangles; absent ones are NaN.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Triangles {
    /// Corner and the two edges from it, indexed [corner, edge, edge][axis][lane].
    pub sides: [[[f32; WIDTH]; 3]; 3],
    pub names: [Name; WIDTH],
}

impl Default for Triangles {
    fn default() -> Triangles {
        Triangles {
            sides: [[[f32::NAN; WIDTH]; 3]; 3],
            names: [Name { owner: u32::MAX, item: u32::MAX }; WIDTH],
        }
    }
}

impl Triangles {
    pub(super) fn set(&mut self, lane: usize, triangle: &Triangle, name: Name) {
        for (side, v) in self.sides.iter_mut().zip([triangle.a, triangle.ab, triangle.ac]) {
            for axis in 0..3 {
                side[axis][lane] = v[axis];
            }
        }
        self.names[lane] = name;
    }

    #[inline(always)]
    pub(super) fn get(&self, lane: usize) -> Triangle {
        let [a, ab, ac] = [0, 1, 2]
            .map(|i| Vec3::new(self.sides[i][0][lane], self.sides[i][1][lane], self.sides[i][2][lane]));
        Triangle { a, ab, ac }
    }
}
