//! Tests of a ray against eight boxes and eight round cones: with AVX2 and FMA, or with what every machine has.

use super::leaf::{Cones, Triangles};
use super::node::{Node, TreeRay, WIDTH};
use crate::cone::EDGE;

/// A way of testing eight things at once. Both tests may let through what the ray does not meet, never the other
/// way round as long as boxes and `pad` are wide enough for rounding.
pub(super) trait Lanes {
    /// Which children the ray enters before `tmax` (a bit each), and where. `from` is where planes that are met first
    /// and last are seen from: the ray's origin twice, or, for boxes that are wider, that before and behind it.
    ///
    /// # Safety
    /// The machine must have the instructions that the implementation uses.
    unsafe fn boxes(
        node: &Node,
        ray: &TreeRay,
        from: [[f32; 3]; 2],
        tmax: f32,
        enter: &mut [f32; WIDTH],
    ) -> u32;

    /// Which cones, made thicker by `pad`, the ray passes so closely that it may meet them before `tmax`.
    ///
    /// # Safety
    /// As above.
    unsafe fn cones(cones: &Cones, ray: &TreeRay, pad: f32, tmax: f32) -> u32;

    /// Which triangles the ray may meet.
    ///
    /// # Safety
    /// As above.
    unsafe fn triangles(triangles: &Triangles, ray: &TreeRay) -> u32;
}

/// Runs everywhere.
pub(super) struct Portable;

/// The larger; `b` if they do not compare.
#[inline(always)]
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// The smaller; `b` if they do not compare.
#[inline(always)]
fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

impl Lanes for Portable {
    #[inline(always)]
    unsafe fn boxes(
        node: &Node,
        ray: &TreeRay,
        from: [[f32; 3]; 2],
        tmax: f32,
        enter: &mut [f32; WIDTH],
    ) -> u32 {
        let mut leave = [tmax; WIDTH];
        *enter = [0.0; WIDTH];
        for axis in 0..3 {
            let (near, far) = (&node.planes[axis][ray.near[axis]], &node.planes[axis][1 - ray.near[axis]]);
            let (first, last, inverse) = (from[0][axis], from[1][axis], ray.inverse[axis]);
            for k in 0..WIDTH {
                enter[k] = larger((near[k] - first) * inverse, enter[k]);
                leave[k] = smaller((far[k] - last) * inverse, leave[k]);
            }
        }
        (0..WIDTH).fold(0, |mask, k| mask | u32::from(enter[k] <= leave[k]) << k)
    }

    #[inline(always)]
    unsafe fn cones(c: &Cones, ray: &TreeRay, pad: f32, tmax: f32) -> u32 {
        let ([ox, oy, oz], [dx, dy, dz]) = (ray.origin, ray.direction);
        let mut met = [false; WIDTH];
        for k in 0..WIDTH {
            let (wx, wy, wz) = (ox - c.middle[0][k], oy - c.middle[1][k], oz - c.middle[2][k]);
            let s = wx * dx + wy * dy + wz * dz;
            let (px, py, pz) = (wx - dx * s, wy - dy * s, wz - dz * s);
            let (hx, hy, hz) = (c.half[0][k], c.half[1][k], c.half[2][k]);
            let (nx, ny, nz) = (hy * dz - hz * dy, hz * dx - hx * dz, hx * dy - hy * dx);
            let x = px * nx + py * ny + pz * nz;
            let n2 = nx * nx + ny * ny + nz * nz;
            let r = c.radius[k] + c.half_delta[k].abs() + pad;
            let reach = (hx * hx + hy * hy + hz * hz).sqrt() + r;
            let p2 = px * px + py * py + pz * pz;
            met[k] = (x * x <= r * r * n2) & (p2 <= reach * reach) & (s <= reach) & (-s - reach <= tmax);
        }
        (0..WIDTH).fold(0, |mask, k| mask | u32::from(met[k]) << k)
    }

    #[inline(always)]
    unsafe fn triangles(_: &Triangles, _: &TreeRay) -> u32 {
        (1 << WIDTH) - 1
    }
}

/// Needs AVX2 and FMA.
#[cfg(target_arch = "x86_64")]
pub(super) struct Avx2;

#[cfg(target_arch = "x86_64")]
impl Lanes for Avx2 {
    #[inline(always)]
    unsafe fn boxes(
        node: &Node,
        ray: &TreeRay,
        from: [[f32; 3]; 2],
        tmax: f32,
        enter: &mut [f32; WIDTH],
    ) -> u32 {
        use std::arch::x86_64::*;
        // SAFETY: the caller vouches for AVX2; a node is aligned to 64 bytes and its rows are 32 bytes long.
        unsafe {
            macro_rules! plane {
                ($axis:literal, $side:expr, $from:expr) => {{
                    let row = _mm256_load_ps(node.planes[$axis].get_unchecked($side).as_ptr());
                    let distance = _mm256_sub_ps(row, _mm256_set1_ps($from[$axis]));
                    _mm256_mul_ps(distance, _mm256_set1_ps(ray.inverse[$axis]))
                }};
            }
            let ([x, y, z], [first, last]) = (ray.near, from);
            let e = _mm256_max_ps(
                _mm256_max_ps(plane!(0, x, first), plane!(1, y, first)),
                _mm256_max_ps(plane!(2, z, first), _mm256_setzero_ps()),
            );
            let leave = _mm256_min_ps(
                _mm256_min_ps(plane!(0, 1 - x, last), plane!(1, 1 - y, last)),
                _mm256_min_ps(plane!(2, 1 - z, last), _mm256_set1_ps(tmax)),
            );
            _mm256_storeu_ps(enter.as_mut_ptr(), e);
            _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(e, leave)) as u32
        }
    }

    #[inline(always)]
    unsafe fn cones(c: &Cones, ray: &TreeRay, pad: f32, tmax: f32) -> u32 {
        // SAFETY: the caller vouches for AVX2 and FMA.
        unsafe { cones_avx2(c, ray, pad, tmax) }
    }

    #[inline(always)]
    unsafe fn triangles(t: &Triangles, ray: &TreeRay) -> u32 {
        // SAFETY: as above.
        unsafe { triangles_avx2(t, ray) }
    }
}

/// See [`Lanes::cones`]. A function of its own, because closures have the instructions of the function that they are in:
/// within [`Avx2`], whose functions are inlined into those that have them, each may call every instruction as a function.
#[cfg(target_arch = "x86_64")]
#[inline]
#[target_feature(enable = "avx2,fma")]
fn cones_avx2(c: &Cones, ray: &TreeRay, pad: f32, tmax: f32) -> u32 {
    use std::arch::x86_64::*;
    let one = |v: f32| _mm256_set1_ps(v);
    // SAFETY: leaves are aligned to 64 bytes and their rows are 32 long.
    let row = |v: &[f32; WIDTH]| unsafe { _mm256_load_ps(v.as_ptr()) };
    let d = ray.direction.map(one);
    let w: [__m256; 3] = std::array::from_fn(|i| _mm256_sub_ps(one(ray.origin[i]), row(&c.middle[i])));
    let dot = |a: [__m256; 3], b: [__m256; 3]| {
        _mm256_fmadd_ps(a[0], b[0], _mm256_fmadd_ps(a[1], b[1], _mm256_mul_ps(a[2], b[2])))
    };
    let s = dot(w, d);
    let p: [__m256; 3] = std::array::from_fn(|i| _mm256_fnmadd_ps(d[i], s, w[i]));
    let h: [__m256; 3] = std::array::from_fn(|i| row(&c.half[i]));
    let cross = |i: usize, j: usize| _mm256_fmsub_ps(h[i], d[j], _mm256_mul_ps(h[j], d[i]));
    let n = [cross(1, 2), cross(2, 0), cross(0, 1)];
    let x = dot(p, n);
    let magnitude = _mm256_castsi256_ps(_mm256_set1_epi32(i32::MAX));
    let delta = _mm256_and_ps(row(&c.half_delta), magnitude);
    let r = _mm256_add_ps(_mm256_add_ps(row(&c.radius), delta), one(pad));
    let reach = _mm256_add_ps(_mm256_sqrt_ps(dot(h, h)), r);
    let near =
        _mm256_cmp_ps::<_CMP_LE_OQ>(_mm256_mul_ps(x, x), _mm256_mul_ps(_mm256_mul_ps(r, r), dot(n, n)));
    let within = _mm256_cmp_ps::<_CMP_LE_OQ>(dot(p, p), _mm256_mul_ps(reach, reach));
    let ahead = _mm256_cmp_ps::<_CMP_LE_OQ>(s, reach);
    let before = _mm256_cmp_ps::<_CMP_GE_OQ>(_mm256_add_ps(s, reach), one(-tmax));
    let met = _mm256_and_ps(_mm256_and_ps(near, within), _mm256_and_ps(ahead, before));
    _mm256_movemask_ps(met) as u32
}

/// The same operations in the same order as [`crate::cone::Triangle::intersect`], so with its every rounding.
#[cfg(target_arch = "x86_64")]
#[inline]
#[target_feature(enable = "avx2,fma")]
fn triangles_avx2(t: &Triangles, ray: &TreeRay) -> u32 {
    use std::arch::x86_64::*;
    let one = |v: f32| _mm256_set1_ps(v);
    let side = |i: usize| -> [__m256; 3] {
        // SAFETY: leaves are aligned to 64 bytes and their rows are 32 long.
        std::array::from_fn(|axis| unsafe { _mm256_load_ps(t.sides[i][axis].as_ptr()) })
    };
    let (mul, sub) = (|a, b| _mm256_mul_ps(a, b), |a, b| _mm256_sub_ps(a, b));
    let dot = |a: [__m256; 3], b: [__m256; 3]| {
        _mm256_add_ps(_mm256_add_ps(mul(a[0], b[0]), mul(a[1], b[1])), mul(a[2], b[2]))
    };
    let cross = |a: [__m256; 3], b: [__m256; 3]| -> [__m256; 3] {
        let term = |i: usize, j: usize| sub(mul(a[i], b[j]), mul(b[i], a[j]));
        [term(1, 2), term(2, 0), term(0, 1)]
    };
    let (a, ab, ac) = (side(0), side(1), side(2));
    let d = ray.direction.map(one);
    let p = cross(d, ac);
    let inverse = _mm256_div_ps(one(1.0), dot(ab, p));
    let s: [__m256; 3] = std::array::from_fn(|i| sub(one(ray.source[i]), a[i]));
    let u = mul(dot(s, p), inverse);
    let q = cross(s, ab);
    let v = mul(dot(d, q), inverse);
    let distance = mul(dot(ac, q), inverse);
    let (low, high) = (one(-EDGE), one(1.0 + EDGE));
    let both = |x, y| _mm256_and_ps(x, y);
    let in_u = both(_mm256_cmp_ps::<_CMP_GE_OQ>(u, low), _mm256_cmp_ps::<_CMP_LE_OQ>(u, high));
    let sum = _mm256_cmp_ps::<_CMP_LE_OQ>(_mm256_add_ps(u, v), high);
    let in_v = both(_mm256_cmp_ps::<_CMP_GE_OQ>(v, low), sum);
    let ahead = _mm256_cmp_ps::<_CMP_GT_OQ>(distance, _mm256_setzero_ps());
    _mm256_movemask_ps(both(both(in_u, in_v), ahead)) as u32
}

/// Whether [`Avx2`] may be used here.
pub(super) fn has_avx2() -> bool {
    #[cfg(target_arch = "x86_64")]
    {
        std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma")
    }
    #[cfg(not(target_arch = "x86_64"))]
    {
        false
    }
}
