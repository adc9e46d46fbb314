//! `ablate`: arms on the same renders, weights tuned apart, differences that follow from the cells, clear refusals.

use crate::support::{TINY, fails, folder, json, ok, strandbench};
use serde_json::Value;

fn number(v: &Value) -> f64 {
    v.as_f64().unwrap_or_else(|| panic!("{v} is no number"))
}

#[test]
fn an_ablation_pairs_its_arms_and_tunes_on_other_scenes() {
    let dir = folder("ablate");
    std::fs::write(dir.join("tiny.toml"), TINY).unwrap();
    std::fs::write(dir.join("other.toml"), TINY.replace("lift_mm = 4.0", "lift_mm = 7.0")).unwrap();
    let mut args = vec!["ablate", "gamma", "--scene", "tiny.toml", "--tune-on", "other.toml"];
    args.extend(["--seed", "1", "--seed", "2", "--out", "out"]);
    args.extend(["--set", "render.samples_per_pixel=8", "--set", "render.max_samples_per_pixel=8"]);
    let first = json(&dir, &args);
    let done = &first[0];

    let tuned = done["tuned"].as_array().unwrap();
    assert_eq!(tuned.len(), 2, "a weight for each arm");
    for arm in tuned {
        let tried = arm["tried"].as_array().unwrap();
        assert_eq!(tried.len(), 3, "the same trials for every arm");
        let least = tried.iter().map(|t| number(&t[1])).fold(f64::INFINITY, f64::min);
        let chosen = tried.iter().find(|t| t[0] == arm["lambda"]).expect("a weight that was tried");
        assert_eq!(number(&chosen[1]), least);
    }

    let rows = done["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 2 * 2 * 2, "seeds, arms, weights");
    let median = |arm: &str, tuned: bool, seed: u64| {
        let row = rows
            .iter()
            .find(|r| r["arm"] == arm && r["tuned"] == tuned && r["row"]["seed"] == seed)
            .unwrap_or_else(|| panic!("{arm}, tuned {tuned}, seed {seed}"));
        let scores = row["row"]["scores"].as_array().unwrap();
        number(
            &scores.iter().find(|s| s["metric"] == "A1.median" && s["subject"] == "method").unwrap()["value"],
        )
    };
    for tuned in [true, false] {
        let c = done["comparisons"]
            .as_array()
            .unwrap()
            .iter()
            .find(|c| c["metric"] == "A1.median" && c["tuned"] == tuned)
            .unwrap();
        let want = [1, 2].map(|s| median("gamma 0.5", tuned, s) - median("gamma 1", tuned, s));
        let mean = number(&c["difference"]["mean"]);
        assert!((mean - (want[0] + want[1]) / 2.0).abs() < 1e-12, "{mean} of {want:?}");
        // Seeds of the only scene are what counts.
        assert_eq!(
            (&c["primary"], &c["of_seeds"], number(&c["difference"]["scenes"])),
            (&Value::Bool(tuned), &Value::Bool(true), 2.0)
        );
    }

    let folder = dir.join("out/ablate/gamma-own");
    for file in
        ["ablation.html", "ablation.json", "ablation.csv", "figure.png", "0-surface.png", "1-error.png"]
    {
        assert!(folder.join(file).is_file(), "{file}");
    }
    let page = std::fs::read_to_string(folder.join("ablation.html")).unwrap();
    let sentence = done["sentences"][0].as_str().unwrap();
    assert!(page.contains(sentence.split(" (").next().unwrap()), "{sentence}");

    let history = ok(&dir, &["history", "--results", "out", "--csv"]);
    let mut told = history.lines().filter(|l| l.contains("ablate gamma (own)") && l.contains("A1.median"));
    assert!(told.next().is_some_and(|l| l.contains("luo")), "{history}");

    let second = json(&dir, &args);
    assert_eq!(second[0]["comparisons"], done["comparisons"]);
    for row in second[0]["rows"].as_array().unwrap() {
        assert_eq!(
            row["row"]["reused"].as_array().unwrap().len(),
            3,
            "nothing is done twice: {}",
            row["row"]["variant"]
        );
    }
}

#[test]
fn what_would_prove_nothing_is_refused() {
    let dir = folder("ablate-refused");
    let said = fails(&dir, &["ablate", "colour"]);
    assert!(said.contains("colour") && said.contains("cameras"), "{said}");
    let said = fails(&dir, &["ablate", "gamma", "--scene", "curly-brown", "--tune-on", "curly-brown"]);
    assert!(said.contains("curly-brown") && said.contains("tuned"), "{said}");
    let said = fails(&dir, &["ablate", "gamma", "--scene", "curly-brown", "--set", "recon.lambda=1"]);
    assert!(said.contains("recon.lambda=1"), "{said}");
    let said = fails(&dir, &["ablate", "denoise", "--scene", "curly-brown"]);
    assert!(said.contains("curly-brown") && said.contains("one pose"), "{said}");
    let said =
        fails(&dir, &["ablate", "denoise", "--scene", "moving-still", "--tune-on", "moving-messy-red"]);
    assert!(said.contains("moving-messy-red") && said.contains("no weight"), "{said}");
    assert!(!dir.join("strandbench-out").exists(), "nothing was begun");
    for args in
        [&["ablate"][..], &["ablate", "gamma", "--on", "huge"], &["ablate", "gamma", "--tune-on", "a"]]
    {
        assert_eq!(strandbench(&dir, args).status.code(), Some(2), "{args:?}");
    }
}
