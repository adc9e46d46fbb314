//! How much of the scalp hair hides: a measure on few, thick fibres.

use super::field::Comb;
use crate::catalog;
use crate::head::Head;
use crate::spec::GroomSpec;
use glam::Vec3;
use std::collections::HashMap;
use strandbench_types::StrandSet;

/// Fibres of a measurement, each as many times thicker as there are fewer of them: what they hide is the same.
const FIBRES: u32 = 8_000;
/// Hair farther along than this does not lie over the scalp that it grows from, mm.
const REACH_MM: f32 = 60.0;
const CELL_MM: f32 = 4.0;

/// A place on the scalp whose normal is followed outward.
struct Probe {
    position: Vec3,
    normal: Vec3,
    /// Distance from the parting's line, mm, seen from above; infinite without a parting.
    from_part_mm: f32,
    inside_mm: f32,
    hidden: bool,
}

/// Follows the normals of a few thousand places through the hair of a scene.
fn probes(name: &str) -> Vec<Probe> {
    let entry = catalog().iter().find(|e| e.name == name).expect("a scene of the catalogue");
    let spec = entry.spec().expect("it parses");
    let full: GroomSpec = spec.groom.expect("procedural hair");
    let head = Head::new(spec.head.breadth_mm);
    let few = GroomSpec { strands: FIBRES, ..full.clone() };
    let (strands, _) = super::groom(&few, &spec.pigment, &head, 1).expect("it grows");
    let comb = Comb::new(&full.style, full.length.fringe, &head);
    let mut probes: Vec<Probe> = head
        .scalp()
        .roots(4000, head.scale(), &[77], 2)
        .into_iter()
        .map(|r| Probe {
            position: r.position,
            normal: r.normal,
            from_part_mm: comb.part_distance_mm(r.position),
            inside_mm: r.inside_mm,
            hidden: false,
        })
        .collect();
    hide(&mut probes, &strands, full.strands as f32 / FIBRES as f32);
    probes
}

fn hide(probes: &mut [Probe], strands: &StrandSet, thicker: f32) {
    let cell = |p: Vec3| (p / CELL_MM).floor().to_array().map(|v| v as i32);
    // The rays that pass through a cell or next to it.
    let mut passing: HashMap<[i32; 3], Vec<u32>> = HashMap::new();
    for (i, p) in probes.iter().enumerate() {
        for k in 0..=(2.0 * REACH_MM / CELL_MM) as i32 {
            let c = cell(p.position + p.normal * (k as f32 * 0.5 * CELL_MM));
            for d in 0..27 {
                let near = [c[0] + d % 3 - 1, c[1] + d / 3 % 3 - 1, c[2] + d / 9 - 1];
                let list = passing.entry(near).or_default();
                if list.last() != Some(&(i as u32)) {
                    list.push(i as u32);
                }
            }
        }
    }
    for s in 0..strands.len() {
        let range = strands.range(s);
        for k in range.start..range.end - 1 {
            let (a, b) = (strands.points[k], strands.points[k + 1]);
            let radius = strands.radii_mm[k] * thicker;
            let steps = (a.distance(b) / CELL_MM).ceil() as usize;
            for j in 0..steps {
                let (from, to) =
                    (a.lerp(b, j as f32 / steps as f32), a.lerp(b, (j + 1) as f32 / steps as f32));
                let Some(list) = passing.get_mut(&cell(from)) else { continue };
                list.retain(|&i| {
                    let p = &mut probes[i as usize];
                    p.hidden |= meets(p.position, p.normal, from, to, radius);
                    !p.hidden
                });
            }
        }
    }
}

/// Whether the ray comes within a distance of the segment.
fn meets(origin: Vec3, direction: Vec3, a: Vec3, b: Vec3, radius: f32) -> bool {
    // Seen along the ray the segment is one in the plane.
    let flat = |p: Vec3| (p - origin) - direction * (p - origin).dot(direction);
    let (u, v) = (flat(a), flat(b) - flat(a));
    let t = (-u.dot(v) / v.length_squared().max(1e-12)).clamp(0.0, 1.0);
    (u + v * t).length() < radius && (a.lerp(b, t) - origin).dot(direction) > 0.0
}

/// Share of the places that satisfy `which` and that no fibre hides.
fn bare(probes: &[Probe], which: impl Fn(&Probe) -> bool) -> (f64, usize) {
    let (n, bare) = probes
        .iter()
        .filter(|p| which(p))
        .fold((0, 0), |(n, bare), p| (n + 1, bare + usize::from(!p.hidden)));
    (bare as f64 / n.max(1) as f64, n)
}

#[test]
fn a_segment_across_a_ray_is_met_within_its_radius() {
    let hits =
        |x: f32, z: f32| meets(Vec3::ZERO, Vec3::Z, Vec3::new(x, -2.0, z), Vec3::new(x, 2.0, z + 1.0), 0.5);
    assert!(hits(0.4, 3.0) && !hits(0.6, 3.0) && !hits(0.4, -3.0));
    assert!(!meets(Vec3::ZERO, Vec3::Z, Vec3::new(0.0, 0.6, 3.0), Vec3::new(0.0, 2.0, 3.0), 0.5));
}

/// What hair leaves bare of 100 places at these distances from the parting; hair at the hairline is thin.
fn bare_percent(probes: &[Probe], from_part_mm: std::ops::Range<f32>) -> f64 {
    let d = from_part_mm;
    100.0 * bare(probes, |p| p.inside_mm > 8.0 && (d.start..d.end).contains(&p.from_part_mm.min(1e3))).0
}

#[test]
fn hair_hides_the_scalp_but_for_the_line_of_a_parting() {
    for name in ["straight-black-long", "straight-brown-bob", "curly-blonde"] {
        let p = probes(name);
        let beyond = bare_percent(&p, 12.0..f32::INFINITY);
        assert!(beyond < 2.0, "{name}: {beyond:.1} % of the scalp is bare");
        if p.iter().any(|p| p.from_part_mm < 2.0) {
            // Hair combed straight away from the line leaves exp(-2 r ρ d) bare at a distance d: 27 % at 10 mm
            // with 1.6 fibres of 0.08 mm to a square millimetre. Hair combed along it hides more.
            let (line, beside) = (bare_percent(&p, 0.0..3.0), bare_percent(&p, 8.0..12.0));
            // Where nothing parts the hair the line is as bare as the rest.
            assert!(line > 5.0 * beyond.max(1.0), "{name}: the parting is not seen: {line:.0} %");
            assert!(beside < 27.0, "{name}: {beside:.0} % is bare 10 mm from the parting");
        }
    }
}

/// Prints the catalogue's figures, for tuning: `cargo test --release -p strandbench-scenes bare -- --ignored
/// --nocapture`.
#[test]
#[ignore = "a table for tuning, not a check"]
fn bare_scalp_of_the_catalogue() {
    for e in catalog() {
        let p = probes(e.name);
        let bands = [0.0..1.5, 1.5..3.0, 3.0..5.0, 5.0..8.0, 8.0..12.0, 12.0..f32::INFINITY];
        let row: Vec<String> = bands.map(|b| format!("{:5.1}", bare_percent(&p, b))).into();
        println!("{:22} {}", e.name, row.join(" "));
    }
}
