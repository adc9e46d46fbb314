use super::*;
use proptest::prelude::*;
use strandbench_rng::Rng;

#[test]
fn halves_built_side_by_side_make_the_tree_of_one_after_the_other() {
    let point = |i: usize| {
        let mut r = Rng::keyed(&[9, i as u64]);
        Vec3::new(r.range(-50.0, 50.0), r.range(-50.0, 50.0), r.range(-50.0, 50.0))
    };
    let n = 3 * PARALLEL;
    let (tree, order) = Tree::new(n, |i| [point(i); 2]);
    let found = tree.fold(
        (0, 0),
        |ranks| (ranks.len(), ranks.map(|r| order[r] as u64).sum::<u64>()),
        |a, b| (a.0 + b.0, a.1 + b.1),
    );
    assert_eq!(found[0], (n, (n as u64 - 1) * n as u64 / 2), "every member below the root once");
    for (i, node) in tree.nodes.iter().enumerate().filter(|(_, node)| node.count == 0) {
        let own = tree.bounds[i];
        for child in [&tree.bounds[i + 1], &tree.bounds[node.link as usize]] {
            let inside = own.lo.cmple(child.lo).all() && own.hi.cmpge(child.hi).all();
            assert!(inside && node.link as usize > i + 1, "node {i}");
        }
    }
    let p = DVec3::new(3.0, -7.0, 2.0);
    let mut met = 0;
    tree.walk(p, 100.0, |rank| {
        met += usize::from(point(order[rank] as usize).as_dvec3().distance_squared(p) <= 100.0);
        100.0
    });
    assert_eq!(met, (0..n).filter(|&i| point(i).as_dvec3().distance_squared(p) <= 100.0).count());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]
    #[test]
    fn a_walk_meets_every_member_within_reach(seed in any::<u64>(), n in 0..300usize, equal in any::<bool>()) {
        let point = |i: usize| {
            let mut r = Rng::keyed(&[seed, if equal { i as u64 % 3 } else { i as u64 }]);
            Vec3::new(r.range(-50.0, 50.0), r.range(-50.0, 50.0), r.range(-1.0, 1.0))
        };
        let (tree, order) = Tree::new(n, |i| [point(i), point(i) + Vec3::ONE]);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        prop_assert!(sorted.iter().enumerate().all(|(i, &o)| i == o as usize), "every member once");
        let (p, reach) = (DVec3::new(3.0, -7.0, 2.0), 400.0);
        let mut met = vec![false; n];
        tree.walk(p, reach, |rank| { met[order[rank] as usize] = true; reach });
        for i in 0..n {
            let nearest = p.clamp(point(i).as_dvec3(), (point(i) + Vec3::ONE).as_dvec3());
            prop_assert!(met[i] || nearest.distance_squared(p) > reach, "member {i}");
        }
    }
}
