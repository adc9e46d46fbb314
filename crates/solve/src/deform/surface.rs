//! Triangle surfaces that are searched for nearest points.

use super::energy::Aim;
use super::register::DeformError;
use super::tree::PointTree;
use glam::DVec3;

/// A triangle mesh with unit normals at its points.
#[derive(Clone, Debug)]
pub struct Surface {
    points: Vec<DVec3>,
    normals: Vec<DVec3>,
    border: Vec<bool>,
    triangles: Vec<[u32; 3]>,
    /// Triangles around a point, indexed [around_starts[point]..around_starts[point + 1]].
    around: Vec<u32>,
    around_starts: Vec<u32>,
    tree: PointTree,
}

/// The nearest place on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// Place on the surface, mm.
    pub point: DVec3,
    /// Normal there, interpolated between the corners' and of unit length; zero where those cancel.
    pub normal: DVec3,
    /// The point of the mesh that is nearest.
    pub vertex: usize,
}

/// Which points of a mesh lie on an open border: on an edge of a single triangle, or on no triangle at all.
pub fn border_points(points: usize, triangles: &[[u32; 3]]) -> Vec<bool> {
    let mut edges: Vec<(u32, u32)> = triangles
        .iter()
        .flat_map(|t| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])].map(|(a, b)| (a.min(b), a.max(b))))
        .collect();
    edges.sort_unstable();
    let mut border = vec![true; points];
    triangles.iter().flatten().for_each(|&i| border[i as usize] = false);
    for run in edges.chunk_by(|a, b| a == b).filter(|run| run.len() == 1) {
        border[run[0].0 as usize] = true;
        border[run[0].1 as usize] = true;
    }
    border
}

impl Surface {
    /// Points in mm, unit normals (zero where unknown) and triangles over them.
    ///
    /// # Errors
    /// If there are no points, arrays differ in length, a number is not finite or a triangle names no point.
    pub fn new(
        points: Vec<DVec3>,
        normals: Vec<DVec3>,
        triangles: Vec<[u32; 3]>,
    ) -> Result<Surface, DeformError> {
        check("target", &points, &normals)?;
        let n = points.len();
        if let Some(i) = triangles.iter().position(|t| t.iter().any(|&k| k as usize >= n)) {
            let fault = format!("triangle {i} names a point beyond the {n} there are");
            return Err(DeformError::Surface { surface: "target", fault });
        }
        let border = border_points(n, &triangles);
        let mut around_starts = vec![0u32; n + 1];
        triangles.iter().flatten().for_each(|&i| around_starts[i as usize + 1] += 1);
        for i in 0..n {
            around_starts[i + 1] += around_starts[i];
        }
        let mut around = vec![0u32; 3 * triangles.len()];
        let mut next = around_starts.clone();
        for (t, corners) in triangles.iter().enumerate() {
            for &i in corners {
                around[next[i as usize] as usize] = t as u32;
                next[i as usize] += 1;
            }
        }
        let tree = PointTree::new(&points);
        Ok(Surface { points, normals, border, triangles, around, around_starts, tree })
    }

    /// Points, mm.
    pub fn points(&self) -> &[DVec3] {
        &self.points
    }

    /// Unit normals.
    pub fn normals(&self) -> &[DVec3] {
        &self.normals
    }

    /// Whether each point lies on an open border.
    pub fn border(&self) -> &[bool] {
        &self.border
    }

    /// The place nearest to `at` on the triangles around the nearest point, that point being within `radius_mm`.
    pub fn nearest(&self, at: DVec3, radius_mm: f64) -> Option<Nearest> {
        let (vertex, d2) = self.tree.nearest(at, radius_mm)?;
        let mut best = Nearest { point: self.points[vertex], normal: self.normals[vertex], vertex };
        let mut least = d2;
        let range = self.around_starts[vertex] as usize..self.around_starts[vertex + 1] as usize;
        for &t in &self.around[range] {
            let corners = self.triangles[t as usize].map(|i| i as usize);
            let [a, b, c] = corners.map(|i| self.points[i]);
            let w = nearest_on_triangle(at, a, b, c);
            let point = a * w.x + b * w.y + c * w.z;
            let d = point.distance_squared(at);
            if d < least {
                least = d;
                let [m, n, o] = corners.map(|i| self.normals[i]);
                best = Nearest { point, normal: (m * w.x + n * w.y + o * w.z).normalize_or_zero(), vertex };
            }
        }
        Some(best)
    }

    /// The nearest place, if it is a partner: its vertex within `distance_mm`, normals within an angle of this
    /// cosine, and not on the border, where it stands for whatever lies beyond.
    pub fn partner(&self, at: DVec3, normal: DVec3, distance_mm: f64, min_cos: f64) -> Option<Aim> {
        let near = self.nearest(at, distance_mm)?;
        let fits = !self.border[near.vertex] && near.normal.dot(normal) >= min_cos;
        fits.then_some(Aim { point: near.point, normal: near.normal })
    }
}

pub(super) fn check(surface: &'static str, points: &[DVec3], normals: &[DVec3]) -> Result<(), DeformError> {
    let fault = if points.is_empty() {
        "no points".to_owned()
    } else if points.len() != normals.len() {
        format!("{} points but {} normals", points.len(), normals.len())
    } else if points.len() >= (u32::MAX / 8) as usize {
        format!("{} points are too many", points.len())
    } else if let Some(i) = points.iter().zip(normals).position(|(p, n)| !(p.is_finite() && n.is_finite())) {
        format!("point {i} or its normal is not finite")
    } else {
        return Ok(());
    };
    Err(DeformError::Surface { surface, fault })
}

/// Barycentric weights of the point of a triangle that is nearest to `p`.
fn nearest_on_triangle(p: DVec3, a: DVec3, b: DVec3, c: DVec3) -> DVec3 {
    let normal = (b - a).cross(c - a);
    let area2 = normal.length_squared();
    if area2 > 0.0 {
        let inside = |u: DVec3, v: DVec3| (v - u).cross(p - u).dot(normal) / area2;
        let w = DVec3::new(inside(b, c), inside(c, a), inside(a, b));
        if w.min_element() >= 0.0 {
            return w / (w.x + w.y + w.z);
        }
    }
    let along = |u: DVec3, v: DVec3| {
        let l = (v - u).length_squared();
        if l > 0.0 { ((p - u).dot(v - u) / l).clamp(0.0, 1.0) } else { 0.0 }
    };
    let (ab, bc, ca) = (along(a, b), along(b, c), along(c, a));
    let edges = [DVec3::new(1.0 - ab, ab, 0.0), DVec3::new(0.0, 1.0 - bc, bc), DVec3::new(ca, 0.0, 1.0 - ca)];
    let distance = |w: &DVec3| (a * w.x + b * w.y + c * w.z).distance_squared(p);
    edges.into_iter().min_by(|x, y| distance(x).total_cmp(&distance(y))).expect("three edges")
}

#[cfg(test)]
mod tests {
    use super::*;
    use strandbench_rng::Rng;

    #[test]
    fn nearest_on_a_triangle_is_no_farther_than_any_sample_of_it() {
        let mut rng = Rng::keyed(&[1]);
        let mut at = || DVec3::new(rng.f64(), rng.f64(), rng.f64()) * 2.0 - 1.0;
        for k in 0..400 {
            let (a, mut b, c, p) = (at(), at(), at(), at() * 2.0);
            if k % 10 == 0 {
                b = a + (c - a) * 0.3;
            }
            let w = nearest_on_triangle(p, a, b, c);
            assert!(w.min_element() >= 0.0 && (w.x + w.y + w.z - 1.0).abs() < 1e-12);
            let got = (a * w.x + b * w.y + c * w.z).distance(p);
            let mut least = f64::INFINITY;
            for i in 0..=40 {
                for j in 0..=40 - i {
                    let (u, v) = (f64::from(i) / 40.0, f64::from(j) / 40.0);
                    least = least.min((a * u + b * v + c * (1.0 - u - v)).distance(p));
                }
            }
            assert!(got <= least + 1e-12 && got >= least - 0.1, "{k}: {got} against {least}");
        }
    }

    #[test]
    fn borders_are_edges_of_one_triangle() {
        // A fan around point 4, closed but for one gap, and a lone point.
        let triangles = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]];
        assert_eq!(border_points(6, &triangles), [true, true, true, true, false, true]);
        assert_eq!(border_points(6, &triangles[..3]), [true, true, true, true, true, true]);
    }
}
