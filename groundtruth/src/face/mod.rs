//! Truth of faces with hair: what a pixel's point is and where it goes, the skin beneath, where hairs stand.
//!
//! Planes come from the rays through the pixels' centres; a renderer finds their first hits, and tells by
//! [`Sight`](strandbench_types::Sight) what hides what. A place keeps its identity: on skin by triangle and weights of its
//! corners, on hair by strand, segment, position along it and the offset from its axis, which turns with the follicle and
//! the segment.

mod field;
mod flow;
mod hair;
mod skin;
mod view;

pub use field::{MAX_VOXELS, hair_field};
pub use flow::{carry, check_moments, flow};
pub use hair::{DENSITY_RADIUS_MM, Follicles, HairIndex, hair_roots};
pub use skin::{BARE_MM, SkinSightings, UNDER_MM, skin_cover};
pub use view::{Frames, face_view};

#[cfg(test)]
mod tests;
