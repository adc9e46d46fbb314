//! The test of a ray against the eight boxes of a BVH node: eight lanes at once where the machine has AVX2, obvhs'
//! own four lanes elsewhere. Boxes are padded for rounding, so both find the same hits.

use obvhs::cwbvh::node::CwBvhNode;
use obvhs::ray::Ray;

/// A way of testing a node.
pub(crate) trait NodeTest {
    /// The node's children that the ray meets, in obvhs' encoding.
    ///
    /// # Safety
    /// The machine must have the instructions that the implementation uses.
    unsafe fn children(node: &CwBvhNode, ray: &Ray, oct_inv4: u32) -> u32;
}

/// Runs everywhere.
pub(crate) struct Portable;

impl NodeTest for Portable {
    #[inline(always)]
    unsafe fn children(node: &CwBvhNode, ray: &Ray, oct_inv4: u32) -> u32 {
        node.intersect_ray(ray, oct_inv4)
    }
}

/// Needs AVX2 and FMA.
#[cfg(target_arch = "x86_64")]
pub(crate) struct Avx2;

#[cfg(target_arch = "x86_64")]
impl NodeTest for Avx2 {
    #[inline(always)]
    unsafe fn children(node: &CwBvhNode, ray: &Ray, oct_inv4: u32) -> u32 {
        use std::arch::x86_64::*;
        let scale = node.compute_extent() * ray.inv_direction;
        let offset = (glam::Vec3A::from(node.p) - ray.origin) * ray.inv_direction;
        let (bits, shifts) = node.get_child_and_index_bits(oct_inv4);
        // The eight planes of an axis, nearer and farther along the ray.
        let order = |low: &[u8; 8], high: &[u8; 8], d: f32| {
            let (low, high) = (u64::from_le_bytes(*low), u64::from_le_bytes(*high));
            if d < 0.0 { (high, low) } else { (low, high) }
        };
        let (near_x, far_x) = order(&node.child_min_x, &node.child_max_x, ray.direction.x);
        let (near_y, far_y) = order(&node.child_min_y, &node.child_max_y, ray.direction.y);
        let (near_z, far_z) = order(&node.child_min_z, &node.child_max_z, ray.direction.z);
        // SAFETY: the caller vouches for AVX2 and FMA; no memory is touched.
        unsafe {
            macro_rules! plane {
                ($bytes:expr, $axis:ident) => {{
                    let lanes = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128($bytes as i64));
                    let q = _mm256_cvtepi32_ps(lanes);
                    _mm256_fmadd_ps(q, _mm256_set1_ps(scale.$axis), _mm256_set1_ps(offset.$axis))
                }};
            }
            let enter = _mm256_max_ps(
                _mm256_max_ps(plane!(near_x, x), plane!(near_y, y)),
                _mm256_max_ps(plane!(near_z, z), _mm256_set1_ps(0.0)),
            );
            let leave = _mm256_min_ps(
                _mm256_min_ps(plane!(far_x, x), plane!(far_y, y)),
                _mm256_min_ps(plane!(far_z, z), _mm256_set1_ps(ray.tmax)),
            );
            let met = _mm256_castps_si256(_mm256_cmp_ps::<_CMP_LE_OQ>(enter, leave));
            let bits = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(bits as i64));
            let shifts = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(shifts as i64));
            let children = _mm256_and_si256(met, _mm256_sllv_epi32(bits, shifts));
            let half =
                _mm_or_si128(_mm256_castsi256_si128(children), _mm256_extracti128_si256::<1>(children));
            let quarter = _mm_or_si128(half, _mm_shuffle_epi32::<0b01_00_11_10>(half));
            let all = _mm_or_si128(quarter, _mm_shuffle_epi32::<0b10_11_00_01>(quarter));
            _mm_cvtsi128_si32(all) as u32
        }
    }
}

/// Whether [`Avx2`] may be used here.
pub(crate) fn has_avx2() -> bool {
    #[cfg(target_arch = "x86_64")]
    {
        std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma")
    }
    #[cfg(not(target_arch = "x86_64"))]
    {
        false
    }
}
