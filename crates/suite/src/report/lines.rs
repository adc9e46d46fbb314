//! Errors of lines, in space (A5) and in the image (B7): over all that was asked for, and over what was answered.

use super::chart::{Chart, Series, colour_of, cumulative, percent, subjects, ticks};
use super::data::Data;
use super::sections::thousands;
use super::tables::format_value;
use maud::{Markup, PreEscaped, html};

/// Errors of the answered pixels alone.
pub(crate) struct Answered {
    /// Median, degrees.
    pub median_deg: f64,
    /// Share within 20 degrees.
    pub within_20deg: f64,
    /// Answered pixels over those asked for.
    pub share: f64,
}

/// The finite part of ascending errors.
fn finite(errors: &[f32]) -> &[f32] {
    &errors[..errors.partition_point(|e| e.is_finite())]
}

/// Figures over the finite errors; the quantile is the protocol's, the ceil(q n)-th smallest.
pub(crate) fn answered(errors: &[f32]) -> Option<Answered> {
    let known = finite(errors);
    let median = known.get(known.len().div_ceil(2).checked_sub(1)?)?;
    Some(Answered {
        median_deg: f64::from(*median),
        within_20deg: known.partition_point(|&e| e <= 20.0) as f64 / known.len() as f64,
        share: known.len() as f64 / errors.len() as f64,
    })
}

/// Rows for the short table: each subject's figure over the pixels that it answered.
pub(crate) fn answered_rows(data: &Data) -> Markup {
    let subjects = data.subjects();
    html! {
        @for (metric, title) in [("A5", "3-D orientation error, median"), ("B7", "2-D orientation error, median")] {
            @let of = |subject: &str| data.curve(metric, subject).and_then(answered);
            @if let Some(method) = of("method").filter(|m| m.share < 1.0) {
                tr.aside {
                    td {
                        (title) ", " b { "answered pixels only" }
                        span.why {
                            "Not a figure of the protocol: it forgives every pixel that the method leaves out. "
                            (format_value(Some(method.within_20deg), "share")) " of the method’s lie within 20°."
                        }
                    }
                    @for subject in &subjects {
                        td.n.method[*subject == "method"].ceiling[*subject == "C"] {
                            (format_value(of(subject).map(|a| a.median_deg), "deg"))
                        }
                    }
                    td.n { (format_value(Some(method.share), "share")) }
                    td.n { (data.curve(metric, "method").map_or(String::new(), |e| thousands(finite(e).len() as u64))) }
                }
            }
        }
    }
}

/// Curves of both, the plot by confidence, and why so much is left out.
pub(crate) fn section(data: &Data) -> Markup {
    let share = data.curve("B7", "method").and_then(answered).map(|a| a.share);
    html! {
        h3 { "How far the lines are off" }
        div.two {
            figure {
                (PreEscaped(curves(data, "B7")))
                figcaption { "Lines in the image (B7): share of hair pixels whose line is off by at most so many degrees." }
            }
            figure {
                (PreEscaped(curves(data, "A5")))
                figcaption { "Lines in space on the surface (A5), the same." }
            }
        }
        @if let Some(share) = share.filter(|s| *s < 0.999) {
            p.note {
                "The method’s curves end at " (format_value(Some(share), "share")) " because that many pixels have a line at all: Luo et al., Eq. 1 keeps the bright "
                "core of each fibre and sets negative responses to zero, so the gaps between fibres have no orientation. The protocol counts a missing answer as "
                "wrong, and where less than half is answered the median is “none”. The dash-dotted curve is the method over its "
                b { "answered pixels only" } ": how good the lines are that it does give. "
                "Nulls answer everywhere; in hair that all falls one way, one direction for all pixels (N1, NC) is a good guess."
            }
        }
        (confidence(data))
    }
}

fn curves(data: &Data, metric: &str) -> String {
    let at: Vec<f64> = (0..=180).map(|i| f64::from(i) * 0.25).collect();
    let mut series = subjects(data.curves_of(metric), &at);
    if let Some(errors) = data.curve(metric, "method").filter(|e| finite(e).len() < e.len()) {
        series.push(Series {
            name: "answered",
            colour: colour_of("method"),
            dash: "9 3 2 3",
            points: cumulative(finite(errors), &at),
        });
    }
    Chart {
        x: (0.0, 45.0),
        y: (0.0, 1.0),
        x_title: "error at most, degrees",
        y_title: "share of hair pixels",
        x_ticks: ticks(0.0, 45.0, 9),
        y_ticks: percent(),
        size: (560.0, 360.0),
    }
    .lines(&series)
}

/// The filter's confidence against its error: a plot, and the figures behind it folded away.
fn confidence(data: &Data) -> Markup {
    let bins = &data.scores.orientation_by_confidence;
    if bins.is_empty() {
        return html! {};
    }
    let colours = ["#0a5c8a", "#3f8fb8", "#8fbdd3"];
    let names = ["within 10°", "within 20°", "within 30°"];
    let series: Vec<Series> = (0..3)
        .map(|k| Series {
            name: names[k],
            colour: colours[k],
            dash: "",
            points: bins.iter().map(|b| (f64::from(b.decile), b.within[k])).collect(),
        })
        .collect();
    let plot = Chart {
        x: (1.0, 10.0),
        y: (0.0, 1.0),
        x_title: "tenth of the answered pixels by the filter’s response, least sure first",
        y_title: "share of the tenth",
        x_ticks: (1..=10).map(|i| (f64::from(i), i.to_string())).collect(),
        y_ticks: percent(),
        size: (560.0, 300.0),
    }
    .lines(&series);
    html! {
        h3 { "Does the filter know when it is right?" }
        div.two {
            figure {
                (PreEscaped(plot))
                figcaption { "B7 of the answered pixels in ten groups of equal size by the strength of the filter’s response. A useful confidence rises to the right." }
            }
            details {
                summary { "The figures behind the plot" }
                table {
                    tr {
                        th { "tenth" } th.n { "response" } th.n { "pixels" } th.n { "median" }
                        @for deg in [10, 20, 30] { th.n { "≤ " (deg) "°" } }
                    }
                    @for b in bins {
                        tr {
                            td { (b.decile) }
                            td.n { (format!("{:.2e} to {:.2e}", b.strength.0, b.strength.1)) }
                            td.n { (thousands(b.pixels)) } td.n.method { (format_value(Some(b.median_deg), "deg")) }
                            @for share in b.within { td.n { (format_value(Some(share), "share")) } }
                        }
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answered_figures_forget_the_absent_and_say_how_many_there_were() {
        let a = answered(&[1.0, 5.0, 21.0, 40.0, f32::INFINITY, f32::INFINITY, f32::INFINITY, f32::INFINITY])
            .unwrap();
        assert_eq!((a.median_deg, a.within_20deg, a.share), (5.0, 0.5, 0.5));
        assert_eq!(answered(&[3.0]).unwrap().median_deg, 3.0);
        assert!(answered(&[f32::INFINITY; 3]).is_none() && answered(&[]).is_none());
    }
}
