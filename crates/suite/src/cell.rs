//! A cell of the benchmark, where its results lie, and its row.

use crate::report::PAGE;
use crate::score::{SCORES, ScoreFile};
use crate::sequence::{ALL_FRAMES, Frames};
use crate::settings::{Setting, render_settings, render_suffix};
use crate::stage::{Done, read_json};
use crate::{Cost, Method, SceneJob, SuiteError};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use strandbench_score::Score;

/// One scene, one variant, one seed.
#[derive(Clone, Debug)]
pub struct Cell {
    /// The scene.
    pub scene: SceneJob,
    /// The method.
    pub method: Method,
    /// Sampling of the renderer.
    pub settings: strandbench_renderer::Settings,
    /// What distinguishes this cell's render from one with the default seed and sampling; part of the folder
    /// name, empty for none.
    pub suffix: String,
    /// Seed of hair, sampling, sensor noise and nulls.
    pub seed: u64,
    /// Frames of a moving scene; all of them where absent.
    pub frames: Option<Frames>,
    /// Longest that the cell may work, s; no limit without.
    pub time_limit_s: Option<f64>,
}

impl Cell {
    /// A cell for every scene, seed and method, in this order; `settings` are the user's, of which the renderer's count.
    ///
    /// # Errors
    /// If a setting of the renderer is unknown or does not fit.
    pub fn matrix(
        scenes: &[SceneJob],
        methods: &[Method],
        seeds: &[u64],
        settings: &[Setting],
        frames: Option<Frames>,
    ) -> Result<Vec<Cell>, SuiteError> {
        let render = render_settings(settings)?;
        let mut cells = Vec::new();
        for scene in scenes {
            for &seed in seeds {
                cells.extend(methods.iter().map(|method| Cell {
                    scene: scene.clone(),
                    method: method.clone(),
                    settings: render.clone(),
                    suffix: render_suffix(seed, settings),
                    seed,
                    frames,
                    time_limit_s: None,
                }));
            }
        }
        Ok(cells)
    }

    /// How many frames it has; 1 of a scene that does not move.
    ///
    /// # Errors
    /// If frames are asked for that the scene does not have.
    pub fn frame_count(&self) -> Result<u64, SuiteError> {
        let fault = |problem: String| SuiteError::Scene { scene: self.scene.name.clone(), problem };
        match (self.scene.spec().motion.as_ref().map(|m| m.frames), self.frames) {
            (None, None) => Ok(1),
            (None, Some(_)) => Err(fault("has one pose: --frames is for moving scenes".into())),
            (Some(all), wanted) => Ok(wanted.unwrap_or_default().indices(all).map_err(fault)?.len() as u64),
        }
    }

    /// Folder name of the scene in this cell.
    pub fn scene_label(&self) -> String {
        format!("{}{}", self.scene.label, self.suffix)
    }

    /// Where the cell's results lie below `out`.
    pub fn places(&self, out: &Path) -> Places {
        let scene = out.join(self.scene_label());
        Places::new(&scene.join("render"), &scene.join(&self.method.label))
    }
}

/// The four folders of a cell.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Places {
    /// Images and truth; shared by all variants.
    pub render: PathBuf,
    /// Estimate.
    pub reconstruct: PathBuf,
    /// Scores.
    pub score: PathBuf,
    /// Report.
    pub report: PathBuf,
}

impl Places {
    /// The render folder, and the folder of the variant that holds the other three.
    pub fn new(render: &Path, variant: &Path) -> Places {
        Places {
            render: render.to_owned(),
            reconstruct: variant.join("reconstruct"),
            score: variant.join("score"),
            report: variant.join("report"),
        }
    }
}

/// How a cell ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "outcome")]
pub enum Outcome {
    /// Scored.
    Ok,
    /// A stage failed; the cell counts as an empty answer.
    Failed {
        /// The stage.
        stage: String,
        /// Why.
        message: String,
    },
    /// A cell took longer than it may; it counts as an empty answer.
    TimedOut {
        /// The stage at work when time was up.
        stage: String,
        /// What it may take, s.
        limit_s: f64,
        /// Which limit that is, and what a method from outside said last.
        #[serde(default)]
        message: String,
    },
    /// The run was stopped before the cell's turn or in its midst; it counts as an empty answer.
    NotRun,
}

impl Outcome {
    /// What became of it, in words; `None` if it was scored.
    pub fn trouble(&self) -> Option<String> {
        match self {
            Outcome::Ok => None,
            Outcome::Failed { stage, message } => Some(format!("failed in {stage}: {message}")),
            Outcome::TimedOut { stage, limit_s, message } => {
                Some(format!("timed out in {stage}: more than the {limit_s} s of {message}"))
            }
            Outcome::NotRun => Some("not run: stopped before it was done".to_owned()),
        }
    }
}

/// One line of a result table; a cell that failed is a line too.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Scene with overrides.
    pub scene: String,
    /// Variant with overrides.
    pub variant: String,
    /// Seed.
    pub seed: u64,
    /// How it ended.
    #[serde(flatten)]
    pub outcome: Outcome,
    /// Protocol version and hash; empty if it failed.
    pub protocol: String,
    /// Figures.
    pub scores: Vec<Score>,
    /// Cost of each stage, of the run that made it.
    pub costs: BTreeMap<String, Cost>,
    /// Stages that were re-used in this run.
    pub reused: Vec<String>,
    /// The page; absent if it failed or none was asked for.
    pub report: Option<PathBuf>,
    /// Folder of raw errors; absent if it failed.
    #[serde(skip)]
    pub(crate) score_dir: Option<PathBuf>,
}

impl Row {
    /// Of a cell whose stages are done.
    pub(crate) fn finished(cell: &Cell, places: &Places, stages: &[Done]) -> Result<Row, SuiteError> {
        let score_dir = if cell.scene.moves() { places.score.join(ALL_FRAMES) } else { places.score.clone() };
        let file: ScoreFile = read_json(&score_dir.join(SCORES))?;
        Ok(Row {
            protocol: file.protocol,
            scores: file.scores,
            costs: stages.iter().map(|d| (d.record.stage.clone(), d.record.cost)).collect(),
            reused: stages.iter().filter(|d| d.reused).map(|d| d.record.stage.clone()).collect(),
            report: stages.iter().any(|d| d.record.stage == "report").then(|| places.report.join(PAGE)),
            score_dir: Some(score_dir),
            ..Row::empty(cell, Outcome::Ok)
        })
    }

    /// Of a cell without a score.
    pub(crate) fn empty(cell: &Cell, outcome: Outcome) -> Row {
        Row {
            scene: cell.scene_label(),
            variant: cell.method.label.clone(),
            seed: cell.seed,
            outcome,
            protocol: String::new(),
            scores: Vec::new(),
            costs: BTreeMap::new(),
            reused: Vec::new(),
            report: None,
            score_dir: None,
        }
    }

    /// The figure of a subject for a metric.
    pub fn score(&self, metric: &str, subject: &str) -> Option<&Score> {
        self.scores.iter().find(|s| s.metric == metric && s.subject == subject)
    }
}

/// Runs a cell's stages; a panic in one of them is that cell's failure and does not end the others.
pub(crate) fn catch<T>(
    stages: impl FnOnce() -> Result<T, (&'static str, SuiteError)>,
) -> Result<T, (&'static str, SuiteError)> {
    std::panic::catch_unwind(std::panic::AssertUnwindSafe(stages)).unwrap_or_else(|panic| {
        let text = panic
            .downcast_ref::<String>()
            .cloned()
            .or_else(|| panic.downcast_ref::<&str>().map(|s| (*s).to_owned()))
            .unwrap_or_else(|| "no message".to_owned());
        let problem =
            format!("the program broke off: {text}; this is a bug of strandbench, please report it");
        Err(("program", SuiteError::File { path: PathBuf::from("strandbench"), problem }))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_a_failure_with_its_words() {
        let hook = std::panic::take_hook();
        std::panic::set_hook(Box::new(|_| {}));
        let got = catch(|| -> Result<(), _> { panic!("index {} out of range", 7) });
        std::panic::set_hook(hook);
        let (stage, error) = got.unwrap_err();
        assert_eq!(stage, "program");
        assert!(error.to_string().contains("index 7 out of range"), "{error}");
    }
}
