//! Smooth resampling of polylines.
//!
//! The curve is the centripetal Catmull-Rom spline through the given points (Catmull and Rom 1974; knots by
//! the square root of the chord, Yuksel et al. 2011, which excludes cusps and loops within a span). It is C1,
//! passes through every point, and its end tangents are those of the parabola through the last three points.

use crate::error::{FormatError, Parsed};
use glam::{DVec3, Vec3};
use strandbench_types::StrandSet;

/// Largest distance between the spline and the chords that replace it, mm.
pub const MAX_CHORD_ERROR_MM: f64 = 0.02;

/// Most points that a resampling may make (1.6 GB).
pub const MAX_POINTS: u64 = 100_000_000;

/// One cubic between two given points, over u in [0, 1].
struct Span {
    p: [DVec3; 2],
    /// Derivatives with respect to u at both ends.
    m: [DVec3; 2],
}

impl Span {
    fn at(&self, u: f64) -> DVec3 {
        let [p0, p1] = self.p;
        let [m0, m1] = self.m;
        let d = p1 - p0;
        p0 + u * (m0 + u * ((3.0 * d - 2.0 * m0 - m1) + u * (m0 + m1 - 2.0 * d)))
    }

    fn slope(&self, u: f64) -> DVec3 {
        let [m0, m1] = self.m;
        let d = self.p[1] - self.p[0];
        m0 + u * ((6.0 * d - 4.0 * m0 - 2.0 * m1) + u * 3.0 * (m0 + m1 - 2.0 * d))
    }

    /// Number of equal steps of u after which every chord is at most `max_segment` long and within
    /// [`MAX_CHORD_ERROR_MM`] of the curve.
    fn steps(&self, max_segment: f64) -> f64 {
        let d = self.p[1] - self.p[0];
        let [m0, m1] = self.m;
        // Enough in any case: |q - chord| <= max|q''| / (8 n²) with q'' linear in u, and a cubic's speed is at
        // most three times its longest Bézier leg. It counts uneven speed as if it were curvature.
        let bend = (6.0 * d - 4.0 * m0 - 2.0 * m1).length().max((2.0 * m0 + 4.0 * m1 - 6.0 * d).length());
        let speed = m0.length().max(m1.length()).max((3.0 * d - m0 - m1).length());
        let enough = (bend / (8.0 * MAX_CHORD_ERROR_MM)).sqrt().max(speed / max_segment).ceil().max(1.0);
        let mut n = (d.length() / max_segment).ceil().max(1.0);
        if enough.is_nan() || enough > 4096.0 {
            return enough;
        }
        while n < enough && !(0..n as u32).all(|j| self.is_fine(f64::from(j) / n, 1.0 / n, max_segment)) {
            n += (n / 8.0).floor().max(1.0);
        }
        n.min(enough)
    }

    /// Whether the chord over [u, u + h] will do. The distance to it is convex, so the curve is no farther
    /// than 3/4 of its farther inner Bézier point (the two weights add up to at most 3/4).
    fn is_fine(&self, u: f64, h: f64, max_segment: f64) -> bool {
        let (a, b) = (self.at(u), self.at(u + h));
        let inner = [a + self.slope(u) * (h / 3.0), b - self.slope(u + h) * (h / 3.0)];
        let chord = b - a;
        let off = |q: DVec3| {
            let t = ((q - a).dot(chord) / chord.length_squared()).clamp(0.0, 1.0);
            q.distance(a + t * chord)
        };
        chord.length() <= max_segment && inner.into_iter().all(|q| 0.75 * off(q) <= MAX_CHORD_ERROR_MM)
    }
}

/// The spans of a polyline of two points or more, no two successive ones equal.
fn spans(points: &[Vec3]) -> impl Iterator<Item = Span> {
    let knot = move |i: usize| points[i].as_dvec3().distance(points[i + 1].as_dvec3()).sqrt();
    let slope = move |i: usize| (points[i + 1].as_dvec3() - points[i].as_dvec3()) / knot(i);
    let last = points.len() - 2;
    // Derivative at point i + 1, seen from spans i and i + 1: of the parabola through three points.
    let inner = move |i: usize| {
        let (h0, h1) = (knot(i), knot(i + 1));
        (slope(i) * h1 + slope(i + 1) * h0) / (h0 + h1)
    };
    (0..=last).map(move |i| {
        let h = knot(i);
        let (start, end) = match (i > 0, i < last) {
            (false, false) => (slope(i), slope(i)),
            (false, true) => (2.0 * slope(i) - inner(i), inner(i)),
            (true, false) => (inner(i - 1), 2.0 * slope(i) - inner(i - 1)),
            (true, true) => (inner(i - 1), inner(i)),
        };
        Span { p: [points[i].as_dvec3(), points[i + 1].as_dvec3()], m: [start * h, end * h] }
    })
}

/// Resamples every strand through a smooth interpolating spline; the given points stay, bit for bit, with
/// their radii, and radii between them are linear. Segments are at most `max_segment_mm` long, and at most
/// [`MAX_CHORD_ERROR_MM`] from the spline.
///
/// # Errors
/// If `max_segment_mm` is not finite and positive, a strand is not usable (see [`StrandSet::validate`]) or
/// repeats a point, or the result would exceed [`MAX_POINTS`].
pub fn resample(strands: &StrandSet, max_segment_mm: f32) -> Parsed<StrandSet> {
    let bad = |place: &str, fault: String| FormatError::new(place, fault, "check the strands and options");
    strands.validate().map_err(|e| bad("content", e.to_string()))?;
    if !(max_segment_mm.is_finite() && max_segment_mm > 0.0) {
        return Err(bad("option max_segment_mm", format!("{max_segment_mm} is not finite and positive")));
    }
    let max_segment = f64::from(max_segment_mm);
    let mut total = 0.0f64;
    for (i, strand) in strands.iter().enumerate() {
        if strand.windows(2).any(|w| w[0] == w[1]) {
            return Err(FormatError::at_strand(i, "a point is repeated", "drop repeated points first"));
        }
        total += 1.0 + spans(strand).map(|s| s.steps(max_segment)).sum::<f64>();
    }
    if total.is_nan() || total > MAX_POINTS as f64 {
        return Err(FormatError::new(
            "option max_segment_mm",
            format!("segments of at most {max_segment_mm} mm would make {total:.0} points"),
            format!("raise it or check scale_mm; at most {MAX_POINTS} points are allowed"),
        ));
    }
    let mut out = StrandSet::new();
    out.points.reserve_exact(total as usize);
    out.radii_mm.reserve_exact(total as usize);
    for i in 0..strands.len() {
        let range = strands.range(i);
        let (points, radii) = (&strands.points[range.clone()], &strands.radii_mm[range]);
        for (k, span) in spans(points).enumerate() {
            out.points.push(points[k]);
            out.radii_mm.push(radii[k]);
            let n = span.steps(max_segment);
            for j in 1..n as u64 {
                let u = j as f64 / n;
                let r = f64::from(radii[k]) + u * (f64::from(radii[k + 1]) - f64::from(radii[k]));
                let q = span.at(u).as_vec3();
                // Far from the origin f32 cannot hold steps this small.
                if out.points.last() == Some(&q) || points[k + 1] == q {
                    continue;
                }
                out.points.push(q);
                out.radii_mm.push(r as f32);
            }
        }
        out.points.push(points[points.len() - 1]);
        out.radii_mm.push(radii[radii.len() - 1]);
        out.offsets.push(out.points.len() as u32);
    }
    Ok(out)
}

#[cfg(test)]
mod tests;
