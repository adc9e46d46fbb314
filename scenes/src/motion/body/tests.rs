use super::*;
use strandbench_rng::Rng;

fn turns() -> [HeadTurn; 4] {
    let r = |x: f64, y: f64| HeadTurn {
        rotation: DQuat::from_rotation_y(y.to_radians()) * DQuat::from_rotation_x(x.to_radians()),
    };
    [r(0.0, 0.0), r(15.0, 0.0), r(-20.0, 40.0), r(0.0, 75.0)]
}

#[test]
fn what_was_carried_is_found_again() {
    let body = Body::embedded(150.0);
    for turn in turns() {
        for i in 0..2000 {
            let mut r = Rng::keyed(&[3, i]);
            let p = Vec3::new(r.range(-110.0, 110.0), r.range(-260.0, 130.0), r.range(-110.0, 110.0));
            if body.exact_rest_gap(p).0.abs() > 25.0 {
                continue;
            }
            let world = body.carry(&turn, p);
            let (rest, rotation) = body.uncarried(&turn, world);
            assert!(rest.distance(p) < 0.05, "{p} came back as {rest} under {:?}", turn.rotation);
            assert!((rotation.length() - 1.0).abs() < 1e-12);
        }
    }
}

#[test]
fn head_and_scalp_are_rigid_and_the_shoulders_still() {
    let body = Body::embedded(155.0);
    let head = Head::new(155.0);
    for turn in turns() {
        for root in head.scalp().roots(500, 1.0, &[1], 1) {
            let rigid = body.carry_with_head(&turn, root.position.as_dvec3()).as_vec3();
            assert_eq!(body.carry(&turn, root.position), rigid, "{:?}", root.position);
        }
        let chin = Vec3::new(0.0, -140.0, 80.0);
        assert_eq!(body.share(chin), 1.0);
        let shoulder = Vec3::new(150.0, -230.0, -20.0);
        assert!(body.carry(&turn, shoulder).distance(shoulder) < 1e-4);
    }
}
