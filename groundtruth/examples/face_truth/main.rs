//! Truth of a face with straight hairs at one moment of a performance, as files, pictures and seconds.
//!
//! `face_truth OUT [rotation | dialogue | smile-puff | brows] [TIME_S] [HAIRS] [WIDTH_PX]`
//!
//! Flow goes to the neutral face. Three cameras: in front, from the subject's left, from below. With
//! `RAYON_NUM_THREADS=1` the seconds are those of one processor.

mod hairs;
mod paint;

use glam::DVec3;
use hairs::{KINDS, Stand};
use std::path::Path;
use std::time::Instant;
use strandbench_groundtruth::face::{
    Follicles, Frames, HairIndex, SkinSightings, face_view, hair_field, hair_roots, skin_cover,
};
use strandbench_io::{write_face_truth, write_face_view, write_flo, write_hair_field, write_png_rgb};
use strandbench_renderer::Probe;
use strandbench_scenes::face::{Act, FaceModel, FaceSpec, Identity, Performance};
use strandbench_types::{Camera, FaceTruth, Moment, Silent, StrandSet, TriMesh, Visibility};

type Failure = Box<dyn std::error::Error>;

fn cameras(width: u32) -> Vec<Camera> {
    let middle = DVec3::new(0.0, -40.0, 40.0);
    // A head of 240 mm fills the height.
    let focal = f64::from(width) / 1500.0 * 6000.0;
    [("front", DVec3::Z), ("left", DVec3::new(0.8, 0.0, 0.6)), ("below", DVec3::new(0.1, -0.6, 0.8))]
        .map(|(name, to)| {
            let eye = middle + to * 900.0;
            Camera::look_at(name, (width, width * 4 / 3), focal, eye, middle, DVec3::NEG_Y)
        })
        .to_vec()
}

fn run() -> Result<(), Failure> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let out = Path::new(args.first().ok_or("usage: face_truth OUT [ACT] [TIME_S] [HAIRS] [WIDTH_PX]")?);
    let act = match args.get(1).map_or("dialogue", String::as_str) {
        "rotation" => Act::Rotation,
        "dialogue" => Act::Dialogue,
        "smile-puff" => Act::SmilePuff,
        "brows" => Act::Brows,
        other => return Err(format!("{other} is no act").into()),
    };
    let number = |i: usize, default: f64| args.get(i).map_or(Ok(default), |a| a.parse::<f64>());
    let (time_s, count, width) = (number(2, 2.6)?, number(3, 8000.0)? as usize, number(4, 1500.0)? as u32);
    let model = FaceModel::embedded();
    let person = Identity::draw(model, &FaceSpec { identity: 4, ..FaceSpec::default() })?;
    let neutral = model.pose(&person, &model.neutral())?;
    let face = model.pose(&person, &Performance { act, seed: 2 }.pose(model, time_s))?;
    let stand = Stand::new(model, &neutral, count);
    let (then, now) = (stand.shot(model, &neutral, &neutral), stand.shot(model, &neutral, &face));
    let clock = Instant::now();
    let lap = |what: &str, clock: Instant| println!("{what}: {:.2} s", clock.elapsed().as_secs_f64());
    let none = StrandSet::new();
    let (here, there): (Vec<&TriMesh>, Vec<&TriMesh>) =
        (now.meshes.iter().collect(), then.meshes.iter().collect());
    let probes = [
        Probe::new(&now.strands, &here)?,
        Probe::new(&none, &here)?,
        Probe::new(&then.strands, &there)?,
        Probe::new(&none, &there)?,
    ];
    let [all, bare, all_then, bare_then] = &probes;
    lap("four trees", clock);
    let frames = Frames {
        now: Moment { strands: &now.strands, meshes: &here, follicle_axes: &now.axes },
        reference: Moment { strands: &then.strands, meshes: &there, follicle_axes: &then.axes },
        kinds: &stand.kinds,
        sight: all_then,
        bare_sight: bare_then,
    };
    let skin = &now.meshes[0];
    let mut sightings = SkinSightings::new(skin.vertices.len());
    for (i, camera) in cameras(width).iter().enumerate() {
        let name = &camera.name;
        let (whole, clock) = (Instant::now(), Instant::now());
        let seen = all.first_hits(camera, &Silent)?;
        lap(&format!("{name}: first hits of {} MP", camera.width * camera.height / 1_000_000), clock);
        let clock = Instant::now();
        let behind = bare.behind_hair(camera, &seen, &Silent)?;
        lap(&format!("{name}: skin behind hair"), clock);
        let clock = Instant::now();
        let view = face_view(&frames, camera, seen, behind, &Silent)?;
        lap(&format!("{name}: labels, flow, occlusion"), clock);
        lap(&format!("{name}: all planes"), whole);
        let clock = Instant::now();
        sightings.add((i, camera), (0, skin), all, bare)?;
        lap(&format!("{name}: vertices of the skin"), clock);
        let clock = Instant::now();
        write_face_view(&out.join(name), &view)?;
        lap(&format!("{name}: files"), clock);
        write_flo(&out.join(name).join("flow.flo"), &view.flow)?;
        let known = view.flow.flow_px.data.iter().filter(|f| !f[0].is_nan());
        let most = known.map(|f| f[0].hypot(f[1])).fold(1.0, f32::max);
        println!("{name}: largest flow {most:.1} px");
        for (what, picture) in [
            ("flow", paint::flow(&view.flow, most)),
            ("skin_flow", paint::flow(&view.bare_flow, most)),
            ("state", paint::state(&view.flow)),
            ("skin_state", paint::state(&view.bare_flow)),
            ("labels", paint::labels(&view)),
            ("identity", paint::identity(&view.seen.hits)),
            ("depth", paint::depth(&view.seen.depth)),
            ("skin_depth", paint::depth(&view.bare.depth)),
        ] {
            write_png_rgb(&out.join(format!("{name}_{what}.png")), &picture)?;
        }
    }
    let clock = Instant::now();
    let index = HairIndex::new(&now.strands, |i| stand.kinds[i] != 2)?;
    let field = hair_field(&index, 1.0, 10.0, &Silent)?;
    lap(&format!("field of {:?} voxels", field.size), clock);
    write_hair_field(out, &field)?;
    let skin_cover = skin_cover(skin, Some(&index), &sightings)?;
    let follicles =
        Follicles { triangles: &stand.triangles, barycentrics: &stand.barycentrics(), kinds: &stand.kinds };
    let offsets = vec![0; now.strands.len() + 1];
    let truth = FaceTruth {
        roots: hair_roots(&now.strands, &follicles)?,
        kinds: KINDS.map(String::from).to_vec(),
        // Strand samples need the sub-pixel hits of a render, which is not made here.
        visibility: Visibility { offsets, seen_by: Vec::new() },
        skin: skin.clone(),
        strands: now.strands.clone(),
        skin_seen_by: sightings.seen_by,
        skin_bare_seen_by: sightings.bare_seen_by,
        skin_cover,
    };
    write_face_truth(out, &truth)?;
    Ok(())
}

fn main() -> std::process::ExitCode {
    match run() {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("face_truth: {e}");
            std::process::ExitCode::FAILURE
        }
    }
}
