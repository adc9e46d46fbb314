//! Line charts and scatter plots as SVG.

use std::fmt::Write as _;

/// Colour of a subject wherever it is drawn.
pub(crate) fn colour_of(subject: &str) -> &'static str {
    match subject {
        "method" => "#0a5c8a",
        "C" => "#2f7d4f",
        "N0" => "#b3541e",
        "N1" => "#c98a1b",
        "N2" => "#8b5fa8",
        "NC" => "#7a7a7a",
        _ => "#555555",
    }
}

/// A line of a chart.
pub(crate) struct Series<'a> {
    pub name: &'a str,
    pub colour: &'a str,
    /// Lengths of dashes and gaps, empty for a whole line.
    pub dash: &'a str,
    /// (x, y) in data units, x ascending.
    pub points: Vec<(f64, f64)>,
}

/// Dots of a chart: colour, radius in pixels, (x, y) in data units.
pub(crate) type Dots<'a> = (&'a str, f64, Vec<(f64, f64)>);

/// A line between two points in data units.
pub(crate) type Segment = ((f64, f64), (f64, f64));

/// Axes in data units.
pub(crate) struct Chart<'a> {
    pub x: (f64, f64),
    pub y: (f64, f64),
    pub x_title: &'a str,
    pub y_title: &'a str,
    pub x_ticks: Vec<(f64, String)>,
    pub y_ticks: Vec<(f64, String)>,
    pub size: (f64, f64),
}

const LEFT: f64 = 58.0;
const BOTTOM: f64 = 44.0;
const TOP: f64 = 12.0;

impl Chart<'_> {
    fn place(&self, (x, y): (f64, f64), right: f64) -> (f64, f64) {
        let (w, h) = (self.size.0 - LEFT - right, self.size.1 - TOP - BOTTOM);
        let u = (x - self.x.0) / (self.x.1 - self.x.0);
        let v = (y - self.y.0) / (self.y.1 - self.y.0);
        (LEFT + u * w, TOP + (1.0 - v) * h)
    }

    fn frame(&self, right: f64) -> String {
        let (w, h) = self.size;
        let mut svg = format!("<svg class=\"chart\" viewBox=\"0 0 {w} {h}\" role=\"img\">");
        for (value, text) in &self.x_ticks {
            let (x, y) = self.place((*value, self.y.0), right);
            let _ = write!(
                svg,
                "<line class=\"grid\" x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"{TOP}\" y2=\"{y:.1}\"/>\
                 <text class=\"tick\" text-anchor=\"middle\" x=\"{x:.1}\" y=\"{:.1}\">{text}</text>",
                y + 16.0
            );
        }
        for (value, text) in &self.y_ticks {
            let (x, y) = self.place((self.x.0, *value), right);
            let _ = write!(
                svg,
                "<line class=\"grid\" x1=\"{x:.1}\" x2=\"{:.1}\" y1=\"{y:.1}\" y2=\"{y:.1}\"/>\
                 <text class=\"tick\" text-anchor=\"end\" x=\"{:.1}\" y=\"{:.1}\">{text}</text>",
                w - right,
                x - 7.0,
                y + 4.0
            );
        }
        let middle = (LEFT + w - right) / 2.0;
        let _ = write!(
            svg,
            "<text class=\"axis\" text-anchor=\"middle\" x=\"{middle:.1}\" y=\"{:.1}\">{}</text>\
             <text class=\"axis\" text-anchor=\"middle\" transform=\"translate(14 {:.1}) rotate(-90)\">{}</text>",
            h - 8.0,
            self.x_title,
            (h - BOTTOM + TOP) / 2.0,
            self.y_title
        );
        svg
    }

    /// The chart with its lines, each named at its right end.
    pub fn lines(&self, series: &[Series]) -> String {
        const RIGHT: f64 = 92.0;
        let mut svg = self.frame(RIGHT);
        let mut ends: Vec<(f64, usize)> = Vec::new();
        for (i, s) in series.iter().enumerate() {
            let mut path = String::new();
            for &p in &s.points {
                let clipped = (p.0, p.1.clamp(self.y.0, self.y.1));
                let (x, y) = self.place(clipped, RIGHT);
                let _ = write!(path, "{}{x:.1} {y:.1}", if path.is_empty() { "M" } else { "L" });
            }
            let dash =
                if s.dash.is_empty() { String::new() } else { format!(" stroke-dasharray=\"{}\"", s.dash) };
            let width = if s.name == "method" { 2.8 } else { 1.8 };
            let _ = write!(
                svg,
                "<path d=\"{path}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{width}\" stroke-linejoin=\"round\"{dash}/>",
                s.colour
            );
            if let Some(&last) = s.points.last() {
                ends.push((self.place((last.0, last.1.clamp(self.y.0, self.y.1)), RIGHT).1, i));
            }
        }
        ends.sort_by(|a, b| a.0.total_cmp(&b.0));
        for i in 1..ends.len() {
            ends[i].0 = ends[i].0.max(ends[i - 1].0 + 15.0);
        }
        let bottom = self.size.1 - BOTTOM;
        let overflow = ends.last().map_or(0.0, |e| (e.0 - bottom).max(0.0));
        for (y, i) in ends {
            let _ = write!(
                svg,
                "<text class=\"name\" x=\"{:.1}\" y=\"{:.1}\" fill=\"{}\">{}</text>",
                self.size.0 - RIGHT + 7.0,
                y - overflow + 4.0,
                series[i].colour,
                series[i].name
            );
        }
        svg.push_str("</svg>");
        svg
    }

    /// A scatter of dots under a set of line segments.
    pub fn scatter(&self, dots: &[Dots], segments: &[Segment]) -> String {
        const RIGHT: f64 = 14.0;
        let mut svg = self.frame(RIGHT);
        for (colour, radius, points) in dots {
            let mut path = String::new();
            for &p in points {
                let (x, y) = self.place(p, RIGHT);
                let _ = write!(path, "M{x:.1} {y:.1}h0");
            }
            let _ = write!(
                svg,
                "<path d=\"{path}\" stroke=\"{colour}\" stroke-width=\"{}\" stroke-linecap=\"round\"/>",
                radius * 2.0
            );
        }
        let mut path = String::new();
        for &(a, b) in segments {
            let ((ax, ay), (bx, by)) = (self.place(a, RIGHT), self.place(b, RIGHT));
            let _ = write!(path, "M{ax:.1} {ay:.1}L{bx:.1} {by:.1}");
        }
        let _ = write!(svg, "<path d=\"{path}\" fill=\"none\" stroke=\"#0a5c8a\" stroke-width=\"2\"/></svg>");
        svg
    }
}

/// Evenly spread round numbers from `low` to `high`, some `count` of them.
pub(crate) fn ticks(low: f64, high: f64, count: usize) -> Vec<(f64, String)> {
    let raw = (high - low) / count.max(1) as f64;
    if !(raw.is_finite() && raw > 0.0) {
        return Vec::new();
    }
    let power = 10f64.powf(raw.log10().floor());
    let step =
        [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * power).find(|s| *s >= raw * 0.999).unwrap_or(raw);
    let digits = (-step.log10().floor()).max(0.0) as usize;
    let first = (low / step).ceil() as i64;
    let last = (high / step + 1e-9).floor() as i64;
    (first..=last).map(|i| (i as f64 * step, format!("{:.digits$}", i as f64 * step))).collect()
}

/// Ticks of an axis of shares, from 0 to 1.
pub(crate) fn percent() -> Vec<(f64, String)> {
    (0..=5).map(|i| (f64::from(i) * 0.2, format!("{} %", i * 20))).collect()
}

/// The share of each subject's errors (ascending) at or below each of `at`: the method whole, all others dashed.
pub(crate) fn subjects<'a>(
    errors: impl Iterator<Item = (&'a str, &'a [f32])>,
    at: &[f64],
) -> Vec<Series<'a>> {
    let of = |(name, errors): (&'a str, &'a [f32])| Series {
        name,
        colour: colour_of(name),
        dash: if name == "method" { "" } else { "5 4" },
        points: cumulative(errors, at),
    };
    errors.map(of).collect()
}

/// Share of ascending errors at or below each of `at`; absent answers are infinite and never below.
pub(crate) fn cumulative(errors: &[f32], at: &[f64]) -> Vec<(f64, f64)> {
    let n = errors.len().max(1) as f64;
    at.iter().map(|&x| (x, errors.partition_point(|&e| f64::from(e) <= x) as f64 / n)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let t = ticks(0.0, 20.0, 5);
        assert_eq!(t.iter().map(|t| t.1.as_str()).collect::<Vec<_>>(), ["0", "5", "10", "15", "20"]);
        let t = ticks(-0.31, 0.29, 4);
        assert_eq!(t.first().unwrap().1, "-0.2");
        assert!(t.iter().all(|t| t.0 >= -0.31 && t.0 <= 0.29));
        assert!(ticks(1.0, 1.0, 4).is_empty());
    }

    #[test]
    fn cumulative_counts_absent_answers_as_never_right() {
        let c = cumulative(&[0.5, 1.0, 3.0, f32::INFINITY], &[0.0, 1.0, 1e9]);
        assert_eq!(c.iter().map(|p| p.1).collect::<Vec<_>>(), [0.0, 0.5, 0.75]);
    }
}
