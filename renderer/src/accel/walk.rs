//! Walking the tree along a ray.

use super::lanes::Lanes;
use super::leaf::{Cones, Name, Triangles};
use super::node::{INDEX, LEAF, Node, TRIANGLES, TreeRay, WIDTH};
use std::mem::MaybeUninit;

/// Levels of nodes that the stack holds; the build never makes more, see [`super::build`].
pub(super) const MOST_LEVELS: usize = 80;
const STACK: usize = MOST_LEVELS * (WIDTH - 1) + 1;

/// Bytes that the tests of eight read.
const CONES: usize = size_of::<Cones>() - size_of::<[Name; WIDTH]>();
const TRIANGLE_SIDES: usize = size_of::<[[[f32; WIDTH]; 3]; 3]>();

/// What a walk goes through.
pub(super) struct Forest<'a> {
    pub nodes: &'a [Node],
    pub cones: &'a [Cones],
    pub triangles: &'a [Triangles],
    /// Widening of cones that makes up for rounding, mm.
    pub pad: f32,
}

/// Distance and reference of a child, in an order by distance: distances are not negative.
#[inline(always)]
fn entry(t: f32, child: u32) -> u64 {
    u64::from(t.to_bits()) << 32 | u64::from(child)
}

impl Forest<'_> {
    /// Asks for a child's cache lines, which take longer to come than the nearer child takes to test.
    #[inline(always)]
    fn prefetch(&self, child: u32) {
        #[cfg(target_arch = "x86_64")]
        {
            use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
            let (start, lines): (*const u8, usize) = if child & LEAF == 0 {
                (self.nodes.as_ptr().wrapping_add(child as usize).cast(), size_of::<Node>() / 64)
            } else if child & TRIANGLES == 0 {
                (self.cones.as_ptr().wrapping_add((child & INDEX) as usize).cast(), CONES / 64)
            } else {
                (
                    self.triangles.as_ptr().wrapping_add((child & INDEX) as usize).cast(),
                    TRIANGLE_SIDES.div_ceil(64),
                )
            };
            for line in 0..lines {
                // SAFETY: a hint; nothing is read.
                unsafe { _mm_prefetch::<_MM_HINT_T0>(start.wrapping_add(64 * line).cast()) };
            }
        }
    }

    /// Offers every primitive that the ray may meet before `tmax` to `visit`, leaves roughly from near to far:
    /// `visit(leaf, lane, tmax)` gets a leaf's reference and returns the new end of the ray, or nothing to stop.
    /// `ORDERED` says whether near children come first.
    ///
    /// # Safety
    /// The machine must have the instructions of `L`.
    #[inline(always)]
    pub(super) unsafe fn walk<L: Lanes, const ORDERED: bool>(
        &self,
        ray: &TreeRay,
        mut tmax: f32,
        mut visit: impl FnMut(u32, usize, f32) -> Option<f32>,
    ) {
        let mut stack = [MaybeUninit::<u64>::uninit(); STACK];
        let mut top = 0;
        let mut at = 0u32;
        loop {
            if at & LEAF == 0 {
                // SAFETY: children refer to nodes of this tree.
                let node = unsafe { self.nodes.get_unchecked(at as usize) };
                let mut enter = [0.0f32; WIDTH];
                // SAFETY: the caller vouches for the instructions.
                let mut met = unsafe { L::boxes(node, ray, [ray.origin; 2], tmax, &mut enter) };
                if met != 0 {
                    let first = met.trailing_zeros() as usize;
                    met &= met - 1;
                    if met == 0 {
                        at = node.children[first];
                        continue;
                    }
                    if ORDERED {
                        let mut nearest = entry(enter[first], node.children[first]);
                        let bottom = top;
                        while met != 0 {
                            let k = met.trailing_zeros() as usize;
                            met &= met - 1;
                            let other = entry(enter[k], node.children[k]);
                            let farther = nearest.max(other);
                            nearest = nearest.min(other);
                            self.prefetch(farther as u32);
                            // Sorted in, the farthest at the bottom.
                            let mut i = top;
                            // SAFETY: entries below `top` are written; a node leaves at most seven, and there are
                            // at most as many levels as the stack is made for.
                            unsafe {
                                while i > bottom && stack.get_unchecked(i - 1).assume_init() < farther {
                                    *stack.get_unchecked_mut(i) = *stack.get_unchecked(i - 1);
                                    i -= 1;
                                }
                                stack.get_unchecked_mut(i).write(farther);
                            }
                            top += 1;
                        }
                        at = nearest as u32;
                    } else {
                        while met != 0 {
                            let k = met.trailing_zeros() as usize;
                            met &= met - 1;
                            // SAFETY: as above.
                            unsafe { stack.get_unchecked_mut(top).write(u64::from(node.children[k])) };
                            self.prefetch(node.children[k]);
                            top += 1;
                        }
                        at = node.children[first];
                    }
                    continue;
                }
            } else {
                let index = (at & INDEX) as usize;
                let mut lanes = if at & TRIANGLES == 0 {
                    // SAFETY: leaves refer to blocks of this tree; the caller vouches for the instructions.
                    unsafe { L::cones(self.cones.get_unchecked(index), ray, self.pad, tmax) }
                } else {
                    // SAFETY: as above.
                    unsafe { L::triangles(self.triangles.get_unchecked(index), ray) }
                };
                while lanes != 0 {
                    let k = lanes.trailing_zeros() as usize;
                    lanes &= lanes - 1;
                    match visit(at, k, tmax) {
                        Some(t) => tmax = t,
                        None => return,
                    }
                }
            }
            loop {
                if top == 0 {
                    return;
                }
                top -= 1;
                // SAFETY: entries below `top` are written.
                let next = unsafe { stack.get_unchecked(top).assume_init() };
                at = next as u32;
                if !ORDERED || f32::from_bits((next >> 32) as u32) <= tmax {
                    break;
                }
            }
        }
    }
}
