use super::*;
use strandbench_rng::Rng;

/// Costs, weights and a labelling in quarters, so that energies are exact.
struct Random {
    unary: Vec<f32>,
    /// Of the edges to the right, then of those down.
    weights: Vec<f32>,
    start: Vec<u16>,
}

fn random(key: &[u64], n: usize, labels: usize) -> Random {
    let mut rng = Rng::keyed(key);
    Random {
        unary: (0..n * labels).map(|_| rng.below(200) as f32 / 4.0).collect(),
        weights: (0..2 * n).map(|_| rng.below(9) as f32 / 4.0).collect(),
        start: (0..n).map(|_| rng.below(labels as u64) as u16).collect(),
    }
}

fn problem<'a>(
    width: usize,
    labels: usize,
    unary: &'a [f32],
    weights: &'a [f32],
    active: &'a [bool],
) -> GridProblem<'a> {
    let n = active.len();
    let (weight_right, weight_down) = weights.split_at(n);
    GridProblem { width, height: n / width, labels, unary, weight_right, weight_down, active }
}

#[test]
fn a_move_that_needs_no_truncation_is_the_best_of_all_subsets() {
    let (width, height, labels) = (4, 3, 5);
    let n = width * height;
    let active = vec![true; n];
    for seed in 0..30 {
        let Random { unary, weights, start } = random(&[seed, 5], n, labels);
        let problem = problem(width, labels, &unary, &weights, &active);
        // Expansions of the outermost labels, and a swap.
        let moves: [&dyn Fn(u16) -> (u16, u16); 3] =
            [&|l| (l, 0), &|l| (l, 4), &|l| if l == 1 || l == 3 { (1, 3) } else { (l, l) }];
        for (kind, choice) in moves.iter().enumerate() {
            let options = MoveOptions { cycles: 1, start: Some(start.clone()) };
            let mut search = Search::new(&problem, &options, &|| false).expect("legal");
            let pixels = search.pixels(|l| kind < 2 || l == 1 || l == 3);
            search.try_move(&pixels, choice).expect("nobody cancels");
            let of = |m: u32| -> Vec<u16> {
                let pick = |p: usize| if m >> p & 1 == 1 { choice(start[p]).1 } else { choice(start[p]).0 };
                (0..n).map(pick).collect()
            };
            let best = (0..1 << n).map(|m| problem.energy(&of(m))).fold(f64::INFINITY, f64::min);
            assert_eq!(search.energy, best, "seed {seed}, move {kind}");
        }
    }
}

#[test]
fn a_truncated_expansion_is_the_best_by_the_flattered_energy_and_never_raises_the_true_one() {
    let (width, height, labels) = (4, 3, 7);
    let n = width * height;
    let active = vec![true; n];
    let square = |a: u16, b: u16| (f64::from(a) - f64::from(b)).powi(2);
    let (mut truncated, mut refused) = (0, 0);
    for seed in 0..40 {
        let Random { unary, weights, start } = random(&[seed, 6], n, labels);
        let problem = problem(width, labels, &unary, &weights, &active);
        let alpha = 2 + (seed % 3) as u16;
        // Lowered by what keeping both ends of an edge costs more than α at either end in turn.
        let flattery = |m: u32| -> f64 {
            let keeps = |p: usize| m >> p & 1 == 0;
            let edge = |p: usize, q: usize, w: f32| {
                let (a, b) = (start[p], start[q]);
                let over = square(a, b) - square(a, alpha) - square(alpha, b);
                if keeps(p) && keeps(q) { f64::from(w) * over.max(0.0) } else { 0.0 }
            };
            let right = (0..n).filter(|p| p % width + 1 < width).map(|p| edge(p, p + 1, weights[p]));
            let down = (0..n - width).map(|p| edge(p, p + width, weights[n + p]));
            right.sum::<f64>() + down.sum::<f64>()
        };
        let of =
            |m: u32| -> Vec<u16> { (0..n).map(|p| if m >> p & 1 == 1 { alpha } else { start[p] }).collect() };
        let moves: Vec<(f64, f64)> = (0..1u32 << n)
            .map(|m| {
                let energy = problem.energy(&of(m));
                (energy - flattery(m), energy)
            })
            .collect();
        let least = moves.iter().map(|e| e.0).fold(f64::INFINITY, f64::min);
        let before = problem.energy(&start);
        let allowed: Vec<f64> = moves.iter().filter(|e| e.0 == least).map(|e| e.1.min(before)).collect();
        truncated += usize::from(flattery(0) > 0.0);
        refused += usize::from(allowed.iter().all(|&e| e == before));
        let options = MoveOptions { cycles: 1, start: Some(start.clone()) };
        let mut search = Search::new(&problem, &options, &|| false).expect("legal");
        let pixels = search.pixels(|l| l != alpha);
        search.try_move(&pixels, |l| (l, alpha)).expect("nobody cancels");
        assert!(allowed.contains(&search.energy), "seed {seed}: {} is none of {allowed:?}", search.energy);
    }
    assert!(truncated == 40 && refused < 20, "{truncated} truncated, {refused} left as they were");
}
