//! Cost volume, aggregation and energy against direct transcriptions of the paper's sums.

mod common;

use glam::DVec2;
use strandbench_recon::aggregate::Bilateral;
use strandbench_recon::cost::{Sampler, orientation_volume};
use strandbench_recon::depth::{DepthLabels, Epipolar};
use strandbench_recon::grid::{Grid, Volume};
use strandbench_recon::mrf::{Edges, minimise};
use strandbench_recon::ncc::{ImageSampler, ncc_volume};
use strandbench_recon::pyramid::{PyramidLevel, pyramid};
use strandbench_recon::{Minimiser, Parameters};
use strandbench_rng::Rng;
use strandbench_types::{OrientationField, Plane, Rig, Silent};

const SIZE: (u32, u32) = (40, 32);

struct Case {
    rig: Rig,
    pyramids: Vec<Vec<PyramidLevel>>,
    fields: Vec<Vec<OrientationField>>,
    grids: Vec<Grid>,
    depths: DepthLabels,
}

/// Random images, masks with holes and random fields: nothing that symmetry could hide.
fn case() -> Case {
    let rig = common::rig(SIZE, 90.0, 130.0);
    let (w, h) = (SIZE.0 as usize, SIZE.1 as usize);
    let mut pyramids = Vec::new();
    let mut fields = Vec::new();
    for c in 0..4u64 {
        let mut rng = Rng::keyed(&[5, c]);
        let image = Plane::from_vec(w, h, (0..w * h).map(|_| rng.f32()).collect());
        let inside = |i: usize, r: f32| i % w > 6 && i % w < 34 && i / w > 4 && r > 0.08;
        let mask = Plane::from_vec(w, h, (0..w * h).map(|i| inside(i, rng.f32())).collect());
        let levels = pyramid(&image, &mask, 2);
        fields.push(
            levels
                .iter()
                .map(|l| {
                    let (w, h) = l.image.size();
                    let mut plane = || {
                        Plane::from_vec(w, h, (0..w * h).map(|_| rng.range(-1.0, 1.0)).collect::<Vec<f32>>())
                    };
                    OrientationField { re: plane(), im: plane() }
                })
                .collect(),
        );
        pyramids.push(levels);
    }
    let grids = Grid::all(&pyramids[0]).unwrap();
    let depths = DepthLabels::new(&rig, 21);
    Case { rig, pyramids, fields, grids, depths }
}

fn guide(case: &Case, level: usize) -> Vec<(f32, f32)> {
    let (g, f) = (&case.grids[level], &case.fields[0][level]);
    g.cut(&f.re).into_iter().zip(g.cut(&f.im)).collect()
}

/// Value and share of hair at a position of a level, in f64. Values go on flat beyond the image's border; keyed
/// ones are zero outside the hair, which goes on likewise, while others count as no hair beyond the border.
fn sample(plane: &Plane<f32>, level: &PyramidLevel, x: f64, y: f64, keyed: bool) -> (f64, f64) {
    let (mut value, mut hair) = (0.0, 0.0);
    let (x0, y0) = ((x - 0.5).floor(), (y - 0.5).floor());
    for (i, j) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
        let (px, py) = (x0 + i, y0 + j);
        let weight = (1.0 - (x - 0.5 - px).abs()) * (1.0 - (y - 0.5 - py).abs());
        let inside = px >= 0.0 && py >= 0.0 && px < plane.width as f64 && py < plane.height as f64;
        let (cx, cy) = (px.clamp(0.0, plane.width as f64 - 1.0), py.clamp(0.0, plane.height as f64 - 1.0));
        let k = cy as usize * plane.width + cx as usize;
        let is_hair = (inside || keyed) && level.is_hair(k);
        hair += if is_hair { weight } else { 0.0 };
        if is_hair || !keyed {
            value += weight * f64::from(plane.data[k]);
        }
    }
    (value, hair)
}

/// Whether a position of a level lies in the image.
fn within(q: DVec2, level: usize) -> bool {
    let (w, h) = (f64::from(SIZE.0) / (1 << level) as f64, f64::from(SIZE.1) / (1 << level) as f64);
    q.x >= 0.0 && q.x <= w && q.y >= 0.0 && q.y <= h
}

#[test]
fn orientation_costs_are_equations_5_and_6() {
    let case = case();
    let absent = 0.25;
    for level in 0..2 {
        let (grid, own) = (&case.grids[level], guide(&case, level));
        let views: Vec<_> = (1..4)
            .map(|v| {
                let e = Epipolar::new(&case.rig.cameras[0], &case.rig.cameras[v]);
                (e, Sampler::new(&case.fields[v][level], &case.pyramids[v][level]))
            })
            .collect();
        let got = orientation_volume(grid, &own, &views, &case.depths, absent, &Silent).unwrap();
        let (mut partly, mut active, mut unseen) = (0, 0, 0);
        for i in 0..grid.pixels() {
            if !grid.active[i] {
                assert!(got.costs(i).iter().all(|c| *c == 0.0));
                continue;
            }
            active += 1;
            let (px, py) = grid.centre_px(i % grid.width, i / grid.width);
            for k in 0..21 {
                let p = case.rig.cameras[0].unproject(DVec2::new(px, py), case.depths.depth_mm(k as f64));
                let (mut want, mut seen) = (0.0, 0.0);
                for v in 1..4 {
                    let (q, _) = case.rig.cameras[v].project(p).unwrap();
                    let q = q / (1 << level) as f64;
                    if !within(q, level) {
                        unseen += 1;
                        continue;
                    }
                    seen += 1.0;
                    let (f, l) = (&case.fields[v][level], &case.pyramids[v][level]);
                    let (re, hair) = sample(&f.re, l, q.x, q.y, true);
                    let (im, _) = sample(&f.im, l, q.x, q.y, true);
                    want += -(f64::from(own[i].0) * re + f64::from(own[i].1) * im);
                    want += f64::from(absent) * (1.0 - hair);
                    partly += usize::from(hair > 0.01 && hair < 0.99);
                }
                let want = if seen > 0.0 { want * 3.0 / seen } else { 3.0 * f64::from(absent) };
                let got = f64::from(got.costs(i)[k]);
                assert!((got - want).abs() < 2e-4, "level {level}, pixel {i}, label {k}: {got} for {want}");
            }
        }
        assert!(active > 100 && partly > 1000, "{active} pixels, {partly} samples at rims");
        assert!(unseen > 20, "{unseen} samples outside a view");
    }
}

/// -NCC of windows summed over views, in f64, against the volume; how many windows had no partner.
fn compare_ncc(case: &Case, level: usize, radius: usize, tolerance: f64) -> usize {
    let absent = 0.5;
    let grid = &case.grids[level];
    let image = grid.cut(&case.pyramids[0][level].image);
    let views: Vec<_> = (1..4)
        .map(|v| {
            let e = Epipolar::new(&case.rig.cameras[0], &case.rig.cameras[v]);
            (e, ImageSampler::new(&case.pyramids[v][level]))
        })
        .collect();
    let got = ncc_volume(grid, &image, &views, &case.depths, radius, absent, &Silent).unwrap();
    let mut absents = 0;
    for i in (0..grid.pixels()).filter(|&i| grid.active[i]).step_by(7) {
        let (x, y) = (i % grid.width, i / grid.width);
        for k in (0..21).step_by(4) {
            let (mut want, mut risky, mut seen) = (0.0, false, 0.0);
            for v in 1..4 {
                let (px, py) = grid.centre_px(x, y);
                let p = case.rig.cameras[0].unproject(DVec2::new(px, py), case.depths.depth_mm(k as f64));
                if !within(case.rig.cameras[v].project(p).unwrap().0 / (1 << level) as f64, level) {
                    continue;
                }
                seen += 1.0;
                let (mut a, mut b, mut wanted) = (Vec::new(), Vec::new(), 0);
                for ny in y.saturating_sub(radius)..(y + radius + 1).min(grid.height) {
                    for nx in x.saturating_sub(radius)..(x + radius + 1).min(grid.width) {
                        let j = ny * grid.width + nx;
                        if !grid.active[j] {
                            continue;
                        }
                        wanted += 1;
                        let (px, py) = grid.centre_px(nx, ny);
                        let p =
                            case.rig.cameras[0].unproject(DVec2::new(px, py), case.depths.depth_mm(k as f64));
                        let (q, _) = case.rig.cameras[v].project(p).unwrap();
                        let q = q / (1 << level) as f64;
                        let l = &case.pyramids[v][level];
                        let (value, hair) = sample(&l.image, l, q.x, q.y, false);
                        risky |= (hair - 0.5).abs() < 1e-4;
                        if hair >= 0.5 {
                            a.push(f64::from(image[j]));
                            b.push(value);
                        }
                    }
                }
                if 2 * a.len() < wanted {
                    want += f64::from(absent);
                    absents += 1;
                    continue;
                }
                let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
                let (ma, mb) = (mean(&a), mean(&b));
                let dot = |p: &[f64], q: &[f64], mp: f64, mq: f64| {
                    p.iter().zip(q).map(|(s, t)| (s - mp) * (t - mq)).sum::<f64>()
                };
                want -= dot(&a, &b, ma, mb) / (dot(&a, &a, ma, ma) * dot(&b, &b, mb, mb)).sqrt();
            }
            let want = if seen > 0.0 { want * 3.0 / seen } else { 3.0 * f64::from(absent) };
            let got = f64::from(got.costs(i)[k]);
            assert!(
                risky || (got - want).abs() < tolerance,
                "level {level}, pixel {i}, label {k}: {got} for {want}"
            );
        }
    }
    absents
}

#[test]
fn correlation_costs_are_ncc_of_windows() {
    let case = case();
    let absents: usize =
        [(0, 2), (1, 2), (0, 3)].map(|(level, radius)| compare_ncc(&case, level, radius, 1e-3)).iter().sum();
    assert!(absents > 20, "{absents} windows that a mask excludes");
}

#[test]
fn faint_contrast_on_a_bright_ground_correlates_as_well() {
    let mut case = case();
    for level in case.pyramids.iter_mut().flatten() {
        level.image.data.iter_mut().for_each(|v| *v = 0.9 + 0.004 * *v);
    }
    compare_ncc(&case, 0, 2, 1e-2);
}

#[test]
fn a_flat_window_correlates_with_nothing() {
    let case = case();
    let grid = &case.grids[0];
    let flat = vec![0.3f32; grid.pixels()];
    let views: Vec<_> = (1..4)
        .map(|v| {
            let e = Epipolar::new(&case.rig.cameras[0], &case.rig.cameras[v]);
            (e, ImageSampler::new(&case.pyramids[v][0]))
        })
        .collect();
    let got = ncc_volume(grid, &flat, &views, &case.depths, 2, 0.5, &Silent).unwrap();
    let (mut zeros, mut absents) = (0, 0);
    for c in (0..grid.pixels()).filter(|&i| grid.active[i]).flat_map(|i| got.costs(i)) {
        // Each view costs nothing or, where it cannot have seen the window, 0.5.
        assert!((0.0..=1.5).contains(c), "{c}");
        zeros += usize::from(*c == 0.0);
        absents += usize::from(*c > 0.0);
    }
    assert!(zeros > 1000 && absents > 100, "{zeros} zeros, {absents} absent");
}

#[test]
fn aggregation_and_filter_are_equations_7_8_and_10() {
    let case = case();
    let p = Parameters { sigma_d: 0.7, sigma_p_px: 1.6, ..Parameters::LUO };
    for level in 0..2 {
        let (grid, own) = (&case.grids[level], guide(&case, level));
        let mut rng = Rng::keyed(&[8, level as u64]);
        // 37 labels: one block of vectors and a rest.
        let mut raw = Volume::zeros(grid, 37);
        raw.data.iter_mut().for_each(|v| *v = rng.range(-1.0, 1.0));
        let values: Vec<f32> = (0..grid.pixels()).map(|_| rng.range(0.0, 36.0)).collect();
        let bilateral = Bilateral::new(grid, &own, &p);
        let got = bilateral.aggregate(&raw, &Silent).unwrap();
        let smooth = bilateral.smooth(&values, &Silent).unwrap();
        let r = (2.0f64 * 1.6).ceil() as isize;
        for i in 0..grid.pixels() {
            if !grid.active[i] {
                assert!(got.costs(i).iter().all(|c| *c == 0.0) && smooth[i] == values[i]);
                continue;
            }
            let (x, y) = ((i % grid.width) as isize, (i / grid.width) as isize);
            let (mut z, mut sum, mut depth) = (0.0f64, vec![0.0f64; 37], 0.0f64);
            for dy in -r..=r {
                for dx in -r..=r {
                    let (u, v) = (x + dx, y + dy);
                    if u < 0 || v < 0 || u >= grid.width as isize || v >= grid.height as isize {
                        continue;
                    }
                    let j = v as usize * grid.width + u as usize;
                    if !grid.active[j] {
                        continue;
                    }
                    let d2 = f64::from(own[i].0 - own[j].0).powi(2) + f64::from(own[i].1 - own[j].1).powi(2);
                    let w = (-d2 / (2.0 * 0.7f64.powi(2))
                        - (dx * dx + dy * dy) as f64 / (2.0 * 1.6f64.powi(2)))
                    .exp();
                    z += w;
                    depth += w * f64::from(values[j]);
                    for (s, c) in sum.iter_mut().zip(raw.costs(j)) {
                        *s += w * f64::from(*c);
                    }
                }
            }
            for (k, s) in sum.iter().enumerate() {
                let got = f64::from(got.costs(i)[k]);
                assert!((got - s / z).abs() < 1e-5, "pixel {i}, label {k}: {got} for {}", s / z);
            }
            assert!((f64::from(smooth[i]) - depth / z).abs() < 1e-4);
        }
    }
}

#[test]
fn edges_join_neighbours_and_never_one_row_to_the_next() {
    let depths = DepthLabels::new(&common::rig(SIZE, 90.0, 130.0), 21);
    let mut grid = Grid { level: 0, origin: (0, 0), width: 3, height: 2, active: vec![true; 6] };
    let p = Parameters { lambda: 0.5, ..Parameters::LUO };
    let e = (depths.step_footprints() * depths.step_footprints()) as f32;
    let edges = Edges::new(&grid, &[(0.3, 0.1); 6], &depths, &p);
    assert_eq!(edges.right, [e, e, 0.0, e, e, 0.0]);
    assert_eq!(edges.down, [e, e, e, 0.0, 0.0, 0.0]);
    grid.active[1] = false;
    let edges = Edges::new(&grid, &[(0.3, 0.1); 6], &depths, &p);
    assert_eq!(edges.right, [0.0, 0.0, 0.0, e, e, 0.0]);
    assert_eq!(edges.down, [e, 0.0, e, 0.0, 0.0, 0.0]);
}

#[test]
fn reported_energy_is_equation_2() {
    let case = case();
    let (grid, own) = (&case.grids[0], guide(&case, 0));
    let p = Parameters { lambda: 0.003, sigma_o: 0.6, ..Parameters::LUO };
    let mut rng = Rng::keyed(&[11]);
    let mut volume = Volume::zeros(grid, 21);
    volume.data.iter_mut().for_each(|v| *v = rng.range(-1.0, 1.0));
    let edges = Edges::new(grid, &own, &case.depths, &p);
    for minimiser in
        [Minimiser::CoarseToFine, Minimiser::Trws, Minimiser::Expansion, Minimiser::WinnerTakesAll]
    {
        let s = minimise(grid, &volume, &edges, minimiser, &Silent).unwrap();
        // (2), (3), (4): each pixel sums over its four neighbours, so each edge counts twice.
        // A label in pixel footprints, z / f.
        let step = (960.0 - 760.0) / 20.0 / ((960.0f64 * 760.0).sqrt() / 90.0);
        let depth = |i: usize| f64::from(s.labels[i]) * step;
        let (mut data, mut smooth) = (0.0, 0.0);
        for i in (0..grid.pixels()).filter(|&i| grid.active[i]) {
            data += f64::from(volume.costs(i)[s.labels[i] as usize]);
            let (x, y) = ((i % grid.width) as isize, (i / grid.width) as isize);
            for (dx, dy) in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
                let (u, v) = (x + dx, y + dy);
                if u < 0 || v < 0 || u >= grid.width as isize || v >= grid.height as isize {
                    continue;
                }
                let j = v as usize * grid.width + u as usize;
                if grid.active[j] {
                    let d2 = f64::from(own[i].0 - own[j].0).powi(2) + f64::from(own[i].1 - own[j].1).powi(2);
                    smooth += (-d2 / (2.0 * 0.6 * 0.6)).exp() * (depth(i) - depth(j)).powi(2);
                }
            }
        }
        let want = data + 0.003 * smooth;
        assert!(
            smooth > 0.0 && (s.energy - want).abs() < 1e-4 * want.abs().max(1.0),
            "{} for {want}",
            s.energy
        );
        if let Some(bound) = s.lower_bound {
            assert!(bound <= s.energy + 1e-6, "bound {bound} above energy {}", s.energy);
        }
    }
}
