//! The report: one page that stands alone, and the same figures as JSON and CSV.

mod pictures;

use crate::gate::number;
use crate::run::{Judged, Outcome};
use crate::{CrossError, Gate, Verdict};
use maud::{DOCTYPE, Markup, PreEscaped, html};
use serde_json::json;
use std::path::{Path, PathBuf};

const STYLE: &str = include_str!("report.css");
const LEVELS: [(&str, &str); 5] = [
    (
        "Cameras",
        "Rays through pixels and projections of points by every camera, ours against Mitsuba's perspective sensor.",
    ),
    (
        "Geometry",
        "First hits, normals and shadows of shared rays: fibres against Mitsuba's linearcurve (Embree), triangles against Embree itself. Every disagreement is examined by a third, double-precision intersection and given a reason.",
    ),
    (
        "Scattering",
        "Scattering functions on a grid of directions: Chiang against Mitsuba's hair, Marschner's lobes against a second implementation written from the paper.",
    ),
    (
        "Direct light",
        "Light of four point lights along shared rays, summed without random numbers, shadow rays starting where Mitsuba starts them.",
    ),
    (
        "Images",
        "The same scene rendered by both with 24 seeds each. Blocks of 8 x 8 pixels are compared by Welch's test; a right pair of renderers fails one of these tests once in a thousand times.",
    ),
];

/// Writes crosscheck.html, .json and .csv to the folder; the path of the page.
///
/// # Errors
/// If a file cannot be written.
pub fn write_report(outcome: &Outcome, out: &Path) -> Result<PathBuf, CrossError> {
    let page = out.join("crosscheck.html");
    let write = |path: &Path, text: String| {
        strandbench_io::atomic_write(path, |f| f.write_all(text.as_bytes()))
            .map_err(|e| CrossError::file(path, e))
    };
    write(&page, html_page(outcome))?;
    write(&out.join("crosscheck.json"), format!("{:#}\n", as_json(outcome)))?;
    write(&out.join("crosscheck.csv"), csv(outcome))?;
    Ok(page)
}

/// Everything as one JSON document.
pub fn as_json(outcome: &Outcome) -> serde_json::Value {
    json!({
        "program": env!("CARGO_PKG_VERSION"),
        "witnesses": outcome.versions,
        "missing": outcome.missing,
        "cases": outcome.judged.iter().map(|j| json!({
            "level": j.case.level,
            "name": j.case.name,
            "job": j.case.job,
            "input_hash": j.case.input.hash(),
            "witness_s": j.witness_s,
            "ours_s": j.ours_s,
            "gates": j.gates,
        })).collect::<Vec<_>>(),
    })
}

fn word(verdict: &Verdict) -> &'static str {
    match verdict {
        Verdict::Passed => "passed",
        Verdict::Failed => "failed",
        Verdict::Ignored(_) => "ignored",
        Verdict::Shown => "shown",
    }
}

fn csv(outcome: &Outcome) -> String {
    let quoted = |text: &str| format!("\"{}\"", text.replace('"', "\"\""));
    let value = |v: Option<f64>| v.map_or(String::new(), |v| format!("{v:e}"));
    let mut text = "level,case,what,value,limit,unit,verdict,note\n".to_owned();
    for g in outcome.gates() {
        let note = if let Verdict::Ignored(reason) = &g.verdict { reason } else { &g.note };
        let fields = [
            g.level.to_string(),
            quoted(&g.case),
            quoted(&g.what),
            value(g.value),
            value(g.limit),
            quoted(&g.unit),
            word(&g.verdict).to_owned(),
            quoted(note),
        ];
        text.push_str(&fields.join(","));
        text.push('\n');
    }
    text
}

fn html_page(outcome: &Outcome) -> String {
    let failed = outcome.count(|v| *v == Verdict::Failed);
    let passed = outcome.count(|v| *v == Verdict::Passed);
    let ignored = outcome.count(|v| matches!(v, Verdict::Ignored(_)));
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { "strandbench cross-check" }
                style { (PreEscaped(STYLE)) }
            }
            body { main {
                p.kicker { "strandbench " (env!("CARGO_PKG_VERSION")) }
                h1 { "The renderer against its witnesses" }
                p.lead {
                    @if failed > 0 {
                        strong.bad { (failed) " of " (failed + passed) " gates failed." }
                    } @else if passed > 0 {
                        strong.good { "All " (passed) " gates passed." }
                    }
                    @if ignored > 0 { strong { " " (ignored) " checks were ignored." } }
                }
                @if let Some(reason) = &outcome.missing { p.fail { "Nothing was compared: " (reason) } }
                p.note { (witnesses(outcome)) }
                @for (level, (title, text)) in LEVELS.iter().enumerate() {
                    @let judged: Vec<_> = outcome.judged.iter().filter(|j| usize::from(j.case.level) == level).collect();
                    @if !judged.is_empty() {
                        h2 { (level) " · " (title) }
                        p { (text) }
                        @for j in judged { (case(j)) }
                    }
                }
            } }
        }
    }
    .into_string()
}

fn witnesses(outcome: &Outcome) -> String {
    let Some(versions) = outcome.versions.as_object() else { return String::new() };
    let list: Vec<_> = versions
        .iter()
        .map(|(k, v)| match v {
            serde_json::Value::Bool(true) => format!("{k} found"),
            serde_json::Value::Bool(false) => format!("no {k}: scalar variant only"),
            other => format!("{k} {}", other.as_str().unwrap_or_default()),
        })
        .collect();
    format!("Witnesses: {}.", list.join(", "))
}

fn case(judged: &Judged) -> Markup {
    html! {
        h3 { (judged.case.name) }
        p.note {
            "Job " (judged.case.job) ", input " code { (judged.case.input.hash()) } "; witness "
            (format!("{:.1} s, ours {:.1} s", judged.witness_s, judged.ours_s)) "."
        }
        @if let Some(pictures) = &judged.pictures { (pictures::row(pictures)) }
        table {
            tr { th { "" } th { "figure" } th.n { "value" } th.n { "limit" } th { "" } th { "note" } }
            @for gate in &judged.gates { (row(gate)) }
        }
    }
}

fn row(gate: &Gate) -> Markup {
    let value = |v: Option<f64>| v.map_or(String::new(), number);
    html! {
        tr {
            td { span class={ "verdict " (word(&gate.verdict)) } { (word(&gate.verdict)) } }
            td { (gate.what) }
            td.n { (value(gate.value)) }
            td.n { (value(gate.limit)) }
            td { (gate.unit) }
            td.why { @if let Verdict::Ignored(reason) = &gate.verdict { (reason) } @else { (gate.note) } }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::pictures::{diverging, enlarge, p_colour};
    use super::*;
    use crate::{Bundle, Case, Pictures};
    use serde_json::Value;
    use strandbench_types::Plane;

    fn outcome(verdicts: &[Verdict]) -> Outcome {
        let gate = |v: &Verdict| Gate { verdict: v.clone(), ..Gate::shown(4, "c<1>", "a, \"b\"", 0.5, "mm") };
        let blocks = Plane::from_vec(2, 1, vec![None, Some((0.02, 0.5))]);
        let image = Plane::filled(16, 8, [0.5f32, 0.2, 0.1]);
        Outcome {
            judged: vec![Judged {
                case: Case { level: 4, name: "c<1>".into(), job: "image", input: Bundle::new("c") },
                pictures: Some(Pictures { ours: image.clone(), theirs: image, blocks }),
                gates: verdicts.iter().map(gate).collect(),
                witness_s: 1.0,
                ours_s: 1.0,
            }],
            versions: Value::Null,
            missing: None,
        }
    }

    #[test]
    fn failed_and_ignored_checks_are_never_called_passed() {
        let page = html_page(&outcome(&[Verdict::Passed, Verdict::Failed]));
        assert!(page.contains("1 of 2 gates failed") && !page.contains("All "));
        assert!(page.contains("c&lt;1&gt;") && page.matches("data:image/png").count() == 4);
        let ignored = Verdict::Ignored("no Python".into());
        let page = html_page(&outcome(std::slice::from_ref(&ignored)));
        assert!(page.contains("1 checks were ignored") && !page.contains("passed."), "nothing passed");
        assert!(csv(&outcome(&[ignored])).contains(",\"a, \"\"b\"\"\",5e-1,,\"mm\",ignored,\"no Python\""));
    }

    #[test]
    fn the_files_are_written_and_the_scales_run_the_right_way() {
        let out = tempfile::tempdir().unwrap();
        let page = write_report(&outcome(&[Verdict::Passed]), out.path()).unwrap();
        assert!(page.exists() && out.path().join("crosscheck.csv").exists());
        let text = std::fs::read_to_string(out.path().join("crosscheck.json")).unwrap();
        let read: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(read["cases"][0]["gates"][0]["verdict"], "passed");
        let (blue, red) = (diverging(-1.0), diverging(1.0));
        assert!(blue[2] > blue[0] && red[0] > red[2]);
        assert!(p_colour(0.5)[2] > 240 && p_colour(1e-9)[2] < 50);
        assert_eq!(
            enlarge(&Plane::from_vec(2, 1, vec![[1; 3], [2; 3]]), 2).data[4..],
            [[1; 3], [1; 3], [2; 3], [2; 3]]
        );
    }
}
