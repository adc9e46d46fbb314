//! Strands in PLY: polylines by an `edge` element or by lists of vertices, or vertices in runs.

use crate::error::{FormatError, Parsed};
use crate::ply::{Element, Ply, parse_ply};
use crate::strands::{Radii, RawStrands};
use glam::Vec3;
use std::io::Write as _;
use strandbench_types::StrandSet;

const FORMAT: &str = "strand PLY";
const LIST_ELEMENTS: &[&str] = &["line", "lines", "polyline", "polylines", "strand", "strands", "curve"];
const LIST_PROPERTIES: &[&str] = &["vertex_indices", "vertex_index", "vertex_indexes", "indices"];
const ID_PROPERTIES: &[&str] = &["strand_id", "strand_index", "strand"];
const RUN_COMMENT: &str = "points_per_strand";

/// Parses strands from a PLY. In order of preference they are: polylines by an element `edge` (vertex1,
/// vertex2; the root is where the edges set out from), vertex lists (element `line`, `polyline`, `strand`, ...),
/// runs of a vertex property `strand_id`, or runs of `points_per_strand` vertices, given by the caller or by a
/// comment `points_per_strand N`. A vertex property `radius` is the fibre's radius in file units.
///
/// # Errors
/// A damaged file, branching or closed edges, a number that is not finite, or nothing that tells the strands
/// apart (a point cloud, a line cloud, a mesh).
pub fn parse_ply_strands(bytes: &[u8], points_per_strand: Option<u32>) -> Parsed<RawStrands> {
    let ply = parse_ply(bytes, |element, property| match element {
        "vertex" => matches!(property, "x" | "y" | "z" | "radius") || ID_PROPERTIES.contains(&property),
        "edge" => matches!(property, "vertex1" | "vertex2"),
        e => LIST_ELEMENTS.contains(&e) && LIST_PROPERTIES.contains(&property),
    })?;
    let vertex = vertices(&ply)?;
    let points = positions(vertex)?;
    let (order, counts) = strands_of(&ply, vertex, points.len(), points_per_strand)?;
    let radii = vertex.scalar("radius");
    let identity = order.iter().enumerate().all(|(i, &v)| i == v as usize);
    let pick = |values: &[f64]| order.iter().map(|&v| values[v as usize] as f32).collect();
    let radii = radii.map_or(Radii::Unstated, |r| Radii::PerPoint(pick(r)));
    let points = if identity && order.len() == points.len() {
        points
    } else {
        order.iter().map(|&v| points[v as usize]).collect()
    };
    RawStrands::new(FORMAT, points, counts.into_iter(), radii)
}

pub(crate) fn vertices(ply: &Ply) -> Parsed<&Element> {
    ply.element("vertex").ok_or_else(|| {
        FormatError::new("header", "there is no element vertex", "export the file with vertices")
    })
}

pub(crate) fn positions(vertex: &Element) -> Parsed<Vec<Vec3>> {
    match (vertex.scalar("x"), vertex.scalar("y"), vertex.scalar("z")) {
        (Some(x), Some(y), Some(z)) => {
            Ok(x.iter().zip(y).zip(z).map(|((&x, &y), &z)| Vec3::new(x as f32, y as f32, z as f32)).collect())
        }
        _ => Err(FormatError::new(
            "header",
            "element vertex lacks one of the scalar properties x, y, z",
            "export the file with positions",
        )),
    }
}

/// Vertex order and points of each strand.
fn strands_of(ply: &Ply, vertex: &Element, n: usize, run: Option<u32>) -> Parsed<(Vec<u32>, Vec<u32>)> {
    if let Some(edge) = ply.element("edge") {
        if let (Some(a), Some(b)) = (edge.scalar("vertex1"), edge.scalar("vertex2")) {
            return chains(a, b, n);
        }
        return Err(FormatError::new(
            "header",
            "element edge lacks vertex1 or vertex2",
            "export the edges with these two properties",
        ));
    }
    for element in ply.elements.iter().filter(|e| LIST_ELEMENTS.contains(&e.name.as_str())) {
        if let Some((offsets, values)) = element.list(LIST_PROPERTIES) {
            let order = values
                .iter()
                .enumerate()
                .map(|(i, &v)| index(v, n, || format!("element {}, index {i}", element.name)))
                .collect::<Parsed<Vec<u32>>>()?;
            return Ok((order, offsets.windows(2).map(|w| w[1] - w[0]).collect()));
        }
    }
    let all = || (0..n as u32).collect::<Vec<u32>>();
    if let Some(ids) = ID_PROPERTIES.iter().find_map(|p| vertex.scalar(p)) {
        return Ok((all(), runs_of_ids(ids)?));
    }
    let stated = ply.comments.iter().find_map(|c| stated_run(c));
    if let Some(each) = run.or(stated).filter(|&each| each > 0) {
        if !n.is_multiple_of(each as usize) {
            return Err(FormatError::new(
                "element vertex",
                format!("{n} vertices are not a multiple of {each} points a strand"),
                "give the right points_per_strand",
            ));
        }
        return Ok((all(), vec![each; n / each as usize]));
    }
    let (what, remedy) = if ply.element("face").is_some() {
        ("this is a triangle mesh", "give a file of strands; a head goes into the option for the head mesh")
    } else if vertex.has("nx") {
        (
            "this is a line cloud (points with directions): nothing says which points belong to one strand",
            "give a file of strands; if its vertices are strands of equal length set points_per_strand",
        )
    } else {
        (
            "this is a point cloud: nothing says which points belong to one strand",
            "export it with edges, or set points_per_strand (NeuralHaircut: 100)",
        )
    };
    Err(FormatError::new("header", what, remedy))
}

fn stated_run(comment: &str) -> Option<u32> {
    let mut words = comment.split([' ', ':', '=']).filter(|w| !w.is_empty());
    words.find(|w| *w == RUN_COMMENT)?;
    words.next()?.parse().ok()
}

fn index(v: f64, n: usize, place: impl Fn() -> String) -> Parsed<u32> {
    if v >= 0.0 && v < n as f64 && v.fract() == 0.0 {
        return Ok(v as u32);
    }
    Err(FormatError::new(
        place(),
        format!("vertex {v} is not one of the {n} vertices"),
        "the file is damaged: export it again",
    ))
}

fn runs_of_ids(ids: &[f64]) -> Parsed<Vec<u32>> {
    let mut counts = Vec::new();
    let mut seen = std::collections::HashSet::new();
    for (i, run) in ids.chunk_by(|a, b| a == b).enumerate() {
        if !seen.insert(run[0].to_bits()) {
            return Err(FormatError::at_strand(
                i,
                format!("id {} appears in two places", run[0]),
                "export the vertices strand after strand",
            ));
        }
        counts.push(run.len() as u32);
    }
    Ok(counts)
}

const NONE: u32 = u32::MAX;

/// Orders the vertices into paths. A path begins at the end without an incoming edge, or, where directions
/// disagree, at the end of lower index; a vertex without edges is a strand of one point.
fn chains(a: &[f64], b: &[f64], n: usize) -> Parsed<(Vec<u32>, Vec<u32>)> {
    let mut next = vec![[NONE; 2]; n];
    let mut incoming = vec![false; n];
    for (e, (&a, &b)) in a.iter().zip(b).enumerate() {
        let a = index(a, n, || format!("edge {e}"))?;
        let b = index(b, n, || format!("edge {e}"))?;
        for (from, to) in [(a, b), (b, a)] {
            let Some(slot) = next[from as usize].iter_mut().find(|s| **s == NONE) else {
                return Err(FormatError::new(
                    format!("edge {e}"),
                    format!("it is the third edge at vertex {from}; a strand cannot branch"),
                    "export strands as separate polylines",
                ));
            };
            *slot = to;
        }
        incoming[b as usize] = true;
    }
    let (mut order, mut counts) = (Vec::with_capacity(n), Vec::new());
    let mut seen = vec![false; n];
    for start in 0..n {
        if seen[start] || next[start][1] != NONE {
            continue;
        }
        let begin = order.len();
        let (mut previous, mut at) = (NONE, start as u32);
        while at != NONE {
            seen[at as usize] = true;
            order.push(at);
            let [p, q] = next[at as usize];
            (previous, at) = (at, if p == previous { q } else { p });
        }
        if incoming[start] && !incoming[previous as usize] {
            order[begin..].reverse();
        }
        counts.push((order.len() - begin) as u32);
    }
    if let Some(v) = seen.iter().position(|s| !s) {
        return Err(FormatError::new(
            format!("vertex {v}"),
            "it lies on a closed loop; a strand has two ends",
            "export strands as open polylines",
        ));
    }
    Ok((order, counts))
}

/// The bytes of a binary little-endian PLY: vertices x, y, z, radius (mm), and an edge for each segment, from
/// root to tip.
pub(crate) fn encode_ply_strands(strands: &StrandSet) -> Vec<u8> {
    let edges = strands.points.len() - strands.len();
    let mut out = Vec::with_capacity(300 + 16 * strands.points.len() + 8 * edges);
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\ncomment strandbench strands in mm, +y up, face +z, root first\n\
         element vertex {}\nproperty float x\nproperty float y\nproperty float z\nproperty float radius\n\
         element edge {edges}\nproperty int vertex1\nproperty int vertex2\nend_header\n",
        strands.points.len()
    )
    .expect("a Vec takes all");
    for (p, r) in strands.points.iter().zip(&strands.radii_mm) {
        out.extend([p.x, p.y, p.z, *r].into_iter().flat_map(f32::to_le_bytes));
    }
    for i in 0..strands.len() {
        let range = strands.range(i);
        for v in range.start..range.end - 1 {
            out.extend((v as u32).to_le_bytes());
            out.extend((v as u32 + 1).to_le_bytes());
        }
    }
    out
}

#[cfg(test)]
mod tests;
