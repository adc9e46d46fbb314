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
