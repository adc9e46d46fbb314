//! Which cameras see which samples.

use super::*;

/// Which of a 3.2 mm strand's samples are seen, from (arc length of hit, pixel) pairs.
fn seen(rays: u16, hits: &[(f32, usize)]) -> Vec<u32> {
    let mut strands = StrandSet::new();
    // Two segments, of 1.2 and 2 mm; the middle of the image of two pixels lies at x = 0.
    strands
        .push(&[Vec3::new(-1.0, 0.0, 100.0), Vec3::new(0.2, 0.0, 100.0), Vec3::new(2.2, 0.0, 100.0)], 0.04);
    let listed: Vec<_> = hits
        .iter()
        .map(|&(s, pixel)| {
            let (segment, along) = if s < 1.2 { (0, s / 1.2) } else { (1, (s - 1.2) / 2.0) };
            (pixel, SampleHit { strand: 0, segment, along, depth_mm: 100.0 })
        })
        .collect();
    let t = truth(&rig(vec![camera("a", 2, 1)]), &strands, None, &[buffer(2, 1, rays, &listed)]).unwrap();
    assert_eq!(t.visibility.offsets, [0, 6]);
    t.visibility.seen_by
}

#[test]
fn samples_are_seen_from_a_twentieth_of_a_pixel_on() {
    // Stretches are 0-0.5, 0.5-1, ... and 2.5-3.2; with 20 rays one hit is 5 %.
    assert_eq!(seen(20, &[(0.2, 0)]), [1, 0, 0, 0, 0, 0]);
    assert_eq!(seen(20, &[(0.7, 0), (1.3, 1), (1.49, 1)]), [0, 1, 1, 0, 0, 0]);
    assert_eq!(seen(20, &[(3.15, 1), (2.0, 1)]), [0, 0, 0, 0, 1, 1]);
    // With 40 rays it takes two hits, which may lie in different pixels but not on different stretches.
    assert_eq!(seen(40, &[(0.7, 0), (1.3, 1)]), [0; 6]);
    assert_eq!(seen(40, &[(1.1, 0), (1.3, 1)]), [0, 0, 1, 0, 0, 0]);
    // Three of sixty are one twentieth exactly.
    assert_eq!(seen(60, &[(1.1, 0), (1.2, 0), (1.3, 1)]), [0, 0, 1, 0, 0, 0]);
}

#[test]
fn each_hit_counts_by_the_rays_of_its_own_pixel() {
    let mut strands = StrandSet::new();
    strands.push(&[Vec3::new(-1.0, 0.0, 100.0), Vec3::new(0.4, 0.0, 100.0)], 0.04);
    let at = |s: f32| SampleHit { strand: 0, segment: 0, along: s / 1.4, depth_mm: 100.0 };
    let seen = |rays: [u16; 2]| {
        let mut b = buffer(2, 1, 1, &[(0, at(0.6)), (1, at(0.9))]);
        b.rays = rays.to_vec();
        truth(&rig(vec![camera("a", 2, 1)]), &strands, None, &[b]).unwrap().visibility.seen_by
    };
    // 1/30 + 1/120 of a pixel is too little, 1/30 + 1/60 is exactly enough.
    assert_eq!(seen([30, 120]), [0, 0, 0]);
    assert_eq!(seen([120, 30]), [0, 0, 0]);
    assert_eq!(seen([30, 60]), [0, 1, 0]);
}

#[test]
fn cameras_have_their_own_bits_and_short_strands_none() {
    let mut strands = ladder(1);
    strands.push(&[Vec3::new(0.0, 0.0, 90.0), Vec3::new(0.2, 0.0, 90.0)], 0.04);
    let listed = [(0, hit(0, 0.1, 100.0)), (0, hit(1, 0.5, 90.0))];
    let t = truth(
        &rig(vec![camera("a", 1, 1), camera("b", 1, 1)]),
        &strands,
        None,
        &[buffer(1, 1, 2, &[]), buffer(1, 1, 2, &listed)],
    )
    .unwrap();
    assert_eq!((t.visibility.offsets, t.visibility.seen_by), (vec![0, 4, 4], vec![2, 0, 0, 0]));
    assert_eq!(t.views[1].depth_first.get(0, 0), Some(90.0));
    for (length, samples) in [(0.0, 0), (0.24, 0), (0.25, 1), (0.74, 1), (0.75, 2), (10.0, 20)] {
        assert_eq!(Visibility::samples_on(length), samples, "{length} mm at step {VISIBILITY_STEP_MM}");
    }
}

#[test]
fn one_camera_after_the_other_sees_what_all_at_once_see() {
    let (rig, strands, hits) = traced(9);
    let all = truth(&rig, &strands, None, &hits).unwrap();
    let text = |v: &[strandbench_types::ViewTruth]| format!("{v:?}");
    let mut sightings = Sightings::new(&rig, &strands).unwrap();
    let mut views: Vec<_> =
        (0..hits.len()).rev().map(|c| sightings.add(c, &hits[c].clone()).unwrap()).collect();
    views.reverse();
    let e = sightings.add(1, &hits[1]).unwrap_err().to_string();
    assert!(e.contains("camera b comes twice"), "{e}");
    let e = sightings.add(9, &hits[1]).unwrap_err().to_string();
    assert!(e.contains("there is none with index 9"), "{e}");
    assert_eq!((sightings.finish(), text(&views)), (all.visibility.clone(), text(&all.views)));
    // A faulty buffer leaves no trace.
    let mut sightings = Sightings::new(&rig, &strands).unwrap();
    let mut bad = hits[0].clone();
    bad.hits.last_mut().unwrap().along = 2.0;
    assert!(sightings.add(0, &bad).is_err());
    sightings.add(1, &hits[1]).unwrap();
    sightings.add(0, &hits[0]).unwrap();
    assert_eq!(sightings.finish(), all.visibility);
    // By counting: a sample is seen where its hits cover a twentieth of a pixel.
    for (c, b) in hits.iter().enumerate() {
        let mut covered = vec![0.0f64; all.visibility.seen_by.len()];
        for (i, h) in (0..b.rays.len()).flat_map(|i| b.pixel(i).iter().map(move |h| (i, h))) {
            let points = strands.strand(h.strand as usize);
            let before: f64 =
                points[..=h.segment as usize].windows(2).map(|w| f64::from(w[0].distance(w[1]))).sum();
            let own = f64::from(points[h.segment as usize].distance(points[h.segment as usize + 1]));
            let of = &all.visibility.offsets[h.strand as usize..];
            let k = of[0] + ((before + f64::from(h.along) * own) / 0.5) as u32;
            covered[k.min(of[1] - 1) as usize] += 1.0 / f64::from(b.rays[i]);
        }
        for (seen, covered) in all.visibility.seen_by.iter().zip(covered) {
            assert_eq!(seen >> c & 1 == 1, covered > 0.05 - 1e-9);
        }
    }
}
