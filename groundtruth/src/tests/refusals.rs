//! Input that is refused.

use super::*;

#[test]
fn inconsistent_input_is_refused_and_named() {
    let good = || buffer(1, 1, 4, &[(0, hit(0, 0.5, 100.0))]);
    let run = |strands: &StrandSet, b: SampleHits| {
        truth(&rig(vec![camera("a", 1, 1)]), strands, None, &[b]).map(|_| ()).unwrap_err().to_string()
    };
    let with = |change: fn(&mut SampleHits)| {
        let mut b = good();
        change(&mut b);
        run(&ladder(1), b)
    };
    truth(&rig(vec![camera("a", 1, 1)]), &ladder(1), None, &[good()]).unwrap();
    let cases: [(String, &str); 14] = [
        (with(|b| b.hits[0].strand = 7), "strand 7, segment 0 names none of the 1 strands"),
        (with(|b| b.hits[0].segment = 1), "names none of its 1 segments"),
        (with(|b| b.hits[0].along = f32::NAN), "outside 0..1"),
        (with(|b| b.hits[0].along = 1.5), "outside 0..1"),
        (with(|b| b.hits[0].depth_mm = f32::NAN), "has depth NaN"),
        (with(|b| b.hits[0].depth_mm = 101.0), "axis is at 100.000 mm"),
        (with(|b| b.hits.clear()), "offsets run from 0 to 1 but there are 0 hits"),
        (with(|b| b.offsets = vec![0, 9]), "offsets run from 0 to 9 but there are 1 hits"),
        (with(|b| b.offsets = vec![0]), "1 pixels need as many"),
        (with(|b| b.rays = vec![0]), "has 1 hits of 0 rays"),
        (with(|b| b.width = 2), "it is 2x1"),
        (run(&StrandSet::new(), good()), "no strands"),
        (
            run(
                &{
                    let mut s = ladder(1);
                    s.points[0].x = f32::NAN;
                    s
                },
                good(),
            ),
            "not finite",
        ),
        (
            run(
                &{
                    let mut s = ladder(1);
                    s.points[0].x = -3e8;
                    s
                },
                good(),
            ),
            "check the unit",
        ),
    ];
    for (got, want) in &cases {
        assert!(got.contains(want), "{got:?} does not say {want:?}");
    }
    let e = truth(&rig(vec![camera("a", 1, 1)]), &ladder(1), None, &[]).unwrap_err();
    assert!(e.to_string().contains("0 identity buffers"), "{e}");
}

#[test]
fn a_hit_that_projects_far_from_its_pixel_is_refused() {
    let mut s = StrandSet::new();
    s.push(&[Vec3::new(-1.0, 0.0, 100.0), Vec3::new(9.0, 0.0, 100.0)], 0.04);
    let b = buffer(1, 1, 4, &[(0, hit(0, 0.9, 100.0))]);
    let e = truth(&rig(vec![camera("a", 1, 1)]), &s, None, &[b]).unwrap_err();
    assert!(
        e.to_string().contains("camera 0, pixel (0, 0)") && e.to_string().contains("projects to (8.50"),
        "{e}"
    );
}
