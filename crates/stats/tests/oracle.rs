//! Against scipy.

use serde_json::{Value, json};
use std::io::Write;
use std::process::{Command, Stdio};
use strandbench_rng::Rng;
use strandbench_stats::{Kind, Options, PairedCell, expanded_tail, holm, paired, sign_flip};

/// The Python of the oracles, if it has scipy: `STRANDBENCH_PYTHON`, else `python3`. Says so if not.
fn python() -> Option<String> {
    let python = std::env::var("STRANDBENCH_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let has = Command::new(&python).args(["-c", "import scipy"]).stderr(Stdio::null()).status();
    if has.is_ok_and(|s| s.success()) {
        return Some(python);
    }
    println!("ignored, no scipy: install it for python3 or set STRANDBENCH_PYTHON");
    assert!(std::env::var_os("CI").is_none(), "CI must have the oracle: `cargo xtask setup` installs scipy");
    None
}

/// Differences of n scenes: skewed, so that bias and acceleration matter, about a mean that is not zero.
fn differences(n: u64, key: u64) -> Vec<f64> {
    (0..n)
        .map(|i| {
            let mut r = Rng::keyed(&[key, i]);
            0.4 + 0.5 * r.f64() - (1.0 - r.f64()).ln() * if r.f64() < 0.7 { 1.0 } else { -0.4 } - 0.8
        })
        .collect()
}

#[test]
fn intervals_p_values_and_adjustments_agree_with_scipy() {
    let Some(python) = python() else { return };
    let all: Vec<Vec<f64>> = [(8, 1), (12, 2), (16, 3)].map(|(n, key)| differences(n, key)).to_vec();
    let ps = [0.011, 0.04, 0.9, 0.02, 0.02];
    let input = Value::from(all.iter().map(|d| json!({ "differences": d })).collect::<Vec<_>>());
    let mut child = Command::new(python)
        .args([concat!(env!("CARGO_MANIFEST_DIR"), "/tests/oracle.py"), &json!(ps).to_string()])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(input.to_string().as_bytes()).unwrap();
    let out = child.wait_with_output().unwrap();
    assert!(out.status.success());
    let theirs: Value = serde_json::from_slice(&out.stdout).unwrap();
    let numbers = |v: &Value| v.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect::<Vec<_>>();
    for (a, b) in holm(&ps).iter().zip(numbers(&theirs["holm"])) {
        assert!((a - b).abs() < 1e-15, "{a} {b}");
    }
    for (d, their) in all.iter().zip(theirs["cases"].as_array().unwrap()) {
        let tail = expanded_tail(0.025, d.len());
        assert!((tail / their["expanded_tail"].as_f64().unwrap() - 1.0).abs() < 1e-9, "{tail}");
        let cells: Vec<PairedCell> = d
            .iter()
            .zip(0..)
            .map(|(&d, i)| PairedCell {
                scene: format!("{i:02}"),
                seed: 1,
                a: Some(0.0),
                b: Some(d),
                units: None,
            })
            .collect();
        let mut ours = None;
        for (kind, name, tail) in [(Kind::Bca, "bca", 0.025), (Kind::BcaExpanded, "expanded", tail)] {
            let got = paired(&cells, &Options { kind, resamples: 200_000, ..Options::default() }).unwrap();
            let width = got.interval.unwrap()[1] - got.interval.unwrap()[0];
            // Standard error of a quantile of R draws is sqrt(tail (1 - tail) / R) over the density there. A normal density with this
            // interval has sd = width / (2 z); at its tail the density is about tail z / sd (Mills). Two such ends differ,
            // BCa's own level in its turn: six standard errors of their difference.
            let z = (-2.0 * tail.ln()).sqrt();
            let sd = width / (2.0 * z);
            let error = (tail / 200_000.0).sqrt() * sd / (tail * z) * 2f64.sqrt();
            for (a, b) in got.interval.unwrap().iter().zip(numbers(&their[name])) {
                assert!((a - b).abs() < 6.0 * error, "{name} of {}: {a} {b}, error {error}", d.len());
            }
            ours = Some(got);
        }
        let ours = ours.unwrap();
        assert!((ours.effect.unwrap() / their["effect"].as_f64().unwrap() - 1.0).abs() < 1e-12);
        assert!((ours.p - their["p"].as_f64().unwrap()).abs() < 1e-12, "{} {}", ours.p, their["p"]);
        let mut ranked: Vec<f64> = d.clone();
        // The largest magnitude made infinite keeps its rank.
        let largest = (0..d.len()).max_by(|&i, &j| d[i].abs().total_cmp(&d[j].abs())).unwrap();
        ranked[largest] = f64::INFINITY.copysign(d[largest]);
        let (_, p) = sign_flip(&ranked, 1);
        assert!((p - their["p_ranks"].as_f64().unwrap()).abs() < 1e-12, "{p} {}", their["p_ranks"]);
    }
}
