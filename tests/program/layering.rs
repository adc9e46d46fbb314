//! The method cannot look at the truth, because it cannot even name it.

use std::process::Command;

fn tree(package: &str) -> String {
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".into());
    let out = Command::new(cargo)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(["tree", "--offline", "--locked", "--edges", "normal,build", "--prefix", "none", "-p", package])
        .output()
        .unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    String::from_utf8_lossy(&out.stdout).into_owned()
}

fn ours(package: &str) -> Vec<String> {
    let mut names: Vec<String> = tree(package)
        .lines()
        .filter_map(|l| Some(l.split_whitespace().next()?.to_owned()))
        .filter(|n| n.starts_with("strandbench-") && n != package)
        .collect();
    names.sort();
    names.dedup();
    names
}

#[test]
fn recon_sees_types_random_numbers_and_solvers_alone() {
    assert_eq!(ours("strandbench-recon"), ["strandbench-rng", "strandbench-solve", "strandbench-types"]);
}

#[test]
fn baselines_see_types_and_solvers_alone() {
    assert_eq!(ours("strandbench-baselines"), ["strandbench-solve", "strandbench-types"]);
}

#[test]
fn the_scorer_and_the_truth_do_not_know_the_method() {
    for package in
        ["strandbench-score", "strandbench-groundtruth", "strandbench-scenes", "strandbench-renderer"]
    {
        let known = ours(package);
        assert!(
            !known
                .iter()
                .any(|n| ["strandbench-recon", "strandbench-baselines", "strandbench-suite"]
                    .contains(&n.as_str())),
            "{package}: {known:?}"
        );
    }
    assert!(
        !ours("strandbench-score").iter().any(|n| n == "strandbench-scenes" || n == "strandbench-renderer")
    );
}

#[test]
fn types_stand_on_nothing_of_ours() {
    assert_eq!(ours("strandbench-types"), Vec::<String>::new());
}
