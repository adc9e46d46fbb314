//! Levels 0 to 3 against the live witnesses. `cargo xtask test` gives the Python that has them.

use strandbench_crosscheck::{Options, Size, Verdict, run, write_report};
use strandbench_types::Silent;

#[test]
fn levels_0_to_3_live() {
    if std::env::var_os("STRANDBENCH_PYTHON").is_none() && std::env::var_os("CI").is_none() {
        println!(
            "ignored, no witnesses: run `cargo xtask test`, or set STRANDBENCH_PYTHON to a Python with Mitsuba"
        );
        return;
    }
    let out = tempfile::tempdir().unwrap();
    let options = Options {
        levels: vec![0, 1, 2, 3],
        size: Size::Quick,
        out: out.path().to_owned(),
        python: None,
        required: std::env::var_os("CI").is_some(),
    };
    let outcome = run(&options, &Silent).unwrap();
    if let Some(reason) = &outcome.missing {
        println!("ignored, {reason}");
        return;
    }
    write_report(&outcome, out.path()).unwrap();
    let failed: Vec<_> = outcome
        .gates()
        .filter(|g| g.verdict == Verdict::Failed)
        .map(|g| format!("{g} ({})", g.note))
        .collect();
    assert!(failed.is_empty(), "\n{}", failed.join("\n"));
    assert!(
        outcome.count(|v| *v == Verdict::Passed) > 40,
        "{} gates",
        outcome.count(|v| *v == Verdict::Passed)
    );
}
