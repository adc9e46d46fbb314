//! The protocol's reasons, on real hair (Cem Yuksel's straight.hair).

mod common;

use common::splat::{bounds, four_cameras, truth};
use common::strands::{mapped, of, value};
use glam::{DVec3, Vec3};
use strandbench_io::{ImportOptions, read_strands};
use strandbench_types::{StrandSet, Truth, VISIBILITY_STEP_MM};

fn straight() -> Option<Truth> {
    let Some(root) = std::env::var_os("STRANDBENCH_DATA") else {
        println!("ignored, no data: set STRANDBENCH_DATA");
        return None;
    };
    let path = std::path::Path::new(&root).join("hair/cem_yuksel/straight.hair");
    let options = ImportOptions::preset("yuksel").unwrap();
    let (strands, _) = read_strands(&path, &options).unwrap();
    let (lo, hi) = bounds(&strands);
    let cameras = four_cameras((lo + hi) * 0.5, 900.0, 190.0, (640, 480), 1100.0);
    Some(truth(strands, cameras, 600.0, 1200.0))
}

/// The half millimetres that two cameras see, moved.
fn visible_layer(t: &Truth, by: Vec3) -> StrandSet {
    let mut out = StrandSet::new();
    for (k, points) in t.strands.iter().enumerate() {
        let first = t.visibility.offsets[k] as usize;
        let (mut arc, mut sample) = (0.0, 0);
        for w in points.windows(2) {
            let length = w[0].distance(w[1]);
            while first + sample < t.visibility.offsets[k + 1] as usize {
                let s = (sample as f32 + 0.5) * VISIBILITY_STEP_MM;
                if s > arc + length {
                    break;
                }
                if t.visibility.seen_by[first + sample].count_ones() >= 2 {
                    let d = (w[1] - w[0]) / length;
                    let p = w[0] + d * (s - arc) + by;
                    out.push(&[p - d * 0.25, p + d * 0.25], 0.04);
                }
                sample += 1;
            }
            arc += length;
        }
    }
    out
}

#[test]
fn a_push_of_the_visible_layer_shows_and_a_push_of_the_volume_barely_does() {
    let Some(t) = straight() else { return };
    let towards = (t.rig.cameras[0].camera_from_world.transpose() * DVec3::NEG_Z).as_vec3();
    // How much is left after a push depends on how deep the cameras see into the hair, and so on fibre width and rig.
    let mut last = f64::INFINITY;
    for mm in [0.0, 5.0, 10.0] {
        let s = of(&t, &visible_layer(&t, towards * mm));
        let f = value(&s, "method", "B1.f_3mm").unwrap();
        println!("visible layer pushed by {mm} mm: F(3, 30) = {f:.3}");
        assert!(f < last && (mm > 0.0 || f > 0.999), "{f} at {mm} mm after {last}");
        last = f;
    }
    // All of the hair, 10 mm sideways, through other vertices, every other strand reversed.
    let sideways = mapped(&t.strands, |k, p| {
        let mut q: Vec<Vec3> = vec![p[0]];
        q.extend(p.windows(2).map(|w| w[0].lerp(w[1], 0.5)));
        q.push(p[p.len() - 1]);
        q.iter_mut().for_each(|p| *p += Vec3::X * 10.0);
        if k % 2 == 0 {
            q.reverse();
        }
        q
    });
    let s = of(&t, &sideways);
    let of_method = |id: &str| value(&s, "method", id).unwrap();
    println!(
        "all hair 10 mm sideways: precision {:.3} of all hair, F {:.3} on V2",
        of_method("B1.full.precision_3mm"),
        of_method("B1.f_3mm")
    );
    println!("N1: precision {:.3} of all hair", value(&s, "N1", "B1.full.precision_3mm").unwrap());
    println!(
        "vertices: recall {:.3}; direction {:.3}",
        of_method("B1.legacy-vertex.recall_1mm"),
        of_method("B4.direction")
    );
    assert!(of_method("B1.f_3mm") < of_method("B1.full.precision_3mm"));
    assert!((of_method("B4.direction") - 0.5).abs() < 0.1, "half of the strands are reversed");
}
