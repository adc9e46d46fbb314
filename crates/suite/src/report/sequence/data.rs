//! What the report of a sequence shows, read from the stages' folders; of a frame, only while its pictures are made.

use crate::reconstruct::{DIAGNOSTICS, ESTIMATE};
use crate::report::data::Figures;
use crate::score::{SCORES, ScoreFile};
use crate::sequence::{ALL_FRAMES, FRAME_FIGURES, Sequence, SequenceFigures, frame_name};
use crate::stage::{Record, read_json, read_record};
use crate::{Cost, Places, RenderFile, SuiteError, read_render_file};
use std::collections::BTreeMap;
use strandbench_recon::Diagnostics;
use strandbench_score::StrandGrid;
use strandbench_types::Estimate;

pub(crate) struct Moving {
    pub places: Places,
    pub sequence: Sequence,
    pub render: RenderFile,
    pub scores: ScoreFile,
    pub figures: SequenceFigures,
    /// Records of each stage's frames.
    pub records: BTreeMap<String, Vec<Record>>,
    /// Median wall seconds a frame of each step of the method, in the order of the last frame that has an answer.
    pub steps: Vec<(String, f64)>,
    /// The method's parameters.
    pub parameters: BTreeMap<String, String>,
    /// What the method says of its last frame.
    pub notes: Vec<String>,
    /// Precision and recall of the method and the ceiling on V2, a grid a frame.
    pub grids: BTreeMap<String, Vec<StrandGrid>>,
    pub variant: String,
}

impl Moving {
    pub fn load(places: &Places, variant: &str) -> Result<Moving, SuiteError> {
        let sequence = Sequence::open(&places.render)?;
        let all = places.score.join(ALL_FRAMES);
        let (mut records, mut grids) = (BTreeMap::<String, Vec<Record>>::new(), BTreeMap::new());
        let mut times: BTreeMap<String, Vec<f64>> = BTreeMap::new();
        let (mut order, mut last) = (Vec::new(), Diagnostics::default());
        for &index in &sequence.file.frames {
            let name = frame_name(index);
            let folders = [
                ("render", places.render.join(&name)),
                ("reconstruct", places.reconstruct.join(&name)),
                ("score", places.score.join(&name)),
            ];
            for (stage, folder) in &folders {
                records.entry((*stage).to_owned()).or_default().push(read_record(folder)?);
            }
            let path = folders[1].1.join(DIAGNOSTICS);
            if path.is_file() {
                last = read_json(&path)?;
                order = Vec::new();
                for (step, seconds) in summed(&last) {
                    times.entry(step.clone()).or_default().push(seconds);
                    order.push(step);
                }
            }
            let path = folders[2].1.join(SCORES);
            if path.is_file() {
                let file: ScoreFile = read_json(&path)?;
                let headline = |g: &StrandGrid| g.set == "v2" && g.mode == "any";
                for grid in file.grids.into_iter().filter(headline) {
                    grids.entry(grid.subject.clone()).or_insert_with(Vec::new).push(grid);
                }
            }
        }
        records.entry("score".to_owned()).or_default().push(read_record(&all)?);
        let median = |mut seconds: Vec<f64>| {
            seconds.sort_by(f64::total_cmp);
            seconds[seconds.len() / 2]
        };
        let steps =
            order.into_iter().map(|s| (s.clone(), median(times.remove(&s).unwrap_or_default()))).collect();
        Ok(Moving {
            render: read_render_file(&sequence.frame_dir(sequence.file.frames[0]))?,
            scores: read_json(&all.join(SCORES))?,
            figures: read_json(&all.join(FRAME_FIGURES))?,
            records,
            steps,
            parameters: last.parameters,
            notes: last.notes,
            grids,
            variant: variant.to_owned(),
            places: places.clone(),
            sequence,
        })
    }

    /// The figures of the whole sequence.
    pub fn table(&self) -> Figures<'_> {
        Figures(&self.scores.scores)
    }

    /// What each stage cost, all frames together; the largest peak of memory.
    pub fn costs(&self) -> BTreeMap<String, Cost> {
        let sum = |records: &[Record]| records.iter().map(|r| r.cost).sum();
        self.records.iter().map(|(stage, records)| (stage.clone(), sum(records))).collect()
    }

    /// A frame's answer; empty where there is none.
    pub fn estimate(&self, index: u32) -> Result<Estimate, SuiteError> {
        let dir = self.places.reconstruct.join(frame_name(index)).join(ESTIMATE);
        if dir.is_dir() { Ok(strandbench_io::read_estimate(&dir)?) } else { Ok(Estimate::default()) }
    }
}

/// Steps by name in their order; a step that is entered more than once is summed.
fn summed(d: &Diagnostics) -> Vec<(String, f64)> {
    let mut steps: Vec<(String, f64)> = Vec::new();
    for s in &d.stages {
        match steps.iter_mut().find(|(name, _)| *name == s.name) {
            Some((_, seconds)) => *seconds += s.wall_s,
            None => steps.push((s.name.clone(), s.wall_s)),
        }
    }
    steps
}
