//! From strands and meshes to the tree and its leaves.

use super::Accel;
use super::bins::{Bounds, Prim, SURFACE};
use super::build::build;
use super::lanes::has_avx2;
use super::leaf::{Cones, Name, Triangles};
use super::node::{LEAF, Node, TRIANGLES, WIDTH};
use super::walk::MOST_LEVELS;
use crate::RenderError;
use crate::cone::{RoundCone, Triangle};
use glam::Vec3;
use rayon::prelude::*;
use strandbench_types::{StrandSet, TriMesh};

/// Leaves are at most as many as primitives, and a place in a leaf has 31 bits.
const MOST: usize = 1 << 28;

struct Geometry<'a> {
    strands: &'a StrandSet,
    meshes: &'a [&'a TriMesh],
}

impl Geometry<'_> {
    fn cone(&self, point: u32) -> RoundCone {
        let (p, r, i) = (&self.strands.points, &self.strands.radii_mm, point as usize);
        RoundCone::new(p[i], r[i], p[i + 1], r[i + 1])
    }

    fn triangle(&self, surface: u32, item: u32) -> Triangle {
        let mesh = self.meshes[surface as usize];
        let [a, b, c] = mesh.triangles[item as usize].map(|k| mesh.vertices[k as usize]);
        Triangle { a, ab: b - a, ac: c - a }
    }

    /// Equal for primitives that coincide.
    fn key(&self, p: &Prim) -> [u32; 8] {
        if p.owner & SURFACE == 0 {
            let c = self.cone(p.item);
            let (m, h) = (c.middle.to_array(), c.half.to_array());
            [m[0], m[1], m[2], h[0], h[1], h[2], c.radius, c.half_delta].map(f32::to_bits)
        } else {
            // Three corners do not fit; triangles that coincide are few and cost little.
            [p.owner, p.item, 0, 0, 0, 0, 0, f32::NAN.to_bits()]
        }
    }

    /// Primitives in the order of strands and meshes, with boxes that are not widened yet.
    fn prims(&self) -> Vec<Prim> {
        let segments = self.strands.points.len().saturating_sub(self.strands.len());
        let triangles: usize = self.meshes.iter().map(|m| m.triangles.len()).sum();
        let mut prims = Vec::with_capacity(segments + triangles);
        let prim = |(low, high): (Vec3, Vec3), owner: u32, item: usize| Prim {
            low: low.to_array(),
            high: high.to_array(),
            owner,
            item: item as u32,
        };
        for strand in 0..self.strands.len() {
            let range = self.strands.range(strand);
            prims.extend(
                (range.start..range.end.saturating_sub(1))
                    .map(|i| prim(self.cone(i as u32).bounds(), strand as u32, i)),
            );
        }
        for (surface, mesh) in self.meshes.iter().enumerate() {
            let surface = surface as u32;
            prims.extend(
                (0..mesh.triangles.len())
                    .map(|i| prim(self.triangle(surface, i as u32).bounds(), SURFACE | surface, i)),
            );
        }
        prims
    }
}

impl Accel {
    /// Builds over all segments of `strands` and all triangles of `meshes`.
    ///
    /// # Errors
    /// If there are neither, more than 2^28 of them, or one is not finite.
    pub fn new(strands: &StrandSet, meshes: &[&TriMesh]) -> Result<Accel, RenderError> {
        let geometry = Geometry { strands, meshes };
        let mut prims = geometry.prims();
        if prims.is_empty() {
            return Err(RenderError::Scene("there is nothing to render: no strands and no meshes".into()));
        }
        if prims.len() > MOST {
            return Err(RenderError::Scene(format!(
                "{} segments and triangles are more than 2^28; leave some strands out",
                prims.len()
            )));
        }
        if let Some(p) = prims.iter().find(|p| !p.is_finite()) {
            let (what, owner) =
                if p.owner & SURFACE == 0 { ("strand", p.owner) } else { ("mesh", p.owner & !SURFACE) };
            let part = if what == "strand" { "the segment from point" } else { "triangle" };
            return Err(RenderError::Scene(format!("{what} {owner}: {part} {} is not finite", p.item)));
        }
        let mut all = Bounds::NONE;
        prims.iter().for_each(|p| all.add_prim(p));
        let (low, high) = (all.low.truncate(), all.high.truncate());
        // Rounding in the tests grows with the distances involved: wider boxes make them conservative.
        let pad = 4e-7 * ((high - low).length() + low.abs().max(high.abs()).max_element());
        for p in &mut prims {
            p.low = p.low.map(|v| v - pad);
            p.high = p.high.map(|v| v + pad);
        }
        let (made, levels) = build(&mut prims, &|p: &Prim| geometry.key(p));
        assert!(levels <= MOST_LEVELS, "{} primitives gave {levels} levels", prims.len());
        let mut nodes = room(made.len());
        nodes.extend(made);
        // Boxes are four fifths of what building takes; the leaves need names alone.
        let names: Vec<Name> = prims.iter().map(|p| Name { owner: p.owner, item: p.item }).collect();
        drop(prims);
        let (cones, triangles) = fill(&mut nodes, &names, &geometry);
        Ok(Accel {
            nodes,
            cones,
            triangles,
            wide: has_avx2(),
            centre: (low + high) * 0.5,
            radius: (high - low).length() * 0.5 + pad,
            pad,
        })
    }
}

/// Makes the leaves in the order of the nodes and lets the nodes refer to them.
fn fill(nodes: &mut [Node], names: &[Name], geometry: &Geometry) -> (Vec<Cones>, Vec<Triangles>) {
    let (mut fibres, mut flats) = (Vec::new(), Vec::new());
    for node in nodes {
        for k in 0..WIDTH {
            if node.counts[k] == 0 {
                continue;
            }
            let from = (node.children[k] & !LEAF) as usize;
            let (list, kind) =
                if names[from].owner & SURFACE == 0 { (&mut fibres, 0) } else { (&mut flats, TRIANGLES) };
            node.children[k] = LEAF | kind | list.len() as u32;
            list.push((from as u32, node.counts[k]));
        }
    }
    let of = |&(from, count): &(u32, u8)| names[from as usize..].iter().take(usize::from(count)).enumerate();
    let mut cones = room(fibres.len());
    fibres
        .par_iter()
        .map(|leaf| {
            let mut cones = Cones::default();
            for (lane, name) in of(leaf) {
                cones.set(lane, &geometry.cone(name.item), *name);
            }
            cones
        })
        .collect_into_vec(&mut cones);
    let triangles = flats
        .par_iter()
        .map(|leaf| {
            let mut made = Triangles::default();
            for (lane, name) in of(leaf) {
                let name = Name { owner: name.owner & !SURFACE, ..*name };
                made.set(lane, &geometry.triangle(name.owner, name.item), name);
            }
            made
        })
        .collect();
    (cones, triangles)
}

/// An empty vector with room for `n`, in large pages where the system gives them on request: rays jump about in
/// it, and each jump to a small page costs a look-up.
fn room<T>(n: usize) -> Vec<T> {
    let vec: Vec<T> = Vec::with_capacity(n);
    #[cfg(target_os = "linux")]
    {
        const PAGE: usize = 4096;
        let start = (vec.as_ptr() as usize).next_multiple_of(PAGE);
        let end = (vec.as_ptr() as usize + n * size_of::<T>()) / PAGE * PAGE;
        if end > start {
            // SAFETY: the range lies within the allocation; this advice changes no content. That it may not be
            // followed is no matter.
            unsafe { libc::madvise(start as *mut libc::c_void, end - start, libc::MADV_HUGEPAGE) };
        }
    }
    vec
}
