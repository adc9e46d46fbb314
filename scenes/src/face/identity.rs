//! People: control meshes drawn from the identity targets.

use super::asset::Kind;
use super::{FaceError, FaceModel, FaceSpec};
use crate::groom::standard_normal;
use glam::Vec3;
use strandbench_rng::Rng;

/// Streams of the person's properties and of the details.
const PERSON: u64 = 0xFACE;
const DETAIL: u64 = 0xDE7A;

/// Standard deviation of a detail's weight, and where the tails are cut. The targets' ends at ±1 are caricatures.
const SPREAD: f32 = 0.22;
const LIMIT: f32 = 0.5;

/// Between the two halves of a face: a third of what differs between faces.
const ASYMMETRY: f32 = 0.35;

/// Of shapes of the whole head: some twenty of them add up.
const HEAD: f32 = 0.4;

/// One person's neutral face.
#[derive(Clone, Debug, PartialEq)]
pub struct Identity {
    /// Control vertices without expression, mm.
    pub control: Vec<Vec3>,
}

impl Identity {
    /// The mean of young women and men.
    pub fn mean(model: &FaceModel) -> Identity {
        Identity { control: model.asset.vertices.clone() }
    }

    /// The person that the description names. The same description gives the same bits.
    ///
    /// # Errors
    /// As [`FaceSpec::check`].
    pub fn draw(model: &FaceModel, spec: &FaceSpec) -> Result<Identity, FaceError> {
        spec.check()?;
        let mut rng = Rng::keyed(&[PERSON, spec.identity]);
        // All numbers are drawn, so that stating one leaves the others as they are.
        let (male, age, weight) = (rng.f32(), 0.7 * rng.f32(), rng.range(-0.6, 0.6));
        let (male, age) = (spec.male.unwrap_or(male), spec.age.unwrap_or(age));
        let weight = spec.weight.unwrap_or(weight);
        let shares: [f32; 3] = std::array::from_fn(|_| -libm::logf(1.0 - rng.f32()) + 1e-3);
        let total: f32 = shares.iter().sum();
        let mut control = model.asset.vertices.clone();
        let mut add = |target: usize, w: f32| {
            for &(i, d) in &model.asset.targets[target].deltas {
                control[i as usize] += d * w;
            }
        };
        let share = |name: &str| -> f32 {
            name.split('-')
                .map(|word| match word {
                    "female" => 1.0 - male,
                    "male" => male,
                    "young" => 1.0 - age,
                    "old" => age,
                    "african" => shares[0] / total,
                    "asian" => shares[1] / total,
                    "caucasian" => shares[2] / total,
                    "minweight" => (-weight).max(0.0),
                    "averageweight" => 1.0 - weight.abs(),
                    "maxweight" => weight.max(0.0),
                    _ => 1.0,
                })
                .product()
        };
        for (i, t) in model.asset.targets.iter().enumerate() {
            if matches!(t.kind, Kind::Ethnicity | Kind::Universal) {
                add(i, share(&t.name));
            }
        }
        for (k, axis) in (0..).zip(&model.asset.axes) {
            let mut rng = Rng::keyed(&[DETAIL, spec.identity, k]);
            let part = match axis.name.split('-').next() {
                Some("asym") => ASYMMETRY,
                Some("head" | "forehead" | "neck") => HEAD,
                _ => 1.0,
            };
            let w = spec.variety * part * (standard_normal(&mut rng) * SPREAD).clamp(-LIMIT, LIMIT);
            match axis.low {
                _ if w > 0.0 => add(axis.high, w),
                Some(low) => add(low, -w),
                None => {}
            }
        }
        Ok(Identity { control })
    }

    /// The neutral face's vertices, mm: shapes for a linear model of faces.
    pub fn vertices(&self, model: &FaceModel) -> Vec<Vec3> {
        model.refined(&self.control)
    }
}
