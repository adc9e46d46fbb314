//! Stratified points of a pixel: Sobol sequences with hashed Owen scrambling and shuffled order (after Burley
//! 2020, "Practical hash-based Owen scrambling"). The first 2^k points of a pixel have one point in every
//! elementary interval of 2^-k in each pair of dimensions drawn together.

/// Direction numbers of the first three Sobol dimensions, most significant bit first, for 16 index bits.
const DIRECTIONS: [[u32; 16]; 3] = directions();

const fn directions() -> [[u32; 16]; 3] {
    let mut v = [[0u32; 16]; 3];
    let mut m1 = [1u32; 16];
    let mut m2 = [1u32; 16];
    m2[1] = 3;
    let mut i = 0;
    while i < 16 {
        // x + 1, and x² + x + 1 (Joe and Kuo 2008: m = 1; m = 1, 3).
        if i >= 1 {
            m1[i] = (m1[i - 1] << 1) ^ m1[i - 1];
        }
        if i >= 2 {
            m2[i] = (m2[i - 1] << 1) ^ (m2[i - 2] << 2) ^ m2[i - 2];
        }
        v[0][i] = 1 << (31 - i);
        v[1][i] = m1[i] << (31 - i);
        v[2][i] = m2[i] << (31 - i);
        i += 1;
    }
    v
}

/// Value of a Sobol dimension at an index below 2^16, as 32 bits of fraction.
#[inline(always)]
fn sobol(mut index: u32, dimension: usize) -> u32 {
    let mut x = 0;
    while index != 0 {
        x ^= DIRECTIONS[dimension][index.trailing_zeros() as usize];
        index &= index - 1;
    }
    x
}

/// A hash in which each bit depends on the seed and on lower bits alone: applied to reversed bits it flips each
/// node of the binary tree over [0, 1) at random, which is Owen's scrambling.
#[inline(always)]
fn tree_hash(mut x: u32, seed: u32) -> u32 {
    x = x.wrapping_add(seed);
    x ^= x.wrapping_mul(0x6c50_b47c);
    x = x.wrapping_mul((seed >> 15) | 1);
    x ^= x.wrapping_mul(0xb82f_1e52);
    x = x.wrapping_add(seed.rotate_left(13));
    x ^= x.wrapping_mul(0xc7af_e638);
    x ^= x.wrapping_mul(0x8d22_f6e6);
    x
}

#[inline(always)]
fn owen(x: u32, seed: u32) -> u32 {
    tree_hash(x.reverse_bits(), seed).reverse_bits()
}

#[inline(always)]
fn unit(x: u32) -> f32 {
    (x >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// The sample points of one pixel; indices below 2^16.
#[derive(Clone, Copy, Debug)]
pub struct PixelSampler {
    seeds: [u32; 21],
}

impl PixelSampler {
    /// The points that belong to `key` (a mix of seed, camera and pixel).
    pub fn new(key: u64) -> PixelSampler {
        let mut rng = strandbench_rng::Rng::keyed(&[key]);
        PixelSampler { seeds: std::array::from_fn(|_| (rng.next_u64() >> 32) as u32) }
    }

    #[inline(always)]
    fn shuffle(index: u32, seed: u32) -> u32 {
        owen(index, seed) & 0xffff
    }

    /// Position within the pixel, in [0, 1)².
    #[inline]
    pub fn film(&self, index: u32) -> [f32; 2] {
        let i = PixelSampler::shuffle(index, self.seeds[0]);
        [unit(owen(sobol(i, 0), self.seeds[1])), unit(owen(sobol(i, 1), self.seeds[2]))]
    }

    /// Choice of a light, and the position on it, in [0, 1)³.
    #[inline]
    pub fn light(&self, index: u32) -> [f32; 3] {
        self.three(index, 3)
    }

    /// Position on the lens and time of the exposure, in [0, 1)³.
    #[inline]
    pub fn lens(&self, index: u32) -> [f32; 3] {
        self.three(index, 7)
    }

    /// Direction of the first scattering, in [0, 1)⁴: the third number is apart from the others, which are a net.
    #[inline]
    pub fn scattering(&self, index: u32) -> [f32; 4] {
        let [a, b, d] = self.three(index, 11);
        let i = PixelSampler::shuffle(index, self.seeds[15]);
        [a, b, unit(owen(sobol(i, 0), self.seeds[16])), d]
    }

    /// As [`PixelSampler::light`], at the second scattering.
    #[inline]
    pub fn second_light(&self, index: u32) -> [f32; 3] {
        self.three(index, 17)
    }

    /// The first three dimensions, shuffled and scrambled by four seeds from `at`.
    #[inline(always)]
    fn three(&self, index: u32, at: usize) -> [f32; 3] {
        let i = PixelSampler::shuffle(index, self.seeds[at]);
        std::array::from_fn(|d| unit(owen(sobol(i, d), self.seeds[at + 1 + d])))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every elementary interval of area 2^-k holds one of the first 2^k points.
    fn is_net(points: &[[f32; 2]]) -> bool {
        let n = points.len();
        let k = n.trailing_zeros();
        (0..=k).all(|a| {
            let (nx, ny) = (1usize << a, n >> a);
            let mut seen = vec![0u32; n];
            for p in points {
                let (x, y) = ((p[0] * nx as f32) as usize, (p[1] * ny as f32) as usize);
                seen[y * nx + x] += 1;
            }
            seen.iter().all(|&s| s == 1)
        })
    }

    #[test]
    fn first_powers_of_two_are_nets_on_the_film_and_on_the_lights() {
        for key in 0..20 {
            let s = PixelSampler::new(key);
            for n in [1, 8, 32, 256] {
                let film: Vec<_> = (0..n).map(|i| s.film(i)).collect();
                assert!(is_net(&film), "film, key {key}, {n} points");
                let light: Vec<_> = (0..n).map(|i| s.light(i)).collect();
                let strata = |d: usize| {
                    let mut v: Vec<u32> = light.iter().map(|p| (p[d] * n as f32) as u32).collect();
                    v.sort_unstable();
                    v.iter().enumerate().all(|(i, &x)| i as u32 == x)
                };
                assert!((0..3).all(strata), "light, key {key}, {n} points");
            }
        }
    }

    #[test]
    fn points_are_uniform_and_uncorrelated_over_keys() {
        let n = 40_000u64;
        let mut sums = [0.0f64; 15];
        let mut products = [[0.0f64; 15]; 15];
        for key in 0..n {
            let s = PixelSampler::new(key);
            let (f, l) = (s.film(3), s.light(3));
            let (n, d, e) = (s.lens(3), s.scattering(3), s.second_light(3));
            let all: Vec<f64> =
                [&f[..], &l, &n, &d, &e].concat().iter().map(|&x| f64::from(x) - 0.5).collect();
            let v: [f64; 15] = all.try_into().unwrap();
            for a in 0..15 {
                sums[a] += v[a];
                for b in 0..15 {
                    products[a][b] += v[a] * v[b];
                }
            }
        }
        // Five standard errors: a mean of n uniforms has sqrt(1/12n), a product of two 1/(12 sqrt n).
        let limit = 5.0 / (12.0 * (n as f64)).sqrt();
        for a in 0..15 {
            assert!((sums[a] / n as f64).abs() < limit, "mean of {a}");
            for b in 0..a {
                let c = products[a][b] / n as f64;
                assert!(c.abs() < 5.0 / (12.0 * (n as f64).sqrt()), "dimensions {a} and {b}: {c}");
            }
        }
    }
}
