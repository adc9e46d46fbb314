//! How often 95 % intervals hold the true difference, and how often a test alarms where there is none:
//! `cargo run --release -p strandbench-stats --example coverage [DRAWS]` prints the table of `reports/statistics.md`.

#[path = "../tests/simulation/model.rs"]
mod model;

use model::{Model, scene_mm, within_variance};
use rayon::prelude::*;
use strandbench_stats::{Kind, Levels, Options, paired};

const TRUE_MM: f64 = 0.3;

fn main() {
    let draws: u64 = std::env::args().nth(1).map_or(2000, |n| n.parse().expect("a number of draws"));
    let within = within_variance();
    println!(
        "{draws} draws a line; one standard error of a coverage of 95 % is {:.2} %.\n",
        100.0 * (0.0475 / draws as f64).sqrt()
    );
    println!(
        "| scenes | share within scenes | scenes' effects | matched, expanded BCa | BCa | percentile | plain levels, expanded BCa | scenes alone, expanded BCa | A/A alarms |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for skewed in [false, true] {
        for scenes in [8, 20, 40] {
            for share in [0.1, 0.5, 0.9] {
                if skewed && share != 0.1 {
                    continue;
                }
                let model =
                    Model { scenes, skewed, scene_mm: scene_mm(share, within), difference_mm: TRUE_MM };
                let line: Vec<String> =
                    rates(&model, draws).iter().map(|r| format!("{:.1} %", 100.0 * r)).collect();
                let shape = if skewed { "exponential" } else { "normal" };
                println!("| {scenes} | {:.0} % | {shape} | {} |", share * 100.0, line.join(" | "));
            }
        }
    }
}

fn rates(model: &Model, draws: u64) -> [f64; 6] {
    let kinds = [
        (Kind::BcaExpanded, Levels::Matched),
        (Kind::Bca, Levels::Matched),
        (Kind::Percentile, Levels::Matched),
        (Kind::BcaExpanded, Levels::Plain),
    ];
    let one = |draw: u64| {
        let mut hits = [0u64; 6];
        let cells = model.draw(&[1, draw]);
        let holds = |cells: &[_], options: &Options| {
            let [low, high] = paired(cells, options).unwrap().interval.unwrap();
            u64::from(low <= TRUE_MM && TRUE_MM <= high)
        };
        for (i, (kind, levels)) in kinds.into_iter().enumerate() {
            hits[i] = holds(&cells, &Options { kind, levels, seed: draw, ..Options::default() });
        }
        let mut bare = cells;
        bare.iter_mut().for_each(|c| c.units = None);
        hits[4] = holds(&bare, &Options { seed: draw, ..Options::default() });
        let null = Model { difference_mm: 0.0, ..*model }.draw(&[2, draw]);
        let d: Vec<f64> = null.iter().map(|c| c.b.unwrap() - c.a.unwrap()).collect();
        hits[5] = u64::from(strandbench_stats::sign_flip(&d, draw).1 <= 0.05);
        hits
    };
    let add = |a: [u64; 6], b: [u64; 6]| std::array::from_fn(|i| a[i] + b[i]);
    let hits = (0..draws).into_par_iter().map(one).reduce(|| [0; 6], add);
    hits.map(|h| h as f64 / draws as f64)
}
