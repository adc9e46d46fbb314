//! The variants table and the help, as text that a reviewer sees change.

use crate::support::{finished, json, ok};

#[test]
fn the_variants_table() {
    let dir = finished();
    let names: Vec<String> = json(dir, &["variants", "list"])
        .as_array()
        .unwrap()
        .iter()
        .map(|v| v["name"].as_str().unwrap().to_owned())
        .collect();
    let first = ok(dir, &["variants", "show", &names[0]]);
    let mut text = first.clone();
    for name in &names[1..] {
        let shown = ok(dir, &["variants", "show", name]);
        for line in shown.lines().filter(|l| !first.lines().any(|f| f == *l)) {
            text.push_str(line);
            text.push('\n');
        }
    }
    insta::assert_snapshot!("variants", text);
}

#[test]
fn help_teaches_with_examples() {
    let dir = finished();
    let help = ok(dir, &["--help"]);
    for wanted in
        ["Examples:", "run", "render", "reconstruct", "score", "report", "scenes", "import", "re-uses"]
    {
        assert!(help.contains(wanted), "{wanted}");
    }
    for command in ["run", "score", "reconstruct", "report", "import"] {
        assert!(ok(dir, &[command, "--help"]).contains("Example"), "{command}");
    }
}
