//! Distances to hair and roots against brute force.

use super::*;

fn brute(strands: &StrandSet, p: DVec3, include: impl Fn(usize) -> bool) -> (f64, usize) {
    let mut best = (f64::MAX, 0);
    for i in (0..strands.len()).filter(|&i| include(i)) {
        for w in strands.strand(i).windows(2) {
            let d = p.distance_squared(foot(p, [w[0].as_dvec3(), w[1].as_dvec3()]));
            if d < best.0 {
                best = (d, i);
            }
        }
    }
    (best.0.sqrt(), best.1)
}

#[test]
fn the_field_is_the_distance_to_the_nearest_axis_everywhere() {
    let strands = &PAIR.now.strands;
    let index = HairIndex::new(strands, |i| i % 9 == 1).unwrap();
    let field = hair_field(&index, 6.1, 10.0, &Silent).unwrap();
    let [nx, ny, nz] = field.size;
    let (low, high) = index.bounds();
    let last = field.centre_mm([nx - 1, ny - 1, nz - 1]);
    assert!((low - field.origin_mm.as_dvec3()).min_element() >= 10.0 && (last - high).min_element() >= 10.0);
    assert!((low - field.origin_mm.as_dvec3()).max_element() < 22.0 && (last - high).max_element() < 22.0);
    let mut near = 0;
    for x in 0..nx {
        for y in 0..ny {
            for z in 0..nz {
                let (i, p) = ((x * ny + y) * nz + z, field.centre_mm([x, y, z]));
                let (d, s) = brute(strands, p, |i| i % 9 == 1);
                // The same numbers in another order: equal but for rounding.
                assert!((f64::from(field.distance_mm[i]) - d).abs() <= 1e-6 * (1.0 + d));
                let own = brute(strands, p, |i| i == field.strand[i] as usize || i == s);
                assert_eq!(own.0, d);
                let of = field.strand[i] as usize;
                assert_eq!(brute(strands, p, |k| k == of).0, d, "strand {of} is not the nearest, {s} is");
                near += usize::from(d < 1.0);
            }
        }
    }
    assert!(near > 10 && field.distance_mm.len() > 1000, "{near} of {}", field.distance_mm.len());
}

#[test]
fn threads_change_no_bit() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let index = HairIndex::new(&PAIR.now.strands, |_| true).unwrap();
            let (seen, bare) = planes(&PAIR.now, &cameras()[0]);
            let refs = [PAIR.reference.refs(), PAIR.now.refs()];
            let (then, now) = (moment(&PAIR.reference, &refs[0]), moment(&PAIR.now, &refs[1]));
            let sight = Probe::new(&PAIR.reference.strands, &refs[0]).unwrap();
            let flow = flow(&cameras()[0], &seen, (&now, &then), &sight, &Silent).unwrap();
            (hair_field(&index, 3.0, 5.0, &Silent).unwrap(), seen, bare, flow)
        })
    };
    assert!(run(1) == run(3));
}

#[test]
fn roots_tell_length_kind_and_how_dense_hair_is() {
    let (strands, n) = (&PAIR.now.strands, PAIR.kinds.len());
    let triangles: Vec<u32> = PAIR.follicles.iter().map(|f| f.0).collect();
    let barycentrics: Vec<[f32; 3]> = PAIR.follicles.iter().map(|f| f.1).collect();
    let follicles = Follicles { triangles: &triangles, barycentrics: &barycentrics, kinds: &PAIR.kinds };
    let roots = hair_roots(strands, &follicles).unwrap();
    let skin = &PAIR.now.meshes[0];
    for (i, r) in roots.iter().enumerate() {
        r.check(skin.triangles.len(), 3).unwrap();
        // The follicle's place on the mesh is where the strand begins.
        let corners = skin.triangles[r.triangle as usize].map(|v| skin.vertices[v as usize]);
        let at: Vec3 = corners.iter().zip(r.barycentric).map(|(p, b)| *p * b).sum();
        assert!(at.distance(r.position_mm) < 1e-4, "strand {i}: {} mm off", at.distance(r.position_mm));
        assert_eq!((r.kind, r.length_mm), ((i % 3) as u8, strands.length_mm(i) as f32));
        let around =
            (0..n).filter(|&k| roots[k].position_mm.distance(r.position_mm) <= DENSITY_RADIUS_MM).count();
        // A disk of 5 mm has 0.7854 cm².
        assert!((r.density_per_cm2 - around as f32 / std::f32::consts::FRAC_PI_4).abs() < 1e-3);
        assert_eq!(r.length_class(), [2.0, 5.0, 20.0].iter().filter(|&&b| r.length_mm >= b).count());
    }
    let classes: Vec<usize> =
        (0..4).map(|c| roots.iter().filter(|r| r.density_class() == c).count()).collect();
    assert!(classes[0] + classes[1] + classes[2] + classes[3] == n && classes[1] > 10, "{classes:?}");
}
