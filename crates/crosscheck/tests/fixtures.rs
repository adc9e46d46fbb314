//! Every gate of levels 0 to 3 against the committed answers of the witnesses; no Mitsuba needed.

use std::path::Path;
use strandbench_crosscheck::{Bundle, Verdict, fixtures};

fn folder() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures"))
}

/// Judges all fixtures of one level and says which gate failed.
fn level(level: u8) {
    let cases = fixtures::fixture_cases(level).unwrap();
    assert!(!cases.is_empty(), "level {level} has no case");
    let mut failed = Vec::new();
    for case in &cases {
        let gates = fixtures::check(folder(), case).unwrap();
        assert!(gates.iter().any(|g| g.verdict == Verdict::Passed), "{}: no gate", case.name);
        failed.extend(
            gates.iter().filter(|g| g.verdict == Verdict::Failed).map(|g| format!("{g} ({})", g.note)),
        );
    }
    assert!(failed.is_empty(), "\n{}", failed.join("\n"));
}

#[test]
fn level_0_cameras() {
    level(0);
}

#[test]
fn level_1_geometry() {
    level(1);
}

#[test]
fn level_2_scattering() {
    level(2);
}

#[test]
fn level_3_direct_light() {
    level(3);
}

#[test]
fn fixtures_say_where_they_come_from_and_are_small() {
    let mut bytes = 0;
    for l in fixtures::LEVELS {
        for case in fixtures::fixture_cases(l).unwrap() {
            let path = fixtures::path_of(folder(), &case);
            bytes += std::fs::metadata(&path).unwrap().len();
            let fixture = Bundle::read(&path, &case.name).unwrap();
            let versions: serde_json::Value = fixture.meta("versions").unwrap();
            assert_eq!(versions["mitsuba"], "3.9.1", "{}", path.display());
            assert_eq!(fixture.meta::<String>("job").unwrap(), case.job);
        }
    }
    assert!(bytes < 2_000_000, "{bytes} bytes of fixtures");
}

#[test]
fn a_fixture_of_another_scene_is_refused_with_the_remedy() {
    let case = &fixtures::fixture_cases(1).unwrap()[0];
    let mut moved = case.clone();
    moved.input = moved.input.with("radii", &[1], [0.1f32]);
    let e = fixtures::check(folder(), &moved).unwrap_err().to_string();
    assert!(e.contains("make_fixtures.py"), "{e}");
}
