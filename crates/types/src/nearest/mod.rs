//! What is nearest: a tree of boxes over anything that has one, and over line segments.

mod order;
mod segments;
mod tree;

pub use order::Ordered;
pub use segments::{Segment, SegmentIndex, outward, point_to_segment_squared};
pub use tree::{Limit, Tree};
