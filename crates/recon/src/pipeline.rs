//! The method from images to an envelope, stage by stage.

use crate::aggregate::Bilateral;
use crate::cost::{Sampler, orientation_volume};
use crate::depth::{DepthLabels, Epipolar};
use crate::grid::{Grid, Volume};
use crate::kernel::FilterBank;
use crate::ncc::{ImageSampler, ncc_volume};
use crate::orientation::{Response, field, respond, unit_response};
use crate::pyramid::{PyramidLevel, pyramid};
use crate::{Diagnostics, MatchCost, ReconError, Reconstruction, SequenceReconstructor, StageTime, Variant};
use crate::{envelope, mrf, refine};
use rayon::prelude::*;
use std::time::Instant;
use strandbench_types::{DepthMap, Estimate, Frame, Monitor, OrientationField, Plane, Rig};

/// Bytes that the cost volumes may take together.
const VOLUME_LIMIT: u64 = 8 << 30;

/// Smallest side of the coarsest pyramid level, pixels.
const SMALLEST_LEVEL_PX: u32 = 4;

/// Reconstructs one frame from images, masks and calibration alone.
///
/// # Errors
/// If the frame disagrees with the rig, the variant asks for cameras that the rig lacks or a parameter is out of
/// range, the reference mask is empty or its hair answers to no filter, the cost volume or the voxels would not
/// fit, strands are asked for and there is no surface or no seed, or the work is cancelled.
pub fn reconstruct(
    rig: &Rig,
    frame: &Frame,
    variant: &Variant,
    monitor: &dyn Monitor,
) -> Result<Reconstruction, ReconError> {
    if variant.strands.is_some() {
        let mut sequence = SequenceReconstructor::new(rig, variant)?;
        let mut out = sequence.push(frame, monitor)?;
        out.extend(sequence.finish(monitor)?);
        return out.pop().expect("a frame pushed comes out").outcome;
    }
    let stereo = stereo(rig, frame, variant, monitor)?;
    let Stereo { depth, orientation, mut diagnostics } = stereo;
    let mut clock = Clock { stages: std::mem::take(&mut diagnostics.stages), monitor };
    let (mesh, orientation_3d) = clock.stage("mesh", 1, || {
        let envelope = envelope::triangulate(&rig.cameras[0], &depth, variant.parameters.cut_mm);
        let lines = envelope::orientation_3d(&rig.cameras[0], &orientation, &envelope);
        Ok((envelope.mesh, lines))
    })?;
    diagnostics.stages = clock.stages;
    let estimate = Estimate {
        depth: Some(depth),
        envelope: Some(mesh),
        orientation: Some(orientation),
        orientation_3d: Some(orientation_3d),
        ..Estimate::default()
    };
    Ok(Reconstruction { estimate, diagnostics })
}

/// What one frame's images say: sections 4.3 and 4.4 up to Eq. 10.
#[derive(Clone, Debug)]
pub(crate) struct Stereo {
    pub depth: DepthMap,
    /// The reference view's field at the finest level.
    pub orientation: OrientationField,
    pub diagnostics: Diagnostics,
}

/// Depth map and orientation field of one frame.
pub(crate) fn stereo(
    rig: &Rig,
    frame: &Frame,
    variant: &Variant,
    monitor: &dyn Monitor,
) -> Result<Stereo, ReconError> {
    variant.validate()?;
    rig.validate().map_err(ReconError::Input)?;
    frame.validate(rig).map_err(ReconError::Input)?;
    let p = &variant.parameters;
    let others = variant.views.others(rig.cameras.len())?;
    let used: Vec<usize> = std::iter::once(0).chain(others.iter().copied()).collect();
    check_levels(rig, &used, p.levels)?;
    if !frame.masks[0].data.contains(&true) {
        return Err(ReconError::EmptyMask { camera: rig.cameras[0].name.clone(), frame: frame.index });
    }
    let mut clock = Clock { stages: Vec::new(), monitor };

    let pyramids: Vec<Vec<PyramidLevel>> = clock.stage("pyramid", used.len() as u64, || {
        let one = |&c: &usize| {
            monitor.check()?;
            let levels = pyramid(&frame.images[c], &frame.masks[c], p.levels);
            monitor.advance(1);
            Ok(levels)
        };
        used.par_iter().map(one).collect::<Result<_, ReconError>>()
    })?;
    let grids = Grid::all(&pyramids[0]).expect("the mask has hair");
    check_memory(&grids, p.labels)?;
    let fields = clock.stage("orientation", (used.len() * p.levels) as u64, || {
        orientation_fields(&pyramids, variant, &rig.cameras[0].name, monitor)
    })?;

    let depths = DepthLabels::new(rig, p.labels);
    let guides: Vec<Vec<(f32, f32)>> = grids.iter().zip(&fields[0]).map(|(g, f)| guide(g, f)).collect();
    let pairs: Vec<Epipolar> =
        others.iter().map(|&c| Epipolar::new(&rig.cameras[0], &rig.cameras[c])).collect();

    let mut sum: Option<(Volume, usize)> = None;
    for level in (0..p.levels).rev() {
        let grid = &grids[level];
        let views = if variant.cost == MatchCost::Ncc { others.len() } else { 1 };
        let raw = clock.stage("cost volume", (views * grid.height) as u64, || match variant.cost {
            MatchCost::Orientation => {
                let samplers = (1..used.len()).map(|v| Sampler::new(&fields[v][level], &pyramids[v][level]));
                let views: Vec<_> = pairs.iter().copied().zip(samplers).collect();
                orientation_volume(grid, &guides[level], &views, &depths, p.absent_cost, monitor)
            }
            MatchCost::Ncc => {
                let samplers = (1..used.len()).map(|v| ImageSampler::new(&pyramids[v][level]));
                let views: Vec<_> = pairs.iter().copied().zip(samplers).collect();
                let image = grid.cut(&pyramids[0][level].image);
                ncc_volume(grid, &image, &views, &depths, p.ncc_radius_px, p.absent_cost, monitor)
            }
        })?;
        let mut own = if p.aggregate {
            clock.stage("aggregation", grid.height as u64, || {
                Bilateral::new(grid, &guides[level], p).aggregate(&raw, monitor)
            })?
        } else {
            raw
        };
        if let Some((coarse, l)) = &sum {
            clock.stage("level sum", grid.height as u64, || {
                own.add_coarser(grid, coarse, &grids[*l], monitor)
            })?;
        }
        sum = Some((own, level));
    }
    let (volume, _) = sum.expect("there is at least one level");

    let grid = &grids[0];
    let solution = clock.stage("mrf", 1, || {
        let edges = mrf::Edges::new(grid, &guides[0], &depths, p);
        mrf::minimise(grid, &volume, &edges, variant.minimiser, monitor)
    })?;
    let labels = clock.stage("refinement", 1, || {
        let mut labels: Vec<f32> = if p.refine {
            refine::refine(&volume, &solution.labels, &grid.active)
        } else {
            solution.labels.iter().map(|&l| f32::from(l)).collect()
        };
        if p.filter {
            labels = Bilateral::new(grid, &guides[0], p).smooth(&labels, monitor)?;
        }
        Ok(labels)
    })?;
    drop(volume);

    let orientation = fields.into_iter().next().and_then(|f| f.into_iter().next()).expect("level 0");
    let depth = depth_map(rig, grid, &labels, &depths);

    let bound = solution.lower_bound;
    let parameters = variant.entries().into_iter().map(|(k, v)| (k.to_owned(), v)).collect();
    let diagnostics = Diagnostics {
        stages: clock.stages,
        energy: solution.energy,
        lower_bound: bound,
        gap: bound.map(|b| (solution.energy - b) / b.abs().max(f64::MIN_POSITIVE)),
        labels: p.labels,
        label_step_mm: depths.step_mm(),
        notes: Vec::new(),
        parameters,
    };
    Ok(Stereo { depth, orientation, diagnostics })
}

pub(crate) struct Clock<'a> {
    pub stages: Vec<StageTime>,
    pub monitor: &'a dyn Monitor,
}

impl Clock<'_> {
    /// Runs a stage; stages of one name add up.
    pub fn stage<T>(
        &mut self,
        name: &str,
        steps: u64,
        work: impl FnOnce() -> Result<T, ReconError>,
    ) -> Result<T, ReconError> {
        self.monitor.check()?;
        self.monitor.begin(name, steps);
        let start = Instant::now();
        let result = work()?;
        let wall_s = start.elapsed().as_secs_f64();
        match self.stages.iter_mut().find(|s| s.name == name) {
            Some(s) => s.wall_s += wall_s,
            None => self.stages.push(StageTime { name: name.to_owned(), wall_s }),
        }
        Ok(result)
    }
}

/// Fields of all views and levels, indexed [view][level], in one unit: that of the reference's finest level.
fn orientation_fields(
    pyramids: &[Vec<PyramidLevel>],
    variant: &Variant,
    reference: &str,
    monitor: &dyn Monitor,
) -> Result<Vec<Vec<OrientationField>>, ReconError> {
    let p = &variant.parameters;
    let bank = FilterBank::new(p.angles, p.sigma_px, p.sigma_wide_px);
    let one = |level: &PyramidLevel| {
        monitor.check()?;
        let response = respond(level, &bank);
        monitor.advance(1);
        Ok(response)
    };
    let responses: Vec<Vec<Response>> = pyramids
        .iter()
        .map(|levels| levels.iter().map(one).collect::<Result<_, ReconError>>())
        .collect::<Result<_, _>>()?;
    let unit = unit_response(&responses[0][0], p.unit_quantile)
        .ok_or_else(|| ReconError::NoResponse { camera: reference.to_owned() })?;
    Ok(responses.iter().map(|levels| levels.iter().map(|r| field(r, unit, p.gamma)).collect()).collect())
}

fn guide(grid: &Grid, field: &OrientationField) -> Vec<(f32, f32)> {
    grid.cut(&field.re).into_iter().zip(grid.cut(&field.im)).collect()
}

fn depth_map(rig: &Rig, grid: &Grid, labels: &[f32], depths: &DepthLabels) -> DepthMap {
    let (w, h) = (rig.cameras[0].width as usize, rig.cameras[0].height as usize);
    let mut raw = Plane::filled(w, h, f32::NAN);
    for (i, &label) in labels.iter().enumerate().filter(|(i, _)| grid.active[*i]) {
        let (x, y) = (grid.origin.0 + i % grid.width, grid.origin.1 + i / grid.width);
        *raw.at_mut(x, y) = depths.depth_mm(f64::from(label)) as f32;
    }
    DepthMap::from_raw(raw)
}

fn check_levels(rig: &Rig, used: &[usize], levels: usize) -> Result<(), ReconError> {
    for &c in used {
        let camera = &rig.cameras[c];
        let smallest = camera.width.min(camera.height);
        if smallest >> (levels - 1) < SMALLEST_LEVEL_PX {
            return Err(ReconError::Parameter {
                key: "levels".into(),
                value: levels.to_string(),
                wanted: format!(
                    "few enough levels that camera {} ({}x{}) keeps {SMALLEST_LEVEL_PX} pixels a side at the coarsest",
                    camera.name, camera.width, camera.height
                ),
            });
        }
    }
    Ok(())
}

fn check_memory(grids: &[Grid], labels: usize) -> Result<(), ReconError> {
    // The finest level is held twice, before and after aggregation; each coarser one while it is added.
    let cells = |g: &Grid| g.pixels() as u64 * labels as u64 * 4;
    let bytes = 2 * cells(&grids[0]) + grids.get(1).map_or(0, cells);
    if bytes > VOLUME_LIMIT {
        return Err(ReconError::TooLarge {
            width: grids[0].width,
            height: grids[0].height,
            labels,
            bytes,
            limit: VOLUME_LIMIT,
        });
    }
    Ok(())
}
