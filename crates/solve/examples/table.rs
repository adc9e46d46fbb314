//! Prints the table of minimisers on a synthetic surface: method, seconds, energy, bound, gap, label error.

#[path = "../benches/minimisers/surface.rs"]
mod surface;

use strandbench_solve::*;
use surface::*;

/// CPU seconds of the process so far, to 10 ms, where the system tells.
fn cpu_s() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields: Vec<f64> = stat.split_whitespace().skip(13).take(2).filter_map(|f| f.parse().ok()).collect();
    fields.iter().sum::<f64>() / 100.0
}

fn main() {
    let arg: Vec<f32> = std::env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    let (contrast, lambda) = (arg.first().copied().unwrap_or(30.0), arg.get(1).copied().unwrap_or(0.3));
    let s = surface(640, 480, 128, contrast, lambda, 1);
    let problem = s.problem();
    let active = s.active.iter().filter(|&&a| a).count();
    println!("active {} ({:.3})", active, active as f32 / s.active.len() as f32);
    let report = |name: &str, t: f64, r: Solution| {
        let secs = cpu_s() - t;
        let mut e: Vec<f32> = (0..s.active.len())
            .filter(|&p| s.active[p])
            .map(|p| (r.labels[p] as f32 - s.truth[p]).abs())
            .collect();
        e.sort_by(f32::total_cmp);
        let b = r.lower_bound.unwrap_or(f64::NAN);
        println!(
            "{name:28} {secs:7.2} s  energy {:12.0} bound {b:12.0} gap {:6.2} %  err {:.2} p90 {:.2}",
            r.energy,
            100.0 * (r.energy - b) / b,
            e[e.len() / 2],
            e[e.len() * 9 / 10]
        );
    };
    if std::env::args().any(|a| a == "sweep") {
        for it in [1, 4] {
            let mut best = f64::INFINITY;
            for _ in 0..5 {
                let t = cpu_s();
                trws(&problem, &TrwsOptions { iterations: it, gap: 0.0 }, &|| false).unwrap();
                best = best.min(cpu_s() - t);
            }
            println!("{it} iterations: {best:.3} s");
        }
        return;
    }
    let t = cpu_s();
    report("wta", t, winner_take_all(&problem).unwrap());
    for (c, f, l) in [(4, 1, 4), (4, 2, 4), (4, 3, 4), (8, 3, 4), (8, 3, 2), (4, 6, 4)] {
        let t = cpu_s();
        let o =
            CoarseToFineOptions { levels: l, coarse_iterations: c, fine_iterations: f, ..Default::default() };
        report(
            &format!("ctf levels {l} coarse {c} fine {f}"),
            t,
            coarse_to_fine(&problem, &o, &|| false).unwrap(),
        );
    }
    for i in [1, 5, 20] {
        let t = cpu_s();
        report(
            &format!("trws {i}"),
            t,
            trws(&problem, &TrwsOptions { iterations: i, gap: 0.0 }, &|| false).unwrap(),
        );
    }
}
