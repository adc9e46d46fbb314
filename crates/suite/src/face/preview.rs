//! Small pictures of a frame, for people.

use super::render::make;
use crate::SuiteError;
use crate::pictures::{PAPER, flow, jpeg, picked, reduced, sequential, srgb};
use glam::Vec3;
use std::path::{Path, PathBuf};
use strandbench_scenes::Scene;
use strandbench_scenes::face::HairKind;
use strandbench_types::{FaceView, FlowState, LABEL_HAIR, LABEL_OTHER, LABEL_SKIN, Plane, Rig};

/// Sub-folder of a frame.
pub(super) const PREVIEW: &str = "preview";

/// Height to which views are reduced, px, by a whole number.
const HEIGHT_PX: usize = 640;
/// Side of the close-ups, px, pixel by pixel.
const CLOSE_UP_PX: usize = 256;

/// What of the truth is pictured: part of the file name, and what it shows.
pub(super) const TRUTHS: [(&str, &str); 4] = [
    ("labels", "What is seen: skin, and hair by kind"),
    ("depth", "Depth of what is seen, near light to far dark"),
    ("bare", "Depth of the skin with the hair left out"),
    ("flow", "Flow to the reference frame: hue its direction, dark what is hidden there"),
];

/// Colours of hair by kind.
const KIND_RGB: [[u8; 3]; 6] =
    [[120, 72, 40], [196, 78, 40], [222, 150, 40], [60, 110, 150], [130, 60, 140], [40, 130, 90]];

/// Colour of a kind of hair in pictures and legends.
pub(super) fn kind_colour(kind: usize) -> [u8; 3] {
    KIND_RGB[kind % KIND_RGB.len()]
}

/// Name of a camera's picture.
pub(super) fn name(camera: &str, what: &str) -> String {
    if what.is_empty() { format!("{camera}.jpg") } else { format!("{camera}_{what}.jpg") }
}

/// Writes the pictures of one frame, a camera at a time.
pub(super) struct Previews {
    dir: PathBuf,
    rig: Rig,
    /// Where most hairs of a kind stand.
    middles: Vec<(HairKind, Vec3)>,
    by: usize,
}

impl Previews {
    /// For a frame that is written into `frame`.
    pub fn new(frame: &Path, scene: &Scene, kinds: &[HairKind]) -> Result<Previews, SuiteError> {
        let dir = frame.join(PREVIEW);
        make(&dir)?;
        let strands = &scene.strands;
        let middles = HairKind::ALL.iter().filter_map(|&kind| {
            let mut roots: Vec<Vec3> = (0..strands.len())
                .filter(|&s| kinds[s] == kind)
                .map(|s| strands.points[strands.range(s).start])
                .collect();
            // A root that exists, for the middle of two brows lies on neither.
            roots.sort_by(|a, b| a.x.total_cmp(&b.x));
            let third = roots.len() / 3;
            roots.get(third).map(|p| (kind, *p))
        });
        let by = (scene.rig.cameras[0].height as usize / HEIGHT_PX).max(1);
        Ok(Previews { middles: middles.collect(), rig: scene.rig.clone(), by, dir })
    }

    /// The whole image, reduced, and close-ups of where hairs of each kind stand.
    pub fn image(&self, camera: usize, image: &Plane<[f32; 3]>) -> Result<(), SuiteError> {
        let c = &self.rig.cameras[camera];
        let shown = |p: &Plane<[f32; 3]>| p.map(|c| c.map(srgb));
        jpeg(&self.dir.join(name(&c.name, "")), &shown(&reduced(image, self.by)))?;
        for (kind, place) in &self.middles {
            let Some((at, _)) = c.project(place.as_dvec3()) else { continue };
            if !c.contains(at) {
                continue;
            }
            let side = |middle: f64, size: usize| {
                let side = CLOSE_UP_PX.min(size);
                ((middle as usize).saturating_sub(side / 2).min(size - side), side)
            };
            let ((x, w), (y, h)) = (side(at.x, image.width), side(at.y, image.height));
            let cut = (0..w * h).map(|i| image.data[(y + i / w) * image.width + x + i % w]);
            let cut = Plane::from_vec(w, h, cut.collect());
            let what = format!("close-{}", kind.name());
            jpeg(&self.dir.join(name(&c.name, &what)), &shown(&cut))?;
        }
        Ok(())
    }

    /// The truth of a view.
    pub fn truth(&self, camera: usize, view: &FaceView) -> Result<(), SuiteError> {
        let c = &self.rig.cameras[camera];
        let save = |what: &str, p: &Plane<[u8; 3]>| jpeg(&self.dir.join(name(&c.name, what)), p);
        let labels = picked(&view.labels, self.by).map(|&l| match l {
            LABEL_SKIN => LEGEND[0].1,
            LABEL_OTHER => LEGEND[1].1,
            l if l >= LABEL_HAIR => kind_colour(usize::from(l - LABEL_HAIR)),
            _ => PAPER,
        });
        save("labels", &labels)?;
        let depths = [("depth", &view.seen.depth), ("bare", &view.bare.depth)];
        let known = |d: &strandbench_types::DepthMap| -> Vec<f32> {
            let all = d.raw().data.iter().step_by(self.by * self.by);
            all.copied().filter(|z| z.is_finite()).collect()
        };
        // Both on the scale of what is seen, without the outermost hundredths.
        let mut all = known(&view.seen.depth);
        all.sort_by(f32::total_cmp);
        let at = |share: usize| all.get(all.len() * share / 100).copied().unwrap_or(0.0);
        let (near, far) = (at(1), at(90));
        for (what, depth) in depths {
            let picture = picked(depth.raw(), self.by).map(|&z| {
                if z.is_finite() { sequential((z - near) / (far - near).max(1e-6)) } else { PAPER }
            });
            save(what, &picture)?;
        }
        let small = strandbench_types::FlowMap {
            flow_px: picked(&view.flow.flow_px, self.by),
            state: picked(&view.flow.state, self.by),
        };
        save("flow", &flow(&small, longest_px(&small)))
    }
}

/// The length that 95 % of the flow stays below, px; at least one.
fn longest_px(map: &strandbench_types::FlowMap) -> f32 {
    let moving = map.flow_px.data.iter().zip(&map.state.data).filter(|(_, s)| **s != FlowState::Absent);
    let mut lengths: Vec<f32> = moving.map(|([u, v], _)| u.hypot(*v)).collect();
    lengths.sort_by(f32::total_cmp);
    lengths.get(lengths.len() * 95 / 100).copied().unwrap_or(0.0).max(1.0)
}

/// Colour of skin and of what else is no hair, for the legend.
pub(super) const LEGEND: [(&str, [u8; 3]); 2] =
    [("skin", [222, 184, 162]), ("eyes, teeth, tongue", [190, 190, 200])];

/// A colour as CSS has it.
pub(super) fn css([r, g, b]: [u8; 3]) -> String {
    format!("rgb({r},{g},{b})")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_means_and_picks_are_pixels() {
        let image = Plane::from_vec(5, 4, (0..20).map(|i| [i as f32, 0.0, 1.0]).collect());
        let small = reduced(&image, 2);
        assert_eq!(small.size(), (2, 2));
        assert_eq!(small.data[0], [(0.0 + 1.0 + 5.0 + 6.0) / 4.0, 0.0, 1.0]);
        assert_eq!(small.data[3], [(12.0 + 13.0 + 17.0 + 18.0) / 4.0, 0.0, 1.0]);
        let one: Vec<f32> = picked(&image, 2).data.iter().map(|c| c[0]).collect();
        assert_eq!(one, [6.0, 8.0, 16.0, 18.0]);
    }
}
