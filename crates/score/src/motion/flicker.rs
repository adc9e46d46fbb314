//! C3, and C5 in depth: the envelope's depth error where material points of true hair are seen.

use super::bands::Series;
use super::carrier::Material;
use crate::stats::{percentile, sorted};
use crate::strands::samples::{STEP_MM, Walk};
use strandbench_types::{Estimate, Truth, Visibility};

/// Material points followed, spread evenly over all true hair.
const POINTS: u64 = 1 << 16;

/// Points whose depth is kept over time for the response.
const SERIES: usize = 1 << 12;

/// A point counts once it was seen in so many frames (or in all frames of a shorter sequence).
const LEAST_FRAMES: u32 = 10;

#[derive(Clone, Copy, Default)]
struct Moments {
    wanted: u32,
    answered: u32,
    mean: f64,
    squares: f64,
}

/// Depth errors of material points over time.
pub(crate) struct Flicker {
    points: Vec<Material>,
    moments: Vec<Moments>,
    frames: u32,
    /// Estimated and true depth of some points, by frame.
    depths: Vec<Series>,
}

/// Where the depth errors leave the envelope.
pub(crate) struct Figures {
    /// Ascending standard deviations over time, mm; infinite where more than half of the answers are absent.
    pub sd_mm: Vec<f64>,
    pub wanted: u64,
    pub answered: u64,
}

impl Flicker {
    pub fn new(truth: &Truth) -> Flicker {
        let strands = &truth.strands;
        let counts: Vec<u64> =
            (0..strands.len()).map(|s| Visibility::samples_on(strands.length_mm(s)) as u64).collect();
        let k = counts.iter().sum::<u64>().div_ceil(POINTS).max(1);
        let (mut points, mut rank) = (Vec::new(), 0);
        for (s, &n) in counts.iter().enumerate() {
            let mut walk = Walk::new(strands, s);
            for i in 0..n {
                if rank % k == k / 2 {
                    let at = walk.at((i as f64 + 0.5) * STEP_MM);
                    points.push(Material { point: at.point, along: at.along });
                }
                rank += 1;
            }
        }
        let n = points.len();
        Flicker {
            points,
            moments: vec![Moments::default(); n],
            frames: 0,
            depths: vec![Vec::new(); n.min(SERIES)],
        }
    }

    /// Adds a frame. `arc_mm` and `strand_of` are the truth's, by point.
    pub fn push(&mut self, truth: &Truth, arc_mm: &[f64], strand_of: &[u32], estimate: &Estimate) {
        let (camera, view) = (&truth.rig.cameras[0], &truth.views[0]);
        let v = &truth.visibility;
        let step = self.points.len().div_ceil(SERIES).max(1);
        for (i, m) in self.points.iter().enumerate() {
            let p = m.point as usize;
            let strand = strand_of[p] as usize;
            let samples = (v.offsets[strand + 1] - v.offsets[strand]) as usize;
            let arc = arc_mm[p] + m.along * (arc_mm[p + 1] - arc_mm[p]);
            let seen = samples > 0 && {
                let k = ((arc / STEP_MM) as usize).min(samples - 1);
                v.seen_by[v.offsets[strand] as usize + k] & 1 != 0
            };
            let place = m.at(&truth.strands.points);
            let pixel = camera.project(place).filter(|(uv, _)| seen && camera.contains(*uv));
            let at = pixel.map(|(uv, _)| uv.y as usize * camera.width as usize + uv.x as usize);
            let wanted = at.and_then(|at| Some((at, f64::from(view.depth_50.get_index(at)?))));
            let mut kept = None;
            if let Some((at, z_true)) = wanted {
                let moments = &mut self.moments[i];
                moments.wanted += 1;
                if let Some(z) = estimate.depth.as_ref().and_then(|d| d.get_index(at)) {
                    moments.answered += 1;
                    let e = f64::from(z) - z_true;
                    let off = e - moments.mean;
                    moments.mean += off / f64::from(moments.answered);
                    moments.squares += off * (e - moments.mean);
                    kept = Some((f64::from(z), camera.to_camera(place).z));
                }
            }
            if i % step == 0 && i / step < self.depths.len() {
                self.depths[i / step].push(kept);
            }
        }
        self.frames += 1;
    }

    pub fn figures(&self) -> Figures {
        let least = LEAST_FRAMES.min(self.frames).max(2);
        let counted = self.moments.iter().filter(|m| m.wanted >= least);
        let sd = |m: &Moments| {
            if m.answered < 2 || 2 * m.answered < m.wanted {
                f64::INFINITY
            } else {
                (m.squares / f64::from(m.answered - 1)).sqrt()
            }
        };
        let (wanted, answered) =
            counted.clone().fold((0, 0), |(w, a), m| (w + u64::from(m.wanted), a + u64::from(m.answered)));
        Figures { sd_mm: sorted(counted.map(sd).collect()), wanted, answered }
    }

    /// Depth over time of points that were seen in at least half of the frames.
    pub fn series(&self) -> Vec<Series> {
        let often = |s: &&Series| 2 * s.iter().flatten().count() >= self.frames as usize && self.frames > 0;
        self.depths.iter().filter(often).cloned().collect()
    }
}

impl Figures {
    pub fn percentile(&self, percent: usize) -> f64 {
        percentile(&self.sd_mm, percent)
    }
}
