//! The pipeline is its tested parts in the paper's order: [`reconstruct`] against parts put together here, with
//! the sum over levels (Eq. 5) written out anew.

mod common;

use common::{Shape, Streaks};
use strandbench_recon::aggregate::Bilateral;
use strandbench_recon::cost::{Sampler, orientation_volume};
use strandbench_recon::depth::{DepthLabels, Epipolar};
use strandbench_recon::grid::{Grid, Volume};
use strandbench_recon::kernel::FilterBank;
use strandbench_recon::mrf::{Edges, minimise};
use strandbench_recon::ncc::{ImageSampler, ncc_volume};
use strandbench_recon::orientation::{Response, field, respond, unit_response};
use strandbench_recon::pyramid::{PyramidLevel, pyramid};
use strandbench_recon::refine::refine;
use strandbench_recon::{LUO, MatchCost, Variant, reconstruct};
use strandbench_types::{Frame, OrientationField, Rig, Silent};

type Changes = &'static [(&'static str, &'static str)];

struct Wanted {
    energy: f64,
    bound: Option<f64>,
    /// Indexed [pixel of the image]; NaN outside the hair.
    depth_mm: Vec<f64>,
    orientation: OrientationField,
}

/// Costs of the next coarser level at the centres of a grid's pixels: bilinear between coarse hair pixels, whose
/// weights sum to one.
fn add_coarser(fine: &mut Volume, grid: &Grid, coarse: &Volume, coarse_grid: &Grid) {
    let side = (1usize << coarse_grid.level) as f64;
    for i in (0..grid.pixels()).filter(|&i| grid.active[i]) {
        let (px, py) = grid.centre_px(i % grid.width, i / grid.width);
        let u = px / side - 0.5 - coarse_grid.origin.0 as f64;
        let v = py / side - 0.5 - coarse_grid.origin.1 as f64;
        let (mut total, mut sum) = (0.0, vec![0.0f64; fine.labels]);
        for y in 0..coarse_grid.height {
            for x in 0..coarse_grid.width {
                let w = (1.0 - (u - x as f64).abs()).max(0.0) * (1.0 - (v - y as f64).abs()).max(0.0);
                let j = y * coarse_grid.width + x;
                if w > 0.0 && coarse_grid.active[j] {
                    total += w;
                    sum.iter_mut().zip(coarse.costs(j)).for_each(|(s, c)| *s += w * f64::from(*c));
                }
            }
        }
        if total > 0.0 {
            let labels = fine.labels;
            let own = &mut fine.data[i * labels..(i + 1) * labels];
            own.iter_mut().zip(&sum).for_each(|(o, s)| *o += (s / total) as f32);
        }
    }
}

fn wanted(rig: &Rig, frame: &Frame, variant: &Variant, others: &[usize]) -> Wanted {
    let p = &variant.parameters;
    let bank = FilterBank::new(p.angles, p.sigma_px, p.sigma_wide_px);
    let levels_of = |c: usize| pyramid(&frame.images[c], &frame.masks[c], p.levels);
    let answers =
        |levels: &[PyramidLevel]| levels.iter().map(|l| respond(l, &bank)).collect::<Vec<Response>>();
    let own_levels = levels_of(0);
    let own_answers = answers(&own_levels);
    // One unit for all views and levels: that of the reference's finest level.
    let unit = unit_response(&own_answers[0], p.unit_quantile).unwrap();
    let own: Vec<OrientationField> = own_answers.iter().map(|r| field(r, unit, p.gamma)).collect();
    let grids = Grid::all(&own_levels).unwrap();
    let depths = DepthLabels::new(rig, p.labels);
    let guide = |l: usize| -> Vec<(f32, f32)> {
        grids[l].cut(&own[l].re).into_iter().zip(grids[l].cut(&own[l].im)).collect()
    };
    let views: Vec<(Epipolar, Vec<PyramidLevel>, Vec<OrientationField>)> = others
        .iter()
        .map(|&c| {
            let levels = levels_of(c);
            let fields = answers(&levels).iter().map(|r| field(r, unit, p.gamma)).collect();
            (Epipolar::new(&rig.cameras[0], &rig.cameras[c]), levels, fields)
        })
        .collect();

    let mut sum: Option<Volume> = None;
    for l in (0..p.levels).rev() {
        let (grid, guide) = (&grids[l], guide(l));
        let mut volume = match variant.cost {
            MatchCost::Orientation => {
                let at: Vec<_> = views.iter().map(|(e, v, f)| (*e, Sampler::new(&f[l], &v[l]))).collect();
                orientation_volume(grid, &guide, &at, &depths, p.absent_cost, &Silent).unwrap()
            }
            MatchCost::Ncc => {
                let at: Vec<_> = views.iter().map(|(e, v, _)| (*e, ImageSampler::new(&v[l]))).collect();
                let image = grid.cut(&own_levels[l].image);
                ncc_volume(grid, &image, &at, &depths, p.ncc_radius_px, p.absent_cost, &Silent).unwrap()
            }
        };
        if p.aggregate {
            volume = Bilateral::new(grid, &guide, p).aggregate(&volume, &Silent).unwrap();
        }
        if let Some(coarse) = &sum {
            add_coarser(&mut volume, grid, coarse, &grids[l + 1]);
        }
        sum = Some(volume);
    }
    let (grid, guide, volume) = (&grids[0], guide(0), sum.unwrap());
    let edges = Edges::new(grid, &guide, &depths, p);
    let solution = minimise(grid, &volume, &edges, variant.minimiser, &Silent).unwrap();
    let mut labels: Vec<f32> = solution.labels.iter().map(|&l| f32::from(l)).collect();
    if p.refine {
        labels = refine(&volume, &solution.labels, &grid.active);
    }
    if p.filter {
        labels = Bilateral::new(grid, &guide, p).smooth(&labels, &Silent).unwrap();
    }
    let mut depth_mm = vec![f64::NAN; frame.masks[0].data.len()];
    for i in (0..grid.pixels()).filter(|&i| grid.active[i]) {
        let (x, y) = (grid.origin.0 + i % grid.width, grid.origin.1 + i / grid.width);
        depth_mm[y * frame.masks[0].width + x] = depths.depth_mm(f64::from(labels[i]));
    }
    let orientation = own.into_iter().next().unwrap();
    Wanted { energy: solution.energy, bound: solution.lower_bound, depth_mm, orientation }
}

#[test]
fn the_pipeline_is_its_parts_in_the_papers_order() {
    let ball = Shape::Sphere { radius_mm: 80.0 };
    let rig = common::rig((80, 60), 260.0, 170.0);
    let mut frame = common::frame(&rig, ball, Streaks { seed: 5, width_mm: 4.0, wave_mm: 4.0 }, 2);
    // Views of unlike brightness and a mask with a hole: units and rims must be the right ones.
    for (c, gain) in [1.0, 0.6, 1.5, 0.8].into_iter().enumerate() {
        frame.images[c].data.iter_mut().for_each(|v| *v *= gain);
    }
    for y in 25..33 {
        for x in 38..45 {
            *frame.masks[0].at_mut(x, y) = false;
        }
    }
    let cases: [(Changes, &[usize]); 11] = [
        (&[], &[1, 2, 3]),
        (&[("levels", "1")], &[1, 2, 3]),
        (&[("views", "two")], &[1]),
        (&[("views", "0,2,3")], &[2, 3]),
        (&[("aggregate", "false")], &[1, 2, 3]),
        (&[("refine", "false"), ("filter", "false")], &[1, 2, 3]),
        (&[("filter", "false")], &[1, 2, 3]),
        (&[("minimiser", "winner-takes-all")], &[1, 2, 3]),
        (&[("minimiser", "trws"), ("gamma", "1")], &[1, 2, 3]),
        (&[("minimiser", "expansion"), ("absent_cost", "0")], &[1, 2, 3]),
        (&[("cost", "ncc"), ("ncc_radius_px", "3"), ("sigma_d", "0.8")], &[1, 2, 3]),
    ];
    for (changes, others) in cases {
        let base = LUO.with("labels", "24").unwrap().with("levels", "3").unwrap();
        let variant = changes.iter().fold(base, |v, (key, value)| v.with(key, value).unwrap());
        let want = wanted(&rig, &frame, &variant, others);
        let got = reconstruct(&rig, &frame, &variant, &Silent).unwrap();
        let d = &got.diagnostics;
        let close = |a: f64, b: f64| (a - b).abs() < 1e-5 * b.abs();
        assert!(close(d.energy, want.energy), "{changes:?}: energy {} for {}", d.energy, want.energy);
        match (d.lower_bound, want.bound) {
            (Some(a), Some(b)) => {
                assert!(close(a, b), "{changes:?}: bound {a} for {b}");
                assert!((d.gap.unwrap() - (d.energy - a) / a.abs()).abs() < 1e-9);
            }
            (a, b) => assert_eq!((a, d.gap), (b, None), "{changes:?}"),
        }
        assert_eq!(got.estimate.orientation.as_ref(), Some(&want.orientation), "{changes:?}");
        // Rounding may turn the choice between two labels that cost the same; no more than a few pixels.
        let depth = got.estimate.depth.unwrap();
        let (mut hair, mut off) = (0, 0);
        for (i, want) in want.depth_mm.iter().enumerate() {
            assert_eq!(depth.get_index(i).is_some(), want.is_finite(), "{changes:?}: pixel {i}");
            if let Some(z) = depth.get_index(i) {
                hair += 1;
                off += usize::from((f64::from(z) - want).abs() > 1e-3);
            }
        }
        println!("{changes:?}: {off} of {hair} pixels differ, energy {} for {}", d.energy, want.energy);
        assert!(hair > 1000 && off * 200 <= hair, "{changes:?}: {off} of {hair} pixels differ");
    }
}
