//! Files in and out: hair formats, meshes, images, and the folders that pass between stages.
//!
//! Every `parse_*` function takes bytes as they come, so that it can be fuzzed: whatever they hold, it returns
//! an error that names place and remedy, never panics, and allocates no more than a small multiple of the bytes
//! that are there. Every `write_*` function is atomic.

mod atomic;
mod bytes;
mod colour;
mod error;
mod estimate;
mod exr;
mod face_truth;
mod face_view;
mod flow;
mod follicles;
mod foreign;
mod frame;
mod hair;
mod hair_field;
mod mesh;
mod npy;
mod obj;
mod options;
mod ply;
mod ply_body;
mod ply_strands;
mod png;
mod read;
mod resample;
mod rig_json;
mod skin_uv;
mod strand_ids;
mod strands;
mod tfx;
mod truth;
mod truth_frame;
mod usc_data;
pub mod usd;
mod visibility;

pub use atomic::{atomic_folder, atomic_write};
pub use colour::{ColourFrame, parse_colour_json, write_colour_image, write_colour_manifest};
pub use error::{FormatError, IoError};
pub use estimate::{
    STRAND_IDS as ESTIMATE_STRAND_IDS, STRANDS as ESTIMATE_STRANDS, read_estimate, write_estimate,
};
pub use exr::{MAX_SIDE_PX, parse_exr, read_exr, write_exr};
pub use face_truth::{read_face_truth, write_face_truth};
pub use face_view::{read_face_view, write_face_view};
pub use flow::{parse_flo, read_flo, read_flow, write_flo, write_flow};
pub use follicles::parse_hair_roots;
pub use foreign::{MAX_ANSWER_LENGTH_MM, MAX_ANSWER_STRANDS, parse_npy, parse_pfm, read_any_estimate};
pub use frame::{parse_frame_json, read_frame, read_frame_of_sequence, write_frame};
pub use hair::{parse_hair, parse_monohair};
pub use hair_field::{read_hair_field, write_hair_field};
pub use mesh::{parse_ply_mesh, read_mesh, write_mesh};
pub use npy::{Npz, write_npy};
pub use obj::{parse_obj_mesh, parse_obj_strands};
pub use options::{ImportOptions, ImportReport, PRESETS, transform_mesh};
pub use ply_strands::parse_ply_strands;
pub use png::{
    parse_png_grey, parse_png_rgb, read_png_grey, read_png_rgb, write_png_grey, write_png_grey16,
    write_png_rgb, write_png_rgb16,
};
pub use read::{MAX_FILE_BYTES, parse_strands, read_strands, write_strands};
pub use resample::{MAX_CHORD_ERROR_MM, MAX_POINTS, resample};
pub use rig_json::{parse_rig, write_rig};
pub use skin_uv::{UvMesh, parse_uv_mesh, read_uv_mesh, write_uv_mesh};
pub use strand_ids::parse_strand_ids;
pub use strands::{MIN_RADIUS_MM, MIN_SEGMENT_MM, Radii, RawStrands};
pub use tfx::parse_tfx;
pub use truth::{read_truth, write_truth};
pub use truth_frame::{parse_seen_by, read_truth_frame, write_truth_frame};
pub use usc_data::parse_usc_data;
pub use visibility::parse_visibility;
