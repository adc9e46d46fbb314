//! Speed of the renderer beside other ray tracers, on the same hair and the same rays in one run.

pub mod contest;
pub mod embree;
pub mod hair;
pub mod memory;
pub mod rays;
