//! The protocol's reasons, on real hair (Cem Yuksel's straight.hair).

mod common;

use common::splat::{bounds, four_cameras, truth, visible_layer};
use common::strands::{mapped, of, value};
use glam::{DVec3, Vec3};
use strandbench_io::{ImportOptions, read_strands};
use strandbench_score::StrandSheet;
use strandbench_types::{StrandSet, Truth};

/// Samples that are compared with every strand.
const PROBES: usize = 1500;

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
    Some(truth(strands, cameras, 600.0, 1200.0, 0.0))
}

/// Middle and unit direction of each segment.
fn segments(set: &StrandSet) -> Vec<(Vec3, Vec3)> {
    let of = |w: &[Vec3]| ((w[0] + w[1]) * 0.5, (w[1] - w[0]).normalize());
    set.iter().flat_map(|p| p.windows(2).map(of).collect::<Vec<_>>()).collect()
}

/// Share of some probes for which a segment of a set runs within 3 mm and 30 degrees, by trying every segment.
fn share_within(probes: &[(Vec3, Vec3)], set: &StrandSet) -> f64 {
    let all: Vec<(Vec3, Vec3)> = set.iter().flat_map(|p| p.windows(2).map(|w| (w[0], w[1] - w[0]))).collect();
    let near = |(p, t): &&(Vec3, Vec3)| {
        all.iter().any(|(a, u)| {
            let uu = u.length_squared();
            let along = ((*p - *a).dot(*u) / uu).clamp(0.0, 1.0);
            (*a + *u * along).distance_squared(*p) <= 9.0 && t.dot(*u).powi(2) / uu >= 0.75
        })
    };
    probes.iter().filter(near).count() as f64 / probes.len() as f64
}

/// The scorer's recall on V2 and precision on all hair at 3 mm and 30 degrees, held against plain counting.
fn counted(t: &Truth, layer: &StrandSet, pushed: &StrandSet, s: &StrandSheet) {
    let some = |set: &StrandSet| -> Vec<(Vec3, Vec3)> {
        let all = segments(set);
        let step = all.len().div_ceil(PROBES);
        all.into_iter().skip(step / 2).step_by(step).collect()
    };
    for (id, probes, set) in
        [("B1.recall_3mm", some(layer), pushed), ("B1.full.precision_3mm", some(pushed), &t.strands)]
    {
        let (got, want) = (value(s, "method", id).unwrap(), share_within(&probes, set));
        // Probes lie a strand's length apart. Five standard errors.
        let bound = 5.0 * (got * (1.0 - got) / probes.len() as f64).sqrt();
        assert!((got - want).abs() < bound, "{id}: {got} for {want}, {} probes", probes.len());
    }
}

#[test]
fn a_push_of_the_visible_layer_shows_and_a_push_of_the_volume_barely_does() {
    let Some(t) = straight() else { return };
    let towards = (t.rig.cameras[0].camera_from_world.transpose() * DVec3::NEG_Z).as_vec3();
    // How much is left after a push depends on how deep the cameras see: the protocol's last section.
    let layer = visible_layer(&t, Vec3::ZERO);
    let mut last = f64::INFINITY;
    for mm in [0.0, 5.0, 10.0] {
        let pushed = visible_layer(&t, towards * mm);
        let s = of(&t, &pushed);
        let f = value(&s, "method", "B1.f_3mm").unwrap();
        println!("visible layer pushed by {mm} mm: F(3, 30) = {f:.3}");
        assert!(f < last && (mm > 0.0 || f > 0.999), "{f} at {mm} mm after {last}");
        if mm > 0.0 {
            counted(&t, &layer, &pushed, &s);
        }
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
