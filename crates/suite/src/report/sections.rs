//! The words and plain facts of a report.

use super::data::Data;
use super::tables::{format_value, one_line};
use super::{goals, lines};
use maud::{Markup, html};

/// The result in one or two sentences, from the figures alone.
pub(crate) fn verdict(data: &Data) -> String {
    let Some(median) = data.score("A1.median", "method") else {
        return "The scorer gave no median depth error.".to_owned();
    };
    let Some(value) = median.value else {
        return format!(
            "More than half of the hair pixels have no usable depth ({:.1} % answered): the method fails here. {}",
            median.coverage * 100.0,
            goals::sentence(&goals::goals(&data.scores.scores))
        );
    };
    let mut text = format!(
        "Half of the hair pixels have a depth within {value:.2} mm of the truth; {:.1} % of them are answered.",
        median.coverage * 100.0
    );
    if let Some((null, of_null)) = goals::best_null(&data.scores.scores, "A1.median") {
        let ratio = of_null / value.max(1e-9);
        text.push_str(&match ratio {
            r if r >= 1.05 => format!(
                " That is {r:.1} times better than the best guess made without looking at the images ({null}: {of_null:.1} mm)."
            ),
            r if r > 0.95 => format!(
                " A guess made without looking at the images ({null}: {of_null:.1} mm) does as well: nothing has been measured."
            ),
            _ => format!(
                " A guess made without looking at the images does better ({null}: {of_null:.1} mm): nothing has been measured."
            ),
        });
    }
    let scores = &data.scores.scores;
    for sentence in [goals::sentence(&goals::goals(scores)), goals::not_better_than_nulls(scores)] {
        if !sentence.is_empty() {
            text.push(' ');
            text.push_str(&sentence);
        }
    }
    text
}

/// Title, verdict and key figures.
pub(crate) fn header(data: &Data) -> Markup {
    let beyond = data.score("A1.over_10mm", "method").and_then(|s| s.value).map(|v| 1.0 - v);
    let complete = data.score("A1.median", "method").map(|s| s.coverage);
    let line = data.curve("B7", "method").and_then(lines::answered);
    let seconds = data.records.iter().find(|r| r.stage == "reconstruct").map(|r| r.cost.wall_s);
    let tile = |value: Option<String>, unit: &str, meaning: &str| {
        html! { div.tile { b { (value.unwrap_or_else(|| "—".into())) " " small { (unit) } } span { (meaning) } } }
    };
    html! {
        header {
            p.kicker { "strandbench report · seed " (data.render.seed) " · protocol " (data.scores.protocol) }
            h1 { (data.render.scene) " " span { "reconstructed by " (data.variant) } }
            p.lead { (verdict(data)) }
            div.tiles {
                (tile(data.score("A1.median", "method").and_then(|s| s.value).map(|v| format!("{v:.2}")), "mm", "median depth error (A1)"))
                (tile(beyond.map(|v| format!("{:.1}", v * 100.0)), "%", "of hair pixels within 10 mm"))
                (tile(complete.map(|v| format!("{:.1}", v * 100.0)), "%", "of hair pixels answered"))
                (tile(line.as_ref().map(|a| format!("{:.1}", a.median_deg)), "°", &line_meaning(line.as_ref())))
                (tile(seconds.map(|v| format!("{v:.1}")), "s", "wall time of the reconstruction"))
                (tile(Some(thousands(data.render.strands as u64)), "", "fibres in the scene"))
            }
            (goals::table(&goals::goals(&data.scores.scores)))
        }
    }
}

fn line_meaning(line: Option<&lines::Answered>) -> String {
    match line {
        Some(a) if a.share < 0.999 => {
            format!("median image orientation error over the {:.0} % of pixels answered", a.share * 100.0)
        }
        _ => "median error of the image orientation (B7)".to_owned(),
    }
}

/// 1234567 as 1 234 567, with thin spaces.
pub(crate) fn thousands(n: u64) -> String {
    let digits = n.to_string();
    let mut text = String::new();
    for (i, c) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push('\u{2009}');
        }
        text.push(c);
    }
    text
}

/// The energy reached and how far from the optimum it can be at most.
pub(crate) fn energy(data: &Data) -> Markup {
    let d = &data.diagnostics;
    if d.labels == 0 {
        // A method from outside, which says nothing of labels and their energy.
        return html! {};
    }
    html! {
        h2 { "Energy of the labelling" }
        p {
            "Matching chose one of " (d.labels) " depths for each pixel by minimising the energy of Luo et al., Eq. 2."
            @if d.lower_bound.is_some() { " No labelling can have less than the lower bound, so the gap is the most that a perfect minimiser could still gain." }
        }
        table {
            tr { th { "energy reached" } th.n { "proven lower bound" } th.n { "gap" } }
            tr {
                td.n { (format_value(Some(d.energy), "")) }
                td.n { @match d.lower_bound { Some(b) => (format_value(Some(b), "")), None => "not given by this minimiser" } }
                td.n { @match gap(d.energy, d.lower_bound) { Some(g) => (format!("{:.2} %", g * 100.0)), None => "unknown" } }
            }
        }
    }
}

fn gap(energy: f64, bound: Option<f64>) -> Option<f64> {
    let bound = bound?;
    (bound != 0.0).then(|| (energy - bound) / bound.abs())
}

/// Fibre radius, exposure, and what else the program chose.
fn decided(data: &Data) -> Vec<(&'static str, String)> {
    let sensor = &data.render.sensor;
    let mut radii = data.truth.strands.radii_mm.clone();
    radii.sort_by(f32::total_cmp);
    let middle = radii.get(radii.len() / 2).copied().unwrap_or(0.0);
    let exposure = match &data.render.metered {
        Some(m) => format!(
            "full scale at a radiance of {:.4}, metered: the brightest hundredth of {} hair pixels lies above {:.0} % of it",
            m.full_scale_radiance,
            thousands(m.hair_pixels),
            crate::METERED_SHARE * 100.0
        ),
        None => format!("full scale at a radiance of {:.4}, as the scene states", sensor.full_scale_radiance),
    };
    let mut facts = vec![("fibre radius", format!("{middle:.3} mm (median)")), ("exposure", exposure)];
    facts.extend(data.render.notes.iter().map(|n| ("decided", n.clone())));
    facts
}

/// Parameters, versions and hashes: all that is needed to make the result again.
pub(crate) fn provenance(data: &Data) -> Markup {
    let p = &data.records[1].provenance;
    let facts = [
        (
            "program",
            format!(
                "strandbench {}{}",
                p.version,
                if p.commit.is_empty() { String::new() } else { format!(", commit {}", p.commit) }
            ),
        ),
        ("compiler", format!("{}, {}", p.rustc, p.target)),
        ("machine", format!("{}, {} logical processors, {}", p.cpu, p.cpus, p.os)),
        ("threads", p.threads.to_string()),
        ("seed", data.render.seed.to_string()),
        ("protocol", data.scores.protocol.clone()),
        (
            "scene",
            format!(
                "{} fibres, {} points, {} m of hair; head {:.0} mm broad",
                thousands(data.render.strands as u64),
                thousands(data.render.points as u64),
                thousands(data.render.length_m.round() as u64),
                data.render.head_breadth_mm
            ),
        ),
    ];
    html! {
        h2 { "How to make this again" }
        table { @for (name, value) in facts.into_iter().chain(decided(data)) { tr { th { (name) } td { (value) } } } }
        h3 { "Parameters of the method" }
        table {
            tr { th { "parameter" } th { "value" } }
            @for (name, value) in &data.diagnostics.parameters { tr { td { code { (name) } } td { (value) } } }
        }
        h3 { "What each stage's result depends on" }
        @for record in &data.records {
            details {
                summary { (record.stage) ": key " code { (record.key) } }
                table { @for (name, value) in &record.inputs { tr { td { code { (name) } } td { code { (one_line(value)) } } } } }
            }
        }
        details { summary { "The scene, whole" } pre { (data.render.toml) } }
    }
}
