//! Resampling scenes, and within them seeds, clumps and strands.

use crate::scenes::{Scene, difference};
use crate::units::POOL;
use crate::{Levels, Options};
use rayon::prelude::*;
use strandbench_rng::Rng;

/// Means of resampled scenes, ascending.
///
/// Drawing scenes, then clumps, then strands with replacement counts what varies within a scene twice: it is already in the
/// scenes' own differences, and the spread comes out too large by as much (Davison and Hinkley 1997, Bootstrap methods and
/// their application, 3.8; Field and Welsh 2007). Here the two parts are scaled so that their
/// variances add up to that of the scenes: a drawn scene enters as
/// mean + between (its difference - mean) + within (its replicate - the replicates' mean).
pub(crate) fn means(scenes: &[Scene], differences: &[f64], options: &Options) -> Vec<f64> {
    let n = scenes.len();
    let mean = differences.iter().sum::<f64>() / n as f64;
    let pools: Vec<Vec<f64>> =
        scenes.iter().zip(0..).map(|(scene, i)| deviations(scene, i, options)).collect();
    let spread = |v: &[f64]| v.iter().map(|d| d * d).sum::<f64>() / v.len().max(1) as f64;
    let inside = pools.iter().map(|p| spread(p)).sum::<f64>() / n as f64;
    let total = differences.iter().map(|d| (d - mean) * (d - mean)).sum::<f64>() / n as f64;
    let (between, within) = match options.levels {
        Levels::Plain => (1.0, 1.0),
        Levels::Matched if inside >= total => (0.0, (total / inside).sqrt()),
        Levels::Matched => ((1.0 - inside / total).sqrt(), 1.0),
    };

    let one = |round: u32| {
        let mut rng = Rng::keyed(&[options.seed, 0xb007, u64::from(round)]);
        let sum: f64 = (0..n)
            .map(|_| {
                let i = rng.below(n as u64) as usize;
                let inner = match pools[i].len() {
                    0 => 0.0,
                    len => pools[i][rng.below(len as u64) as usize],
                };
                between * (differences[i] - mean) + within * inner
            })
            .sum();
        mean + sum / n as f64
    };
    let mut all: Vec<f64> = (0..options.resamples).into_par_iter().map(one).collect();
    all.sort_unstable_by(f64::total_cmp);
    all
}

/// Replicates of a scene's difference less their mean: its seeds drawn with replacement, each by one of its own replicates.
/// Empty where nothing is known of what lies beneath.
fn deviations(scene: &Scene, index: u64, options: &Options) -> Vec<f64> {
    let pools: Vec<Vec<f64>> = (scene.cells.iter().zip(0u64..))
        .map(|(cell, k)| {
            let pool = cell.units.as_ref().and_then(|u| u.pool([options.seed, index << 32 | k]));
            pool.unwrap_or_else(|| vec![difference(cell, options.lower_is_better)])
        })
        .collect();
    if pools.len() == 1 && pools[0].len() == 1 {
        return Vec::new();
    }
    let mut rng = Rng::keyed(&[options.seed, 0x5eed, index]);
    let mut drawn: Vec<f64> = (0..POOL)
        .map(|_| {
            let sum: f64 = (0..pools.len())
                .map(|_| {
                    let pool = &pools[rng.below(pools.len() as u64) as usize];
                    pool[rng.below(pool.len() as u64) as usize]
                })
                .sum();
            sum / pools.len() as f64
        })
        .collect();
    let mean = drawn.iter().sum::<f64>() / drawn.len() as f64;
    drawn.iter_mut().for_each(|d| *d -= mean);
    drawn
}
