//! Points at which shadows are kept.

use super::mesh::Meshes;
use crate::accel::Hit;
use glam::Vec3;
use std::collections::HashSet;
use strandbench_types::{StrandSet, TriMesh};

/// How much farther apart points are along fibres, which see lights from amid other fibres, than on the skin below.
const ALONG: f32 = 2.0;
/// Shadows of fibres farther than this are as smooth as those of meshes, mm.
const NEAR_MM: f32 = 5.0;
/// How much farther apart points are there.
const FAR: f32 = 4.0;
/// Most points: a gigabyte.
pub(super) const MOST: usize = 1 << 25;
/// Parts of a segment, or of a triangle's edge.
const MOST_PARTS: f32 = 255.0;

/// One of the points, and what it is on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    pub index: u32,
    pub on: On,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum On {
    /// On the axis of the segment that starts at `point`; `along` is below 1.
    Fibre { strand: u32, point: u32, along: f32 },
    /// See [`Places::on_mesh`].
    Mesh,
}

/// Numbers of the points.
#[derive(Debug)]
pub(super) struct Places {
    /// The point at each of the strands' points; those of its segment follow.
    fibres: Vec<u32>,
    meshes: Meshes,
}

fn parts(length: f32, spacing: f32) -> f32 {
    (length / spacing).ceil().clamp(1.0, MOST_PARTS)
}

impl Places {
    /// Points at most about `spacing_mm` apart on meshes, farther along fibres and where no fibre is near; farther everywhere if
    /// there were more than `most`; `None` if there are as many at any distance.
    pub fn new(strands: &StrandSet, meshes: &[&TriMesh], spacing_mm: f32, most: usize) -> Option<Places> {
        let fewest = strands.points.len() + meshes.iter().map(|m| m.vertices.len()).sum::<usize>();
        if fewest > most {
            return None;
        }
        let near = Near::new(strands);
        let mut spacing_mm = spacing_mm;
        loop {
            let made = Places::spaced(strands, meshes, spacing_mm, &near, most);
            if made.is_some() {
                return made;
            }
            spacing_mm *= 1.25;
        }
    }

    fn spaced(
        strands: &StrandSet,
        meshes: &[&TriMesh],
        spacing: f32,
        near: &Near,
        most: usize,
    ) -> Option<Places> {
        let mut count = 0usize;
        let mut fibres = vec![0u32; strands.points.len()];
        for strand in 0..strands.len() {
            let range = strands.range(strand);
            for i in range.clone() {
                fibres[i] = count as u32;
                count += match strands.points[i..range.end].get(1) {
                    Some(next) => parts(strands.points[i].distance(*next), spacing * ALONG) as usize,
                    None => 1,
                };
            }
            if count > most {
                return None;
            }
        }
        let mut made = Meshes { first: count as u32, ..Meshes::default() };
        for mesh in meshes {
            made.add(mesh, |side, middle| {
                parts(side, spacing * if near.holds(middle) { 1.0 } else { FAR }) as u8
            });
            if count + made.owners.len() > most {
                return None;
            }
        }
        Some(Places { fibres, meshes: made })
    }

    pub fn len(&self) -> usize {
        self.meshes.first as usize + self.meshes.owners.len()
    }

    /// Surface, triangle, and weights of its second and third corner, of a point on a mesh.
    pub fn on_mesh(&self, index: u32) -> (u32, u32, [f32; 2]) {
        let owner = &self.meshes.owners[(index - self.meshes.first) as usize];
        let parts = f32::from(self.meshes.triangles[owner.surface as usize][owner.triangle as usize].parts);
        (owner.surface, owner.triangle, owner.at.map(|k| f32::from(k) / parts))
    }

    /// The points that a hit lies between, and their weights.
    #[inline]
    pub fn around(&self, hit: &Hit) -> [(Place, f32); 3] {
        match *hit {
            Hit::Fibre { strand, point, along, .. } => {
                let first = self.fibres[point as usize];
                let parts = self.fibres[point as usize + 1] - first;
                let at = along.clamp(0.0, 1.0) * parts as f32;
                let part = (at as u32).min(parts - 1);
                let place = |part: u32| {
                    let (point, along) =
                        if part < parts { (point, part as f32 / parts as f32) } else { (point + 1, 0.0) };
                    Place { index: first + part, on: On::Fibre { strand, point, along } }
                };
                let weight = at - part as f32;
                [(place(part), 1.0 - weight), (place(part + 1), weight), (place(part), 0.0)]
            }
            Hit::Mesh { surface, triangle, uv, .. } => {
                let of = &self.meshes.triangles[surface as usize][triangle as usize];
                let parts = u32::from(of.parts);
                let [u, v] = uv.map(|w| w.clamp(0.0, 1.0) * parts as f32);
                // Rounding may carry a hit beyond the third edge.
                let row = (v as u32).min(parts - 1);
                let column = (u as u32).min(parts - 1 - row);
                let (du, dv) = ((u - column as f32).min(1.0), (v - row as f32).min(1.0));
                let place = |column: u32, row: u32| Place { index: of.point(column, row), on: On::Mesh };
                let (beside, above) = (place(column + 1, row), place(column, row + 1));
                if du + dv <= 1.0 || column + row + 1 >= parts {
                    let here = (1.0 - du - dv).max(0.0);
                    let sum = here + du + dv;
                    [(place(column, row), here / sum), (beside, du / sum), (above, dv / sum)]
                } else {
                    [(place(column + 1, row + 1), du + dv - 1.0), (beside, 1.0 - dv), (above, 1.0 - du)]
                }
            }
        }
    }
}

/// Where fibres are near.
struct Near(HashSet<[i32; 3]>);

/// Side of a cell, mm.
const CELL_MM: f32 = NEAR_MM / 2.0;

impl Near {
    fn cell(p: Vec3) -> [i32; 3] {
        (p / CELL_MM).floor().to_array().map(|v| v as i32)
    }

    fn new(strands: &StrandSet) -> Near {
        let cells: HashSet<_> = strands.points.iter().map(|&p| Near::cell(p)).collect();
        let around = |&[x, y, z]: &[i32; 3]| {
            let side = -2..=2;
            let cells = side.clone().flat_map(move |i| (-2..=2).map(move |j| (i, j)));
            cells
                .flat_map(move |(i, j)| {
                    side.clone().map(move |k| [x.saturating_add(i), y.saturating_add(j), z.saturating_add(k)])
                })
                .collect::<Vec<_>>()
        };
        Near(cells.iter().flat_map(around).collect())
    }

    fn holds(&self, p: Vec3) -> bool {
        self.0.contains(&Near::cell(p))
    }
}
