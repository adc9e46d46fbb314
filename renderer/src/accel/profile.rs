//! What rays cost apart from any clock: the work of a ray and the shape of the tree.

use super::lanes::{Lanes, Portable};
use super::leaf::{Cones, Triangles};
use super::node::{Node, TreeRay, WIDTH};
use super::{Accel, LastBlockers};
use glam::Vec3;
use std::cell::Cell;

/// Work of one ray.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Nodes whose boxes were tested.
    pub nodes: u64,
    /// Children whose boxes the ray met.
    pub met: u64,
    /// Leaves of fibres whose segments were tested eight at once.
    pub leaves: u64,
    /// Segments that passed that test and were intersected one by one.
    pub segments: u64,
}

/// Numbers of things in a tree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Shape {
    /// Nodes.
    pub nodes: usize,
    /// Children of all nodes, leaves among them.
    pub children: usize,
    /// Leaves.
    pub leaves: usize,
    /// Segments and triangles in the leaves.
    pub primitives: usize,
}

const NOTHING: Work = Work { nodes: 0, met: 0, leaves: 0, segments: 0 };

thread_local! {
    static WORK: Cell<Work> = const { Cell::new(NOTHING) };
}

/// Counts what [`Portable`] does.
struct Counted;

impl Lanes for Counted {
    unsafe fn boxes(
        node: &Node,
        ray: &TreeRay,
        from: [[f32; 3]; 2],
        tmax: f32,
        enter: &mut [f32; WIDTH],
    ) -> u32 {
        // SAFETY: it runs everywhere.
        let mask = unsafe { Portable::boxes(node, ray, from, tmax, enter) };
        let w = WORK.get();
        WORK.set(Work { nodes: w.nodes + 1, met: w.met + u64::from(mask.count_ones()), ..w });
        mask
    }

    unsafe fn cones(cones: &Cones, ray: &TreeRay, pad: f32, tmax: f32) -> u32 {
        // SAFETY: it runs everywhere.
        let mask = unsafe { Portable::cones(cones, ray, pad, tmax) };
        let w = WORK.get();
        WORK.set(Work { leaves: w.leaves + 1, segments: w.segments + u64::from(mask.count_ones()), ..w });
        mask
    }

    unsafe fn triangles(triangles: &Triangles, ray: &TreeRay) -> u32 {
        // SAFETY: it runs everywhere.
        unsafe { Portable::triangles(triangles, ray) }
    }
}

impl Accel {
    /// What [`Accel::closest`] does for a ray.
    pub fn work_of_closest(&self, origin: Vec3, direction: Vec3) -> Work {
        WORK.set(NOTHING);
        self.closest_with::<Counted>(origin, direction, None);
        WORK.get()
    }

    /// What [`Accel::occluded`] does for a ray without blockers from earlier rays.
    pub fn work_of_occluded(&self, origin: Vec3, direction: Vec3, tmax: f32) -> Work {
        WORK.set(NOTHING);
        self.occluded_with::<Counted>(origin, direction, tmax, None, &mut LastBlockers::default());
        WORK.get()
    }

    /// How the tree is made up.
    pub fn shape(&self) -> Shape {
        let mut shape = Shape { nodes: self.nodes.len(), ..Shape::default() };
        for node in &self.nodes {
            for k in (0..WIDTH).filter(|&k| node.planes[0][0][k] < f32::INFINITY) {
                shape.children += 1;
                shape.leaves += usize::from(node.counts[k] > 0);
                shape.primitives += usize::from(node.counts[k]);
            }
        }
        shape
    }
}
