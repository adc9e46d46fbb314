//! Prints a table of the minimisers on a made-up stereo problem of 640 x 480 pixels and 128 labels:
//! `table [largest data cost] [largest weight] [slow]`; with `slow`, the graph cut moves too (minutes).

#[path = "../benches/minimisers/surface.rs"]
mod surface;

use std::time::Instant;

use strandbench_solve::{
    CoarseToFineOptions, MoveOptions, Solution, SolveError, TrwsOptions, alpha_beta_swap, alpha_expansion,
    coarse_to_fine, icm, trws, winner_take_all,
};
use surface::{Surface, surface};

/// CPU seconds of the process so far, in steps of 10 ms; 0 where the system has no such file.
fn cpu_s() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    stat.split_whitespace().skip(13).take(2).filter_map(|f| f.parse::<f64>().ok()).sum::<f64>() / 100.0
}

fn row(
    name: &str,
    s: &Surface,
    bound: f64,
    solve: impl FnOnce() -> Result<Solution, SolveError>,
) -> Result<Solution, SolveError> {
    let (wall, cpu) = (Instant::now(), cpu_s());
    let r = solve()?;
    let (wall, cpu) = (wall.elapsed().as_secs_f64(), cpu_s() - cpu);
    let active = (0..s.active.len()).filter(|&p| s.active[p]);
    let mut off: Vec<f32> = active.map(|p| (f32::from(r.labels[p]) - s.truth[p]).abs()).collect();
    off.sort_by(f32::total_cmp);
    let own = r.lower_bound.unwrap_or(f64::NAN);
    let gap = |b: f64| 100.0 * (r.energy - b) / b;
    println!(
        "{name:26} {cpu:8.2} {wall:8.2} {:12.0} {own:12.0} {:9.3} {:9.3} {:7.2} {:7.2}",
        r.energy,
        gap(own),
        gap(bound),
        off[off.len() / 2],
        off[off.len() * 9 / 10]
    );
    Ok(r)
}

fn main() -> Result<(), SolveError> {
    let numbers: Vec<f32> = std::env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    let slow = std::env::args().any(|a| a == "slow");
    let contrast = numbers.first().copied().unwrap_or(30.0);
    let lambda = numbers.get(1).copied().unwrap_or(0.3);
    let s = surface(640, 480, 128, contrast, lambda, 1);
    let problem = s.problem();
    let go = || false;
    println!(
        "{} active pixels, {} threads, data costs to {contrast}, weights to {lambda}",
        s.active.iter().filter(|&&a| a).count(),
        rayon::current_num_threads()
    );
    println!(
        "{:26} {:>8} {:>8} {:>12} {:>12} {:>9} {:>9} {:>7} {:>7}",
        "method", "CPU s", "wall s", "energy", "bound", "gap %", "to best", "median", "p90"
    );
    let options = TrwsOptions { iterations: 30, gap: 0.0 };
    let best = row("TRW-S, 30 sweeps", &s, f64::NAN, || trws(&problem, &options, &go))?;
    let bound = best.lower_bound.unwrap_or(f64::NAN);
    for iterations in [1, 5] {
        let options = TrwsOptions { iterations, gap: 0.0 };
        row(&format!("TRW-S, {iterations} sweeps"), &s, bound, || trws(&problem, &options, &go))?;
    }
    for (coarse_iterations, fine_iterations) in [(2, 1), (3, 1), (3, 2), (3, 3)] {
        let options =
            CoarseToFineOptions { coarse_iterations, fine_iterations, ..CoarseToFineOptions::default() };
        let name = format!("coarse-to-fine, {coarse_iterations} + {fine_iterations}");
        row(&name, &s, bound, || coarse_to_fine(&problem, &options, &go))?;
    }
    let start = row("winner takes all", &s, bound, || winner_take_all(&problem))?.labels;
    row("ICM", &s, bound, || icm(&problem, &start, 100, &go))?;
    if slow {
        let options = MoveOptions { cycles: 1, start: None };
        row("expansion, 1 cycle", &s, bound, || alpha_expansion(&problem, &options, &go))?;
        row("expansion", &s, bound, || alpha_expansion(&problem, &MoveOptions::default(), &go))?;
        row("swap, 1 cycle", &s, bound, || alpha_beta_swap(&problem, &options, &go))?;
    }
    Ok(())
}
