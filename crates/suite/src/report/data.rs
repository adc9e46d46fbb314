//! Everything that a report shows, read from the stages' folders.

use crate::reconstruct::{DIAGNOSTICS, ESTIMATE};
use crate::render::{FRAME, RenderFile, TRUTH, read_render_file};
use crate::score::{ERROR_CHANNEL, ERRORS, SCORES, ScoreFile, read_curve};
use crate::stage::{Record, read_json, read_record};
use crate::{Places, SuiteError};
use strandbench_recon::Diagnostics;
use strandbench_score::Score;
use strandbench_types::{Estimate, Frame, Plane, Rig, Truth};

pub(crate) struct Data {
    pub render: RenderFile,
    pub rig: Rig,
    pub frame: Frame,
    pub truth: Truth,
    pub estimate: Estimate,
    pub diagnostics: Diagnostics,
    pub scores: ScoreFile,
    pub error_mm: Plane<f32>,
    /// Ascending |A1 error| by subject, mm.
    pub curves: Vec<(String, Vec<f32>)>,
    /// Records of the render, reconstruct and score stages.
    pub records: Vec<Record>,
    pub variant: String,
    pub colour: Plane<[u8; 3]>,
}

impl Data {
    pub fn load(places: &Places, variant: &str) -> Result<Data, SuiteError> {
        let (rig, frame) = strandbench_io::read_frame(&places.render.join(FRAME))?;
        let render = read_render_file(&places.render)?;
        let reference = &rig.cameras[0].name;
        let path = places.render.join(format!("radiance/{reference}.exr"));
        let colour = read_colour(&path)?;
        let path = places.score.join(ERRORS);
        let mut channels = strandbench_io::read_exr(&path)?;
        let error_mm = channels
            .iter()
            .position(|(name, _)| name == ERROR_CHANNEL)
            .map(|i| channels.swap_remove(i).1)
            .ok_or_else(|| SuiteError::file(&path, format!("has no channel {ERROR_CHANNEL}")))?;
        let scores: ScoreFile = read_json(&places.score.join(SCORES))?;
        let mut curves = Vec::new();
        for curve in scores.curves.iter().filter(|c| c.metric == "A1") {
            curves.push((curve.subject.clone(), read_curve(&places.score, curve)?));
        }
        Ok(Data {
            render,
            frame,
            truth: strandbench_io::read_truth(&places.render.join(TRUTH))?,
            estimate: strandbench_io::read_estimate(&places.reconstruct.join(ESTIMATE))?,
            diagnostics: read_json(&places.reconstruct.join(DIAGNOSTICS))?,
            scores,
            error_mm,
            curves,
            records: [&places.render, &places.reconstruct, &places.score]
                .into_iter()
                .map(|folder| read_record(folder))
                .collect::<Result<_, _>>()?,
            variant: variant.to_owned(),
            colour,
            rig,
        })
    }

    /// The method's or a null's figure, where it stands in the table.
    pub fn score(&self, metric: &str, subject: &str) -> Option<&Score> {
        self.scores.scores.iter().find(|s| s.metric == metric && s.subject == subject)
    }

    /// Subjects in the order in which the scorer names them.
    pub fn subjects(&self) -> Vec<&str> {
        let mut seen: Vec<&str> = Vec::new();
        for s in &self.scores.scores {
            if !seen.contains(&s.subject.as_str()) {
                seen.push(&s.subject);
            }
        }
        seen
    }
}

fn read_colour(path: &std::path::Path) -> Result<Plane<[u8; 3]>, SuiteError> {
    let channels = strandbench_io::read_exr(path)?;
    let channel = |name: &str| {
        let found = channels.iter().find(|(n, _)| n == name).map(|(_, plane)| plane);
        found.ok_or_else(|| SuiteError::file(path, format!("has no channel {name}")))
    };
    let (r, g, b) = (channel("R")?, channel("G")?, channel("B")?);
    let mut rgb = r.map(|&v| [v, 0.0, 0.0]);
    for (i, pixel) in rgb.data.iter_mut().enumerate() {
        (pixel[1], pixel[2]) = (g.data[i], b.data[i]);
    }
    Ok(crate::pictures::radiance(&rgb))
}
