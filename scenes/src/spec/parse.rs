//! From TOML to a checked scene.

use super::SceneSpec;
use super::check::Fault;
use crate::SceneError;
use serde::de::DeserializeOwned;
use std::ops::Range;
use std::path::Path;
use toml::de::{DeTable, DeValue};

/// Longest scene file accepted, bytes.
const MAX_BYTES: usize = 1 << 20;

/// Reads a scene; `path` is named in errors and gives the scene its name where the file has none.
///
/// # Errors
/// [`SceneError::Syntax`] for text that is not TOML, unknown or missing keys and wrong types,
/// [`SceneError::Value`] for values out of range; both name file and line.
pub fn parse(toml_text: &str, path: &Path) -> Result<SceneSpec, SceneError> {
    let mut spec = checked(toml_text, path, SceneSpec::check)?;
    if spec.name.is_empty() {
        spec.name = path.file_stem().map_or_else(|| "scene".into(), |s| s.to_string_lossy().into_owned());
    }
    Ok(spec)
}

/// Any kind of scene file, its values `check`ed.
///
/// # Errors
/// As [`parse`].
pub(crate) fn checked<T: DeserializeOwned>(
    toml_text: &str,
    path: &Path,
    check: impl FnOnce(&T) -> Result<(), Fault>,
) -> Result<T, SceneError> {
    let syntax = |at: usize, problem: String| SceneError::Syntax {
        path: path.to_owned(),
        line: line_of(toml_text, at),
        problem,
    };
    if toml_text.len() > MAX_BYTES {
        return Err(syntax(0, format!("the file has {} bytes; a scene has a few thousand", toml_text.len())));
    }
    let spec: T = toml::from_str(toml_text)
        .map_err(|e| syntax(e.span().map_or(0, |s| s.start), e.message().trim().to_owned()))?;
    if let Err((key, problem)) = check(&spec) {
        let line = DeTable::parse(toml_text)
            .ok()
            .and_then(|table| place(table.get_ref(), &key))
            .map_or(0, |span| line_of(toml_text, span.start));
        return Err(SceneError::Value { path: path.to_owned(), line, key, problem });
    }
    Ok(spec)
}

fn line_of(text: &str, at: usize) -> usize {
    1 + text.bytes().take(at).filter(|&b| b == b'\n').count()
}

/// Where a dotted key stands, or the nearest table that would hold it.
fn place(table: &DeTable<'_>, key: &str) -> Option<Range<usize>> {
    let (head, rest) = key.split_once('.').map_or((key, None), |(h, r)| (h, Some(r)));
    let (name, value) = table.iter().find(|(k, _)| k.get_ref().as_ref() == head)?;
    match (rest, value.get_ref()) {
        (Some(rest), DeValue::Table(inner)) => place(inner, rest).or(Some(name.span())),
        _ => Some(name.span()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const SMALL: &str = "difficulty = \"easy\"\nstresses = \"nothing\"\n\n[groom]\nfamily = \"straight\"\n\
        strands = 100\nradius_mm = 0.04\n\n[groom.length]\ntop_mm = 300.0\n\n[groom.style]\nlift_mm = 4.0\n";

    fn error(text: &str) -> String {
        parse(text, Path::new("a/b.toml")).unwrap_err().to_string()
    }

    #[test]
    fn a_small_scene_has_defaults_and_its_files_name() {
        let spec = parse(SMALL, Path::new("a/b.toml")).unwrap();
        assert_eq!((spec.name.as_str(), spec.rig.width_px), ("b", 640));
        let again = parse(&spec.to_toml(), Path::new("c.toml")).unwrap();
        assert_eq!(again, spec);
    }

    #[test]
    fn faults_are_named_with_file_line_key_and_remedy() {
        for (from, to, wants) in [
            ("radius_mm = 0.04", "radius_mm = -0.04", "a/b.toml, line 7: groom.radius_mm: -0.04 is not"),
            ("strands = 100", "strands = 0", "line 6: groom.strands: 0 is not between 1 and 400000"),
            ("strands = 100", "strands = 400001", "line 6: groom.strands: 400001 is not between"),
            ("strands = 100", "strands = -1", "line 6: invalid value"),
            ("strands = 100", "strands = 100\nstrand = 3", "line 7: unknown field `strand`"),
            ("lift_mm = 4.0", "lift_mm = nan", "line 13: groom.style.lift_mm: NaN is not"),
            (
                "lift_mm = 4.0",
                "lift_mm = 4.0\n[rig]\ndistance_mm = 50",
                "line 15: rig.distance_mm: 50 is not",
            ),
            ("lift_mm = 4.0", "lift_mm = 4.0\n[rig]\nnear_mm = 1200", "line 15: rig.near_mm: 1200 is not"),
            (
                "lift_mm = 4.0",
                "[groom.clumping]\nonset_mm = 501",
                "line 14: groom.clumping.onset_mm: 501 is not between 0 and 500",
            ),
            (
                "lift_mm = 4.0",
                "[groom.wave]\nflatness = 1.5",
                "line 14: groom.wave.flatness: 1.5 is not between 0 and 1",
            ),
            (
                "lift_mm = 4.0",
                "[groom.disorder]\nfrizz_mm = nan",
                "line 14: groom.disorder.frizz_mm: NaN is not between 0 and 20",
            ),
            (
                "lift_mm = 4.0",
                "[motion]\nframes = 2\n[motion.solver]\nsubsteps = 0",
                "line 16: motion.solver.substeps: 0 is not between 1 and 100",
            ),
            ("[groom.length]\ntop_mm = 300.0\n", "", "line 4: missing field `length`"),
            ("lift_mm = 4.0", "lift_mm = 4.0\n[hair_file]\npath = \"x\"", "hair_file"),
            ("stresses", "stresses = ", "line 2"),
        ] {
            let text = SMALL.replace(from, to);
            assert_ne!(text, SMALL);
            let got = error(&text);
            assert!(got.contains(wants), "{got:?} lacks {wants:?}");
        }
        assert!(error("difficulty = \"easy\"\nstresses = \"\"").contains("groom"));
        assert!(error("").contains("missing field"));
    }

    proptest! {
        #[test]
        fn any_text_is_a_scene_or_an_error(text in "\\PC{0,200}") {
            let _ = parse(&text, Path::new("x.toml"));
        }

        #[test]
        fn any_value_in_any_place_is_a_scene_or_an_error(
            line in 0usize..13,
            value in prop_oneof![
                Just("nan".to_owned()), Just("inf".to_owned()), Just("-1".to_owned()), Just("1e300".to_owned()),
                Just("{}".to_owned()), Just("[1,2]".to_owned()), Just("\"\"".to_owned()),
                any::<i64>().prop_map(|v| v.to_string()), any::<f32>().prop_map(|v| format!("{v:e}")),
            ],
        ) {
            let text: Vec<String> = SMALL
                .lines()
                .enumerate()
                .map(|(i, l)| match l.split_once('=') {
                    Some((key, _)) if i == line => format!("{key}= {value}"),
                    _ => l.to_owned(),
                })
                .collect();
            if let Ok(spec) = parse(&text.join("\n"), Path::new("x.toml")) {
                let groom = spec.groom.unwrap();
                prop_assert!(groom.radius_mm > 0.0 && groom.strands > 0 && groom.length.top_mm.is_finite());
            }
        }
    }
}
