//! A third opinion on rays and round cones, in double precision and without any acceleration structure, that
//! says why two renderers differ.

use glam::DVec3;
use strandbench_types::StrandSet;

/// A segment in double precision: the hull of two spheres.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Segment {
    p: DVec3,
    q: DVec3,
    rp: f64,
    rq: f64,
}

/// A ray in double precision.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray {
    pub origin: DVec3,
    pub direction: DVec3,
}

/// All segments, in the order in which both renderers number them.
pub(crate) fn segments_of(strands: &StrandSet) -> Vec<Segment> {
    let end = |i: usize| (strands.points[i].as_dvec3(), f64::from(strands.radii_mm[i]));
    (0..strands.len())
        .flat_map(|s| strands.range(s).skip(1))
        .map(|i| {
            let ((p, rp), (q, rq)) = (end(i - 1), end(i));
            Segment { p, q, rp, rq }
        })
        .collect()
}

impl Segment {
    fn at(&self, s: f64) -> (DVec3, f64) {
        (self.p.lerp(self.q, s), self.rp + (self.rq - self.rp) * s)
    }

    /// How near the ray's line passes: the least over all spheres of the hull of the line's distance to the
    /// centre over the radius. Below 1 the line pierces it, at 1 it grazes. The quotient of a convex function
    /// and a positive linear one has a single valley, so the golden section finds it.
    pub fn impact(&self, ray: &Ray) -> f64 {
        let f = |s: f64| {
            let (c, r) = self.at(s);
            (c - ray.origin).reject_from(ray.direction).length() / r
        };
        const GOLDEN: f64 = 0.618_033_988_749_894_9;
        let (mut a, mut b) = (0.0, 1.0);
        for _ in 0..60 {
            let (x, y) = (b - GOLDEN * (b - a), a + GOLDEN * (b - a));
            if f(x) < f(y) { b = y } else { a = x }
        }
        f(0.5 * (a + b)).min(f(0.0)).min(f(1.0))
    }

    /// Signed distance of a point to the surface, mm; negative inside.
    pub fn distance(&self, point: DVec3) -> f64 {
        // Along the axis the distance to the spheres' surfaces is convex.
        let f = |s: f64| {
            let (c, r) = self.at(s);
            (point - c).length() - r
        };
        let (mut a, mut b) = (0.0, 1.0);
        for _ in 0..120 {
            let (x, y) = (a + (b - a) / 3.0, b - (b - a) / 3.0);
            if f(x) < f(y) { b = y } else { a = x }
        }
        f(0.5 * (a + b)).min(f(0.0)).min(f(1.0))
    }

    /// Whether the place at `t` along the ray is nearest one of the two end spheres.
    pub fn beyond_an_end(&self, ray: &Ray, t: f64) -> bool {
        let point = ray.origin + ray.direction * t;
        let f = |s: f64| {
            let (c, r) = self.at(s);
            (point - c).length() - r
        };
        // The slope at the ends says whether the valley lies within.
        f(0.0) <= f(1e-7) || f(1.0) <= f(1.0 - 1e-7)
    }

    /// Where the ray enters, mm along it: the smallest over the hull's spheres of their entries. `None` if it
    /// misses; negative if the entry lies behind the origin.
    pub fn entry(&self, ray: &Ray) -> Option<f64> {
        // The entry into the sphere at s is convex in s where it exists; those s form one interval around the
        // place that the line pierces deepest.
        let depth = |s: f64| {
            let (c, r) = self.at(s);
            let w = c - ray.origin;
            let along = w.dot(ray.direction);
            (along, r * r - (w - ray.direction * along).length_squared())
        };
        let deepest = {
            let f = |s: f64| {
                let (c, r) = self.at(s);
                (c - ray.origin).reject_from(ray.direction).length() / r
            };
            let (mut a, mut b) = (0.0, 1.0);
            for _ in 0..120 {
                let (x, y) = (a + (b - a) / 3.0, b - (b - a) / 3.0);
                if f(x) < f(y) { b = y } else { a = x }
            }
            [0.0, 1.0, 0.5 * (a + b)].into_iter().min_by(|x, y| f(*x).total_cmp(&f(*y)))?
        };
        if depth(deepest).1 < 0.0 {
            return None;
        }
        let edge = |mut out: f64| {
            let mut inside = deepest;
            if depth(out).1 >= 0.0 {
                return out;
            }
            for _ in 0..80 {
                let m = 0.5 * (inside + out);
                if depth(m).1 >= 0.0 { inside = m } else { out = m }
            }
            inside
        };
        let f = |s: f64| {
            let (along, d2) = depth(s);
            along - d2.max(0.0).sqrt()
        };
        let (mut a, mut b) = (edge(0.0), edge(1.0));
        let ends = f(a).min(f(b));
        for _ in 0..120 {
            let (x, y) = (a + (b - a) / 3.0, b - (b - a) / 3.0);
            if f(x) < f(y) { b = y } else { a = x }
        }
        Some(f(0.5 * (a + b)).min(ends))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use strandbench_rng::Rng;

    #[test]
    fn the_referee_agrees_with_a_march_along_the_ray() {
        // Sphere tracing on the signed distance needs none of the algebra above.
        let mut hits = 0;
        for i in 0..250u64 {
            let mut rng = Rng::keyed(&[77, i]);
            let mut v = || DVec3::from_array(std::array::from_fn(|_| rng.f64() * 2.0 - 1.0));
            let (p, q, o, aim) = (v(), v(), v() * 3.0 + DVec3::Z * 6.0, v());
            let s = Segment { p, q, rp: 0.3 + 0.2 * v().x, rq: 0.3 + 0.2 * v().x };
            let ray = Ray { origin: o, direction: (aim - o).normalize() };
            let mut t = 0.0;
            let met = (0..4000).any(|_| {
                let d = s.distance(ray.origin + ray.direction * t);
                t += d;
                d < 1e-10
            });
            let impact = s.impact(&ray);
            assert_eq!(impact < 1.0, s.entry(&ray).is_some());
            if (impact - 1.0).abs() > 1e-4 {
                assert_eq!(met, impact < 1.0, "{i}: {impact}");
            }
            if met && impact < 0.999 {
                let e = s.entry(&ray).unwrap();
                assert!((e - t).abs() < 1e-6, "{i}: {e} {t}");
                hits += 1;
            }
        }
        assert!(hits > 40, "{hits} hits");
    }

    #[test]
    fn segments_come_in_the_order_of_the_points() {
        let mut set = StrandSet::new();
        set.push(&[Vec3::ZERO, Vec3::X, Vec3::X * 2.0], 0.1);
        set.push(&[Vec3::Y, Vec3::Z], 0.2);
        let s = segments_of(&set);
        assert_eq!((s.len(), s[1].p.x, s[2].rp), (3, 1.0, f64::from(0.2f32)));
    }
}
