//! Faces with hair from fourteen cameras (Winberg et al. 2022, section 3): images for a method, truth for a scorer, and a
//! page for people. No method takes them yet.
//!
//! ```text
//! OUT/<scene>/render/face.json                  which frames, of what
//! OUT/<scene>/render/subject/                   skin.obj and hair/ (truth, maps to edit); model/: other people's
//!                                               faces, for a method's hair-free mesh
//! OUT/<scene>/render/<frame>/frame/             <camera>.png  rig.json  frame.json: what a method may see
//! OUT/<scene>/render/<frame>/truth/             the skin's mesh, every hair, and what each camera sees of them
//! OUT/<scene>/render/<frame>/preview/           <camera>.jpg and pictures of the truth, small, for people
//! OUT/<scene>/render/<frame>/render.json        sampling, work, notes
//! OUT/<scene>/render/report/report.html         contact sheet, close-ups, rig, player
//! ```
//! A `<frame>` is its index in six digits; frame 0 is the reference, neutral and frontal, whichever frames are rendered.

mod file;
mod job;
mod page;
mod preview;
mod render;
mod subject;
mod truth;

pub use file::{FACE_FILE, FaceFile, FaceRenderFile};
pub use job::FaceJob;
pub use page::report;
pub use render::render_face;

use crate::SuiteError;
use crate::settings::{Setting, render_settings_from};
use strandbench_renderer::Settings;

/// Sampling of a face, with the overrides of [`crate::Part::Render`] applied. The defaults are other ones than those of
/// [`crate::render_settings`]: at most eight shaded samples of a kind in a pixel, so that fourteen views of half a megapixel
/// take minutes. They leave hair some five times the variance of the sensor's noise (the report says in how many pixels); a
/// `max_samples_per_pixel` of 64 to 128 brings it to about once and a half. Shadows are kept a pixel apart for all views;
/// `shadow_spacing_px = 0` seeks them anew at each hit.
///
/// # Errors
/// If a key is unknown or a value does not fit.
pub fn settings(settings: &[Setting]) -> Result<Settings, SuiteError> {
    let defaults = Settings {
        samples_per_pixel: 8,
        max_samples_per_pixel: 8,
        sensor_noise: 1.0,
        shadow_spacing_px: 1.0,
        indirect_every: 1,
        depth: 4,
        ..Settings::default()
    };
    render_settings_from(defaults, settings)
}
