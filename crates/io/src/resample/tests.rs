use super::*;

/// A helix of radius `r` and rise `rise` a radian, from `from` to `to` radians.
fn helix(r: f64, rise: f64, from: f64, to: f64, n: usize) -> StrandSet {
    let mut s = StrandSet::new();
    let points: Vec<Vec3> = (0..n)
        .map(|i| {
            let a = from + (to - from) * i as f64 / (n - 1) as f64;
            DVec3::new(r * a.cos(), -rise * a, r * a.sin()).as_vec3()
        })
        .collect();
    s.push(&points, 0.04);
    s
}

#[test]
fn given_points_stay_bit_for_bit_and_segments_are_short() {
    let s = helix(30.0, 8.0, 0.0, 12.0, 16);
    for max in [0.7, 2.0, 5.0, 1000.0] {
        let out = resample(&s, max).unwrap();
        out.validate().unwrap();
        let mut rest = out.points.iter();
        for p in &s.points {
            assert!(rest.any(|q| q == p), "{p} left the curve at max {max}");
        }
        let longest = out.points.windows(2).map(|w| w[0].distance(w[1])).fold(0.0, f32::max);
        assert!(longest <= max * 1.000_01, "{longest} > {max}");
    }
}

#[test]
fn a_straight_strand_stays_straight_and_gains_no_point_it_does_not_need() {
    let mut s = StrandSet::new();
    let uneven = [0.0, 4.0, 4.5, 9.5, 12.0, 12.1].map(|t| Vec3::new(1.0, -2.0, 2.0) * t / 3.0);
    s.push(&uneven, 0.04);
    let out = resample(&s, 5.001).unwrap();
    assert_eq!(out.points, s.points);
    for (p, q) in resample(&s, 0.3).unwrap().points.windows(2).map(|w| (w[0], w[1])) {
        let d = q - p;
        assert!(d.normalize().dot(Vec3::new(1.0, -2.0, 2.0) / 3.0) > 0.999_999, "it turned back or aside");
    }
}

/// The chords against the spline itself, evaluated densely: the stated bound holds, and is not idle.
#[test]
fn chords_stay_within_the_stated_distance_of_the_spline() {
    let s = helix(30.0, 8.0, 0.0, 12.0, 16);
    let out = resample(&s, 1000.0).unwrap();
    let mut worst: f64 = 0.0;
    for span in spans(&s.points) {
        let n = span.steps(1000.0);
        for j in 0..n as u64 {
            let (a, b) = (span.at(j as f64 / n), span.at((j + 1) as f64 / n));
            for k in 1..20 {
                let q = span.at((j as f64 + f64::from(k) / 20.0) / n);
                let t = ((q - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
                worst = worst.max(q.distance(a + t * (b - a)));
            }
        }
    }
    println!("{} points, worst chord error {worst} mm", out.points.len());
    assert!(worst <= MAX_CHORD_ERROR_MM && worst > 0.2 * MAX_CHORD_ERROR_MM, "{worst}");
}

/// A true helix sampled as published files are (10 mm segments): the spline is nearer to it than the chords are.
#[test]
fn the_spline_is_far_nearer_to_a_helix_than_its_polyline() {
    let (r, rise) = (12.0, 4.0);
    let error = |s: &StrandSet| {
        let mut worst: f64 = 0.0;
        for w in s.points.windows(2) {
            for k in 0..8 {
                let p = w[0].as_dvec3().lerp(w[1].as_dvec3(), f64::from(k) / 8.0);
                worst = worst.max((DVec3::new(p.x, 0.0, p.z).length() - r).abs());
            }
        }
        worst
    };
    let coarse = helix(r, rise, 0.0, 12.0, 16);
    let (before, after) = (error(&coarse), error(&resample(&coarse, 1.0).unwrap()));
    println!("polyline {before} mm, spline {after} mm");
    assert!(before > 0.9 && after < 0.2, "{before} {after}");
    // Fourth order: twice the points, the error falls by more than 2^3 (chord error aside).
    let finer = helix(r, rise, 0.0, 12.0, 31);
    assert!(error(&resample(&finer, 1.0).unwrap()) < after / 6.0);
}

#[test]
fn the_tangent_is_continuous_across_given_points() {
    let points = [(0.0, 0.0, 0.0), (3.0, -5.0, 1.0), (3.5, -6.0, 1.0), (9.0, -7.0, -8.0), (2.0, -19.0, 0.0)]
        .map(|(x, y, z)| Vec3::new(x, y, z));
    let spans: Vec<Span> = spans(&points).collect();
    for (i, w) in spans.windows(2).enumerate() {
        let (a, b) = (w[0].m[1].normalize(), w[1].m[0].normalize());
        assert!(a.dot(b) > 1.0 - 1e-12, "corner at point {}", i + 1);
        let step = 1e-6;
        let numeric = (w[0].at(1.0) - w[0].at(1.0 - step)) / step;
        assert!((numeric - w[0].m[1]).length() < 1e-3, "m is not the derivative");
    }
}

#[test]
fn radii_are_linear_between_points_and_two_points_suffice() {
    let mut s = StrandSet::new();
    s.push_tapered(&[Vec3::ZERO, Vec3::new(0.0, -8.0, 0.0)], &[0.05, 0.01]);
    let out = resample(&s, 2.0).unwrap();
    assert_eq!(out.points.len(), 5);
    for (p, r) in out.points.iter().zip(&out.radii_mm) {
        assert!((r - (0.05 + 0.04 * p.y / 8.0)).abs() < 1e-7);
    }
}

#[test]
fn what_would_not_fit_into_memory_is_refused() {
    let s = helix(1e6, 1e6, 0.0, 12.0, 16);
    let e = resample(&s, 1e-4).unwrap_err();
    assert!(e.fault.contains("would make") && e.place.contains("max_segment_mm"), "{e}");
    assert!(resample(&s, f32::NAN).unwrap_err().fault.contains("not finite"));
    let mut twice = StrandSet::new();
    twice.push(&[Vec3::ZERO, Vec3::ZERO], 0.04);
    assert!(resample(&twice, 1.0).unwrap_err().fault.contains("repeated"));
    let huge = f32::MAX;
    let mut far = StrandSet::new();
    far.push(&[Vec3::splat(-huge), Vec3::splat(huge), Vec3::ZERO], 0.04);
    assert!(resample(&far, 1.0).is_err());
}

/// The span between the inner two of four points by Barry and Goldman's pyramid, an independent construction.
fn pyramid(p: [DVec3; 4], u: f64) -> DVec3 {
    let mut t = [0.0; 4];
    for i in 0..3 {
        t[i + 1] = t[i] + p[i].distance(p[i + 1]).powf(0.5);
    }
    let x = t[1] + u * (t[2] - t[1]);
    let mix = |a: DVec3, b: DVec3, i: usize, j: usize| (a * (t[j] - x) + b * (x - t[i])) / (t[j] - t[i]);
    let a = [mix(p[0], p[1], 0, 1), mix(p[1], p[2], 1, 2), mix(p[2], p[3], 2, 3)];
    let b = [mix(a[0], a[1], 0, 2), mix(a[1], a[2], 1, 3)];
    mix(b[0], b[1], 1, 2)
}

#[test]
fn inner_spans_are_centripetal_catmull_rom_and_end_spans_parabolas() {
    let points = [(0.0, 0.0, 0.0), (3.0, -5.0, 1.0), (3.5, -6.0, 1.0), (9.0, -7.0, -8.0)]
        .map(|(x, y, z)| Vec3::new(x, y, z));
    let spans: Vec<Span> = spans(&points).collect();
    let p = points.map(|p| p.as_dvec3());
    for i in 0..=10 {
        let u = f64::from(i) / 10.0;
        assert!(spans[1].at(u).distance(pyramid(p, u)) < 1e-12);
        // The parabola through the first three points at the same knots (Lagrange).
        let (h0, h1) = (p[0].distance(p[1]).sqrt(), p[1].distance(p[2]).sqrt());
        let (x, t1, t2) = (u * h0, h0, h0 + h1);
        let parabola = p[0] * ((x - t1) * (x - t2) / (t1 * t2))
            + p[1] * (x * (x - t2) / (t1 * (t1 - t2)))
            + p[2] * (x * (x - t1) / (t2 * (t2 - t1)));
        assert!(spans[0].at(u).distance(parabola) < 1e-12);
    }
}
