//! Procedural hair: roots on the scalp, carriers grown by combing, weight and layers, gathered into wisps and
//! tufts, waved, frizzed, and sampled.

mod clump;
#[cfg(test)]
mod cover;
mod fibre;
mod field;
mod grow;
mod noise;

use crate::Pigment;
use crate::head::Head;
use crate::spec::{GroomSpec, PigmentSpec};
use clump::{FIBRE, Planner, TUFT};
use field::Comb;
use grow::{Grower, bend_length_cubed_mm3};
use noise::lognormal;
pub(crate) use noise::{
    LineNoise, lognormal as standard_lognormal, normal as standard_normal, quintic, ramp, space_noise,
};
use rayon::prelude::*;
use strandbench_rng::Rng;
use strandbench_types::StrandSet;

/// Most points of all fibres together: 1 GiB of points and radii.
const MAX_TOTAL_POINTS: usize = 60_000_000;

/// Stream of pigment.
const PIGMENT: u64 = 9;

/// Grows the hair of a head; equal arguments give equal bits on any number of threads.
///
/// # Errors
/// If the fibres together would need more points than memory should hold.
pub(crate) fn groom(
    spec: &GroomSpec,
    pigment: &PigmentSpec,
    head: &Head,
    seed: u64,
) -> Result<(StrandSet, Vec<Pigment>), String> {
    let comb = Comb::new(&spec.style, spec.length.fringe, head);
    let grower = Grower {
        head,
        comb: &comb,
        style: &spec.style,
        bend_mm3: bend_length_cubed_mm3(spec.style.young_gpa, spec.radius_mm),
        wander_length_mm: spec.disorder.wander_length_mm,
    };
    let planner = Planner { spec, head, comb: &comb, grower: &grower, seed };
    let roots = head.scalp().roots(spec.strands as usize, head.scale(), &[seed, FIBRE], 4);
    let (tufts, wisps, wisp_of) = planner.plan(&roots);

    // In batches, so that hair too fine for memory is noticed before it has filled it.
    let mut strands = StrandSet::new();
    for first in (0..roots.len()).step_by(8192) {
        let last = (first + 8192).min(roots.len());
        let fibres: Vec<fibre::Fibre> = (first..last)
            .into_par_iter()
            .map(|i| {
                let wisp = &wisps[wisp_of[i]];
                planner.fibre(i, &roots[i], wisp, &tufts[wisp.parent])
            })
            .collect();
        let total = strands.points.len() + fibres.iter().map(|f| f.points.len()).sum::<usize>();
        if total > MAX_TOTAL_POINTS {
            return Err(format!(
                "{last} of {} fibres already need {total} points, over the limit of {MAX_TOTAL_POINTS}; \
                 lower strands, or raise chord_error_mm or wave.pitch_mm",
                roots.len()
            ));
        }
        for f in &fibres {
            strands.push_tapered(&f.points, &f.radii_mm);
        }
    }
    let tuft_tone: Vec<f32> = (0..tufts.len())
        .map(|t| lognormal(&mut Rng::keyed(&[seed, PIGMENT, TUFT, t as u64]), pigment.tuft_spread))
        .collect();
    let pigments = (0..strands.len())
        .map(|i| {
            let mut rng = Rng::keyed(&[seed, PIGMENT, FIBRE, i as u64]);
            let tone = tuft_tone[wisps[wisp_of[i]].parent] * lognormal(&mut rng, pigment.strand_spread);
            Pigment { eumelanin: pigment.eumelanin * tone, pheomelanin: pigment.pheomelanin * tone }
        })
        .collect();
    Ok((strands, pigments))
}
