//! Rays against fibres: first hits, normals and shadows.

use super::reason::{Answer, Context, Reason};
use super::{DISTANCE_MM, MISS_SHARE, PRIMITIVE_SHARE, strands_of};
use crate::referee::{Ray, segments_of};
use crate::stats::quantile;
use crate::{Bundle, Case, CrossError, Gate};
use glam::Vec3;
use rayon::prelude::*;
use std::collections::BTreeMap;
use strandbench_renderer::accel::{Accel, Hit, LastBlockers};
use strandbench_types::StrandSet;

/// 99th percentile of the angle between normals, in units of what rounding of the hit's distance to single
/// precision does to it: half a unit in the last place of the longest ray, over a typical fibre's radius. Measured
/// 1.5 at 400 mm and 2.7 at 900 mm.
const NORMAL_ROUNDINGS: f64 = 4.0;

/// The segment's index, as Mitsuba counts them: strands in order, without gaps.
fn segment_index(strand: u32, point: u32) -> i32 {
    (point - strand) as i32
}

fn ours(accel: &Accel, strands: &StrandSet, origin: Vec3, direction: Vec3) -> Answer {
    match accel.closest(origin, direction) {
        Some(Hit::Fibre { t, strand, point, along }) => {
            let i = point as usize;
            let centre = strands.points[i].lerp(strands.points[i + 1], along);
            let position = origin + direction * t;
            Answer {
                t,
                primitive: segment_index(strand, point),
                normal: (position - centre).normalize_or_zero(),
                position,
            }
        }
        _ => Answer { t: f32::INFINITY, primitive: -1, normal: Vec3::ZERO, position: Vec3::ZERO },
    }
}

pub(super) fn judge(
    case: &Case,
    answer: &Bundle,
    origins: &[Vec3],
    directions: &[Vec3],
    tmax: &[f32],
) -> Result<Vec<Gate>, CrossError> {
    let n = origins.len();
    let strands = strands_of(&case.input)?;
    let accel = Accel::new(&strands, &[])?;
    let theirs: Vec<Answer> = {
        let t: Vec<f32> = answer.get("t", &[n])?;
        let primitive: Vec<i32> = answer.get("primitive", &[n])?;
        let normal = answer.vec3("normal", n)?;
        let position = answer.vec3("position", n)?;
        (0..n)
            .map(|i| Answer { t: t[i], primitive: primitive[i], normal: normal[i], position: position[i] })
            .collect()
    };
    let blocked: Vec<u8> = answer.get("blocked", &[n])?;
    let segments = segments_of(&strands);
    if let Some(p) = theirs.iter().map(|a| a.primitive).find(|&p| p >= segments.len() as i32) {
        return Err(CrossError::Array {
            job: case.name.clone(),
            name: "primitive".into(),
            fault: format!("names segment {p} of {}", segments.len()),
        });
    }
    let strand = (0..strands.len()).flat_map(|s| strands.range(s).skip(1).map(move |_| s as u32)).collect();
    let context = Context { segments: &segments, strand };
    // Per ray: what differs in first hits, and in shadow.
    let verdicts: Vec<(Answer, Option<Reason>, Option<Reason>)> = (0..n)
        .into_par_iter()
        .map(|i| {
            let mine = ours(&accel, &strands, origins[i], directions[i]);
            let ray = Ray { origin: origins[i].as_dvec3(), direction: directions[i].as_dvec3().normalize() };
            let differs = mine.primitive != theirs[i].primitive;
            let reason = differs.then(|| context.reason(&ray, &mine, &theirs[i]));
            let shadow = tmax[i].is_finite().then(|| {
                accel.occluded(origins[i], directions[i], tmax[i], None, &mut LastBlockers::default())
            });
            let flip = shadow
                .filter(|&b| u8::from(b) != blocked[i])
                .map(|_| context.shadow_reason(&ray, f64::from(tmax[i])));
            (mine, reason, flip)
        })
        .collect();
    let mut tally: BTreeMap<Reason, u64> = BTreeMap::new();
    let mut flips: BTreeMap<Reason, u64> = BTreeMap::new();
    let (mut hits, mut missed, mut renamed) = (0u64, 0u64, 0u64);
    let (mut dt, mut dn, mut dp) = (Vec::new(), Vec::new(), Vec::new());
    for ((mine, reason, flip), other) in verdicts.iter().zip(&theirs) {
        hits += u64::from(other.primitive >= 0);
        if let Some(r) = reason {
            *tally.entry(*r).or_default() += 1;
            if mine.primitive < 0 || other.primitive < 0 { missed += 1 } else { renamed += 1 }
        } else if mine.primitive >= 0 {
            dt.push(f64::from((mine.t - other.t).abs()));
            dn.push(f64::from(mine.normal.angle_between(other.normal).to_degrees()));
            dp.push(f64::from(mine.position.distance(other.position)));
        }
        if let Some(r) = flip {
            *flips.entry(*r).or_default() += 1;
        }
    }
    let shadows = tmax.iter().filter(|t| t.is_finite()).count() as f64;
    let flipped: u64 = flips.values().sum();
    let unexplained =
        tally.get(&Reason::Unexplained).unwrap_or(&0) + flips.get(&Reason::Unexplained).unwrap_or(&0);
    let list = |t: &BTreeMap<Reason, u64>| {
        t.iter().map(|(r, n)| format!("{n} {}", r.name())).collect::<Vec<_>>().join("; ")
    };
    let farthest = theirs.iter().map(|a| f64::from(a.t)).filter(|t| t.is_finite()).fold(0.0, f64::max);
    let mut radii: Vec<f64> = strands.radii_mm.iter().map(|r| f64::from(*r)).collect();
    let rounding = farthest * f64::from(f32::EPSILON) * 0.5 / quantile(&mut radii, 0.5);
    let normal_limit = (NORMAL_ROUNDINGS * rounding).to_degrees();
    // What to look at first if something has no reason.
    let odd = (0..n).find(|&i| {
        let (_, reason, flip) = &verdicts[i];
        [reason, flip].contains(&&Some(Reason::Unexplained))
    });
    let odd = odd.map_or(String::new(), |i| {
        let (mine, ..) = &verdicts[i];
        let ray = Ray { origin: origins[i].as_dvec3(), direction: directions[i].as_dvec3().normalize() };
        let nearest = segments
            .iter()
            .enumerate()
            .filter_map(|(k, s)| s.entry(&ray).filter(|t| *t > 0.0).map(|t| (t, k, s.impact(&ray))))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        format!(
            "; ray {i} from {} along {} to {}: ours {} at {}, theirs {} at {} (blocked: {}), nearest in double precision {nearest:?}",
            origins[i], directions[i], tmax[i], mine.primitive, mine.t, theirs[i].primitive, theirs[i].t, blocked[i]
        )
    });
    let at_most = |what: &str, v: f64, l: f64, unit: &str| Gate::at_most(1, &case.name, what, v, l, unit);
    let total = n as f64;
    Ok(vec![
        Gate::shown(1, &case.name, "rays", total, "rays")
            .because(format!("{hits} of them hit; {shadows} shadow rays; {} segments", segments.len())),
        Gate::at_least(1, &case.name, "share of rays that hit", hits as f64 / total, 0.2, "")
            .because("rays that miss everything prove little"),
        at_most("hit against miss", missed as f64 / total, MISS_SHARE, "of rays").because(list(&tally)),
        at_most("another segment", renamed as f64 / total, PRIMITIVE_SHARE, "of rays").because(list(&tally)),
        at_most("shadow against light", flipped as f64 / shadows.max(1.0), MISS_SHARE, "of shadow rays")
            .because(list(&flips)),
        at_most("distance, 99th percentile", quantile(&mut dt, 0.99), DISTANCE_MM, "mm"),
        at_most("position, 99th percentile", quantile(&mut dp, 0.99), DISTANCE_MM, "mm"),
        at_most("normal, 99th percentile", quantile(&mut dn, 0.99), normal_limit, "degrees"),
        at_most("disagreements without a reason", unexplained as f64, 0.0, "rays").because(format!(
            "{} disagreements examined in double precision{odd}",
            missed + renamed + flipped
        )),
    ])
}
