//! The tree's own promises: everything in one leaf, boxes that hold, depth, tests of eight that let no hit slip.

use super::bins::{Prim, SURFACE};
use super::build::build;
use super::lanes::{Lanes, Portable, has_avx2};
use super::leaf::{Cones, Name};
use super::node::{LEAF, Node, TreeRay, WIDTH};
use super::walk::MOST_LEVELS;
use crate::cone::RoundCone;
use glam::Vec3;
use strandbench_rng::Rng;

fn vector(rng: &mut Rng, size: f32) -> Vec3 {
    Vec3::new(rng.range(-size, size), rng.range(-size, size), rng.range(-size, size))
}

fn prim(low: Vec3, high: Vec3, owner: u32, item: u32) -> Prim {
    Prim { low: low.to_array(), high: high.to_array(), owner, item }
}

/// Bits of the box: boxes that are equal count as coincident.
fn key(p: &Prim) -> [u32; 8] {
    let [a, b, c] = p.low.map(f32::to_bits);
    let [d, e, f] = p.high.map(f32::to_bits);
    [a, b, c, d, e, f, 0, 0]
}

/// Identities in the leaves, after a check of every box and leaf against what is below it.
fn checked(nodes: &[Node], prims: &[Prim]) -> Vec<(u32, u32)> {
    let mut found = Vec::new();
    let mut open = vec![(0usize, [f32::NEG_INFINITY; 3], [f32::INFINITY; 3])];
    while let Some((at, low, high)) = open.pop() {
        let node = &nodes[at];
        for k in (0..WIDTH).filter(|&k| node.planes[0][0][k] < f32::INFINITY) {
            let (l, h) = ([0, 1, 2].map(|a| node.planes[a][0][k]), [0, 1, 2].map(|a| node.planes[a][1][k]));
            assert!((0..3).all(|a| low[a] <= l[a] && h[a] <= high[a]), "a child leaves its parent");
            if node.children[k] & LEAF == 0 {
                open.push((node.children[k] as usize, l, h));
                continue;
            }
            let from = (node.children[k] & !LEAF) as usize;
            let leaf = &prims[from..from + usize::from(node.counts[k])];
            assert!((1..=WIDTH).contains(&leaf.len()));
            assert!(leaf.iter().all(|p| (p.owner ^ leaf[0].owner) & SURFACE == 0), "a mixed leaf");
            for p in leaf {
                assert!((0..3).all(|a| l[a] <= p.low[a] && p.high[a] <= h[a]), "a box that does not hold");
                found.push((p.owner, p.item));
            }
        }
    }
    found.sort_unstable();
    found
}

#[test]
fn every_primitive_is_in_one_leaf_whose_boxes_hold_it() {
    for n in [1usize, 2, 8, 9, 17, 300, 5000] {
        let mut rng = Rng::keyed(&[n as u64]);
        let mut prims: Vec<Prim> = (0..n as u32)
            .map(|i| {
                let (p, s) = (vector(&mut rng, 50.0), vector(&mut rng, 3.0).abs());
                // Every fifth is a triangle; every seventh has a centre that others have too.
                let p = if i % 7 == 0 { p.round() } else { p };
                prim(p - s, p + s, if i % 5 == 0 { SURFACE } else { i / 9 }, i)
            })
            .collect();
        let mut want: Vec<_> = prims.iter().map(|p| (p.owner, p.item)).collect();
        want.sort_unstable();
        let (nodes, levels) = build(&mut prims, &key);
        assert_eq!(checked(&nodes, &prims), want, "{n} primitives");
        assert!(levels <= MOST_LEVELS);
    }
}

#[test]
fn places_that_shrink_without_end_do_not_make_the_tree_deep() {
    // A split by area takes a few octaves off at a time. (The 180 that f32 has room for make a tree that the stack
    // holds even without the limit on splits: this test shows the depth, not the limit.)
    let mut prims: Vec<Prim> = (0..1800u32)
        .map(|i| {
            let x = (1e18 * 0.5f64.powf(f64::from(i) * 0.1)) as f32;
            prim(Vec3::new(x, 0.0, 0.0), Vec3::splat(x * 1.01), i, i)
        })
        .collect();
    let want: Vec<_> = (0..1800).map(|i| (i, i)).collect();
    let (nodes, levels) = build(&mut prims, &key);
    assert_eq!(checked(&nodes, &prims), want);
    // Forty splits by area and the logarithm of what is left by number.
    assert!(levels <= 40 + 11, "{levels} levels");
}

#[test]
fn of_copies_those_that_can_be_an_answer_are_kept_and_neighbours_are_untouched() {
    let mut prims: Vec<Prim> =
        (0..5000u32).map(|i| prim(Vec3::splat(-1.0), Vec3::ONE, (4999 - i) / 10, i % 10)).collect();
    // The same centre, other boxes; and others beside.
    prims.extend(
        (0..40u32).map(|i| prim(Vec3::splat(-2.0 - i as f32), Vec3::splat(2.0 + i as f32), 5000 + i, 0)),
    );
    prims.extend((0..40u32).map(|i| prim(Vec3::splat(i as f32), Vec3::splat(3.0 + i as f32), 6000 + i, 0)));
    let (nodes, _) = build(&mut prims, &key);
    let want: Vec<_> = [(0, 0), (0, 1), (0, 2), (0, 3), (1, 0)]
        .into_iter()
        .chain((5000..5040).chain(6000..6040).map(|i| (i, 0)))
        .collect();
    assert_eq!(checked(&nodes, &prims), want);
}

#[test]
fn the_tree_is_the_same_with_any_number_of_threads() {
    let made = |threads: usize| {
        let mut rng = Rng::keyed(&[4]);
        let mut prims: Vec<Prim> = (0..150_000u32)
            .map(|i| {
                let p = vector(&mut rng, 100.0);
                prim(p, p + Vec3::ONE, i, i)
            })
            .collect();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let (nodes, _) = pool.install(|| build(&mut prims, &key));
        let order: Vec<u32> = prims.iter().map(|p| p.item).collect();
        let bits: Vec<u32> = nodes
            .iter()
            .flat_map(|n| {
                n.planes.as_flattened().as_flattened().iter().map(|v| v.to_bits()).chain(n.children)
            })
            .collect();
        (order, bits)
    };
    assert!(made(1) == made(4));
}

/// Tests of eight cones by all ways that this machine has.
fn masks(cones: &Cones, ray: &TreeRay, pad: f32, tmax: f32) -> Vec<u32> {
    // SAFETY: the one runs everywhere, the other where it is asked for first.
    let mut all = vec![unsafe { Portable::cones(cones, ray, pad, tmax) }];
    #[cfg(target_arch = "x86_64")]
    if has_avx2() {
        #[target_feature(enable = "avx2,fma")]
        fn wide(cones: &Cones, ray: &TreeRay, pad: f32, tmax: f32) -> u32 {
            // SAFETY: this function has the instructions.
            unsafe { super::lanes::Avx2::cones(cones, ray, pad, tmax) }
        }
        // SAFETY: asked for above.
        all.push(unsafe { wide(cones, ray, pad, tmax) });
    }
    all
}

#[test]
fn the_test_of_eight_cones_lets_no_hit_slip_and_few_misses_through() {
    let mut rng = Rng::keyed(&[8]);
    let pad = 4e-7 * 500.0;
    let (mut hits, mut through, mut rays) = (0u32, 0u32, 0u32);
    for round in 0..4000 {
        // A hair's scale, in a scene of 200 mm; spheres, cones with ends of unlike radius, rays along the axis.
        let mut cones = Cones::default();
        let near = vector(&mut rng, 100.0);
        let used = 1 + round % WIDTH;
        for lane in 0..used {
            let a = near + vector(&mut rng, 1.0);
            let b = if lane == 3 { a } else { a + vector(&mut rng, 4.0) };
            let cone = RoundCone::new(a, rng.range(0.02, 0.05), b, rng.range(0.02, 0.05));
            cones.set(lane, &cone, Name { owner: lane as u32, item: 0 });
        }
        let aimed = cones.get(rng.below(used as u64) as usize);
        let target = aimed.middle + aimed.half * rng.range(-1.1, 1.1) + vector(&mut rng, 0.06);
        let origin = if round % 5 == 0 {
            target + aimed.half * 20.0
        } else {
            target + vector(&mut rng, 1.0).normalize_or(Vec3::X) * rng.range(0.1, 250.0)
        };
        let direction = (target - origin).normalize_or(Vec3::X);
        let ray = TreeRay::new(origin.to_array(), origin.to_array(), direction.to_array());
        let tmax = if round % 3 == 0 { rng.range(0.0, 300.0) } else { f32::INFINITY };
        for mask in masks(&cones, &ray, pad, tmax) {
            assert_eq!(mask >> used, 0, "a lane without a cone is met");
            for lane in 0..used {
                let hit = cones.get(lane).intersect(origin, direction, 0.0).is_some_and(|h| h.t <= tmax);
                assert!(!hit || mask >> lane & 1 == 1, "round {round}: the hit of lane {lane} slips");
                hits += u32::from(hit);
            }
            through += mask.count_ones();
            rays += 1;
        }
    }
    assert!(hits > rays / 4, "{hits} hits of {rays} rays");
    // What is let through without a hit grazes, or passes near an end.
    assert!(through < 2 * hits, "{through} let through, {hits} hits");
}
