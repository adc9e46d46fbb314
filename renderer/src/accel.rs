//! The acceleration structure over fibre segments and triangles: obvhs' compressed wide BVH.

use crate::RenderError;
use crate::build::build;
use crate::cone::{RoundCone, Triangle};
#[cfg(target_arch = "x86_64")]
use crate::node::Avx2;
use crate::node::{NodeTest, Portable, has_avx2};
use glam::{UVec2, Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::cwbvh::CwBvh;
use obvhs::ray::Ray;
use rayon::prelude::*;
use std::hash::{DefaultHasher, Hash, Hasher};
use strandbench_types::{StrandSet, TriMesh};

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

/// A primitive's identity: which strand and point, or which surface and triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Name {
    /// Strand, or surface with the top bit set.
    owner: u32,
    /// Start point of the segment, or triangle.
    item: u32,
}

const MESH_BIT: u32 = 1 << 31;

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

/// Blockers that were met last; trying them first spares most traversals of shadowed points and cannot
/// change an answer.
#[derive(Clone, Copy, Debug)]
pub struct LastBlockers {
    slots: [u32; 4],
    next: usize,
}

impl Default for LastBlockers {
    fn default() -> LastBlockers {
        LastBlockers { slots: [u32::MAX; 4], next: 0 }
    }
}

/// All primitives of a scene, in the order of the BVH's leaves.
pub struct Accel {
    bvh: CwBvh,
    /// Indexed [leaf slot]; a negative radius marks a triangle, whose index stands in the bits of `half_delta`.
    cones: Vec<RoundCone>,
    /// Indexed [leaf slot].
    names: Vec<Name>,
    triangles: Vec<Triangle>,
    wide: bool,
    centre: Vec3,
    radius: f32,
}

/// Indices below `n` in order, without those whose key an earlier index has.
fn distinct<K: Hash + Eq>(n: usize, key: impl Fn(usize) -> K + Sync) -> Vec<u32> {
    let hash = |i: usize| {
        let mut h = DefaultHasher::new();
        key(i).hash(&mut h);
        h.finish()
    };
    let mut by_hash: Vec<(u64, u32)> = (0..n).into_par_iter().map(|i| (hash(i), i as u32)).collect();
    by_hash.par_sort_unstable();
    let mut keep = vec![true; n];
    for run in by_hash.chunk_by(|a, b| a.0 == b.0) {
        for (k, &(_, i)) in run.iter().enumerate().skip(1) {
            // Two keys of one hash that differ are all kept; that they never occur in practice is no matter.
            keep[i as usize] = key(i as usize) != key(run[k - 1].1 as usize);
        }
    }
    (0..n as u32).filter(|&i| keep[i as usize]).collect()
}

fn segment(strands: &StrandSet, i: usize) -> RoundCone {
    let (p, r) = (&strands.points, &strands.radii_mm);
    RoundCone::new(p[i], r[i], p[i + 1], r[i + 1])
}

impl Accel {
    /// Builds over all segments of `strands` and all triangles of `meshes`.
    ///
    /// # Errors
    /// If there are neither, or more than 2^31 - 1 of them.
    pub fn new(strands: &StrandSet, meshes: &[&TriMesh]) -> Result<Accel, RenderError> {
        let mut cones = Vec::with_capacity(strands.points.len().saturating_sub(strands.len()));
        let mut cone_names = Vec::with_capacity(cones.capacity());
        for strand in 0..strands.len() {
            let range = strands.range(strand);
            for i in range.start..range.end.saturating_sub(1) {
                cones.push(segment(strands, i));
                cone_names.push(Name { owner: strand as u32, item: i as u32 });
            }
        }
        let mut triangles = Vec::new();
        let mut triangle_names = Vec::new();
        for (surface, mesh) in meshes.iter().enumerate() {
            for (item, t) in mesh.triangles.iter().enumerate() {
                let [a, b, c] = t.map(|k| mesh.vertices[k as usize]);
                triangles.push(Triangle { a, ab: b - a, ac: c - a });
                triangle_names.push(Name { owner: MESH_BIT | surface as u32, item: item as u32 });
            }
        }
        let total = cones.len() + triangles.len();
        if total == 0 {
            return Err(RenderError::Scene("there is nothing to render: no strands and no meshes".into()));
        }
        if total >= MESH_BIT as usize {
            return Err(RenderError::Scene(format!("{total} segments and triangles are more than 2^31 - 1")));
        }
        let boxes = cones.iter().map(RoundCone::bounds).chain(triangles.iter().map(Triangle::bounds));
        let (lo, hi) = boxes
            .clone()
            .fold((Vec3::splat(f32::MAX), Vec3::splat(f32::MIN)), |(lo, hi), (a, b)| (lo.min(a), hi.max(b)));
        // Rounding in the node test grows with the distances involved: wider boxes make it conservative.
        let pad = 4e-7 * ((hi - lo).length() + lo.abs().max(hi.abs()).max_element());
        // Coincident primitives would be chained into a tree of unlimited depth, and only the lowest of them can
        // ever be the answer.
        let mut kept = distinct(cones.len(), |i| {
            let c = &cones[i];
            (c.middle.to_array().map(f32::to_bits), c.half.to_array().map(f32::to_bits), c.radius.to_bits())
        });
        kept.extend(
            distinct(triangles.len(), |i| {
                let t = &triangles[i];
                [t.a, t.ab, t.ac].map(|v| v.to_array().map(f32::to_bits))
            })
            .into_iter()
            .map(|i| i + cones.len() as u32),
        );
        let n = cones.len();
        let boxes: Vec<Aabb> = kept
            .iter()
            .map(|&i| {
                let i = i as usize;
                let (lo, hi) = if i < n { cones[i].bounds() } else { triangles[i - n].bounds() };
                Aabb::new(Vec3A::from(lo - pad), Vec3A::from(hi + pad))
            })
            .collect();
        // Made again below: what is not needed meanwhile would add to the peak of memory.
        drop(cones);
        let mut bvh = build(&boxes);
        drop(boxes);
        let order = std::mem::take(&mut bvh.primitive_indices);
        let slots = order.iter().map(|&k| kept[k as usize] as usize);
        let sorted = slots.clone().map(|i| match i.checked_sub(n) {
            None => segment(strands, cone_names[i].item as usize),
            Some(t) => {
                RoundCone { radius: -1.0, half_delta: f32::from_bits(t as u32), ..RoundCone::default() }
            }
        });
        let sorted: Vec<RoundCone> = sorted.collect();
        let names =
            slots.map(|i| i.checked_sub(n).map_or_else(|| cone_names[i], |t| triangle_names[t])).collect();
        Ok(Accel {
            bvh,
            cones: sorted,
            names,
            triangles,
            wide: has_avx2(),
            centre: (lo + hi) * 0.5,
            radius: (hi - lo).length() * 0.5 + pad,
        })
    }

    /// Centre and radius of a sphere around everything, mm.
    pub fn bounding_sphere(&self) -> (Vec3, f32) {
        (self.centre, self.radius)
    }

    /// Whether nodes are tested eight lanes at a time.
    pub fn is_wide(&self) -> bool {
        self.wide
    }

    /// The same geometry with the node test that runs on every machine.
    pub fn portable(self) -> Accel {
        Accel { wide: false, ..self }
    }

    /// The first thing that the ray (unit direction) meets with `t > 0`; equal distances go to the lower
    /// identity, so the answer does not depend on the BVH.
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

    #[inline(always)]
    fn closest_with<N: NodeTest>(&self, origin: Vec3, direction: Vec3, skip: Option<Skip>) -> Option<Hit> {
        let mut ray = Ray::new(origin.into(), direction.into(), 0.0, f32::INFINITY);
        let mut best = (u32::MAX, [0.0f32; 2]);
        let mut state = self.bvh.new_traversal(ray.direction);
        let mut node;
        // SAFETY: `N` runs on this machine, as `wide` was asked before it was chosen.
        obvhs::traverse!(self.bvh, node, state, unsafe { N::children(node, &ray, state.oct_inv4) }, {
            let slot = state.primitive_id;
            if let Some((t, uv)) = self.meet(slot, origin, direction)
                && (t < ray.tmax || (t == ray.tmax && best.0 != u32::MAX && self.precedes(slot, best.0)))
                && !self.passes(slot, t, skip)
            {
                ray.tmax = t;
                best = (slot, uv);
            }
        });
        let (slot, uv) = best;
        let name = *self.names.get(slot as usize)?;
        let t = ray.tmax;
        Some(if name.owner & MESH_BIT == 0 {
            Hit::Fibre { t, strand: name.owner, point: name.item, along: uv[0] }
        } else {
            Hit::Mesh { t, surface: name.owner & !MESH_BIT, triangle: name.item, uv }
        })
    }

    fn precedes(&self, a: u32, b: u32) -> bool {
        let (a, b) = (self.names[a as usize], self.names[b as usize]);
        (a.owner, a.item) < (b.owner, b.item)
    }

    /// Distance and place of the ray's entry into a primitive.
    #[inline(always)]
    fn meet(&self, slot: u32, origin: Vec3, direction: Vec3) -> Option<(f32, [f32; 2])> {
        let cone = &self.cones[slot as usize];
        if cone.radius >= 0.0 {
            cone.intersect(origin, direction, 0.0).map(|h| (h.t, [h.along, 0.0]))
        } else {
            let triangle = &self.triangles[cone.half_delta.to_bits() as usize];
            triangle.intersect(origin, direction, 0.0).map(|h| (h.t, [h.u, h.v]))
        }
    }

    #[inline(always)]
    fn blocks(&self, slot: u32, origin: Vec3, direction: Vec3, tmax: f32, skip: Option<Skip>) -> bool {
        let Some((t, _)) = self.meet(slot, origin, direction) else { return false };
        if t >= tmax {
            return false;
        }
        !self.passes(slot, t, skip)
    }

    /// Whether a ray that leaves a fibre goes through this hit.
    #[inline(always)]
    fn passes(&self, slot: u32, t: f32, skip: Option<Skip>) -> bool {
        let Some(skip) = skip else { return false };
        // The owner of a triangle has a bit that no strand has.
        let name = self.names[slot as usize];
        name.owner == skip.strand && (name.item.abs_diff(skip.point) <= 1 || t < skip.near_mm)
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
            if slot != u32::MAX && self.blocks(slot, origin, direction, tmax, skip) {
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
    fn occluded_with<N: NodeTest>(
        &self,
        origin: Vec3,
        direction: Vec3,
        tmax: f32,
        skip: Option<Skip>,
        last: &mut LastBlockers,
    ) -> bool {
        let ray = Ray::new(origin.into(), direction.into(), 0.0, tmax);
        let mut state = self.bvh.new_traversal(ray.direction);
        let mut node;
        let mut blocked = false;
        'walk: {
            // SAFETY: `N` runs on this machine, as `wide` was asked before it was chosen.
            obvhs::traverse!(self.bvh, node, state, unsafe { N::children(node, &ray, state.oct_inv4) }, {
                let slot = state.primitive_id;
                if self.blocks(slot, origin, direction, tmax, skip) {
                    last.slots[last.next] = slot;
                    last.next = (last.next + 1) % last.slots.len();
                    blocked = true;
                    break 'walk;
                }
            });
        }
        blocked
    }
}
