//! What truth and estimate must satisfy before any of it is indexed.

use crate::ScoreError;
use rayon::prelude::*;
use strandbench_types::{Estimate, StrandSet, Truth, Visibility};

pub(crate) fn fault<T>(text: String) -> Result<T, ScoreError> {
    Err(ScoreError::Input(text))
}

pub(crate) fn truth(t: &Truth) -> Result<(), ScoreError> {
    t.rig.validate().map_err(|e| ScoreError::Input(format!("truth: {e}")))?;
    let cameras = t.rig.cameras.len();
    if t.views.len() != cameras || cameras > 32 {
        return fault(format!("truth: {} views of {cameras} cameras (32 at most)", t.views.len()));
    }
    for (camera, v) in t.rig.cameras.iter().zip(&t.views) {
        let want = (camera.width as usize, camera.height as usize);
        let sizes = [
            v.depth_first.size(),
            v.depth_05.size(),
            v.depth_50.size(),
            v.coverage.size(),
            v.mask.size(),
            v.orientation_2d.size(),
            v.orientation_3d.size(),
        ];
        if let Some(size) = sizes.iter().find(|s| **s != want) {
            return fault(format!(
                "truth of camera {}: a map is {}x{} but the camera {}x{}",
                camera.name, size.0, size.1, want.0, want.1
            ));
        }
        for (i, &hair) in v.mask.data.iter().enumerate() {
            if hair != v.depth_50.get_index(i).is_some() {
                return fault(format!(
                    "truth of camera {}, pixel ({}, {}): mask and depth at 50 % coverage disagree",
                    camera.name,
                    i % want.0,
                    i / want.0
                ));
            }
            let (first, at_05) = (v.depth_first.get_index(i), v.depth_05.get_index(i));
            let lines = v.orientation_3d.data[i].is_finite() && !v.orientation_2d.data[i].is_infinite();
            if hair && (first.is_none() || at_05.is_none() || !lines) {
                return fault(format!(
                    "truth of camera {}, pixel ({}, {}): hair without a first depth or with a direction that is \
                     not finite",
                    camera.name,
                    i % want.0,
                    i / want.0
                ));
            }
        }
    }
    t.strands.validate().map_err(|e| ScoreError::Input(format!("true strands: {e}")))?;
    visibility(&t.strands, &t.visibility, cameras)
}

fn visibility(strands: &StrandSet, v: &Visibility, cameras: usize) -> Result<(), ScoreError> {
    if v.offsets.len() != strands.len() + 1
        || v.offsets.first() != Some(&0)
        || v.offsets.last().map(|&n| n as usize) != Some(v.seen_by.len())
    {
        return fault(format!(
            "visibility: {} offsets and {} samples do not fit {} strands",
            v.offsets.len(),
            v.seen_by.len(),
            strands.len()
        ));
    }
    let mismatch = |i: usize| {
        let (got, want) =
            (v.offsets[i + 1].checked_sub(v.offsets[i]), Visibility::samples_on(strands.length_mm(i)));
        (got.map(|n| n as usize) != Some(want)).then_some((i, got, want))
    };
    if let Some((i, got, want)) = (0..strands.len()).into_par_iter().find_map_first(mismatch) {
        return fault(format!("visibility: strand {i} has {got:?} samples where its length asks for {want}"));
    }
    if let Some(i) = v.seen_by.iter().position(|&s| cameras < 32 && s >> cameras != 0) {
        return fault(format!("visibility: sample {i} is seen by a camera beyond the {cameras} there are"));
    }
    Ok(())
}

pub(crate) fn estimate(t: &Truth, e: &Estimate) -> Result<(), ScoreError> {
    let want = t.views[0].mask.size();
    let sizes = [
        ("depth map", e.depth.as_ref().map(|m| m.size())),
        ("orientation map", e.orientation.as_ref().map(|m| m.re.size())),
        ("orientation map", e.orientation.as_ref().map(|m| m.im.size())),
        ("3-D orientation map", e.orientation_3d.as_ref().map(|m| m.size())),
    ];
    for (what, size) in sizes {
        if let Some((w, h)) = size.filter(|s| *s != want) {
            return fault(format!(
                "the estimate's {what} is {w}x{h} but the reference camera {}x{}; give one value a pixel",
                want.0, want.1
            ));
        }
    }
    let place = |i: usize| format!("pixel ({}, {})", i % want.0, i / want.0);
    if let Some(o) = &e.orientation
        && let Some(i) =
            (0..o.re.data.len()).find(|&i| !(o.re.data[i].is_finite() && o.im.data[i].is_finite()))
    {
        return fault(format!(
            "the estimate's orientation map is not finite at {}; zero means absent",
            place(i)
        ));
    }
    if let Some(o) = &e.orientation_3d
        && let Some(i) = o.data.iter().position(|v| !v.is_finite())
    {
        return fault(format!(
            "the estimate's 3-D orientation is not finite at {}; zero means absent",
            place(i)
        ));
    }
    if let Some(mesh) = &e.envelope {
        mesh.validate().map_err(|m| ScoreError::Input(format!("the estimate's envelope: {m}")))?;
    }
    if let Some(strands) = &e.strands {
        strands.validate().map_err(|m| ScoreError::Input(format!("the estimate's strands: {m}")))?;
    }
    e.validate_strand_ids().map_err(|m| ScoreError::Input(format!("the estimate's strands: {m}")))?;
    Ok(())
}
