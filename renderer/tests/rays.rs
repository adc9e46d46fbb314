//! Rays against fibres and meshes: the BVH against brute force.

mod geometry;

use geometry::{brute, direction, distance, mesh, point, strands};
use glam::Vec3;
use strandbench_renderer::accel::{Accel, Hit, LastBlockers, Skip};
use strandbench_rng::Rng;
use strandbench_types::{StrandSet, TriMesh};

#[test]
fn bvh_gives_the_brute_force_answer_to_the_bit() {
    // From dense tufts to fibres of a hair's scale seen from afar, where a textbook f32 test fails.
    for (case, (n, size, radius, far)) in
        [(300, 50.0, 3.0, 80.0), (400, 20.0, 0.04, 900.0), (1, 10.0, 1.0, 30.0), (2, 5.0, 0.5, 5.0)]
            .into_iter()
            .enumerate()
    {
        let mut rng = Rng::keyed(&[11, case as u64]);
        let set = strands(&mut rng, n, size, radius);
        let m = mesh(&mut rng, if n > 2 { 40 } else { 0 }, size);
        let accel = Accel::new(&set, &[&m]).unwrap();
        let narrow = Accel::new(&set, &[&m]).unwrap().portable();
        let (mut hits, mut blocked) = (0, 0);
        let mut last = LastBlockers::default();
        for k in 0..4000 {
            // Half of the rays aim at a fibre, so that thin ones are met.
            let o = direction(&mut rng) * far;
            let target = if k % 2 == 0 {
                set.points[rng.below(set.points.len() as u64) as usize] + point(&mut rng, radius)
            } else {
                point(&mut rng, size)
            };
            let d = (target - o).normalize();
            let want = brute(&set, &m, o, d);
            assert_eq!(accel.closest(o, d), want, "case {case}, ray {k}");
            assert_eq!(narrow.closest(o, d), want, "case {case}, ray {k}, portable");
            hits += usize::from(want.is_some());
            let tmax = far * rng.range(0.2, 2.0);
            let shadow = accel.occluded(o, d, tmax, None, &mut last);
            assert_eq!(shadow, distance(want) < tmax, "case {case}, shadow ray {k}");
            assert_eq!(narrow.occluded(o, d, tmax, None, &mut LastBlockers::default()), shadow);
            blocked += usize::from(shadow);
        }
        assert!(hits > 1000 && blocked > 300, "case {case}: {hits} hits, {blocked} blocked");
    }
}

#[test]
fn shadow_rays_pass_their_own_fibre_and_nothing_else() {
    let mut set = StrandSet::new();
    // A straight fibre along x and a second one above it.
    set.push(&(0..10).map(|i| Vec3::new(i as f32, 0.0, 0.0)).collect::<Vec<_>>(), 0.05);
    set.push(&[Vec3::new(0.0, 1.0, 0.0), Vec3::new(9.0, 1.0, 0.0)], 0.05);
    let accel = Accel::new(&set, &[]).unwrap();
    let mut last = LastBlockers::default();
    let under = Vec3::new(4.5, -0.05, 0.0);
    let skip = Some(Skip { strand: 0, point: 4, near_mm: 0.2 });
    assert!(accel.occluded(under, Vec3::Y, 100.0, skip, &mut last), "the fibre above blocks");
    assert!(!accel.occluded(under, Vec3::Y, 0.9, skip, &mut last), "its own does not");
    assert!(accel.occluded(under + Vec3::NEG_Y, Vec3::Y, 1.5, None, &mut last), "without skip it does");
    // A neighbour that comes back from afar does block.
    let far = Vec3::new(4.5, -5.0, 0.0);
    assert!(accel.occluded(far, Vec3::Y, 5.5, Some(Skip { strand: 0, point: 8, near_mm: 0.2 }), &mut last));
}

#[test]
fn empty_and_coincident_geometry_is_handled() {
    assert!(Accel::new(&StrandSet::new(), &[]).is_err());
    let mut set = StrandSet::new();
    for _ in 0..20_000 {
        set.push(&[Vec3::ONE, Vec3::ONE], 0.1);
    }
    let accel = Accel::new(&set, &[]).unwrap();
    let hit = accel.closest(Vec3::new(1.0, 1.0, -5.0), Vec3::Z).unwrap();
    assert_eq!(hit, Hit::Fibre { t: 5.9, strand: 0, point: 0, along: 0.5 }, "the lowest of equals");
    assert_eq!(accel.closest(Vec3::ONE, Vec3::Z), None, "a ray from inside sees no entry");
}

#[test]
fn nested_fibres_around_one_point_neither_overflow_the_stack_nor_lose_hits() {
    // Each box holds all smaller ones: merging neighbours makes a chain as deep as there are fibres. Around one
    // centre, and from one corner.
    for (n, growth, centred) in [(60_000, 1.0f32, true), (60_000, 1.000_1, true), (1_500, 1.01, false)] {
        let mut rng = Rng::keyed(&[6]);
        let mut set = StrandSet::new();
        let mut half = 1e-3f32;
        for i in 0..n {
            half = if growth == 1.0 { 1e-3 * (i + 1) as f32 } else { half * growth };
            let d = direction(&mut rng) * half;
            if centred { set.push(&[-d, d], 1e-3) } else { set.push(&[Vec3::ZERO, d.abs()], 1e-3) }
        }
        let accel = Accel::new(&set, &[]).unwrap();
        let mut hits = 0;
        for _ in 0..20 {
            let o = direction(&mut rng) * (3.0 * half);
            let target = set.points[rng.below(set.points.len() as u64) as usize] * 0.5;
            let d = (target - o).normalize();
            let want = brute(&set, &TriMesh::default(), o, d);
            assert_eq!(accel.closest(o, d), want, "growth {growth}");
            hits += usize::from(want.is_some());
        }
        assert!(hits > 5, "growth {growth}: {hits} hits");
    }
}

#[test]
fn segments_without_length_do_no_harm_and_infinite_ones_are_refused() {
    let mut rng = Rng::keyed(&[21]);
    let mut set = strands(&mut rng, 200, 20.0, 0.5);
    // Strands that are a single place, hair-thin, many at one point, and a mesh of slivers.
    for i in 0..300 {
        let p = if i % 2 == 0 { Vec3::splat(3.0) } else { point(&mut rng, 20.0) };
        set.push(&[p, p, p], if i % 3 == 0 { 1e-7 } else { 0.4 });
    }
    let mut slivers = mesh(&mut rng, 20, 20.0);
    for i in 0..20u32 {
        slivers.triangles.push([3 * i, 3 * i, 3 * i + 1]);
        slivers.triangles.push([3 * i; 3]);
    }
    let accel = Accel::new(&set, &[&slivers]).unwrap();
    let mut hits = 0;
    for _ in 0..3000 {
        let o = direction(&mut rng) * 60.0;
        let d = (point(&mut rng, 20.0) - o).normalize();
        let want = brute(&set, &slivers, o, d);
        assert_eq!(accel.closest(o, d), want);
        hits += usize::from(want.is_some());
    }
    assert!(hits > 300, "{hits} hits");
    let narrow = Accel::new(&set, &[&slivers]).unwrap().portable();
    let outside = Vec3::new(0.0, 0.0, -50.0);
    for (o, d) in [
        (outside, Vec3::ZERO),
        (outside, Vec3::NAN),
        (outside, Vec3::INFINITY),
        (outside, Vec3::new(f32::NAN, 0.0, 1.0)),
        (Vec3::NAN, Vec3::Z),
        (Vec3::splat(f32::NEG_INFINITY), Vec3::Z),
    ] {
        for accel in [&accel, &narrow] {
            assert_eq!(accel.closest(o, d), None, "from {o} along {d}");
            assert!(!accel.occluded(o, d, f32::INFINITY, None, &mut LastBlockers::default()));
            assert!(!accel.occluded(outside, Vec3::Z, f32::NAN, None, &mut LastBlockers::default()));
        }
    }
    set.points[5] = Vec3::new(0.0, f32::INFINITY, 0.0);
    let error = Accel::new(&set, &[]).err().expect("infinite").to_string();
    assert!(error.contains("strand 1: the segment from point"), "{error}");
}

#[test]
fn a_ray_looks_at_few_of_many_segments() {
    // 100,000 segments in locks: a tree that does its work spares a ray all but two thousandths of them.
    let mut rng = Rng::keyed(&[22]);
    let mut set = StrandSet::new();
    for _ in 0..2000 {
        let (mut p, mut points) = (point(&mut rng, 60.0), Vec::new());
        let heading = (Vec3::NEG_Y + direction(&mut rng) * 0.3).normalize();
        for _ in 0..51 {
            points.push(p);
            p += (heading + direction(&mut rng) * 0.2) * 3.0;
        }
        set.push(&points, 0.04);
    }
    let accel = Accel::new(&set, &[]).unwrap();
    let shape = accel.shape();
    assert_eq!(shape.primitives, 100_000);
    assert!(shape.leaves < 100_000 / 6, "leaves of eight hold {} on average", 100_000 / shape.leaves);
    let (mut nodes, mut leaves) = (0, 0);
    for _ in 0..1000 {
        let o = direction(&mut rng) * 400.0;
        let work = accel.work_of_closest(o, (point(&mut rng, 60.0) - o).normalize());
        nodes += work.nodes;
        leaves += work.leaves;
    }
    // Two thousandths of the segments, eight a leaf, are 25 leaves a ray, with two nodes on the way to each.
    assert!(leaves < 25_000 && nodes < 50_000, "{} leaves and {} nodes a ray", leaves / 1000, nodes / 1000);
}
