//! The envelope and the strands as decimated geometry for the page's own small viewer.

use super::data::Data;
use crate::pictures::{ABSENT, base64, diverging};
use glam::{DVec3, Vec3};
use std::collections::HashMap;
use strandbench_types::{Plane, Rig, StrandSet, TriMesh, Truth};

/// Steps of the positions sent to the page, mm: 16-bit integers then reach ±1,638 mm.
const STEP_MM: f32 = 0.05;
/// Most strands shown of each kind.
const STRANDS: usize = 2500;
/// Most points shown of a strand.
const STRAND_POINTS: usize = 20;

/// The viewer's data as a JSON object for a script element.
pub(crate) fn json(data: &Data, error_limit_mm: f32) -> String {
    let centre = centre(data);
    let none = TriMesh::default();
    let envelope = cluster(data.estimate.envelope.as_ref().unwrap_or(&none), 2.0);
    let colours: Vec<u8> = envelope
        .vertices
        .iter()
        .flat_map(|&v| error_colour(&data.truth.rig, &data.error_mm, v, error_limit_mm))
        .collect();
    let head = cluster(data.truth.head.as_ref().unwrap_or(&none), 4.0);
    let (seen, rest) = pick(&data.truth);
    let camera = &data.truth.rig.cameras[0];
    let eye = camera.centre_mm() - centre.as_dvec3();
    serde_json::json!({
        "step": STEP_MM,
        "camera": [eye.x, eye.y, eye.z],
        "envelope": { "positions": positions(&envelope.vertices, centre), "indices": indices(&envelope), "colours": base64(&colours) },
        "head": { "positions": positions(&head.vertices, centre), "indices": indices(&head) },
        "seen": lines(&data.truth.strands, &seen, centre),
        "rest": lines(&data.truth.strands, &rest, centre),
    })
    .to_string()
}

fn centre(data: &Data) -> Vec3 {
    let bounds = data.estimate.envelope.as_ref().and_then(TriMesh::bounds);
    let (low, high) = bounds.unwrap_or_else(|| {
        let points = &data.truth.strands.points;
        let first = points.first().copied().unwrap_or_default();
        points.iter().fold((first, first), |(lo, hi), &p| (lo.min(p), hi.max(p)))
    });
    (low + high) * 0.5
}

fn positions(points: &[Vec3], centre: Vec3) -> String {
    let bytes: Vec<u8> = points
        .iter()
        .flat_map(|&p| ((p - centre) / STEP_MM).to_array())
        .flat_map(|v| (v.round() as i16).to_le_bytes())
        .collect();
    base64(&bytes)
}

fn indices(mesh: &TriMesh) -> String {
    let bytes: Vec<u8> = mesh.triangles.iter().flatten().flat_map(|i| i.to_le_bytes()).collect();
    base64(&bytes)
}

/// Vertices merged in cells of `cell_mm`, enlarged until at most 60,000 triangles remain; triangles that
/// collapse are dropped.
fn cluster(mesh: &TriMesh, mut cell_mm: f32) -> TriMesh {
    loop {
        let made = cluster_once(mesh, cell_mm);
        if made.triangles.len() <= 60_000 {
            return made;
        }
        cell_mm *= 1.3;
    }
}

fn cluster_once(mesh: &TriMesh, cell_mm: f32) -> TriMesh {
    let mut cells: HashMap<[i32; 3], u32> = HashMap::new();
    let mut sums: Vec<(DVec3, f64)> = Vec::new();
    let map: Vec<u32> = mesh
        .vertices
        .iter()
        .map(|v| {
            let cell = (*v / cell_mm).floor().to_array().map(|c| c as i32);
            let i = *cells.entry(cell).or_insert_with(|| {
                sums.push((DVec3::ZERO, 0.0));
                (sums.len() - 1) as u32
            });
            let sum = &mut sums[i as usize];
            *sum = (sum.0 + v.as_dvec3(), sum.1 + 1.0);
            i
        })
        .collect();
    let vertices = sums.iter().map(|(sum, n)| (*sum / *n).as_vec3()).collect();
    let triangles = mesh.triangles.iter().map(|t| t.map(|i| map[i as usize]));
    let triangles = triangles.filter(|[a, b, c]| a != b && b != c && a != c).collect();
    TriMesh { vertices, triangles }
}

/// The colour of the error map where the reference camera sees the vertex.
fn error_colour(rig: &Rig, error_mm: &Plane<f32>, vertex: Vec3, limit_mm: f32) -> [u8; 3] {
    const UNASKED: [u8; 3] = [190, 188, 184];
    let Some((p, _)) = rig.cameras[0].project(vertex.as_dvec3()) else { return UNASKED };
    let (x, y) = (p.x.floor(), p.y.floor());
    if x < 0.0 || y < 0.0 || x >= error_mm.width as f64 || y >= error_mm.height as f64 {
        return UNASKED;
    }
    match *error_mm.at(x as usize, y as usize) {
        e if e.is_nan() => UNASKED,
        e if e.is_infinite() => ABSENT,
        e => diverging(e / limit_mm),
    }
}

/// Strands of which the reference camera sees something, and others, evenly thinned.
fn pick(truth: &Truth) -> (Vec<usize>, Vec<usize>) {
    let offsets = &truth.visibility.offsets;
    let sees = |s: usize| {
        let range = match (offsets.get(s), offsets.get(s + 1)) {
            (Some(&a), Some(&b)) => a as usize..b as usize,
            _ => 0..0,
        };
        let seen = truth.visibility.seen_by[range.clone()].iter().filter(|b| *b & 1 == 1).count();
        seen * 10 > range.len()
    };
    let (seen, rest): (Vec<usize>, Vec<usize>) = (0..truth.strands.len()).partition(|&s| sees(s));
    let thin =
        |of: Vec<usize>| of.iter().copied().step_by(of.len().div_ceil(STRANDS).max(1)).collect::<Vec<_>>();
    (thin(seen), thin(rest))
}

/// Strands as line segments: positions of all points and, per strand, how many there are.
fn lines(strands: &StrandSet, which: &[usize], centre: Vec3) -> serde_json::Value {
    let (mut points, mut counts) = (Vec::new(), Vec::new());
    for &s in which {
        let strand = strands.strand(s);
        let n = strand.len().min(STRAND_POINTS);
        for k in 0..n {
            points.push(strand[k * (strand.len() - 1) / (n - 1).max(1)]);
        }
        counts.push(n as u8);
    }
    serde_json::json!({ "positions": positions(&points, centre), "counts": base64(&counts) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clustering_keeps_the_shape_and_bounds_the_size() {
        let n = 300u32;
        let vertices = (0..n * n).map(|i| Vec3::new((i % n) as f32, (i / n) as f32, 0.0)).collect();
        let mut triangles = Vec::new();
        for y in 0..n - 1 {
            for x in 0..n - 1 {
                let i = y * n + x;
                triangles.extend([[i, i + 1, i + n], [i + 1, i + n + 1, i + n]]);
            }
        }
        let mesh = TriMesh { vertices, triangles };
        let small = cluster(&mesh, 1.0);
        assert!(
            small.triangles.len() <= 60_000 && small.triangles.len() > 5_000,
            "{}",
            small.triangles.len()
        );
        small.validate().unwrap();
        let (low, high) = small.bounds().unwrap();
        assert!(low.x < 2.0 && high.x > 297.0 && high.z.abs() < 1e-6);
        let area: f32 = small
            .triangles
            .iter()
            .map(|t| t.map(|i| small.vertices[i as usize]))
            .map(|[a, b, c]| (b - a).cross(c - a).z * 0.5)
            .sum();
        assert!((area / (299.0 * 299.0) - 1.0).abs() < 0.03, "area {area}");
    }
}
