//! Deformation graphs and the points that they carry (Sumner et al. 2007, section 3).

use super::tree::PointTree;
use glam::{DMat3, DVec3};
use rayon::prelude::*;

/// Nodes with an affine map each: a point x near node g goes to A (x - g) + g + b.
#[derive(Clone, Debug, PartialEq)]
pub struct DeformationGraph {
    /// Node positions g at rest, mm.
    pub rest: Vec<DVec3>,
    /// Undirected edges (lower index, higher index), ascending, without repetition.
    pub edges: Vec<(u32, u32)>,
    /// A of each node.
    pub linear: Vec<DMat3>,
    /// b of each node, mm.
    pub offset: Vec<DVec3>,
}

/// How points depend on nodes: `k` nodes and weights a point.
#[derive(Clone, Debug, PartialEq)]
pub struct Skinning {
    /// Nodes a point.
    pub k: usize,
    /// Node indices, indexed [point * k + slot], nearest first.
    pub nodes: Vec<u32>,
    /// Weights that sum to 1 at each point, indexed [point * k + slot].
    pub weights: Vec<f64>,
}

/// Picks points so that no two are nearer than `spacing_mm` and every point has a picked one within that
/// distance, in the order given. Returns indices into `points`.
pub fn sample_uniformly(points: &[DVec3], spacing_mm: f64) -> Vec<usize> {
    assert!(spacing_mm > 0.0, "a spacing is positive");
    let cell = |p: DVec3| (p / spacing_mm).floor().to_array().map(|v| v as i64);
    let mut cells: std::collections::HashMap<[i64; 3], Vec<usize>> = std::collections::HashMap::new();
    let mut picked = Vec::new();
    for (i, &p) in points.iter().enumerate() {
        let c = cell(p);
        let near = (0..27).any(|k: i64| {
            let n = [c[0] + k % 3 - 1, c[1] + k / 3 % 3 - 1, c[2] + k / 9 - 1];
            let inside = |j: &usize| points[*j].distance_squared(p) < spacing_mm * spacing_mm;
            cells.get(&n).is_some_and(|v| v.iter().any(inside))
        });
        if !near {
            cells.entry(c).or_default().push(i);
            picked.push(i);
        }
    }
    picked
}

impl Skinning {
    /// Each point on its `k` nearest nodes (all of them if there are fewer), weights inversely proportional to
    /// Euclidean distance (Luo et al. 4.4 and 5.3; Li et al. 2008). A point on a node belongs to it alone.
    pub fn new(points: &[DVec3], nodes: &[DVec3], k: usize) -> Skinning {
        let k = k.min(nodes.len());
        assert!(k > 0, "skinning needs a node");
        let tree = PointTree::new(nodes);
        let mut skin = Skinning { k, nodes: vec![0; points.len() * k], weights: vec![0.0; points.len() * k] };
        let slots = skin.nodes.par_chunks_mut(k).zip(skin.weights.par_chunks_mut(k));
        slots.zip(points).for_each_init(
            || vec![(0.0, 0u32); k],
            |near, ((nodes, weights), &p)| {
                tree.k_nearest(p, near);
                for (slot, &(_, node)) in nodes.iter_mut().zip(near.iter()) {
                    *slot = node;
                }
                if near[0].0 == 0.0 {
                    weights[0] = 1.0;
                    return;
                }
                // Relative to the nearest, which no division can overflow.
                let nearest = near[0].0;
                let mut total = 0.0;
                for (w, &(d2, _)) in weights.iter_mut().zip(near.iter()) {
                    *w = (nearest / d2).sqrt();
                    total += *w;
                }
                weights.iter_mut().for_each(|w| *w /= total);
            },
        );
        skin
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.nodes.len() / self.k
    }

    /// Whether there are no points.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Nodes and weights of a point.
    pub fn of(&self, point: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let range = point * self.k..(point + 1) * self.k;
        self.nodes[range.clone()].iter().map(|&n| n as usize).zip(self.weights[range].iter().copied())
    }
}

impl DeformationGraph {
    /// A graph at rest. Nodes are joined if they carry a point together, and each with its `neighbours` nearest
    /// nodes, so that what carries no point hangs together too.
    pub fn new(nodes: Vec<DVec3>, skin: &Skinning, neighbours: usize) -> DeformationGraph {
        let mut edges = std::collections::BTreeSet::new();
        let mut join = |a: u32, b: u32| {
            if a != b {
                edges.insert((a.min(b), a.max(b)));
            }
        };
        for p in skin.nodes.chunks(skin.k) {
            for (i, &a) in p.iter().enumerate() {
                p[..i].iter().for_each(|&b| join(a, b));
            }
        }
        let tree = PointTree::new(&nodes);
        let mut near = vec![(0.0, 0u32); (neighbours + 1).min(nodes.len())];
        for (i, &g) in nodes.iter().enumerate() {
            tree.k_nearest(g, &mut near);
            near.iter().for_each(|&(_, j)| join(i as u32, j));
        }
        let n = nodes.len();
        DeformationGraph {
            rest: nodes,
            edges: edges.into_iter().collect(),
            linear: vec![DMat3::IDENTITY; n],
            offset: vec![DVec3::ZERO; n],
        }
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.rest.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.rest.is_empty()
    }

    /// Where the nodes are now, mm.
    pub fn positions(&self) -> Vec<DVec3> {
        self.rest.iter().zip(&self.offset).map(|(&g, &b)| g + b).collect()
    }

    /// Where a point at rest goes, and the blended linear map there.
    pub fn carry(&self, skin: &Skinning, point: usize, at: DVec3) -> (DVec3, DMat3) {
        let (mut to, mut linear) = (DVec3::ZERO, DMat3::ZERO);
        for (j, w) in skin.of(point) {
            to += w * (self.linear[j] * (at - self.rest[j]) + self.rest[j] + self.offset[j]);
            linear += self.linear[j] * w;
        }
        (to, linear)
    }

    /// Where all points go, mm.
    pub fn carry_all(&self, skin: &Skinning, points: &[DVec3]) -> Vec<DVec3> {
        assert_eq!(skin.len(), points.len(), "skinning of these points");
        (0..points.len()).into_par_iter().map(|i| self.carry(skin, i, points[i]).0).collect()
    }

    /// Applies a rigid motion x -> rotation x + translation to all nodes.
    pub fn move_rigidly(&mut self, rotation: DMat3, translation: DVec3) {
        for i in 0..self.len() {
            let now = self.rest[i] + self.offset[i];
            self.linear[i] = rotation * self.linear[i];
            self.offset[i] = rotation * now + translation - self.rest[i];
        }
    }
}

/// A normal under a linear map: the cofactor matrix, which needs no inverse. Zero if the map flattens it.
pub fn carry_normal(linear: DMat3, normal: DVec3) -> DVec3 {
    let [x, y, z] = [linear.x_axis, linear.y_axis, linear.z_axis];
    let cofactor = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
    (cofactor * normal).normalize_or_zero()
}
