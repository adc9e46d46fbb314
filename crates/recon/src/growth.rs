//! Growing strands from seeds through the tensor volume (5.4).

use crate::StrandParameters;
use crate::field3d::{TensorVolume, line_at};
use crate::layer::Layer;
use glam::Vec3;
use rayon::prelude::*;

/// Why a strand ended at one of its ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// Rule 1: it reached its length.
    Length,
    /// Rule 2: the next point would lie outside the hair layer.
    Layer,
    /// Rule 3: the line turns by more than T_ψ.
    Turn,
    /// The field has no direction here.
    NoDirection,
}

/// A strand and how its two ends came about.
#[derive(Clone, Debug, PartialEq)]
pub struct Grown {
    /// Points, mm, from the end that was grown against `towards` to the other.
    pub points: Vec<Vec3>,
    /// Why the first and the last end stopped.
    pub stops: [Stop; 2],
}

/// Grows a strand from a seed in both directions of the field by forward Euler steps of `step_mm`. It stops at an end
///
/// 1. when the whole strand has the length `length_mm`, half of it on either side of the seed;
/// 2. when it leaves the layer; the point outside is not kept;
/// 3. when the line at the new point turns from the last step's direction by more than `turn_deg`. The paper speaks of
///    the original direction d; read as the direction before the step, since a curl turns from where it began.
///
/// `towards` chooses which of the line's two directions comes second. `None` if the seed lies outside the layer or has
/// no direction.
pub fn grow(
    layer: &Layer,
    volume: &TensorVolume,
    seed: Vec3,
    towards: Vec3,
    p: &StrandParameters,
) -> Option<Grown> {
    if !layer.contains(seed) {
        return None;
    }
    let line = line_at(layer, volume, seed)?;
    let line = if line.dot(towards) < 0.0 { -line } else { line };
    let (backward, first) = march(layer, volume, seed, -line, p);
    let (forward, last) = march(layer, volume, seed, line, p);
    let points = backward.into_iter().rev().chain([seed]).chain(forward).collect();
    Some(Grown { points, stops: [first, last] })
}

fn march(
    layer: &Layer,
    volume: &TensorVolume,
    seed: Vec3,
    start: Vec3,
    p: &StrandParameters,
) -> (Vec<Vec3>, Stop) {
    let steps = (0.5 * p.length_mm / p.step_mm) as usize;
    let min_cos = libm::cosf(p.turn_deg.to_radians());
    let (mut at, mut direction) = (seed, start);
    let mut points = Vec::new();
    for _ in 0..steps {
        let next = at + direction * p.step_mm;
        if !layer.contains(next) {
            return (points, Stop::Layer);
        }
        let Some(line) = line_at(layer, volume, next) else { return (points, Stop::NoDirection) };
        let cos = line.dot(direction);
        if cos.abs() < min_cos {
            return (points, Stop::Turn);
        }
        points.push(next);
        at = next;
        direction = if cos < 0.0 { -line } else { line };
    }
    (points, Stop::Length)
}

/// Grows all seeds, in order; a seed without a strand of at least two points and `shortest_mm` gives `None`.
pub fn grow_all(
    layer: &Layer,
    volume: &TensorVolume,
    seeds: &[Vec3],
    towards: Vec3,
    p: &StrandParameters,
) -> Vec<Option<Grown>> {
    let long = |g: &Grown| (g.points.len() - 1) as f32 * p.step_mm >= p.shortest_mm && g.points.len() >= 2;
    seeds.par_iter().map(|&s| grow(layer, volume, s, towards, p).filter(long)).collect()
}
