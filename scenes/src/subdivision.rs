//! Catmull and Clark's subdivision of quads, apart from what is subdivided.

use std::collections::HashMap;
use std::ops::{Add, Div, Mul};

/// Two vertices, the lower first.
type Edge = (u32, u32);

/// One step of Catmull and Clark 1978 for a fixed topology; borders follow the cubic spline rule, and so does every
/// chart of texture coordinates that is refined as a mesh of its own: seams stay seams.
#[derive(Clone, Debug)]
pub(crate) struct Refinement {
    coarse: Vec<[u32; 4]>,
    vertices: usize,
    /// Edges in order of first appearance, with the one or two faces they belong to.
    edges: Vec<(Edge, [Option<usize>; 2])>,
    /// The refined quads, four for each old one in its order: the n-th around its n-th corner.
    pub quads: Vec<[u32; 4]>,
}

/// What can be averaged.
pub(crate) trait Value:
    Copy + Default + Add<Output = Self> + Mul<f32, Output = Self> + Div<f32, Output = Self>
{
}

impl<T> Value for T where T: Copy + Default + Add<Output = T> + Mul<f32, Output = T> + Div<f32, Output = T> {}

impl Refinement {
    /// The step for these quads over so many vertices.
    pub fn new(coarse: &[[u32; 4]], vertices: usize) -> Refinement {
        let mut edge_of: HashMap<Edge, usize> = HashMap::new();
        let mut edges: Vec<(Edge, [Option<usize>; 2])> = Vec::new();
        let mut face_edges: Vec<[usize; 4]> = Vec::with_capacity(coarse.len());
        for (f, q) in coarse.iter().enumerate() {
            face_edges.push(std::array::from_fn(|k| {
                let (a, b) = (q[k], q[(k + 1) % 4]);
                let key = (a.min(b), a.max(b));
                let e = *edge_of.entry(key).or_insert_with(|| {
                    edges.push((key, [None, None]));
                    edges.len() - 1
                });
                let slot = &mut edges[e].1;
                slot[usize::from(slot[0].is_some())] = Some(f);
                e
            }));
        }
        let (e0, f0) = (vertices as u32, (vertices + edges.len()) as u32);
        let mut quads = Vec::with_capacity(4 * coarse.len());
        for (f, q) in coarse.iter().enumerate() {
            let e = face_edges[f].map(|e| e0 + e as u32);
            for k in 0..4 {
                quads.push([q[k], e[k], f0 + f as u32, e[(k + 3) % 4]]);
            }
        }
        Refinement { coarse: coarse.to_vec(), vertices, edges, quads }
    }

    /// Vertices after the step.
    pub fn refined_vertices(&self) -> usize {
        self.vertices + self.edges.len() + self.coarse.len()
    }

    fn middle<T: Value>(values: &[T], q: &[u32; 4]) -> T {
        q.iter().fold(T::default(), |sum, &i| sum + values[i as usize]) * 0.25
    }

    /// The values at the refined vertices: at the old ones, at the edges, at the faces.
    pub fn smooth<T: Value>(&self, values: &[T]) -> Vec<T> {
        let zero = T::default();
        let faces: Vec<T> = self.coarse.iter().map(|q| Self::middle(values, q)).collect();
        let mut sums = vec![(zero, zero, 0.0f32); self.vertices];
        let mut border = vec![(zero, 0u32); self.vertices];
        for (q, &f) in self.coarse.iter().zip(&faces) {
            for &i in q {
                let s = &mut sums[i as usize];
                (s.0, s.2) = (s.0 + f, s.2 + 1.0);
            }
        }
        for ((a, b), sides) in &self.edges {
            let mid = (values[*a as usize] + values[*b as usize]) * 0.5;
            for &i in [a, b] {
                sums[i as usize].1 = sums[i as usize].1 + mid;
                if sides[1].is_none() {
                    let at = &mut border[i as usize];
                    *at = (at.0 + mid, at.1 + 1);
                }
            }
        }
        let mut out = Vec::with_capacity(self.refined_vertices());
        for i in 0..self.vertices {
            let p = values[i];
            out.push(if border[i].1 == 2 {
                p * 0.5 + border[i].0 * 0.25
            } else if border[i].1 > 0 || sums[i].2 == 0.0 {
                p
            } else {
                let (faces, mids, n) = sums[i];
                (faces / n + mids * (2.0 / n) + p * (n - 3.0)) / n
            });
        }
        for ((a, b), sides) in &self.edges {
            let ends = values[*a as usize] + values[*b as usize];
            out.push(match sides {
                [Some(f), Some(g)] => (ends + faces[*f] + faces[*g]) * 0.25,
                _ => ends * 0.5,
            });
        }
        out.extend(faces);
        out
    }

    /// The same places by means alone: old values stay as they are.
    pub fn linear<T: Value>(&self, values: &[T]) -> Vec<T> {
        let mut out = values.to_vec();
        out.extend(self.edges.iter().map(|((a, b), _)| (values[*a as usize] + values[*b as usize]) * 0.5));
        out.extend(self.coarse.iter().map(|q| Self::middle(values, q)));
        out
    }
}

/// Each quad as two triangles.
pub(crate) fn triangles(quads: &[[u32; 4]]) -> Vec<[u32; 3]> {
    quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect()
}
