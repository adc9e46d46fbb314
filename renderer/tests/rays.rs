//! Rays against fibres and meshes: the BVH against brute force, round cones against an f64 oracle.

use glam::{DVec3, Vec3};
use proptest::prelude::*;
use strandbench_renderer::accel::{Accel, Hit, LastBlockers, Skip};
use strandbench_renderer::cone::{RoundCone, Triangle};
use strandbench_rng::Rng;
use strandbench_types::{StrandSet, TriMesh};

fn direction(rng: &mut Rng) -> Vec3 {
    loop {
        let v = Vec3::new(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0), rng.range(-1.0, 1.0));
        if (0.01..1.0).contains(&v.length_squared()) {
            return v.normalize();
        }
    }
}

fn point(rng: &mut Rng, size: f32) -> Vec3 {
    Vec3::new(rng.range(-size, size), rng.range(-size, size), rng.range(-size, size))
}

/// Random strands of a few segments, some with repeated points, within a cube of half side `size`.
fn strands(rng: &mut Rng, n: usize, size: f32, radius: f32) -> StrandSet {
    let mut set = StrandSet::new();
    for _ in 0..n {
        let mut p = point(rng, size);
        let (mut points, mut radii) = (vec![p], vec![radius * rng.range(0.3, 1.0)]);
        for _ in 0..3 {
            if rng.f32() > 0.1 {
                p += direction(rng) * rng.range(0.0, 0.2 * size);
            }
            points.push(p);
            radii.push(radius * rng.range(0.3, 1.0));
        }
        set.push_tapered(&points, &radii);
    }
    set
}

fn mesh(rng: &mut Rng, n: u32, size: f32) -> TriMesh {
    let mut m = TriMesh::default();
    for i in 0..n {
        let a = point(rng, size);
        m.vertices.extend([a, a + point(rng, 0.2 * size), a + point(rng, 0.2 * size)]);
        m.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    m
}

fn brute(strands: &StrandSet, mesh: &TriMesh, o: Vec3, d: Vec3) -> Option<Hit> {
    let mut best: Option<Hit> = None;
    let mut t = f32::INFINITY;
    for s in 0..strands.len() {
        let r = strands.range(s);
        for i in r.start..r.end - 1 {
            let (p, w) = (&strands.points, &strands.radii_mm);
            if let Some(h) = RoundCone::new(p[i], w[i], p[i + 1], w[i + 1]).intersect(o, d, 0.0)
                && h.t < t
            {
                t = h.t;
                best = Some(Hit::Fibre { t, strand: s as u32, point: i as u32, along: h.along });
            }
        }
    }
    for (i, k) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = k.map(|v| mesh.vertices[v as usize]);
        if let Some(h) = (Triangle { a, ab: b - a, ac: c - a }).intersect(o, d, 0.0)
            && h.t < t
        {
            t = h.t;
            best = Some(Hit::Mesh { t, surface: 0, triangle: i as u32, uv: [h.u, h.v] });
        }
    }
    best
}

fn distance(h: Option<Hit>) -> f32 {
    match h {
        Some(Hit::Fibre { t, .. } | Hit::Mesh { t, .. }) => t,
        None => f32::INFINITY,
    }
}

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

/// Distance (f64) to the hull of two spheres: the least over all spheres between them, found by golden section
/// (the distance is convex in the position).
fn hull_distance(p: DVec3, a: DVec3, ra: f64, b: DVec3, rb: f64) -> f64 {
    let f = |u: f64| p.distance(a.lerp(b, u)) - (ra + (rb - ra) * u);
    let (mut lo, mut hi) = (0.0f64, 1.0f64);
    for _ in 0..120 {
        let (u, v) = (hi - 0.618_033_988_75 * (hi - lo), lo + 0.618_033_988_75 * (hi - lo));
        if f(u) < f(v) { hi = v } else { lo = u }
    }
    f(0.5 * (lo + hi)).min(f(0.0)).min(f(1.0))
}

fn march(o: DVec3, d: DVec3, a: DVec3, ra: f64, b: DVec3, rb: f64) -> Option<f64> {
    let reach = o.distance(a).max(o.distance(b)) + ra.max(rb) + 1.0;
    let mut t = 0.0;
    for _ in 0..20_000 {
        let s = hull_distance(o + d * t, a, ra, b, rb);
        if s < 1e-9 {
            return Some(t);
        }
        t += s;
        if t > reach {
            return None;
        }
    }
    Some(t)
}

#[test]
fn round_cones_agree_with_sphere_tracing_in_f64() {
    let mut rng = Rng::keyed(&[5]);
    let (mut hits, mut unclear) = (0, 0);
    for k in 0..1500 {
        let far = if k % 2 == 0 { 300.0 } else { 5.0 };
        let a = point(&mut rng, 100.0);
        let b = a + direction(&mut rng) * rng.range(0.0, 6.0);
        let (ra, rb) = (rng.range(0.02, 0.08), rng.range(0.02, 0.08));
        // Rays along the axis too.
        let o = if k % 5 == 0 {
            a + (a - b) * 3.0 + point(&mut rng, 0.03)
        } else {
            a + direction(&mut rng) * far
        };
        let d = (a.lerp(b, rng.f32()) + point(&mut rng, 0.08) - o).normalize_or(Vec3::X);
        let got = RoundCone::new(a, ra, b, rb).intersect(o, d, 0.0);
        let (dd, da, db) = (d.as_dvec3().normalize(), a.as_dvec3(), b.as_dvec3());
        let od = o.as_dvec3();
        if hull_distance(od, da, f64::from(ra), db, f64::from(rb)) <= 1e-3 {
            continue;
        }
        let want = march(od, dd, da, f64::from(ra), db, f64::from(rb));
        match (got, want) {
            (Some(g), Some(w)) => {
                hits += 1;
                let p = od + dd * f64::from(g.t);
                let off = hull_distance(p, da, f64::from(ra), db, f64::from(rb)).abs();
                // Along the ray a grazing hit is ill-conditioned; across the surface it is not.
                assert!(off < 1e-4, "ray {k}: {off} mm off the surface (t {} against {w})", g.t);
            }
            (None, None) => {}
            // f32 rounding of the direction moves a ray by up to 6e-8 of its distance: 4e-5 mm.
            _ => {
                let grown = march(od, dd, da, f64::from(ra) + 6e-5, db, f64::from(rb) + 6e-5).is_some();
                let shrunk = march(od, dd, da, f64::from(ra) - 6e-5, db, f64::from(rb) - 6e-5).is_none();
                assert!(grown && shrunk, "ray {k}: {got:?} against {want:?}");
                unclear += 1;
            }
        }
    }
    assert!(hits > 500 && unclear < 8, "{hits} hits, {unclear} grazing");
}

proptest! {
    #[test]
    fn degenerate_segments_never_give_nan(
        p in prop::array::uniform3(-1.0f32..1.0),
        q in prop::array::uniform3(-1.0f32..1.0),
        same in any::<bool>(),
        radii in prop::array::uniform2(1e-6f32..2.0),
        o in prop::array::uniform3(-3.0f32..3.0),
        along in any::<bool>(),
        d in prop::array::uniform3(-1.0f32..1.0),
    ) {
        let (p, q) = (Vec3::from(p), if same { Vec3::from(p) } else { Vec3::from(q) });
        let d = if along { q - p } else { Vec3::from(d) };
        let d = d.normalize_or(Vec3::Z);
        let cone = RoundCone::new(p, radii[0], q, radii[1]);
        let (lo, hi) = cone.bounds();
        for origin in [Vec3::from(o), p, p - d * 5.0] {
            if let Some(h) = cone.intersect(origin, d, 0.0) {
                prop_assert!(h.t > 0.0 && h.t.is_finite());
                prop_assert!((0.0..=1.0).contains(&h.along));
                let x = origin + d * h.t;
                prop_assert!(x.cmpge(lo - 1e-4).all() && x.cmple(hi + 1e-4).all(), "{x} outside {lo}..{hi}");
            }
        }
    }
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
