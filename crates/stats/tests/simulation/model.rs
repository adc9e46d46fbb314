//! Synthetic errors that share strands and clumps, with a known mean difference.

use strandbench_rng::Rng;
use strandbench_stats::{PairedCell, Statistic, Units};

/// One made-up benchmark.
#[derive(Clone, Copy)]
pub struct Model {
    /// Scenes.
    pub scenes: u64,
    /// Standard deviation of the scenes' true differences, mm.
    pub scene_mm: f64,
    /// Whether scenes' true differences are skewed (exponential) instead of normal.
    pub skewed: bool,
    /// True mean difference, mm.
    pub difference_mm: f64,
}

const CLUMPS: u32 = 24;
const STRANDS: u32 = 4;
const PIXELS: u32 = 3;
/// Standard deviations of clumps, strands and pixels, mm, in the errors that both sides share ...
const SHARED_MM: [f64; 3] = [1.0, 0.5, 0.5];
/// ... and in what b adds to them.
const ADDED_MM: [f64; 3] = [0.8, 0.4, 0.4];
/// Far enough from zero that no error is negative.
const LEVEL_MM: f64 = 50.0;

/// Normal, by Box and Muller.
pub fn normal(rng: &mut Rng) -> f64 {
    (-2.0 * (1.0 - rng.f64()).ln()).sqrt() * (std::f64::consts::TAU * rng.f64()).cos()
}

impl Model {
    /// One draw of all scenes. Effects are symmetric about their centres, and so are medians: the expected difference of a scene is
    /// exactly its true one.
    pub fn draw(&self, key: &[u64]) -> Vec<PairedCell> {
        (0..self.scenes).map(|j| self.cell(&mut Rng::keyed(&[key, &[j]].concat()), j)).collect()
    }

    fn cell(&self, rng: &mut Rng, j: u64) -> PairedCell {
        let effect = if self.skewed { -(1.0 - rng.f64()).ln() - 1.0 } else { normal(rng) };
        let scene = self.difference_mm + self.scene_mm * effect;
        let mut units = Units {
            clump: vec![],
            strand: vec![],
            a: vec![],
            b: vec![],
            statistic: Statistic::Percentile(50),
        };
        let both = |sd: usize, rng: &mut Rng| (SHARED_MM[sd] * normal(rng), ADDED_MM[sd] * normal(rng));
        for clump in 0..CLUMPS {
            let c = both(0, rng);
            for s in 0..STRANDS {
                let t = both(1, rng);
                for _ in 0..PIXELS {
                    let p = both(2, rng);
                    let a = LEVEL_MM + c.0 + t.0 + p.0;
                    units.clump.push(clump);
                    units.strand.push(clump * STRANDS + s);
                    units.a.push(a as f32);
                    units.b.push((a + scene + c.1 + t.1 + p.1) as f32);
                }
            }
        }
        let [a, b] = units.figures();
        PairedCell { scene: format!("{j:03}"), seed: 1, a: Some(a), b: Some(b), units: Some(units) }
    }
}

/// Variance of a scene's difference that stems from its clumps, strands and pixels, from 4000 draws, mm².
pub fn within_variance() -> f64 {
    let model = Model { scenes: 4000, scene_mm: 0.0, skewed: false, difference_mm: 0.0 };
    let d: Vec<f64> = model.draw(&[0xca1]).iter().map(|c| c.b.unwrap() - c.a.unwrap()).collect();
    d.iter().map(|v| v * v).sum::<f64>() / d.len() as f64
}

/// Standard deviation of scenes at which this share (above 0) of a difference's variance lies within scenes, mm.
pub fn scene_mm(share_within: f64, within: f64) -> f64 {
    (within * (1.0 - share_within) / share_within).sqrt()
}
