//! Where follicles stand: by density over the skin, no two closer than chance would have it.

use super::{HairKind, Patch, region};
use crate::face::{FaceModel, Follicle, Part};
use crate::head::MeshBvh;
use glam::{IVec3, Vec3};
use std::collections::HashMap;
use strandbench_rng::Rng;
use strandbench_types::Plane;

/// Candidates for each follicle.
const CANDIDATES: usize = 4;
/// Distance between follicles relative to the mean distance at their density.
const APART: f32 = 0.72;

/// A follicle and what it takes from its place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Root {
    pub follicle: Follicle,
    /// On the mean neutral face, mm.
    pub rest: Vec3,
    /// On this person's neutral face, mm.
    pub place: Vec3,
    /// Factor of the length.
    pub length: f32,
}

/// What places are looked up in.
pub(super) struct Ground<'a> {
    pub model: &'a FaceModel,
    /// Vertices of the mean face and of this person's, both neutral.
    pub rest: &'a [Vec3],
    pub neutral: &'a [Vec3],
    pub density: Option<Plane<f32>>,
    pub length: Option<Plane<f32>>,
}

impl Ground<'_> {
    fn place(&self, f: &Follicle, vertices: &[Vec3]) -> Vec3 {
        let corners = self.model.triangles()[f.triangle as usize];
        (0..3).map(|k| vertices[corners[k] as usize] * f.barycentric[k]).sum()
    }

    fn mapped(&self, map: &Plane<f32>, f: &Follicle) -> f32 {
        let uv = f.uv(self.model);
        let size = map.width as f32;
        let at = |v: f32| ((v * size) as usize).min(map.width - 1);
        *map.at(at(uv.x), at(1.0 - uv.y))
    }

    /// Hairs a square millimetre at a place of the skin.
    fn density(&self, kind: HairKind, patch: &Patch, f: &Follicle) -> f32 {
        let share = match &self.density {
            Some(map) => self.mapped(map, f),
            None => region::density(kind, self.place(f, self.rest)),
        };
        share * patch.density_per_cm2 * 0.01
    }

    fn root(&self, follicle: Follicle) -> Root {
        Root {
            rest: self.place(&follicle, self.rest),
            place: self.place(&follicle, self.neutral),
            length: self.length.as_ref().map_or(1.0, |map| self.mapped(map, &follicle)),
            follicle,
        }
    }

    /// Follicles of a patch: as many as density over area asks for, chosen among candidates drawn in proportion to it so
    /// that none stands nearer to another than about three quarters of the mean distance, as long as there are such.
    pub fn roots(&self, kind: HairKind, patch: &Patch, key: u64) -> Vec<Root> {
        const MIDDLE: [f32; 3] = [1.0 / 3.0; 3];
        // Triangles on which hair grows, and how many hairs grow on them and those before.
        let (mut sums, mut sum) = (Vec::new(), 0.0f64);
        let triangles = (0u32..).zip(self.model.triangles()).zip(self.model.parts());
        for ((triangle, t), _) in triangles.filter(|(_, part)| **part == Part::Skin) {
            let [a, b, c] = t.map(|v| self.neutral[v as usize]);
            let area = 0.5 * (b - a).cross(c - a).length();
            let middle = Follicle { triangle, barycentric: MIDDLE };
            let expected = f64::from(area * self.density(kind, patch, &middle));
            if expected > 0.0 {
                sum += expected;
                sums.push((sum, triangle));
            }
        }
        let wanted = sum.round() as usize;
        let mut candidates: Vec<(u64, Follicle)> = (0..wanted * CANDIDATES)
            .map(|i| {
                let mut rng = Rng::keyed(&[key, i as u64]);
                let u = (i as f64 + rng.f64()) / (wanted * CANDIDATES) as f64 * sum;
                let (_, triangle) = sums[sums.partition_point(|s| s.0 <= u).min(sums.len() - 1)];
                let (a, b) = (rng.f32().sqrt(), rng.f32());
                (rng.next_u64(), Follicle { triangle, barycentric: [1.0 - a, a * (1.0 - b), a * b] })
            })
            .collect();
        candidates.sort_unstable_by_key(|c| c.0);
        let cell_mm = 1.0f32;
        let cell = |p: Vec3| (p / cell_mm).floor().as_ivec3();
        let mut near: HashMap<IVec3, Vec<Vec3>> = HashMap::new();
        let mut out = Vec::with_capacity(wanted);
        let mut left: Vec<Follicle> = candidates.into_iter().map(|c| c.1).collect();
        for apart in [APART, 0.6 * APART, 0.0] {
            let mut rest = Vec::new();
            for f in left {
                if out.len() == wanted {
                    break;
                }
                let root = self.root(f);
                let density = self.density(kind, patch, &f).max(1e-4);
                let gap = (apart / density.sqrt()).min(4.0 * cell_mm);
                let (c, reach) = (cell(root.place), (gap / cell_mm).ceil() as i32);
                let crowded = (-reach..=reach).any(|x| {
                    (-reach..=reach).any(|y| {
                        (-reach..=reach).any(|z| {
                            let at = near.get(&(c + IVec3::new(x, y, z)));
                            at.is_some_and(|v| v.iter().any(|p| p.distance(root.place) < gap))
                        })
                    })
                });
                if crowded {
                    rest.push(f);
                } else {
                    near.entry(c).or_default().push(root.place);
                    out.push(root);
                }
            }
            left = rest;
        }
        out
    }

    /// Follicles of lashes on the margins of the lids, evenly with some disorder; the lids' names with them.
    pub fn lashes(&self, patch: &Patch, key: u64, skin: &MeshBvh, faces: &[u32]) -> Vec<(Root, bool)> {
        let mut out = Vec::new();
        for (line, (name, path)) in (0u64..).zip(self.model.lash_lines()) {
            let corner = |k: usize| self.neutral[path[k] as usize];
            let lengths: Vec<f32> = (1..path.len()).map(|k| corner(k).distance(corner(k - 1))).collect();
            let whole: f32 = lengths.iter().sum();
            let count = (whole * 0.1 * patch.density_per_cm2).round() as usize;
            for i in 0..count {
                let mut rng = Rng::keyed(&[key, line, i as u64]);
                // No lashes in the corners of the eye.
                let mut s = whole * (0.1 + 0.86 * (i as f32 + rng.f32()) / count as f32);
                let k = lengths.iter().position(|l| {
                    let here = s <= *l;
                    if !here {
                        s -= l;
                    }
                    here
                });
                let k = k.unwrap_or(lengths.len() - 1);
                let at = corner(k).lerp(corner(k + 1), (s / lengths[k].max(1e-6)).clamp(0.0, 1.0));
                let at = at + Vec3::new(0.0, 0.0, 0.5 * rng.f32());
                let triangle = faces[skin.closest(at, None).triangle as usize];
                let follicle = Follicle { triangle, barycentric: self.weights(triangle, at) };
                out.push((self.root(follicle), name.contains("upper")));
            }
        }
        out
    }

    /// Weights of a triangle's corners for the place of it nearest to a point close by.
    fn weights(&self, triangle: u32, p: Vec3) -> [f32; 3] {
        let [a, b, c] = self.model.triangles()[triangle as usize].map(|v| self.neutral[v as usize]);
        let (u, v, w) = (b - a, c - a, p - a);
        let (uu, uv, vv) = (u.dot(u), u.dot(v), v.dot(v));
        let det = (uu * vv - uv * uv).max(1e-12);
        let (wu, wv) = (w.dot(u), w.dot(v));
        let s = ((wu * vv - wv * uv) / det).max(0.0);
        let t = ((wv * uu - wu * uv) / det).max(0.0);
        let over = (s + t).max(1.0);
        let (s, t) = (s / over, t / over);
        [1.0 - s - t, s, t]
    }
}
