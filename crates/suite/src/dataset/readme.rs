//! The page that explains a dataset folder to whoever finds it.

use super::{Dataset, Source};
use strandbench_types::Rig;

pub(super) fn text(made: &Dataset, rig: &Rig, source: &Source) -> String {
    let scene = source.scene().map_or_else(|| "an unnamed scene".to_owned(), |s| format!("scene `{s}`"));
    let reference = &made.cameras[0];
    let c = &rig.cameras[0];
    let frames = if source.moves() {
        format!(
            "{} frames at {} frames a second; images, masks and whatever else differs from frame to frame lie in a folder \
             (or file) a frame, named by its index in six digits. The calibration is the same for all.",
            made.frames.len(),
            rig.frame_rate_hz
        )
    } else {
        "One frame.".to_owned()
    };
    let answer = if source.moves() {
        ", in a folder a frame (`000012/`; a frame without one counts as not answered, which is the worst answer)"
    } else {
        ""
    };
    let scored = if source.moves() { "RENDER" } else { "RENDER/truth" };
    let head = if made.head {
        "| `head.ply`, `scalp.ply` | the bald head and the part of it that hair grows on, mm, world (of a moving scene `head/`, `scalp/`); the built-in methods are not given them |\n"
    } else {
        ""
    };
    let truth = if made.truth {
        "| `truth/` | **not for a method**: the true answer (`depth.exr`, `strands.hair`, ...: scored with `--estimate` it gets 100 %), each camera's maps in `views/` (depth at which hair covers half of the pixel, a twentieth, and first hit; mm), the rig as it really is in `opencv.json` and `colmap/` |\n"
    } else {
        ""
    };
    format!(
        "# Multi-view hair: {scene}

{frames} {n} cameras of {w}x{h} pixels; `{reference}` is the reference. Lengths are millimetres; the world has +y up, \
the face looks along +z, the origin lies in the head. Hair lies between {near} and {far} mm along the reference \
camera's +z.{scale}

The calibration is what a calibration would have found, not what is true; the reference camera alone is exact. There is \
no lens distortion to undo.

| what | meaning |
|---|---|
| `dataset.json` | all of this for programs: cameras, frames and their folders, near and far |
| `images/` | 16-bit grey PNG, linear light: 65535 is full scale |
| `images_exr/` | the same as 32-bit float OpenEXR, channel `Y`, linear, 1.0 is full scale |
| `images_srgb/` | the same as 8-bit PNG with the transfer function of sRGB: for people, and programs that expect photographs |
| `masks/` | white where hair covers half of the pixel or more |
| `colmap/` | COLMAP's text model, PINHOLE, no points; the centre of the top-left pixel is (0.5, 0.5). Its image path is `images/` or `images_srgb/` (of a moving scene a frame's folder in it) |
| `opencv.json` | K, R, t (rows) for OpenCV's functions: x_cam = R x_world + t, +x right, +y down, +z forward; the centre of the top-left pixel is (0, 0) |
| `transforms.json` | camera-to-world for NeRF programs: OpenGL's axes (+x right, +y up, +z backward), mm; the centre of the top-left pixel is (0.5, 0.5) |
{head}{truth}
## The answer

A folder{answer} with any of these, each for `{reference}` where it is a map:

| file | meaning |
|---|---|
| `depth.exr` (channel `Z`), `depth.npy`, `depth.pfm`, `depth.png` (16 bits) | depth along +z, one value a pixel of `{reference}`; not finite, zero or less is no answer |
| `mesh.ply`, `mesh.obj` | the surface; without a depth map, its first hit on the ray through each pixel's centre is the depth |
| `points.ply` | points; each a disc of a radius of 1 px about its image, the nearest counts |
| `strands.hair`, `.data`, `.ply`, `.obj`, `.tfx` | strands, root first |
| `orientation.exr` (`re`, `im`), `orientation_3d.exr` (`X`, `Y`, `Z`) | line directions in the image (F exp 2iΘ, Θ from +x towards +y) and in the world |
| `units.json` | only where it is not millimetres in the world: `{{\"mm_per_unit\": 1000, \"frame\": \"reference-camera\", \"depth_png_mm_per_unit\": 0.1, \"point_radius_px\": 1}}`, whichever apply |

`strandbench score --estimate ANSWER --truth {scored} --out SCORE` holds it against the truth.
",
        n = made.cameras.len(),
        w = c.width,
        h = c.height,
        near = rig.near_mm,
        far = rig.far_mm,
        scale = source.head_breadth_mm().map_or(String::new(), |b| format!(" The head is {b} mm broad.")),
    )
}
