//! The acceleration structure over fibre segments and triangles: a tree of nodes with eight boxes each, whose
//! leaves hold up to eight segments side by side, so that both take one pass of the machine's vector unit.

mod beam;
mod bins;
mod build;
mod lanes;
mod leaf;
mod node;
mod prepare;
mod profile;
#[cfg(test)]
mod tests;
mod walk;

pub(crate) use beam::Beam;
use glam::{DVec3, Vec3};
#[cfg(target_arch = "x86_64")]
use lanes::Avx2;
use lanes::{Lanes, Portable};
use leaf::{Cones, Name, Triangles};
use node::{INDEX, Node, TRIANGLES, TreeRay, WIDTH};
pub use profile::{Shape, Work};
use walk::Forest;

/// What a ray met first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Hit {
    /// A fibre.
    Fibre {
        /// Distance along the ray, mm.
        t: f32,
        /// Strand index.
        strand: u32,
        /// Index of the strand set's point at which the segment starts.
        point: u32,
        /// Position along the segment, 0..1.
        along: f32,
    },
    /// A mesh.
    Mesh {
        /// Distance along the ray, mm.
        t: f32,
        /// Surface index.
        surface: u32,
        /// Triangle index in the surface's mesh.
        triangle: u32,
        /// Barycentric weights of the second and third corner.
        uv: [f32; 2],
    },
}

/// A ray that starts on a fibre (shadow or bounce) passes that fibre near its start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Skip {
    /// The strand that the ray leaves.
    pub strand: u32,
    /// Start point of the segment that the ray leaves; it and its two neighbours are passed.
    pub point: u32,
    /// Other segments of the strand are passed below this distance, mm.
    pub near_mm: f32,
}

/// A primitive's place: the leaf's index times eight plus the lane, [`FLAT`] set for triangles.
type Slot = u32;
const FLAT: Slot = 1 << 31;
const NO_SLOT: Slot = u32::MAX;

/// Blockers that were met last; trying them first spares most traversals of shadowed points and cannot
/// change an answer.
#[derive(Clone, Copy, Debug)]
pub struct LastBlockers {
    slots: [Slot; 4],
    next: usize,
}

impl Default for LastBlockers {
    fn default() -> LastBlockers {
        LastBlockers { slots: [NO_SLOT; 4], next: 0 }
    }
}

/// All primitives of a scene, in leaves.
pub struct Accel {
    nodes: Vec<Node>,
    cones: Vec<Cones>,
    triangles: Vec<Triangles>,
    wide: bool,
    centre: Vec3,
    radius: f32,
    /// By how much boxes and cones are wider than they are, mm: more than rounding moves a ray within the scene.
    pad: f32,
}

impl Accel {
    /// Centre and radius of a sphere around everything, mm.
    pub fn bounding_sphere(&self) -> (Vec3, f32) {
        (self.centre, self.radius)
    }

    /// Whether boxes and segments are tested with the machine's AVX2 instructions.
    pub fn is_wide(&self) -> bool {
        self.wide
    }

    /// The same geometry with the tests that run on every machine.
    pub fn portable(self) -> Accel {
        Accel { wide: false, ..self }
    }

    /// Memory of the structure, bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.cones[..]) + size_of_val(&self.triangles[..])
    }

    /// The first thing that the ray (unit direction) meets with `t > 0`; equal distances go to the lower
    /// identity, so the answer does not depend on the tree.
    #[inline]
    pub fn closest(&self, origin: Vec3, direction: Vec3) -> Option<Hit> {
        self.closest_after(origin, direction, None)
    }

    /// As [`Accel::closest`] for a ray that leaves a fibre, which it does not meet near its start.
    #[inline]
    pub fn closest_after(&self, origin: Vec3, direction: Vec3, skip: Option<Skip>) -> Option<Hit> {
        #[cfg(target_arch = "x86_64")]
        if self.wide {
            // SAFETY: `wide` says that the machine has the instructions.
            return unsafe { self.closest_avx2(origin, direction, skip) };
        }
        self.closest_with::<Portable>(origin, direction, skip)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma,bmi1,lzcnt,popcnt")]
    fn closest_avx2(&self, origin: Vec3, direction: Vec3, skip: Option<Skip>) -> Option<Hit> {
        self.closest_with::<Avx2>(origin, direction, skip)
    }

    /// The ray from where it may first meet the scene, and how far that is from its origin, mm. None if a number
    /// is not finite: such a ray would meet the boxes of children that are not there.
    #[inline(always)]
    fn tree_ray(&self, origin: Vec3, direction: Vec3) -> Option<(TreeRay, f32)> {
        if !(origin.is_finite() && direction.is_finite()) {
            return None;
        }
        let start = ((self.centre - origin).dot(direction) - self.radius).max(0.0);
        let moved = if start > 0.0 {
            let o: DVec3 = origin.as_dvec3() + direction.as_dvec3() * f64::from(start);
            o.as_vec3()
        } else {
            origin
        };
        Some((TreeRay::new(origin.to_array(), moved.to_array(), direction.to_array()), start))
    }

    fn forest(&self) -> Forest<'_> {
        Forest { nodes: &self.nodes, cones: &self.cones, triangles: &self.triangles, pad: self.pad }
    }

    #[inline(always)]
    fn closest_with<L: Lanes>(&self, origin: Vec3, direction: Vec3, skip: Option<Skip>) -> Option<Hit> {
        let (ray, start) = self.tree_ray(origin, direction)?;
        let mut best = (NO_SLOT, f32::INFINITY, [0.0f32; 2]);
        // Rounding of distances that are measured from far away.
        let slack = self.pad + 4e-7 * start - start;
        let visit = |leaf: u32, lane: usize, _: f32| {
            let slot = slot(leaf, lane);
            if let Some((t, uv)) = self.meet(slot, origin, direction)
                && (t < best.1 || (t == best.1 && best.0 != NO_SLOT && self.name(slot) < self.name(best.0)))
                && !self.passes(slot, t, skip)
            {
                best = (slot, t, uv);
            }
            Some(best.1 + slack)
        };
        // SAFETY: `L` runs on this machine, as `wide` was asked before it was chosen.
        unsafe { self.forest().walk::<L, true>(&ray, f32::INFINITY, visit) };
        let (slot, t, uv) = best;
        if slot == NO_SLOT {
            return None;
        }
        let name = self.name(slot).1;
        Some(if slot & FLAT == 0 {
            Hit::Fibre { t, strand: name.owner, point: name.item, along: uv[0] }
        } else {
            Hit::Mesh { t, surface: name.owner, triangle: name.item, uv }
        })
    }

    /// Identity, in an order in which fibres come before meshes.
    #[inline(always)]
    fn name(&self, slot: Slot) -> (bool, Name) {
        let (leaf, lane) = ((slot & !FLAT) as usize / WIDTH, slot as usize % WIDTH);
        if slot & FLAT == 0 {
            (false, self.cones[leaf].names[lane])
        } else {
            (true, self.triangles[leaf].names[lane])
        }
    }

    /// Distance and place of the ray's entry into a primitive.
    #[inline(always)]
    fn meet(&self, slot: Slot, origin: Vec3, direction: Vec3) -> Option<(f32, [f32; 2])> {
        let (leaf, lane) = ((slot & !FLAT) as usize / WIDTH, slot as usize % WIDTH);
        if slot & FLAT == 0 {
            self.cones[leaf].get(lane).intersect(origin, direction, 0.0).map(|h| (h.t, [h.along, 0.0]))
        } else {
            let triangle = self.triangles[leaf].get(lane);
            triangle.intersect(origin, direction, 0.0).map(|h| (h.t, [h.u, h.v]))
        }
    }

    #[inline(always)]
    fn blocks(&self, slot: Slot, origin: Vec3, direction: Vec3, tmax: f32, skip: Option<Skip>) -> bool {
        let Some((t, _)) = self.meet(slot, origin, direction) else { return false };
        t < tmax && !self.passes(slot, t, skip)
    }

    /// Whether a ray that leaves a fibre goes through this hit.
    #[inline(always)]
    fn passes(&self, slot: Slot, t: f32, skip: Option<Skip>) -> bool {
        let Some(skip) = skip else { return false };
        let (flat, name) = self.name(slot);
        !flat && name.owner == skip.strand && (name.item.abs_diff(skip.point) <= 1 || t < skip.near_mm)
    }

    /// Whether anything lies on the ray (unit direction) before `tmax`.
    #[inline]
    pub fn occluded(
        &self,
        origin: Vec3,
        direction: Vec3,
        tmax: f32,
        skip: Option<Skip>,
        last: &mut LastBlockers,
    ) -> bool {
        for &slot in &last.slots {
            if slot != NO_SLOT && self.blocks(slot, origin, direction, tmax, skip) {
                return true;
            }
        }
        #[cfg(target_arch = "x86_64")]
        if self.wide {
            // SAFETY: `wide` says that the machine has the instructions.
            return unsafe { self.occluded_avx2(origin, direction, tmax, skip, last) };
        }
        self.occluded_with::<Portable>(origin, direction, tmax, skip, last)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma,bmi1,lzcnt,popcnt")]
    fn occluded_avx2(
        &self,
        o: Vec3,
        d: Vec3,
        tmax: f32,
        skip: Option<Skip>,
        last: &mut LastBlockers,
    ) -> bool {
        self.occluded_with::<Avx2>(o, d, tmax, skip, last)
    }

    #[inline(always)]
    fn occluded_with<L: Lanes>(
        &self,
        origin: Vec3,
        direction: Vec3,
        tmax: f32,
        skip: Option<Skip>,
        last: &mut LastBlockers,
    ) -> bool {
        let Some((ray, start)) = self.tree_ray(origin, direction) else { return false };
        let mut blocked = false;
        let visit = |leaf: u32, lane: usize, end: f32| {
            let slot = slot(leaf, lane);
            if self.blocks(slot, origin, direction, tmax, skip) {
                last.slots[last.next] = slot;
                last.next = (last.next + 1) % last.slots.len();
                blocked = true;
                return None;
            }
            Some(end)
        };
        let end = tmax + (self.pad + 4e-7 * start - start);
        // SAFETY: `L` runs on this machine, as `wide` was asked before it was chosen.
        unsafe { self.forest().walk::<L, false>(&ray, end, visit) };
        blocked
    }
}

#[inline(always)]
fn slot(leaf: u32, lane: usize) -> Slot {
    let flat = if leaf & TRIANGLES == 0 { 0 } else { FLAT };
    ((leaf & INDEX) * WIDTH as u32 + lane as u32) | flat
}
