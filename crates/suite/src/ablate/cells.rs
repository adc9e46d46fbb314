//! Which scenes an ablation is judged on, and on which others the weights are tuned.

use super::table::{Ablation, Arm};
use crate::sequence::Frames;
use crate::{Cell, Method, Part, SceneJob, Setting, SuiteError};
use std::str::FromStr;

/// How much is run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Set {
    /// A few scenes in direct light with 16 rays a pixel: minutes.
    Small,
    /// Twelve scenes under two conditions each (four moving ones with five seeds), at the defaults: hours.
    Full,
}

impl FromStr for Set {
    type Err = String;

    fn from_str(text: &str) -> Result<Set, String> {
        match text {
            "small" => Ok(Set::Small),
            "full" => Ok(Set::Full),
            _ => Err(format!("{text:?} is no set; there are small and full")),
        }
    }
}

/// What is changed in a scene, so that a result does not hang on one lighting, one noise and one calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Condition {
    name: &'static str,
    /// Settings of the scene, `key=value`.
    changes: &'static [&'static str],
}

/// The scene as it stands.
const AS_IS: Condition = Condition { name: "as it is", changes: &[] };
/// A quarter of the light reaches the sensor's wells: shot noise doubles.
const NOISY: Condition = Condition { name: "noisy", changes: &["scene.sensor.full_well_e=4000"] };
/// Two lights, to the sides.
const TWO_LIGHTS: Condition =
    Condition { name: "two lights", changes: &["scene.lights.count=2", "scene.lights.first_deg=0"] };
/// Three times the residual of a good calibration.
const MISCALIBRATED: Condition = Condition {
    name: "miscalibrated",
    changes: &[
        "scene.rig.calibration_error.rotation_mdeg=9",
        "scene.rig.calibration_error.translation_mm=0.15",
        "scene.rig.calibration_error.focal_relative=3e-4",
    ],
};
const CONDITIONS: [Condition; 4] = [AS_IS, NOISY, TWO_LIGHTS, MISCALIBRATED];

/// Scenes on which weights are tuned; no result is drawn from them.
const TUNING: [&str; 2] = ["straight-brown-bob", "wavy-brown"];
const SMALL: [&str; 6] = [
    "straight-blonde",
    "straight-black-long",
    "wavy-red",
    "curly-brown",
    "messy-red",
    "straight-brown-short",
];
const MOVING_SMALL: [&str; 3] = ["moving-straight-blonde", "moving-curly-blonde", "moving-messy-red"];
const MOVING_FULL: [&str; 4] =
    ["moving-straight-blonde", "moving-curly-blonde", "moving-messy-red", "moving-wavy-shake"];
/// Frames of a moving scene: the motion has begun, and every frame but the ends has both neighbours.
const FRAMES: Frames = Frames { first: 20, end: Some(26) };

/// Direct light, 16 rays a pixel.
const QUICK: [&str; 3] = ["render.samples_per_pixel=16", "render.max_samples_per_pixel=16", "render.depth=1"];

/// A scene, its seed and its condition.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Case {
    pub scene: String,
    pub seed: u64,
    /// Name of the condition.
    pub condition: String,
    /// Settings of the scene.
    pub changes: Vec<Setting>,
}

/// What an ablation is run on.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Part of the result's folder name.
    pub name: String,
    /// What the claim is judged on.
    pub(crate) cases: Vec<Case>,
    /// What weights are tuned on; none for the variants' own weights alone.
    pub(crate) tuning: Vec<Case>,
    /// What the variant's own weight of smoothness is multiplied with; each arm gets the same trials.
    pub(crate) factors: Vec<f32>,
    /// Settings of the renderer.
    pub(crate) render: Vec<Setting>,
    /// Frames of a moving scene.
    pub(crate) frames: Option<Frames>,
    /// Seconds of a frame's render on two processors, roughly.
    pub(crate) render_s: f64,
}

/// Seconds on two processors of a frame's render in direct light at 16 rays a pixel, and at the defaults; measured on the
/// catalogue, a guess for any other machine.
const RENDER_S: [f64; 2] = [15.0, 60.0];

impl Plan {
    /// A set of the catalogue.
    ///
    /// # Errors
    /// None that is not a bug: the set's settings are read as a user's would be.
    pub fn of(set: Set, ablation: &Ablation) -> Result<Plan, SuiteError> {
        let read = |texts: &[&str]| texts.iter().map(|s| s.parse()).collect::<Result<Vec<Setting>, _>>();
        let case = |scene: &str, seed: u64, condition: Condition| -> Result<Case, SuiteError> {
            let changes = read(condition.changes)?;
            Ok(Case { scene: scene.to_owned(), seed, condition: condition.name.to_owned(), changes })
        };
        let (scenes, seeds): (Vec<&str>, u64) = match (set, ablation.moving) {
            (Set::Small, false) => (SMALL.to_vec(), 1),
            (Set::Small, true) => (MOVING_SMALL.to_vec(), 1),
            (Set::Full, false) => (
                strandbench_scenes::catalog()
                    .iter()
                    .map(|e| e.name)
                    .filter(|n| !TUNING.contains(n))
                    .collect(),
                2,
            ),
            (Set::Full, true) => (MOVING_FULL.to_vec(), 5),
        };
        let mut cases = Vec::new();
        for (i, scene) in scenes.into_iter().enumerate() {
            for seed in 1..=seeds {
                // The first seed as it is, the others under the conditions in turn.
                let condition = if seed == 1 { AS_IS } else { CONDITIONS[1 + (i + seed as usize) % 3] };
                cases.push(case(scene, seed, condition)?);
            }
        }
        let tuning = if ablation.tuned { &TUNING[..] } else { &[] };
        let factors: &[f32] = match set {
            Set::Small => &[0.5, 1.0, 2.0],
            Set::Full => &[0.25, 0.5, 1.0, 2.0, 4.0],
        };
        Ok(Plan {
            name: set.name().to_owned(),
            cases,
            tuning: tuning.iter().map(|scene| case(scene, 1, AS_IS)).collect::<Result<_, _>>()?,
            factors: factors.to_vec(),
            render: if set == Set::Small { read(&QUICK)? } else { Vec::new() },
            frames: ablation.moving.then_some(FRAMES),
            render_s: RENDER_S[usize::from(set == Set::Full)],
        })
    }

    /// Scenes of one's own, each with every seed; `tuning` are other scenes to tune the weights on, none for the variants'
    /// own. `settings` change all scenes and renders.
    ///
    /// # Errors
    /// If a scene is among both, or a setting is one of the method's.
    pub fn on(
        scenes: &[String],
        tuning: &[String],
        seeds: &[u64],
        settings: &[Setting],
        frames: Option<Frames>,
    ) -> Result<Plan, SuiteError> {
        if let Some(wrong) = settings.iter().find(|s| s.part == Part::Recon) {
            return Err(wrong.fault("the ablation decides about the method; use scene.KEY or render.KEY"));
        }
        if let Some(both) = tuning.iter().find(|t| scenes.contains(t)) {
            let problem = "weights are tuned on it, so that nothing may be concluded from it; name another";
            return Err(SuiteError::Scene { scene: both.clone(), problem: problem.to_owned() });
        }
        let changes: Vec<Setting> = settings.iter().filter(|s| s.part == Part::Scene).cloned().collect();
        let case = |scene: &String, seed: u64| Case {
            scene: scene.clone(),
            seed,
            condition: AS_IS.name.to_owned(),
            changes: changes.clone(),
        };
        Ok(Plan {
            name: "own".to_owned(),
            cases: scenes
                .iter()
                .flat_map(|s| seeds.iter().map(move |&seed| (s, seed)))
                .map(|(s, n)| case(s, n))
                .collect(),
            tuning: tuning.iter().map(|s| case(s, seeds.first().copied().unwrap_or(1))).collect(),
            factors: vec![0.5, 1.0, 2.0],
            render: settings.iter().filter(|s| s.part == Part::Render).cloned().collect(),
            frames,
            render_s: RENDER_S[1],
        })
    }

    /// Whether weights are tuned.
    pub(crate) fn tunes(&self) -> bool {
        !self.tuning.is_empty()
    }
}

impl Set {
    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Set::Small => "small",
            Set::Full => "full",
        }
    }
}

/// The cell of a case for an arm whose weight of smoothness is multiplied by `factor`.
pub(crate) fn cell(plan: &Plan, case: &Case, arm: &Arm, factor: f32) -> Result<Cell, SuiteError> {
    let recon =
        |key: &str, value: &str| Setting { part: Part::Recon, key: key.to_owned(), value: value.to_owned() };
    let mut method: Vec<Setting> = arm.changes.iter().map(|(key, value)| recon(key, value)).collect();
    // The variant's own weight is left unsaid, so that its folder is the one that `run` makes.
    if factor != 1.0 {
        method.push(recon("lambda", &lambda(arm, factor)?.to_string()));
    }
    let scene = SceneJob::open(&case.scene, &case.changes)?;
    let method = Method::find(arm.variant, &method)?;
    let mut one = Cell::matrix(&[scene], &[method], &[case.seed], &plan.render, plan.frames)?;
    Ok(one.remove(0))
}

/// The arm's weight of smoothness times a factor.
pub(crate) fn lambda(arm: &Arm, factor: f32) -> Result<f32, SuiteError> {
    let fault = |e: strandbench_recon::ReconError| SuiteError::Variant(e.to_string());
    let base = strandbench_recon::Variant::named(arm.variant).map_err(fault)?;
    Ok(base.parameters.lambda * factor)
}

#[cfg(test)]
mod tests {
    use super::super::table::ABLATIONS;
    use super::*;

    #[test]
    fn sets_are_as_large_as_they_say_and_tune_apart() {
        for ablation in ABLATIONS {
            let [small, full] = [Set::Small, Set::Full].map(|set| Plan::of(set, ablation).unwrap());
            assert!(full.cases.len() >= 20, "{} cells", full.cases.len());
            for case in full.cases.iter().chain(&small.cases) {
                assert!(!TUNING.contains(&case.scene.as_str()), "{}", case.scene);
            }
            for c in &CONDITIONS {
                assert!(full.cases.iter().any(|case| case.condition == c.name), "{} occurs", c.name);
            }
            assert_eq!((small.tunes(), full.tunes()), (ablation.tuned, ablation.tuned));
        }
        assert_eq!(Set::from_str("full"), Ok(Set::Full));
        assert!(Set::from_str("all").is_err());
    }

    #[test]
    fn every_case_of_every_arm_is_a_cell_with_a_folder_of_its_own() {
        for a in ABLATIONS {
            let plan = Plan::of(Set::Small, a).unwrap();
            let mut places = std::collections::BTreeSet::new();
            let mut cells = 0;
            for case in &plan.cases {
                for arm in a.arms() {
                    for &factor in if plan.tunes() { &plan.factors[..] } else { &[1.0] } {
                        let cell = cell(&plan, case, arm, factor).unwrap();
                        assert_eq!(cell.frames.is_some(), cell.scene.moves());
                        places.insert(cell.places(std::path::Path::new("out")).score);
                        cells += 1;
                    }
                }
            }
            assert_eq!(places.len(), cells, "{}", a.name);
        }
        let full = Plan::of(Set::Full, &ABLATIONS[0]).unwrap();
        let noisy = full.cases.iter().find(|c| c.condition == NOISY.name).unwrap();
        let cell = cell(&full, noisy, &ABLATIONS[0].with, 1.0).unwrap();
        assert!(cell.scene_label().contains("full_well_e=4000"), "{}", cell.scene_label());
    }

    #[test]
    fn nothing_is_concluded_from_what_was_tuned_on() {
        let names = |n: &[&str]| n.iter().map(|s| (*s).to_owned()).collect::<Vec<_>>();
        let both = Plan::on(&names(&["a", "b"]), &names(&["b"]), &[1], &[], None).unwrap_err().to_string();
        assert!(both.contains("scene b") && both.contains("tuned"), "{both}");
        let lambda = "lambda=1".parse().unwrap();
        assert!(
            Plan::on(&names(&["a"]), &[], &[1], &[lambda], None).is_err(),
            "the method is the ablation's"
        );
        let plan = Plan::on(&names(&["a", "b"]), &[], &[1, 2, 3], &[], None).unwrap();
        assert_eq!((plan.cases.len(), plan.tunes()), (6, false));
    }
}
