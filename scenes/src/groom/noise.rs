//! Smooth random functions of arc length and of place, as functions of a key.

use glam::Vec3;
use strandbench_rng::Rng;

/// Smoothstep of degree 5 on 0..1: its second derivative vanishes at both ends.
#[inline]
pub(crate) fn quintic(t: f32) -> f32 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

/// 0 below `from`, 1 beyond `from + reach`, smooth between.
#[inline]
pub(crate) fn ramp(x: f32, from: f32, reach: f32) -> f32 {
    let t = ((x - from) / reach).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// A standard normal number (Box and Muller 1958), the tails beyond 2.5 cut off.
pub(crate) fn normal(rng: &mut Rng) -> f32 {
    loop {
        let u = 1.0 - rng.f64();
        let v = rng.f64();
        let z = libm::sqrt(-2.0 * libm::log(u)) * libm::cos(std::f64::consts::TAU * v);
        if z.abs() < 2.5 {
            return z as f32;
        }
    }
}

/// exp(sd · z) with z standard normal: 1 in the median.
pub(crate) fn lognormal(rng: &mut Rng, sd: f32) -> f32 {
    libm::expf(sd * normal(rng))
}

/// A smooth random vector along a line: unit variance in each component at the knots, which lie 1 apart.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LineNoise {
    key: u64,
}

impl LineNoise {
    pub fn new(key: &[u64]) -> LineNoise {
        LineNoise { key: Rng::keyed(key).next_u64() }
    }

    fn knot(&self, k: i64) -> Vec3 {
        let mut r = Rng::keyed(&[self.key, k as u64]);
        // Uniform with variance 1.
        Vec3::new(r.f32() - 0.5, r.f32() - 0.5, r.f32() - 0.5) * 3.464_101_6
    }

    pub fn at(&self, x: f32) -> Vec3 {
        let k = x.floor();
        let (a, b) = (self.knot(k as i64), self.knot(k as i64 + 1));
        a + (b - a) * quintic(x - k)
    }

    /// Values at 0, step, 2 step, ...
    pub fn along(&self, step: f32) -> LineWalk {
        LineWalk { noise: *self, step, i: 0, knot: 0, a: self.knot(0), b: self.knot(1) }
    }
}

/// Walks along a [`LineNoise`], drawing each knot once.
pub(crate) struct LineWalk {
    noise: LineNoise,
    step: f32,
    i: u32,
    knot: i64,
    a: Vec3,
    b: Vec3,
}

impl LineWalk {
    pub fn next(&mut self) -> Vec3 {
        let x = self.i as f32 * self.step;
        self.i += 1;
        let k = x.floor();
        while self.knot < k as i64 {
            self.knot += 1;
            self.a = self.b;
            self.b = self.noise.knot(self.knot + 1);
        }
        self.a + (self.b - self.a) * quintic(x - k)
    }
}

/// A smooth random number in space, about -1..1, cells of size 1 (value noise).
pub(crate) fn space_noise(key: u64, p: Vec3) -> f32 {
    let i = p.floor();
    let f = p - i;
    let (u, v, w) = (quintic(f.x), quintic(f.y), quintic(f.z));
    let corner = |dx: f32, dy: f32, dz: f32| {
        let c = |v: f32| (v as i64) as u64;
        Rng::keyed(&[key, c(i.x + dx), c(i.y + dy), c(i.z + dz)]).f32() * 2.0 - 1.0
    };
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let face = |dz: f32| {
        mix(
            mix(corner(0.0, 0.0, dz), corner(1.0, 0.0, dz), u),
            mix(corner(0.0, 1.0, dz), corner(1.0, 1.0, dz), u),
            v,
        )
    };
    mix(face(0.0), face(1.0), w)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_smooth_keyed_and_of_unit_variance() {
        let (a, b) = (LineNoise::new(&[1, 2]), LineNoise::new(&[1, 3]));
        let mut walk = a.along(0.1);
        let (mut sum, mut squares, n) = (0.0f64, 0.0f64, 20_000);
        for i in 0..n {
            let x = i as f32 * 0.1;
            let v = a.at(x);
            assert_eq!(walk.next(), v, "the walk and the function agree at {x}");
            assert!((a.at(x + 0.01) - v).length() < 0.2);
            if i % 10 == 0 {
                sum += f64::from(v.x);
                squares += f64::from(v.x * v.x);
            }
        }
        let n = f64::from(n / 10);
        assert!((sum / n).abs() < 0.1, "mean {}", sum / n);
        assert!((squares / n - 1.0).abs() < 0.1, "variance {}", squares / n);
        assert_ne!(a.at(3.3), b.at(3.3));
        let p = Vec3::new(-3.2, 1.7, 9.0);
        let gap = (space_noise(5, p) - space_noise(5, p + Vec3::splat(1e-3))).abs();
        assert!(gap > 0.0 && gap < 0.02);
    }

    #[test]
    fn normals_have_unit_deviation() {
        let mut r = Rng::keyed(&[4]);
        let n = 20_000;
        let (mut sum, mut squares) = (0.0, 0.0);
        for _ in 0..n {
            let z = f64::from(normal(&mut r));
            (sum, squares) = (sum + z, squares + z * z);
        }
        // A standard normal cut at 2.5 has variance 0.911.
        assert!((sum / f64::from(n)).abs() < 0.03 && (squares / f64::from(n) - 0.911).abs() < 0.03);
    }
}
