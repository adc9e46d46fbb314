//! Properties that need the posed skin's exact distance.

use super::*;
use crate::head::MeshBvh;
use crate::moving_catalog;
use crate::spec::{HeadDrive, Swing};
use strandbench_types::Silent;

/// Deepest point of any strand below the skin as posed, mm (negative: clear of it): on the head, which is rigid,
/// and on the neck and shoulders, which bend. The distance is from the posed mesh itself.
fn deepest(name: &str, drive: HeadDrive, frames: u32) -> [f32; 2] {
    let entry = moving_catalog().iter().find(|e| e.name == name).expect("a moving scene");
    let mut spec = entry.spec().unwrap().with_strands(250);
    let motion = spec.motion.as_mut().unwrap();
    (motion.frames, motion.head, motion.solver.guides) = (frames, drive, 60);
    let mut simulation = Simulation::new(&spec, 1, None, &Silent).unwrap();
    let mut deepest = [f32::NEG_INFINITY; 2];
    while let Some(frame) = simulation.next_frame(&Silent).unwrap() {
        if frame.index % 12 != 11 {
            continue;
        }
        let skin = &frame.scene.surfaces[0].mesh;
        let exact = MeshBvh::new(&skin.vertices, &skin.triangles);
        let turn = HeadTurn { rotation: frame.head.rotation };
        let strands = &frame.scene.strands;
        for i in 0..strands.len() {
            for &p in &strands.strand(i)[1..] {
                // Away from the edge at which the bust ends.
                if p.y < -280.0 || simulation.model.body.gap(&turn, p).0 > 12.0 {
                    continue;
                }
                let gap = exact.closest(p, None).distance;
                let rigid = simulation.model.body.is_rigid(&turn, p);
                let k = usize::from(!rigid);
                deepest[k] = deepest[k].max(-gap);
            }
        }
    }
    deepest
}

#[test]
fn moved_strands_stay_out_of_the_skin() {
    let swing = Swing { amplitude_deg: 30.0, frequency_hz: 2.0, cycles: 2.0, start_s: 0.0 };
    let turn = HeadDrive::Turn { angle_deg: -50.0, duration_s: 0.3, start_s: 0.0 };
    let flick = HeadDrive::Flick { forward_deg: 28.0, back_deg: 12.0, duration_s: 0.3, start_s: 0.0 };
    for (name, drive, frames) in [
        ("moving-straight-blonde", HeadDrive::Shake(swing), 72),
        ("moving-messy-red", turn, 60),
        ("moving-bob-flick", flick, 72),
    ] {
        let [head, neck] = deepest(name, drive, frames);
        println!("{name}: {head} mm in the head, {neck} mm in the neck");
        // On the head points are put where the mesh itself has them 0.3 mm clear, or as groomed.
        assert!(head < 0.05, "{name}: {head} mm");
        // In the bent neck, distance is that of the straight neck: it can be wrong, its sign cannot.
        assert!(neck < 0.05, "{name}: {neck} mm");
    }
}
