//! Every minimiser against exhaustive search on tiny grids, and against the exact cut on larger ones.

use strandbench_rng::Rng;
use strandbench_solve::*;

#[path = "../benches/minimisers/surface.rs"]
#[allow(dead_code)]
mod surface;
use surface::{Surface, surface};

fn never() -> bool {
    false
}

/// Random costs in whole steps of 1/4, random weights, some of them 0, and about `share` active pixels.
fn random(width: usize, height: usize, labels: usize, share: f32, strength: f32, seed: u64) -> Surface {
    let n = width * height;
    let mut rng = Rng::keyed(&[seed, 77]);
    let weights = |rng: &mut Rng| -> Vec<f32> {
        (0..n)
            .map(|_| if rng.f32() < 0.15 { 0.0 } else { strength * (1 + rng.below(8)) as f32 / 8.0 })
            .collect()
    };
    Surface {
        width,
        height,
        labels,
        weight_right: weights(&mut rng),
        weight_down: weights(&mut rng),
        unary: (0..n * labels).map(|_| rng.below(81) as f32 / 4.0 - 10.0).collect(),
        active: (0..n).map(|_| rng.f32() < share).collect(),
        truth: vec![0.0; n],
    }
}

/// Least energy of all labellings, by trying them all.
fn exhaustive(problem: &GridProblem<'_>) -> f64 {
    let pixels: Vec<usize> = (0..problem.active.len()).filter(|&p| problem.active[p]).collect();
    let mut labels = vec![0u16; problem.active.len()];
    let mut best = f64::INFINITY;
    fn descend(problem: &GridProblem<'_>, left: &[usize], labels: &mut Vec<u16>, sum: f64, best: &mut f64) {
        let Some((&p, left)) = left.split_first() else {
            *best = best.min(sum);
            return;
        };
        for l in 0..problem.labels as u16 {
            labels[p] = l;
            let square = |q: usize| (f64::from(l) - f64::from(labels[q])).powi(2);
            let mut sum = sum + f64::from(problem.unary[p * problem.labels + usize::from(l)]);
            if p % problem.width > 0 && problem.active[p - 1] {
                sum += f64::from(problem.weight_right[p - 1]) * square(p - 1);
            }
            if p >= problem.width && problem.active[p - problem.width] {
                let q = p - problem.width;
                sum += f64::from(problem.weight_down[q]) * square(q);
            }
            descend(problem, left, labels, sum, best);
        }
    }
    descend(problem, &pixels, &mut labels, 0.0, &mut best);
    best
}

/// All that must hold of a solution whatever the method.
fn check(problem: &GridProblem<'_>, s: &Solution, optimum: f64, name: &str) {
    let close = 1e-9 * (1.0 + optimum.abs());
    assert_eq!(s.labels.len(), problem.active.len(), "{name}");
    for (p, &l) in s.labels.iter().enumerate() {
        assert!(usize::from(l) < problem.labels && (problem.active[p] || l == 0), "{name}: {l} at pixel {p}");
    }
    assert!((s.energy - problem.energy(&s.labels)).abs() <= close, "{name}: the energy is not the labels'");
    assert!(s.energy >= optimum - close, "{name}: {} is below the optimum {optimum}", s.energy);
    if let Some(bound) = s.lower_bound {
        assert!(bound <= optimum + close, "{name}: bound {bound} is above the optimum {optimum}");
    }
    let energies: Vec<f64> = s.history.iter().map(|h| h.1).collect();
    assert!(energies.windows(2).all(|e| e[1] <= e[0]), "{name}: the energy rose: {energies:?}");
    assert!(s.history.windows(2).all(|h| h[1].0 >= h[0].0 && h[1].2 >= h[0].2), "{name}: time or bound fell");
}

fn solve_all(problem: &GridProblem<'_>) -> Vec<(&'static str, Solution)> {
    let wta = winner_take_all(problem).expect("wta");
    let start = wta.labels.clone();
    vec![
        ("wta", wta),
        ("icm", icm(problem, &start, 50, &never).expect("icm")),
        ("trws", trws(problem, &TrwsOptions { iterations: 200, gap: 1e-6 }, &never).expect("trws")),
        ("coarse", coarse_to_fine(problem, &CoarseToFineOptions::default(), &never).expect("coarse")),
        ("expansion", alpha_expansion(problem, &MoveOptions::default(), &never).expect("expansion")),
        ("swap", alpha_beta_swap(problem, &MoveOptions::default(), &never).expect("swap")),
        ("exact", exact(problem, &never).expect("exact")),
    ]
}

#[test]
fn against_exhaustive_search() {
    let mut hits = std::collections::BTreeMap::<&str, usize>::new();
    let cases = 24;
    for seed in 0..cases {
        let (width, height) = [(3, 3), (9, 1), (1, 9), (4, 2)][seed as usize % 4];
        let labels = 2 + seed as usize % 3;
        let strength = [0.5, 2.0, 8.0][seed as usize / 4 % 3];
        let s = random(width, height, labels, if seed < 8 { 1.0 } else { 0.8 }, strength, seed);
        let problem = s.problem();
        let optimum = exhaustive(&problem);
        for (name, solution) in solve_all(&problem) {
            check(&problem, &solution, optimum, name);
            if (solution.energy - optimum).abs() < 1e-9 * (1.0 + optimum.abs()) {
                *hits.entry(name).or_default() += 1;
            }
        }
    }
    assert_eq!(hits["exact"], cases as usize, "the exact cut is not exact: {hits:?}");
    // Trees (grids of one row) are solved by message passing; loops nearly always.
    assert!(hits["trws"] >= cases as usize - 3, "{hits:?}");
    assert!(hits["swap"] >= cases as usize - 4 && hits["expansion"] >= cases as usize - 4, "{hits:?}");
}

#[test]
fn message_passing_is_exact_on_chains() {
    for seed in 0..6 {
        for (width, height) in [(60, 1), (1, 60)] {
            let s = random(width, height, 21, 0.95, 1.0, seed);
            let problem = s.problem();
            let optimum = exact(&problem, &never).expect("small").energy;
            let one = trws(&problem, &TrwsOptions { iterations: 1, gap: 0.0 }, &never).expect("legal");
            assert!((one.energy - optimum).abs() < 1e-9 * optimum.abs(), "{} of {optimum}", one.energy);
            let gap = optimum - one.lower_bound.expect("trws has a bound");
            assert!((0.0..1e-4 * optimum.abs()).contains(&gap), "the bound is not tight on a tree: {gap}");
        }
    }
}

#[test]
fn against_the_exact_cut_on_middling_problems() {
    for seed in 0..3u64 {
        for s in [random(14, 11, 12, 0.85, 1.5, seed), surface(24, 20, 14, 20.0, 1.0, seed)] {
            let problem = s.problem();
            let optimum = exact(&problem, &never).expect("fits");
            let proof = optimum.lower_bound.expect("the flow");
            assert!(
                (optimum.energy - proof) < 1e-6 * (1.0 + optimum.energy.abs()),
                "{} {proof}",
                optimum.energy
            );
            for (name, solution) in solve_all(&problem) {
                check(&problem, &solution, optimum.energy, name);
            }
        }
    }
}

#[test]
fn message_passing_closes_the_gap_on_a_surface() {
    let s = surface(80, 60, 40, 20.0, 1.0, 5);
    let problem = s.problem();
    let wta = winner_take_all(&problem).expect("legal");
    let long = trws(&problem, &TrwsOptions { iterations: 60, gap: 0.0 }, &never).expect("legal");
    let coarse = coarse_to_fine(&problem, &CoarseToFineOptions::default(), &never).expect("legal");
    let cuts = alpha_expansion(&problem, &MoveOptions { cycles: 2, start: None }, &never).expect("legal");
    let bound = long.lower_bound.expect("trws has a bound");
    let gap = |s: &Solution| (s.energy - bound) / bound;
    assert!(gap(&long) < 0.005, "trws {}", gap(&long));
    assert!(gap(&coarse) < 0.01, "coarse to fine {}", gap(&coarse));
    assert!(coarse.energy <= cuts.energy, "expansion {} beats {}", cuts.energy, coarse.energy);
    assert!(gap(&wta) > 1.0, "the problem is too easy to tell anything: {}", gap(&wta));
    let own = coarse.lower_bound.expect("coarse to fine has a bound");
    assert!(own <= bound * 1.0001 && own > 0.98 * bound, "{own} against {bound}");
}

#[test]
fn same_bits_with_one_and_two_threads() {
    // Wide enough for diagonals to be split among tasks.
    let s = surface(320, 200, 128, 20.0, 0.5, 9);
    let problem = s.problem();
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| {
            let a = trws(&problem, &TrwsOptions { iterations: 2, gap: 0.0 }, &never).expect("legal");
            let o = CoarseToFineOptions { levels: 2, ..CoarseToFineOptions::default() };
            let b = coarse_to_fine(&problem, &o, &never).expect("legal");
            [a, b].map(|s| (s.labels, s.energy.to_bits(), s.lower_bound.map(f64::to_bits)))
        })
    };
    assert!(run(1) == run(2), "the answer depends on the number of threads");
}

#[test]
fn degenerate_problems() {
    for (width, height, labels) in [(1, 1, 1), (5, 4, 1), (1, 7, 3), (7, 1, 130), (2, 2, 2), (33, 3, 17)] {
        for (share, strength) in [(1.0, 0.0), (0.0, 1.0), (0.9, 1e24), (0.7, 1e-30), (1.0, 0.3)] {
            let s = random(width, height, labels, share, strength, 3);
            let problem = s.problem();
            let mut solutions = solve_all(&problem);
            let optimum = solutions.pop().expect("exact is the last").1.energy;
            for (name, solution) in solutions {
                check(&problem, &solution, optimum, name);
                assert!(solution.energy.is_finite(), "{name}");
                if strength < 1e-20 || share == 0.0 || labels == 1 {
                    let off = (solution.energy - optimum).abs();
                    assert!(off <= 1e-9 * (1.0 + optimum.abs()), "{name}: off by {off} without smoothness");
                }
            }
        }
    }
}

#[test]
fn coordinate_descent_ends_where_no_single_pixel_gains() {
    let s = random(9, 8, 10, 0.9, 1.0, 4);
    let problem = s.problem();
    let start = vec![5; 72];
    let r = icm(&problem, &start, 100, &never).expect("legal");
    for p in (0..72).filter(|&p| problem.active[p]) {
        for l in 0..10 {
            let mut other = r.labels.clone();
            other[p] = l;
            assert!(problem.energy(&other) >= r.energy - 1e-9, "pixel {p} gains with label {l}");
        }
    }
}

/// Best energy of a single expansion of `alpha` from `start`, by trying all subsets.
fn best_expansion(problem: &GridProblem<'_>, start: &[u16], alpha: u16) -> f64 {
    (0u32..1 << start.len())
        .map(|m| {
            let l: Vec<u16> =
                start.iter().enumerate().map(|(p, &l)| if m >> p & 1 == 1 { alpha } else { l }).collect();
            problem.energy(&l)
        })
        .fold(f64::INFINITY, f64::min)
}

#[test]
fn expansions_of_outer_labels_are_the_best_of_their_kind() {
    // Label 0 is never between two others, so the first move is not truncated and must be optimal.
    for seed in 0..40 {
        let labels = 2 + seed as usize % 4;
        let s = random(4, 3, labels, 1.0, 0.5, seed);
        let problem = s.problem();
        let start: Vec<u16> = (0..12).map(|p| Rng::keyed(&[seed, p]).below(labels as u64) as u16).collect();
        let options = MoveOptions { cycles: 1, start: Some(start.clone()) };
        let got = alpha_expansion(&problem, &options, &never).expect("legal").energy;
        let first = best_expansion(&problem, &start, 0);
        assert!(got <= first + 1e-9, "{got} is worse than the first move alone, {first}");
        let exact = exact(&problem, &never).expect("small").energy;
        assert!(labels > 2 || (got - exact).abs() < 1e-9, "two labels, one cut: {got} {exact}");
    }
}

#[test]
fn bad_input_is_an_error_that_names_the_place() {
    let good = random(4, 3, 5, 1.0, 1.0, 1);
    let refused = |s: &Surface| {
        let problem = s.problem();
        let e = trws(&problem, &TrwsOptions::default(), &never).expect_err("trws takes it");
        let (moves, coarse) = (MoveOptions::default(), CoarseToFineOptions::default());
        // By their texts, as NaN differs from itself.
        for other in [
            winner_take_all(&problem),
            exact(&problem, &never),
            alpha_expansion(&problem, &moves, &never),
            alpha_beta_swap(&problem, &moves, &never),
            coarse_to_fine(&problem, &coarse, &never),
            icm(&problem, &[0; 12], 1, &never),
        ] {
            assert_eq!(other.expect_err("taken by another").to_string(), e.to_string());
        }
        e
    };
    let clone = || random(4, 3, 5, 1.0, 1.0, 1);
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 2e25] {
        let mut s = clone();
        s.unary[(2 * 4 + 1) * 5 + 3] = value;
        let SolveError::Unary { x: 1, y: 2, label: 3, value: v } = refused(&s) else { panic!("{value}") };
        assert_eq!(v.to_bits(), value.to_bits());
    }
    for value in [f32::NAN, f32::INFINITY, -1e-9] {
        let mut s = clone();
        s.weight_down[2] = value;
        assert!(refused(&s).to_string().starts_with("`weight_down` at pixel (2, 0)"));
        let mut s = clone();
        s.weight_right[4] = value;
        assert!(refused(&s).to_string().starts_with("`weight_right` at pixel (0, 1)"));
        // Weights beyond the border, and anything at pixels that do not take part, are not looked at.
        let mut s = clone();
        s.weight_right[3] = value;
        s.weight_down[11] = value;
        s.active[0] = false;
        s.unary[2] = value;
        assert!(trws(&s.problem(), &TrwsOptions::default(), &never).is_ok());
    }
    let mut s = clone();
    s.unary.pop();
    assert_eq!(refused(&s), SolveError::Length { array: "unary", len: 59, want: 60 });
    let mut s = clone();
    s.active.push(true);
    assert_eq!(refused(&s), SolveError::Length { array: "active", len: 13, want: 12 });
    for (width, height, labels) in
        [(0, 3, 5), (4, 0, 5), (4, 3, 0), (4, 3, 65_536), (usize::MAX, 3, 5), (1 << 20, 1 << 20, 5)]
    {
        let s = Surface { width, height, labels, ..clone() };
        assert_eq!(refused(&s), SolveError::Size { width, height, labels });
    }
    let start = |start: Vec<u16>| {
        let a = icm(&good.problem(), &start, 1, &never).expect_err("icm takes it");
        let o = MoveOptions { cycles: 1, start: Some(start) };
        assert_eq!(alpha_expansion(&good.problem(), &o, &never).expect_err("expansion takes it"), a);
        a
    };
    assert_eq!(start(vec![0; 11]), SolveError::Start { index: 11, len: 11, label: 0, max: 4 });
    let mut bad = vec![0; 12];
    bad[7] = 5;
    assert_eq!(start(bad), SolveError::Start { index: 7, len: 12, label: 5, max: 4 });
    let big = random(40, 40, 200, 1.0, 1.0, 1);
    assert!(matches!(exact(&big.problem(), &never), Err(SolveError::TooLarge { method: "exact", .. })));
}

#[test]
fn stops_when_asked() {
    let s = random(9, 9, 6, 1.0, 1.0, 2);
    let problem = s.problem();
    let now = || true;
    assert_eq!(trws(&problem, &TrwsOptions::default(), &now), Err(SolveError::Cancelled));
    assert_eq!(coarse_to_fine(&problem, &CoarseToFineOptions::default(), &now), Err(SolveError::Cancelled));
    assert_eq!(alpha_expansion(&problem, &MoveOptions::default(), &now), Err(SolveError::Cancelled));
    assert_eq!(alpha_beta_swap(&problem, &MoveOptions::default(), &now), Err(SolveError::Cancelled));
    assert_eq!(icm(&problem, &[0; 81], 5, &now), Err(SolveError::Cancelled));
}
