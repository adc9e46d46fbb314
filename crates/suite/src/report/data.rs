//! Everything that a report shows, read from the stages' folders.

use crate::reconstruct::{DIAGNOSTICS, ESTIMATE};
use crate::render::{FRAME, RenderFile, TRUTH, read_render_file};
use crate::score::{Curve, SCORES, ScoreFile, read_curve, read_error_map};
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
    /// Ascending raw errors: what of, whose, values.
    curves: Vec<(Curve, Vec<f32>)>,
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
        let error_mm = read_error_map(&places.score)?;
        let scores: ScoreFile = read_json(&places.score.join(SCORES))?;
        let mut curves = Vec::new();
        for curve in &scores.curves {
            curves.push((curve.clone(), read_curve(&places.score, curve)?));
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

    /// The figures.
    pub fn figures(&self) -> Figures<'_> {
        Figures(&self.scores.scores)
    }

    /// The method's or a null's figure, where it stands in the table.
    pub fn score(&self, metric: &str, subject: &str) -> Option<&Score> {
        self.figures().score(metric, subject)
    }

    /// Subject and ascending errors of `A1` (mm), `A5` or `B7` (degrees).
    pub fn curves_of(&self, metric: &str) -> impl Iterator<Item = (&str, &[f32])> {
        let of = self.curves.iter().filter(move |(c, _)| c.metric == metric);
        of.map(|(c, errors)| (c.subject.as_str(), errors.as_slice()))
    }

    /// One subject's of these.
    pub fn curve(&self, metric: &str, subject: &str) -> Option<&[f32]> {
        self.curves_of(metric).find(|(name, _)| *name == subject).map(|(_, errors)| errors)
    }

    /// Subjects in the order in which the scorer names them.
    pub fn subjects(&self) -> Vec<&str> {
        self.figures().subjects()
    }
}

/// Figures of a table.
#[derive(Clone, Copy)]
pub(crate) struct Figures<'a>(pub &'a [Score]);

impl<'a> Figures<'a> {
    /// The figure of a subject.
    pub fn score(&self, metric: &str, subject: &str) -> Option<&'a Score> {
        self.0.iter().find(|s| s.metric == metric && s.subject == subject)
    }

    /// The method's value.
    pub fn method(&self, metric: &str) -> Option<f64> {
        self.score(metric, "method").and_then(|s| s.value)
    }

    /// Subjects in the order in which the scorer names them.
    pub fn subjects(&self) -> Vec<&'a str> {
        let mut seen: Vec<&str> = Vec::new();
        for s in self.0 {
            if !seen.contains(&s.subject.as_str()) {
                seen.push(&s.subject);
            }
        }
        seen
    }

    /// Metrics in the order in which the scorer names them.
    pub fn metrics(&self) -> Vec<&'a str> {
        let mut seen: Vec<&str> = Vec::new();
        for s in self.0 {
            if !seen.contains(&s.metric.as_str()) {
                seen.push(&s.metric);
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
