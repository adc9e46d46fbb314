use super::*;
use std::sync::atomic::{AtomicBool, Ordering};
use strandbench_types::Silent;

fn inputs(value: &str) -> BTreeMap<String, String> {
    BTreeMap::from([("code".to_owned(), "1".to_owned()), ("lambda".to_owned(), value.to_owned())])
}

fn fill(folder: &Path, text: &str) -> Result<(), SuiteError> {
    std::fs::create_dir(folder.join("sub")).unwrap();
    std::fs::write(folder.join("sub/a.txt"), text).unwrap();
    std::fs::write(folder.join("b.txt"), "b").unwrap();
    Ok(())
}

fn names(dir: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        std::fs::read_dir(dir).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn unchanged_is_kept_and_changed_is_redone_with_the_reason() {
    let root = tempfile::tempdir().unwrap();
    let dir = root.path().join("deep/render");
    let go =
        |value: &str, text: &str| run("render", &dir, inputs(value), &Silent, |d| fill(d, text)).unwrap();
    let first = go("0.3", "one");
    assert!(!first.reused && first.reason == "no earlier result");
    let again = go("0.3", "two");
    assert!(again.reused, "{}", again.reason);
    assert_eq!(std::fs::read_to_string(dir.join("sub/a.txt")).unwrap(), "one", "re-used means untouched");
    let changed = go("0.4", "three");
    assert_eq!((changed.reused, changed.reason.as_str()), (false, "lambda changed"));
    assert_eq!(std::fs::read_to_string(dir.join("sub/a.txt")).unwrap(), "three");
    assert_ne!(first.content("sub"), changed.content("sub"));
    assert_eq!(names(root.path().join("deep").as_path()), ["render"], "no temporary folder stays");
}

#[test]
fn damage_of_every_kind_is_seen() {
    let root = tempfile::tempdir().unwrap();
    let dir = root.path().join("score");
    let go = || run("score", &dir, inputs("1"), &Silent, |d| fill(d, "one")).unwrap().reason;
    assert_eq!(go(), "no earlier result");
    let damages: [(&str, &dyn Fn()); 5] = [
        ("sub/a.txt is damaged", &|| std::fs::write(dir.join("sub/a.txt"), "on!").unwrap()),
        ("b.txt is missing", &|| std::fs::remove_file(dir.join("b.txt")).unwrap()),
        ("extra does not belong there", &|| std::fs::write(dir.join("extra"), "").unwrap()),
        ("the earlier result is incomplete", &|| std::fs::write(dir.join(RECORD_FILE), "{").unwrap()),
        ("lambda changed", &|| {
            let text = std::fs::read_to_string(dir.join(RECORD_FILE)).unwrap();
            let text = text.replace("\"lambda\": \"1\"", "\"lambda\": \"2\"");
            let old_key = hash::of_map(&inputs("1"));
            std::fs::write(dir.join(RECORD_FILE), text.replace(&old_key, "0")).unwrap();
        }),
    ];
    for (reason, damage) in damages {
        damage();
        assert_eq!(go(), reason);
        assert_eq!(go(), "", "then it is whole again");
    }
}

#[test]
fn an_error_or_a_cancel_leaves_the_old_result_and_nothing_else() {
    let root = tempfile::tempdir().unwrap();
    let dir = root.path().join("render");
    run("render", &dir, inputs("1"), &Silent, |d| fill(d, "one")).unwrap();
    let failed = run("render", &dir, inputs("2"), &Silent, |d| {
        fill(d, "half")?;
        Err(SuiteError::file(d, "broken"))
    });
    assert!(failed.is_err());

    #[derive(Default)]
    struct Stop(AtomicBool);
    impl Monitor for Stop {
        fn begin(&self, _: &str, _: u64) {}
        fn advance(&self, _: u64) {}
        fn cancelled(&self) -> bool {
            self.0.load(Ordering::Relaxed)
        }
    }
    impl Progress for Stop {
        fn stage_begins(&self, _: &str, _: &Path, _: &str) {}
        fn stage_done(&self, _: &Done) {
            panic!("a cancelled stage is not done");
        }
    }
    let stop = Stop::default();
    let cancelled = run("render", &dir, inputs("2"), &stop, |d| {
        stop.0.store(true, Ordering::Relaxed);
        fill(d, "whole, but too late")
    });
    assert!(matches!(cancelled, Err(SuiteError::Cancelled)));
    assert_eq!(names(root.path()), ["render"]);
    assert_eq!(std::fs::read_to_string(dir.join("sub/a.txt")).unwrap(), "one");
}

#[test]
fn a_folder_of_somebody_else_is_never_replaced() {
    let root = tempfile::tempdir().unwrap();
    let dir = root.path().join("thesis");
    std::fs::create_dir(&dir).unwrap();
    std::fs::write(dir.join("chapter1.tex"), "years of work").unwrap();
    let error = run("render", &dir, inputs("1"), &Silent, |d| fill(d, "one")).unwrap_err();
    assert!(error.to_string().contains("not a folder of this program"), "{error}");
    assert_eq!(names(&dir), ["chapter1.tex"]);
}

#[cfg(target_os = "linux")]
#[test]
fn leftovers_of_a_killed_run_are_swept_and_those_of_a_living_one_stay() {
    let root = tempfile::tempdir().unwrap();
    let dead = root.path().join(format!("{TEMP_PREFIX}{}4294967295-x", host()));
    let alive = root.path().join(format!("{TEMP_PREFIX}{}{}-x", host(), std::process::id()));
    let elsewhere = root.path().join(format!("{TEMP_PREFIX}another{}4294967295-x", host()));
    std::fs::create_dir(&dead).unwrap();
    std::fs::create_dir(&elsewhere).unwrap();
    std::fs::create_dir(&alive).unwrap();
    run("render", &root.path().join("render"), inputs("1"), &Silent, |d| fill(d, "one")).unwrap();
    assert!(!dead.exists() && alive.exists() && elsewhere.exists());
}
