//! Where hair grows: a closed hairline on the mesh, and roots spread evenly inside it.

use glam::Vec3;
use strandbench_rng::Rng;
use strandbench_types::TriMesh;

/// The hairline: height (mm) at azimuths (degrees from the face towards either ear) on a head of reference
/// breadth. Forehead, receding temple, sideburn, over the ear, down behind it, nape. The heights follow the
/// rule of thirds of portrait drawing: chin to nose, nose to brow and brow to hairline are alike.
const HAIRLINE: [(f32, f32); 17] = [
    (0.0, 57.0),
    (15.0, 57.5),
    (30.0, 56.0),
    (42.0, 48.0),
    (52.0, 30.0),
    (60.0, 8.0),
    (66.0, -16.0),
    (72.0, -28.0),
    (78.0, -16.0),
    (84.0, -2.0),
    (95.0, 2.0),
    (108.0, -4.0),
    (116.0, -30.0),
    (125.0, -62.0),
    (140.0, -80.0),
    (160.0, -88.0),
    (180.0, -90.0),
];

/// Distance inside the hairline (mm, about; negative outside) of a point on a head of reference size.
fn inside_hairline_mm(p: Vec3) -> f32 {
    let azimuth = libm::atan2f(p.x.abs(), p.z).to_degrees();
    let k = HAIRLINE[1..].partition_point(|(a, _)| *a < azimuth).min(HAIRLINE.len() - 2);
    // Catmull-Rom over uneven knots, slopes by central differences; the curve is even about 0° and 180°.
    let slope = |i: usize| {
        if i == 0 || i == HAIRLINE.len() - 1 {
            return 0.0;
        }
        (HAIRLINE[i + 1].1 - HAIRLINE[i - 1].1) / (HAIRLINE[i + 1].0 - HAIRLINE[i - 1].0)
    };
    let ((a0, y0), (a1, y1)) = (HAIRLINE[k], HAIRLINE[k + 1]);
    let (w, t) = (a1 - a0, ((azimuth - a0) / (a1 - a0)).clamp(0.0, 1.0));
    let (t2, t3) = (t * t, t * t * t);
    let height = y0 * (2.0 * t3 - 3.0 * t2 + 1.0)
        + slope(k) * w * (t3 - 2.0 * t2 + t)
        + y1 * (3.0 * t2 - 2.0 * t3)
        + slope(k + 1) * w * (t3 - t2);
    // A vertical gap on a slanting hairline is longer than the distance to it.
    let radius = (p.x * p.x + p.z * p.z).sqrt().max(1.0);
    let per_degree = (y1 - y0) / w * (6.0 * t - 6.0 * t2)
        + slope(k) * (3.0 * t2 - 4.0 * t + 1.0)
        + slope(k + 1) * (3.0 * t2 - 2.0 * t);
    let steepness = per_degree.to_degrees() / radius;
    (p.y - height) / (1.0 + steepness * steepness).sqrt()
}

/// Height of the hairline in the middle of the forehead at the reference size, mm.
pub(crate) fn front_height_mm() -> f32 {
    HAIRLINE[0].1
}

/// A place where a hair grows, at the size of the head asked for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Root {
    /// On the mesh, mm.
    pub position: Vec3,
    /// Unit, outward.
    pub normal: Vec3,
    /// Distance from the hairline, mm, about.
    pub inside_mm: f32,
}

/// Triangles inside the hairline, at the reference size.
pub(crate) struct Scalp {
    triangles: Vec<[Vec3; 3]>,
    normals: Vec<[Vec3; 3]>,
    /// Which triangles of the skin these are, ascending.
    indices: Vec<u32>,
    /// Running sum of areas, mm².
    cumulative: Vec<f32>,
}

/// Width over which hair thins out towards the hairline, mm.
const FADE_MM: f32 = 7.0;

impl Scalp {
    pub fn new(skin: &TriMesh, ear: &[f32]) -> Scalp {
        let vertex_normals = skin.vertex_normals();
        let mut out =
            Scalp { triangles: Vec::new(), normals: Vec::new(), indices: Vec::new(), cumulative: Vec::new() };
        let mut total = 0.0;
        for (i, t) in (0..).zip(&skin.triangles) {
            let corner = t.map(|i| skin.vertices[i as usize]);
            let middle = (corner[0] + corner[1] + corner[2]) / 3.0;
            let on_ear = t.iter().any(|&i| ear[i as usize] > 0.3);
            // The mouth and the eye sockets turn inward; so does nothing of the scalp.
            let outward = (corner[1] - corner[0]).cross(corner[2] - corner[0]).dot(middle) > 0.0;
            let near = corner.iter().any(|&p| inside_hairline_mm(p) > 0.0);
            if on_ear || !outward || !near {
                continue;
            }
            total += 0.5 * (corner[1] - corner[0]).cross(corner[2] - corner[0]).length();
            out.triangles.push(corner);
            out.indices.push(i);
            out.normals.push(t.map(|i| vertex_normals[i as usize]));
            out.cumulative.push(total);
        }
        out
    }

    /// Which triangles of the skin have a corner inside the hairline, ascending.
    pub fn indices(&self) -> &[u32] {
        &self.indices
    }

    /// Area inside the hairline or next to it at the reference size, mm².
    pub fn area_mm2(&self) -> f32 {
        *self.cumulative.last().expect("the head has a scalp")
    }

    fn candidate(&self, rng: &mut Rng) -> Root {
        let at = rng.f32() * self.area_mm2();
        let i = self.cumulative.partition_point(|&c| c <= at).min(self.triangles.len() - 1);
        // Uniform on a triangle by folding the unit square.
        let (mut u, mut v) = (rng.f32(), rng.f32());
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        let mix = |t: &[Vec3; 3]| t[0] * (1.0 - u - v) + t[1] * u + t[2] * v;
        let position = mix(&self.triangles[i]);
        Root {
            position,
            normal: mix(&self.normals[i]).normalize_or(Vec3::Y),
            inside_mm: inside_hairline_mm(position),
        }
    }

    /// `n` roots, evenly spread without a lattice: each is the farthest from its predecessors among a few
    /// area-uniform candidates (Mitchell 1991), fewer near the hairline. `scale` is the head's size relative
    /// to the reference. Equal keys give equal roots.
    pub fn roots(&self, n: usize, scale: f32, key: &[u64], candidates: usize) -> Vec<Root> {
        let mut rng = Rng::keyed(key);
        let spacing = (self.area_mm2() / n.max(1) as f32).sqrt();
        let mut grid = Grid::new(spacing * 1.5);
        let mut out: Vec<Root> = Vec::with_capacity(n);
        for _ in 0..n {
            let mut best: Option<(f32, Root)> = None;
            for _ in 0..candidates {
                let c = loop {
                    let c = self.candidate(&mut rng);
                    let keep = (c.inside_mm / FADE_MM).clamp(0.0, 1.0);
                    // Three quarters as dense at the nape and the temples as on the top.
                    let high = 0.75 + 0.25 * (c.position.y / 60.0).clamp(0.0, 1.0);
                    if c.inside_mm > 0.0 && rng.f32() < high * keep * (0.35 + 0.65 * keep) {
                        break c;
                    }
                };
                let gap = grid.nearest(&out, c.position);
                if best.as_ref().is_none_or(|(b, _)| gap > *b) {
                    best = Some((gap, c));
                }
            }
            let (_, root) = best.expect("at least one candidate");
            grid.insert(root.position, out.len() as u32);
            out.push(root);
        }
        for r in &mut out {
            r.position *= scale;
            r.inside_mm *= scale;
        }
        out
    }
}

/// Buckets of points for looking up close neighbours.
struct Grid {
    cell: f32,
    buckets: std::collections::HashMap<[i32; 3], Vec<u32>>,
}

impl Grid {
    fn new(cell: f32) -> Grid {
        Grid { cell, buckets: std::collections::HashMap::new() }
    }
    fn key(&self, p: Vec3) -> [i32; 3] {
        (p / self.cell).floor().to_array().map(|v| v as i32)
    }
    fn insert(&mut self, p: Vec3, index: u32) {
        self.buckets.entry(self.key(p)).or_default().push(index);
    }
    /// Squared distance to the nearest point within a cell's reach; infinite if there is none.
    fn nearest(&self, points: &[Root], p: Vec3) -> f32 {
        let k = self.key(p);
        let mut best = f32::INFINITY;
        for dz in -1..=1 {
            for dy in -1..=1 {
                for dx in -1..=1 {
                    if let Some(b) = self.buckets.get(&[k[0] + dx, k[1] + dy, k[2] + dz]) {
                        for &i in b {
                            best = best.min(points[i as usize].position.distance_squared(p));
                        }
                    }
                }
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::super::Head;
    use super::*;

    #[test]
    fn roots_lie_on_the_skull_inside_the_hairline_and_apart() {
        let head = Head::new(155.0);
        let area = head.scalp().area_mm2();
        assert!((45_000.0..95_000.0).contains(&area), "scalps have 500 to 800 cm²: {area}");
        let n = 3000;
        let roots = head.scalp().roots(n, 1.0, &[5], 5);
        let mut left = 0;
        let mut closest = vec![f32::INFINITY; n];
        for (i, r) in roots.iter().enumerate() {
            assert!(r.inside_mm > 0.0);
            assert!(head.exact_distance(r.position).0.abs() < 1e-3, "{:?}", r);
            assert!(r.position.y > -100.0 && !(r.position.z > 60.0 && r.position.y < 45.0), "{:?}", r);
            left += usize::from(r.position.x > 0.0);
            for (j, o) in roots.iter().enumerate() {
                if i != j {
                    closest[i] = closest[i].min(o.position.distance(r.position));
                }
            }
        }
        assert!((n * 45 / 100..n * 55 / 100).contains(&left), "{left} of {n} on the left");
        // Independent uniform points would have a mean nearest gap of 0.5 spacings.
        let spacing = (area / n as f32).sqrt();
        let mean = closest.iter().sum::<f32>() / n as f32;
        assert!(mean > 0.6 * spacing, "mean nearest gap {mean} mm of spacing {spacing} mm");
    }

    #[test]
    fn the_hairline_is_smooth() {
        let at = |deg: f32| {
            let (s, c) = (libm::sinf(deg.to_radians()), libm::cosf(deg.to_radians()));
            inside_hairline_mm(Vec3::new(80.0 * s, 200.0, 80.0 * c))
        };
        for i in 0..1799 {
            let a = i as f32 * 0.1;
            assert!((at(a + 0.1) - at(a)).abs() < 60.0, "a step at {a}°");
        }
        assert_eq!(at(30.0).to_bits(), at(-30.0).to_bits());
    }
}
