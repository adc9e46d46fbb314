//! What the rays of one pixel may meet, found once for all of them.
//!
//! Rays that leave one point through one pixel go nearly the same way: a cone around their middle holds them all. What
//! it touches is gathered from near to far, as far as a ray asks, and each ray is tried against that short list in
//! place of the tree (a walk with a beam of rays: Heckbert and Hanrahan 1984). What a ray meets is what it meets in the tree.

#[cfg(test)]
mod tests;

#[cfg(target_arch = "x86_64")]
use super::lanes::Avx2;
use super::lanes::{Lanes, Portable};
use super::leaf::{Cones, Name};
use super::node::{INDEX, LEAF, Node, TRIANGLES, TreeRay, WIDTH};
use super::{Accel, Hit};
use glam::Vec3;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// What a beam touches, as far as it has been asked for; kept from pixel to pixel for its memory.
#[derive(Default)]
pub(crate) struct Beam {
    middle: Option<Middle>,
    /// Not looked into yet.
    open: BinaryHeap<Open>,
    /// From near to far.
    blocks: Vec<Block>,
    cones: Vec<Cones>,
}

/// A beam's middle.
#[derive(Clone, Copy)]
struct Middle {
    ray: TreeRay,
    /// Distance from where the beam's rays leave to where `ray` starts, mm.
    ahead_mm: f64,
    /// The beam's radius, mm: at the middle's start, and more for each mm.
    radius: [f32; 2],
    /// The scene's end, mm from the middle's start, and the radius there.
    depth: f32,
    widest: f32,
    /// From where planes that are met first and last are seen, so that boxes are wider by as much.
    from: [[f32; 3]; 2],
}

impl Middle {
    /// The beam's radius at a distance from the middle's start, mm.
    fn radius(&self, distance: f32) -> f32 {
        self.radius[0] + self.radius[1] * distance.min(self.depth)
    }
}

/// A part of the tree; the nearest is the greatest.
#[derive(Clone, Copy)]
struct Open {
    /// No ray of the beam enters it before, and none leaves it after: distances from the middle's start, mm.
    near: f32,
    far: f32,
    child: u32,
}

impl Ord for Open {
    fn cmp(&self, other: &Open) -> Ordering {
        other.near.total_cmp(&self.near).then(other.child.cmp(&self.child))
    }
}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Open) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Open {
    fn eq(&self, other: &Open) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Open {}

/// Up to eight primitives.
#[derive(Clone, Copy)]
struct Block {
    /// No ray of the beam meets them before, mm from the middle's start.
    near: f32,
    /// A leaf of triangles of the tree, or cones of the beam.
    leaf: u32,
}

/// Runs `$with::<L>($args)` with the machine's instructions.
macro_rules! dispatch {
    ($self:ident.$wide:ident, $with:ident($($arg:expr),*)) => {{
        #[cfg(target_arch = "x86_64")]
        if $self.wide {
            // SAFETY: `wide` says that the machine has the instructions.
            return unsafe { $self.$wide($($arg),*) };
        }
        // SAFETY: this runs everywhere.
        unsafe { $self.$with::<Portable>($($arg),*) }
    }};
}

impl Accel {
    /// Begins a beam around the ray `origin`, `direction` (unit), which starts `ahead_mm` from the point that all rays of
    /// the beam leave; `spread` is the greatest tangent of an angle between it and them. Nothing may lie before it.
    pub(crate) fn begin(&self, beam: &mut Beam, origin: Vec3, direction: Vec3, ahead_mm: f64, spread: f32) {
        beam.open.clear();
        beam.blocks.clear();
        beam.cones.clear();
        beam.middle = self.tree_ray(origin, direction).map(|(ray, start)| {
            beam.open.push(Open { near: 0.0, far: f32::INFINITY, child: 0 });
            let ahead_mm = ahead_mm + f64::from(start);
            // Wider by what rounding does to directions, and to places far from the camera.
            let radius = [spread * ahead_mm as f32 * 1.000_1 + 2.0 * self.pad, spread * 1.000_1];
            let depth = 2.0 * self.radius;
            let widest = radius[0] + radius[1] * depth;
            let wider: [f32; 3] = std::array::from_fn(|i| widest.copysign(ray.inverse[i]));
            let from = [1.0, -1.0].map(|s| std::array::from_fn(|i| ray.origin[i] + s * wider[i]));
            Middle { ray, ahead_mm, radius, depth, widest, from }
        });
    }

    /// As [`Accel::closest`] for a ray of the beam, which starts `ahead_mm` from the point that all leave. A ray that is
    /// not of the beam may miss what it meets.
    #[inline]
    pub(crate) fn closest_in(
        &self,
        beam: &mut Beam,
        origin: Vec3,
        direction: Vec3,
        ahead_mm: f64,
    ) -> Option<Hit> {
        dispatch!(self.closest_in_avx2, closest_in_with(beam, origin, direction, ahead_mm))
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma,bmi1,lzcnt,popcnt")]
    fn closest_in_avx2(&self, beam: &mut Beam, origin: Vec3, direction: Vec3, ahead_mm: f64) -> Option<Hit> {
        // SAFETY: this function has the instructions.
        unsafe { self.closest_in_with::<Avx2>(beam, origin, direction, ahead_mm) }
    }

    /// # Safety
    /// The machine must have the instructions of `L`.
    #[inline(always)]
    unsafe fn closest_in_with<L: Lanes>(
        &self,
        beam: &mut Beam,
        origin: Vec3,
        direction: Vec3,
        ahead_mm: f64,
    ) -> Option<Hit> {
        let middle = beam.middle?;
        let (ray, start) = self.tree_ray(origin, direction)?;
        // From distances along this ray to those from the beam's start, and what rounding may take off them.
        let shift = (ahead_mm - middle.ahead_mm) as f32 + self.pad + 4e-7 * start;
        let slack = self.pad + 4e-7 * start - start;
        let mut best: Option<(f32, (bool, Name), [f32; 2])> = None;
        let mut end = f32::INFINITY;
        let mut next = 0;
        loop {
            if next == beam.blocks.len() {
                // SAFETY: the caller vouches for the instructions.
                unsafe { self.gather::<L>(beam, &middle, end + shift) };
                if next == beam.blocks.len() {
                    break;
                }
            }
            let Block { near, leaf } = beam.blocks[next];
            if near > end + shift {
                break;
            }
            next += 1;
            let (flat, index) = (leaf & TRIANGLES != 0, (leaf & INDEX) as usize);
            let mut lanes = if flat {
                // SAFETY: as above.
                unsafe { L::triangles(&self.triangles[index], &ray) }
            } else {
                // SAFETY: as above.
                unsafe { L::cones(&beam.cones[index], &ray, self.pad, end + slack) }
            };
            while lanes != 0 {
                let k = lanes.trailing_zeros() as usize;
                lanes &= lanes - 1;
                let (found, name) = if flat {
                    let leaf = &self.triangles[index];
                    let hit = leaf.get(k).intersect(origin, direction, 0.0);
                    (hit.map(|h| (h.t, [h.u, h.v])), leaf.names[k])
                } else {
                    let block = &beam.cones[index];
                    let hit = block.get(k).intersect(origin, direction, 0.0);
                    (hit.map(|h| (h.t, [h.along, 0.0])), block.names[k])
                };
                if let Some((t, uv)) = found
                    && best.is_none_or(|(least, first, _)| t < least || (t == least && (flat, name) < first))
                {
                    best = Some((t, (flat, name), uv));
                    end = t;
                }
            }
        }
        best.map(|(t, (flat, name), uv)| match flat {
            false => Hit::Fibre { t, strand: name.owner, point: name.item, along: uv[0] },
            true => Hit::Mesh { t, surface: name.owner, triangle: name.item, uv },
        })
    }

    /// Adds the next block of what the beam touches, if it begins before `until`.
    ///
    /// # Safety
    /// The machine must have the instructions of `L`.
    #[inline(always)]
    unsafe fn gather<L: Lanes>(&self, beam: &mut Beam, middle: &Middle, until: f32) {
        let (mut used, mut enter, before) = (WIDTH, [0.0f32; WIDTH], beam.blocks.len());
        while let Some(&Open { near, far, child }) = beam.open.peek() {
            if near > until {
                return;
            }
            beam.open.pop();
            if child & LEAF == 0 {
                let node = &self.nodes[child as usize];
                // SAFETY: the caller vouches for the instructions.
                let mut met = unsafe { L::boxes(node, &middle.ray, middle.from, f32::INFINITY, &mut enter) };
                while met != 0 {
                    let k = met.trailing_zeros() as usize;
                    met &= met - 1;
                    let far = enter[k] + diameter(node, k) + 2.0 * middle.widest;
                    beam.open.push(Open { near: enter[k], far, child: node.children[k] });
                }
            } else if child & TRIANGLES != 0 {
                beam.blocks.push(Block { near, leaf: child & !LEAF });
                return;
            } else {
                let leaf = &self.cones[(child & INDEX) as usize];
                // SAFETY: as above.
                let mut lanes = unsafe { L::cones(leaf, &middle.ray, middle.radius(far), f32::INFINITY) };
                while lanes != 0 {
                    let k = lanes.trailing_zeros() as usize;
                    lanes &= lanes - 1;
                    if used == WIDTH {
                        used = 0;
                        beam.blocks.push(Block { near, leaf: beam.cones.len() as u32 });
                        beam.cones.push(Cones::default());
                    }
                    let last = beam.cones.len() - 1;
                    beam.cones[last].set(used, &leaf.get(k), leaf.names[k]);
                    used += 1;
                }
                // Blocks that are not full cost as much to try.
                let made = beam.blocks.len() - before;
                if made > 1 || (made == 1 && used == WIDTH) {
                    return;
                }
            }
        }
    }
}

/// No less than the diagonal of a child's box, mm.
#[inline(always)]
fn diameter(node: &Node, k: usize) -> f32 {
    node.planes.iter().map(|[low, high]| high[k] - low[k]).sum()
}
