//! A node of eight boxes and the test of a ray against them.

/// What a child is, in its reference's top bits: a leaf of fibres, a leaf of triangles, or else a node.
pub(super) const LEAF: u32 = 1 << 31;
pub(super) const TRIANGLES: u32 = 1 << 30;
/// The index that is left.
pub(super) const INDEX: u32 = TRIANGLES - 1;
/// Children of a node, and primitives of a leaf.
pub(super) const WIDTH: usize = 8;

/// Eight boxes, not compressed: a node is read far more often than it is fetched from memory.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Node {
    /// Indexed [axis][low, high][child], mm; absent children have boxes that no ray meets.
    pub planes: [[[f32; WIDTH]; 2]; 3],
    /// References, see [`LEAF`].
    pub children: [u32; WIDTH],
    /// Primitives of children that are leaves; used by the build alone.
    pub counts: [u8; WIDTH],
}

impl Default for Node {
    fn default() -> Node {
        Node {
            planes: [[[f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]]; 3],
            children: [0; WIDTH],
            counts: [0; WIDTH],
        }
    }
}

/// A ray as the tree sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct TreeRay {
    /// Where it starts.
    pub source: [f32; 3],
    /// The same, moved along the ray to the tree's surroundings.
    pub origin: [f32; 3],
    pub direction: [f32; 3],
    pub inverse: [f32; 3],
    /// Index of the plane that is met first, per axis.
    pub near: [usize; 3],
}

impl TreeRay {
    pub(super) fn new(source: [f32; 3], origin: [f32; 3], direction: [f32; 3]) -> TreeRay {
        // A component below this moves the ray by less than rounding does on its way through any scene; its
        // reciprocal stays finite and not zero, so that no product is 0 times infinity.
        let inverse = direction.map(|d| 1.0 / d.abs().clamp(1e-18, 1e18).copysign(d));
        let near = direction.map(|d| usize::from(d.is_sign_negative()));
        TreeRay { source, origin, direction, inverse, near }
    }
}
