use super::super::stairs::{GRID_DEG, cos_squared};
use super::*;
use proptest::prelude::*;
use strandbench_rng::Rng;

fn random(seed: u64, n: u64) -> StrandSet {
    let mut set = StrandSet::new();
    for i in 0..n {
        let mut r = Rng::keyed(&[seed, i]);
        let mut v = |s: f32| Vec3::new(r.range(-s, s), r.range(-s, s), r.range(-s, s));
        let a = v(8.0);
        set.push(&[a, a + v(3.0), a + v(4.0)], 0.04);
    }
    set
}

fn brute(set: &StrandSet, p: DVec3, t: DVec3) -> Vec<(f64, f64)> {
    let mut all = Vec::new();
    for s in set.iter() {
        for w in s.windows(2) {
            let (a, b) = (w[0].as_dvec3(), w[1].as_dvec3());
            let u = b - a;
            let along = ((p - a).dot(u) / u.length_squared()).clamp(0.0, 1.0);
            all.push((p.distance(a + u * along), t.dot(u.normalize()).abs().min(1.0).acos().to_degrees()));
        }
    }
    all
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]
    #[test]
    fn queries_agree_with_brute_force(seed in any::<u64>(), n in 1..120u64) {
        let set = random(seed, n);
        let curves = Curves::whole(&set, |_| true).unwrap();
        let mut r = Rng::keyed(&[seed, 1 << 40]);
        let mut v = |s: f32| DVec3::new(f64::from(r.range(-s, s)), f64::from(r.range(-s, s)), f64::from(r.range(-s, s)));
        let (p, t) = (v(9.0), v(1.0).normalize());
        let all = brute(&set, p, t);
        let hit = curves.nearest(p, t, f64::INFINITY, 0.0).unwrap();
        let stairs = curves.staircase(p, t, &hit);
        for (d, mm) in GRID_MM.iter().enumerate() {
            for deg in GRID_DEG {
                let want = all.iter().any(|(x, a)| x <= mm && *a <= deg);
                let place = GRID_DEG.iter().position(|g| *g == deg).unwrap();
                prop_assert_eq!(usize::from(stairs[d]) <= place, want, "{} mm {} deg", mm, deg);
            }
        }
        let nearest = all.iter().fold(f64::INFINITY, |m, x| m.min(x.0));
        prop_assert!((hit.distance_mm - nearest).abs() < 1e-12);
        let aligned = all.iter().filter(|x| x.1 <= 20.0).fold(f64::INFINITY, |m, x| m.min(x.0));
        let hit = curves.nearest(p, t, 4.0, cos_squared(20.0));
        prop_assert_eq!(hit.map_or(f64::INFINITY, |h| (h.distance_mm * 1e9).round()),
            if aligned <= 4.0 { (aligned * 1e9).round() } else { f64::INFINITY });
    }
}

#[test]
fn ties_go_to_the_smaller_angle_and_parts_end_where_they_are_cut() {
    let mut set = StrandSet::new();
    set.push(&[Vec3::ZERO, Vec3::X, Vec3::new(1.0, -1.0, 0.0)], 0.04);
    let curves = Curves::whole(&set, |_| true).unwrap();
    let corner = DVec3::new(2.0, 1.0, 0.0);
    for (t, point) in [(DVec3::X, 0), (DVec3::Y, 1)] {
        let hit = curves.nearest(corner, t, 9.0, 0.0).unwrap();
        assert_eq!((hit.point, hit.cos2), (point, 1.0));
    }
    assert_eq!(curves.nearest(corner, DVec3::Y, 9.0, 0.0).unwrap().direction, DVec3::NEG_Y);
    let parts = Curves::parts(&set, &[(0, [0.25, 0.5])]);
    let hit = parts.nearest(DVec3::new(1.0, 0.0, 0.0), DVec3::X, 9.0, 0.0).unwrap();
    assert_eq!((hit.distance_mm, hit.along), (0.5, 0.5));
    assert!(parts.nearest(DVec3::X, DVec3::X, 0.4, 0.0).is_none());
    let far = DVec3::new(0.5, 3.5, 0.0);
    let hit = curves.nearest(far, DVec3::X, 9.0, 0.0).unwrap();
    let far = curves.staircase(far, DVec3::X, &hit);
    assert_eq!(far.map(|c| c < 6), [false, false, false, false, false, true, true]);
    assert!(curves.vertex_staircase(DVec3::new(0.5, 0.0, 0.0), DVec3::X)[0] == 6, "no vertex within 0.25 mm");
}
