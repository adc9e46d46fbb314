//! Estimates made of the true strands.

use super::{RADIUS, STILL, scene};
use glam::Vec3;
use strandbench_score::{StrandSheet, score_strands};
use strandbench_types::{Estimate, Silent, StrandSet, Truth, Visibility};

/// Every third strand of a truth.
pub fn thinned(truth: &Truth) -> Truth {
    let mut out = Truth { strands: StrandSet::new(), visibility: Visibility::default(), ..truth.clone() };
    out.visibility.offsets.push(0);
    for k in (0..truth.strands.len()).step_by(3) {
        out.strands.push(truth.strands.strand(k), 0.04);
        let o = &truth.visibility.offsets;
        out.visibility.seen_by.extend(&truth.visibility.seen_by[o[k] as usize..o[k + 1] as usize]);
        out.visibility.offsets.push(out.visibility.seen_by.len() as u32);
    }
    out
}

/// Hair in two layers, 12 mm apart.
pub fn layers() -> Truth {
    thinned(&scene(&STILL, &[RADIUS, 48.0]))
}

pub fn of(truth: &Truth, strands: &StrandSet) -> StrandSheet {
    let estimate = Estimate { strands: Some(strands.clone()), ..Estimate::default() };
    score_strands(truth, &estimate, 7, &Silent).unwrap()
}

pub fn value(s: &StrandSheet, subject: &str, id: &str) -> Option<f64> {
    s.get(subject, id).unwrap().value
}

/// The strands, each point list replaced.
pub fn mapped(strands: &StrandSet, f: impl Fn(usize, &[Vec3]) -> Vec<Vec3>) -> StrandSet {
    let mut out = StrandSet::new();
    for (k, p) in strands.iter().enumerate() {
        out.push(&f(k, p), 0.04);
    }
    out
}

/// The true strands, each point moved away from the cylinders' axis.
pub fn moved_outwards(truth: &Truth, mm: f64) -> StrandSet {
    mapped(&truth.strands, |_, points| {
        let out = |p: &Vec3| *p + Vec3::new(p.x, 0.0, p.z).normalize() * mm as f32;
        points.iter().map(out).collect()
    })
}
