//! Where the points that pixels show lie in the image of another moment.

use crate::GroundTruthError;
use glam::{DMat3, DQuat, DVec2, DVec3, Mat3};
use rayon::prelude::*;
use strandbench_types::{Camera, FirstHit, FlowMap, FlowState, HitPlane, Moment, Monitor, Plane, Sight};

/// Rows that one task fills.
const BAND: usize = 8;

/// Checks that a place of one moment has its like at the other.
///
/// # Errors
/// If strands, points, surfaces or triangles differ in number or order, or a strand has no follicle's axes.
pub fn check_moments(now: &Moment, then: &Moment) -> Result<(), GroundTruthError> {
    let fault = |text: String| {
        Err(GroundTruthError::Inconsistent(format!(
            "{text}; strands and meshes keep their order and topology"
        )))
    };
    if now.strands.offsets != then.strands.offsets {
        let (a, b) = (now.strands.len(), then.strands.len());
        return fault(format!("the strands of two moments ({a} and {b}) differ in number or points"));
    }
    for m in [now, then] {
        m.strands.validate()?;
        if m.follicle_axes.len() != m.strands.len() {
            let (a, s) = (m.follicle_axes.len(), m.strands.len());
            return fault(format!("{s} strands have {a} axes of follicles"));
        }
        if let Some(i) = m.follicle_axes.iter().position(|a| !is_orthonormal(a)) {
            return fault(format!("the axes of the follicle of strand {i} are not orthonormal"));
        }
        for (i, mesh) in m.meshes.iter().enumerate() {
            if let Err(e) = mesh.validate() {
                return fault(format!("surface {i}: {e}"));
            }
        }
    }
    if now.meshes.len() != then.meshes.len() {
        return fault(format!("two moments have {} and {} surfaces", now.meshes.len(), then.meshes.len()));
    }
    for (i, (a, b)) in now.meshes.iter().zip(then.meshes).enumerate() {
        if a.triangles != b.triangles || a.vertices.len() != b.vertices.len() {
            return fault(format!("surface {i} differs in topology between two moments"));
        }
    }
    Ok(())
}

/// Single precision and several products leave 1e-6; this only tells axes from what is none.
fn is_orthonormal(m: &Mat3) -> bool {
    let off = *m * m.transpose() - Mat3::IDENTITY;
    off.to_cols_array().iter().all(|v| v.abs() <= 1e-4)
}

/// Where `place` (mm), a point of what was hit now, is at the other moment. Positions on a mesh follow its corners; a
/// place on a fibre keeps its position along the segment, and its offset from the axis turns with the follicle's axes
/// and then by the least turn that takes the carried segment's direction to the segment's own. Going to a moment and back
/// ends where it began.
pub fn carry(now: &Moment, then: &Moment, place: DVec3, hit: FirstHit) -> Option<DVec3> {
    match hit {
        FirstHit::Nothing => None,
        FirstHit::Mesh { surface, triangle, uv } => {
            let mesh = then.meshes.get(surface as usize)?;
            let corner = mesh.triangles.get(triangle as usize)?;
            let [a, b, c] = corner.map(|i| mesh.vertices[i as usize].as_dvec3());
            Some(a + (b - a) * f64::from(uv[0]) + (c - a) * f64::from(uv[1]))
        }
        FirstHit::Fibre { strand, segment, along } => {
            let s = strand as usize;
            let range = (s < now.strands.len()).then(|| now.strands.range(s))?;
            let k = range.start + segment as usize;
            if k + 1 >= range.end {
                return None;
            }
            let ends = |m: &Moment| [k, k + 1].map(|i| m.strands.points[i].as_dvec3());
            let ([a, b], [c, d]) = (ends(now), ends(then));
            let axes = |m: &Moment| m.follicle_axes[s].as_dmat3();
            let turn: DMat3 = axes(then) * axes(now).transpose();
            let offset = turn * (place - a.lerp(b, f64::from(along)));
            let offset = match ((turn * (b - a)).try_normalize(), (d - c).try_normalize()) {
                (Some(from), Some(to)) => DQuat::from_rotation_arc(from, to) * offset,
                _ => offset,
            };
            Some(c.lerp(d, f64::from(along)) + offset)
        }
    }
}

/// Flow of what each pixel shows now to where it lies in the same camera's image at the other moment; `sight` is of that
/// other moment. Swap moments, and take the other's hits and this one's sight, for the way back.
///
/// # Errors
/// As [`check_moments`]; if the hits are of another size than the camera or name what is not there, or the work is stopped.
pub fn flow(
    camera: &Camera,
    hits: &HitPlane,
    (now, then): (&Moment, &Moment),
    sight: &dyn Sight,
    monitor: &dyn Monitor,
) -> Result<FlowMap, GroundTruthError> {
    check_moments(now, then)?;
    flow_but(camera, hits, (now, then), sight, monitor, |_| None)
}

/// As [`flow`] for moments that were checked; pixels of which `known` says the flow are taken from there.
pub(super) fn flow_but(
    camera: &Camera,
    hits: &HitPlane,
    (now, then): (&Moment, &Moment),
    sight: &dyn Sight,
    monitor: &dyn Monitor,
    known: impl Fn(usize) -> Option<([f32; 2], FlowState)> + Sync,
) -> Result<FlowMap, GroundTruthError> {
    let fault = |text: String| GroundTruthError::Inconsistent(format!("camera {}: {text}", camera.name));
    camera.validate().map_err(GroundTruthError::Inconsistent)?;
    let (w, h) = (camera.width as usize, camera.height as usize);
    if hits.hits.size() != (w, h) || hits.depth.size() != (w, h) {
        return Err(fault(format!("first hits are {:?} px, not {w}x{h}", hits.hits.size())));
    }
    let mut flow_px = Plane::filled(w, h, [f32::NAN; 2]);
    let mut state = Plane::filled(w, h, FlowState::Absent);
    let bands = flow_px.data.par_chunks_mut(BAND * w).zip(state.data.par_chunks_mut(BAND * w));
    // The first fault in the image's order, whatever the order of the bands.
    let faults: Vec<Result<(), GroundTruthError>> = bands
        .enumerate()
        .map(|(band, (flows, states))| {
            monitor.check()?;
            for (k, (flow, state)) in flows.iter_mut().zip(states).enumerate() {
                let i = band * BAND * w + k;
                if let Some(known) = known(i) {
                    (*flow, *state) = known;
                    continue;
                }
                let hit = hits.hits.data[i];
                let Some(element) = hit.element() else { continue };
                let pixel = DVec2::new((i % w) as f64 + 0.5, (i / w) as f64 + 0.5);
                let Some(z) = hits.depth.get_index(i) else {
                    return Err(fault(format!("pixel ({}, {}) has a hit without depth", i % w, i / w)));
                };
                let place = camera.unproject(pixel, f64::from(z));
                let Some(there) = carry(now, then, place, hit) else {
                    let text = format!("pixel ({}, {}) shows {hit:?}, which is not there", i % w, i / w);
                    return Err(fault(text));
                };
                let Some((px, _)) = camera.project(there) else { continue };
                *flow = (px - pixel).as_vec2().to_array();
                *state = match camera.contains(px) {
                    false => FlowState::Outside,
                    true if sight.sees(camera, there, element) => FlowState::Seen,
                    true => FlowState::Occluded,
                };
            }
            Ok(())
        })
        .collect();
    faults.into_iter().collect::<Result<(), _>>()?;
    Ok(FlowMap { flow_px, state })
}
