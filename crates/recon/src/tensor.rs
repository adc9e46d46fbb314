//! Structure tensors T = ℓ ℓᵀ (Paris et al. 2008; Luo et al. 5.1): lines with a strength, which can be added.

use glam::{DVec3, Vec3};

/// A symmetric 3x3 matrix as (xx, yy, zz, xy, xz, yz).
pub type Tensor = [f32; 6];

/// ℓ ℓᵀ: the line along ℓ; its trace is |ℓ|².
pub fn outer(l: Vec3) -> Tensor {
    [l.x * l.x, l.y * l.y, l.z * l.z, l.x * l.y, l.x * l.z, l.y * l.z]
}

/// Sum of a tensor's diagonal: for ℓ ℓᵀ the squared strength |ℓ|².
pub fn trace(t: &Tensor) -> f32 {
    t[0] + t[1] + t[2]
}

/// Adds `w` times `t` to `sum`.
#[inline]
pub fn add_scaled(sum: &mut Tensor, t: &Tensor, w: f32) {
    for (s, v) in sum.iter_mut().zip(t) {
        *s += w * v;
    }
}

/// The largest eigenvalue and its unit eigenvector, whose sign means nothing. `None` if no direction stands out: the
/// tensor is zero or not finite, or its two largest eigenvalues are equal to f32 precision.
pub fn principal(t: &Tensor) -> Option<(f32, Vec3)> {
    let scale = t.iter().fold(0.0f32, |m, v| m.max(v.abs()));
    if !(scale > 0.0 && scale.is_finite()) {
        return None;
    }
    let [a, b, c, d, e, f] = t.map(|v| f64::from(v) / f64::from(scale));
    // Roots of the characteristic polynomial by the cosine formula, about the mean eigenvalue.
    let mean = (a + b + c) / 3.0;
    let (p, q, r) = (a - mean, b - mean, c - mean);
    let spread = ((p * p + q * q + r * r + 2.0 * (d * d + e * e + f * f)) / 6.0).sqrt();
    if spread <= f64::from(f32::EPSILON) {
        return None;
    }
    let half_det =
        (p * (q * r - f * f) - d * (d * r - f * e) + e * (d * f - q * e)) / (2.0 * spread * spread * spread);
    let angle = libm::acos(half_det.clamp(-1.0, 1.0)) / 3.0;
    let largest = mean + 2.0 * spread * libm::cos(angle);
    let middle = mean + 2.0 * spread * libm::cos(angle - 2.0 * std::f64::consts::PI / 3.0);
    if largest - middle <= f64::from(f32::EPSILON) {
        return None;
    }
    // The eigenvector is orthogonal to the rows of T - λ; the longest cross product of two is the surest.
    let rows = [DVec3::new(a - largest, d, e), DVec3::new(d, b - largest, f), DVec3::new(e, f, c - largest)];
    let candidates = [rows[0].cross(rows[1]), rows[0].cross(rows[2]), rows[1].cross(rows[2])];
    let longest = candidates
        .into_iter()
        .fold(DVec3::ZERO, |best, v| if v.length_squared() > best.length_squared() { v } else { best });
    let v = longest.try_normalize()?;
    Some(((largest * f64::from(scale)) as f32, v.as_vec3()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use strandbench_rng::Rng;

    fn apply(t: &Tensor, v: Vec3) -> Vec3 {
        Vec3::new(
            t[0] * v.x + t[3] * v.y + t[4] * v.z,
            t[3] * v.x + t[1] * v.y + t[5] * v.z,
            t[4] * v.x + t[5] * v.y + t[2] * v.z,
        )
    }

    #[test]
    fn a_line_is_found_again_and_its_strength() {
        let mut rng = Rng::keyed(&[3]);
        for k in 0..500 {
            let mut at = || Vec3::new(rng.f32(), rng.f32(), rng.f32()) * 2.0 - 1.0;
            let l = if k < 3 { Vec3::AXES[k] * 2.0 } else { at() };
            let (value, v) = principal(&outer(l)).unwrap();
            assert!((value - l.length_squared()).abs() < 1e-5 * l.length_squared());
            // Rounding of the entries tilts the vector by some epsilon.
            assert!(v.cross(l.normalize()).length() < 1e-5, "{l}: {v}");
        }
    }

    #[test]
    fn sums_have_their_largest_eigenvalue_and_no_direction_is_none() {
        let mut rng = Rng::keyed(&[4]);
        for _ in 0..500 {
            let mut t = [0.0; 6];
            for _ in 0..4 {
                let l = Vec3::new(rng.f32(), rng.f32(), rng.f32()) * 2.0 - 1.0;
                add_scaled(&mut t, &outer(l), 0.3);
            }
            let (value, v) = principal(&t).unwrap();
            let gap = (apply(&t, v) - v * value).length();
            assert!(gap < 1e-5 * value, "not an eigenpair: {gap}");
            for k in 0..50 {
                let u = Vec3::from_array(libm_direction(k));
                assert!(apply(&t, u).dot(u) <= value * (1.0 + 1e-5), "{u} has more");
            }
        }
        assert_eq!(principal(&[0.0; 6]), None);
        assert_eq!(principal(&[f32::NAN, 0.0, 0.0, 0.0, 0.0, 0.0]), None);
        assert_eq!(principal(&[1.0, 1.0, 1.0, 0.0, 0.0, 0.0]), None, "a ball");
        assert_eq!(principal(&[1.0, 1.0, 0.2, 0.0, 0.0, 0.0]), None, "a disc");
        let (value, v) = principal(&[1.0, 0.2, 0.2, 0.0, 0.0, 0.0]).unwrap();
        assert!((value - 1.0).abs() < 1e-6 && v.x.abs() > 0.999_999);
        // Neither huge nor tiny numbers lose it.
        for s in [1e-30, 1e30] {
            assert!(principal(&outer(Vec3::new(0.6, 0.8, 0.0)).map(|v| v * s)).unwrap().1.z.abs() < 1e-6);
        }
    }

    fn libm_direction(k: u32) -> [f32; 3] {
        let z = 1.0 - 2.0 * (k as f32 + 0.5) / 50.0;
        let (s, c) = libm::sincosf(k as f32 * 2.399_963);
        let r = (1.0 - z * z).sqrt();
        [r * c, r * s, z]
    }
}
