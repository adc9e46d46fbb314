//! The 3-D orientation field on the envelope through time, and its diffusion into the layer (5.1).

use crate::StrandParameters;
use crate::layer::{Layer, NO_VOXEL};
use crate::surface::FrameSurface;
use crate::temporal::Correspondence;
use crate::tensor::{Tensor, add_scaled, outer, principal, trace};
use glam::Vec3;
use rayon::prelude::*;
use strandbench_types::Camera;

/// A neighbouring frame in one pass of the temporal filter.
#[derive(Clone, Copy, Debug)]
pub struct Neighbour<'a> {
    /// Its envelope.
    pub surface: &'a FrameSurface,
    /// Where this frame's vertices are in it. Vertices are those of the surface that was registered.
    pub correspondence: &'a Correspondence,
    /// Vertex of the registered surface at each of this frame's pixels (`u32::MAX` for none).
    pub registered: &'a strandbench_types::Plane<u32>,
    /// Its tensors before this pass, indexed `[vertex]`.
    pub tensors: &'a [Tensor],
}

/// One pass of the bilateral temporal filter (Eq. 11): T_t ← T_t + w_(t-1) T_(t-1) + w_(t+1) T_(t+1), of which the
/// principal line, with the root of its eigenvalue for strength, is projected to the tangent plane.
///
/// The paper defines w_t = 1 - w_(t-1) - w_(t+1) and then prints T_t with factor 1; `convex_filter` takes w_t. A
/// neighbour without the place in view, or beyond the sequence's end, has weight 0.
pub fn temporal_pass(
    own: &FrameSurface,
    tensors: &[Tensor],
    neighbours: &[Neighbour<'_>],
    p: &StrandParameters,
) -> Vec<Tensor> {
    let two_sigma2 = 2.0 * f64::from(p.temporal_sigma_mm).powi(2);
    let filter = |v: usize| {
        let at = own.envelope.mesh.vertices[v];
        let mut sum = [0.0f32; 6];
        let mut own_weight = 1.0f32;
        for n in neighbours {
            let registered = n.registered.data[own.pixels[v] as usize];
            let place =
                if registered == u32::MAX { None } else { n.correspondence.pixels[registered as usize] };
            let Some(there) = place.and_then(|q| n.surface.vertex_at(q)) else { continue };
            let d2 = f64::from(at.distance_squared(n.surface.envelope.mesh.vertices[there]));
            let w = (0.25 * libm::exp(-d2 / two_sigma2)) as f32;
            add_scaled(&mut sum, &n.tensors[there], w);
            own_weight -= w;
        }
        add_scaled(&mut sum, &tensors[v], if p.convex_filter { own_weight } else { 1.0 });
        let Some((value, line)) = principal(&sum) else { return [0.0; 6] };
        let l = line * value.max(0.0).sqrt();
        let n = own.normals[v];
        outer(l - n * l.dot(n))
    };
    (0..own.len()).into_par_iter().map(filter).collect()
}

/// Unit lines of tensors, zero where they have none.
pub fn lines(tensors: &[Tensor]) -> Vec<Vec3> {
    tensors.iter().map(|t| principal(t).map_or(Vec3::ZERO, |(_, l)| l)).collect()
}

/// Structure tensors throughout the layer.
#[derive(Clone, Debug)]
pub struct TensorVolume {
    /// X, indexed `[active voxel]`.
    pub tensors: Vec<Tensor>,
    /// Iterations of the solver at the finest grid.
    pub iterations: usize,
    /// Largest residual over the six components, as a share of the right side's norm.
    pub residual: f64,
}

/// Residual at which the diffusion has arrived, as a share of the right side: a thousandth of the source turns no
/// line by more than some hundredths of a degree.
const RESIDUAL: f64 = 1e-3;

/// Iterations at most, on each grid.
const ITERATIONS: usize = 200;

/// Grids coarser than this many voxels are not made.
const COARSEST: usize = 2_000;

/// Confidence-weighted diffusion of the surface's tensors to where it no longer changes: the X that minimises
///
/// ∫_surface c |X - T / c|² dA + κ ∫_layer |∇X|² dV, with c = tr T = |ℓ|²,
///
/// that is (C + κ L) X = T. The paper names the principle and gives neither equation nor constants; κ is
/// `diffusion_mm`. Strong lines hold what they say, weak ones yield to their surroundings, and below the surface X is
/// the harmonic continuation. Voxels' borders with what is outside the layer carry no flux. Solved by conjugate
/// gradients from coarse grids to fine ones.
pub fn diffuse(
    camera: &Camera,
    surface: &FrameSurface,
    tensors: &[Tensor],
    layer: &Layer,
    p: &StrandParameters,
) -> TensorVolume {
    let mut source = vec![[0.0f32; 6]; layer.voxels.len()];
    let scale = 1.0 / (f64::from(layer.voxel_mm) * f64::from(p.diffusion_mm));
    let footprint = 1.0 / (camera.focal_px.x * camera.focal_px.y);
    for (v, t) in tensors.iter().enumerate() {
        let at = surface.envelope.mesh.vertices[v];
        let depth = camera.to_camera(at.as_dvec3()).z;
        // A pixel's share of the surface facing the camera; κ and the voxel's edge make it a weight against the
        // seven-point Laplacian.
        let area = depth * depth * footprint * scale;
        splat(layer, at, |voxel, w| add_scaled(&mut source[voxel], t, (area * w) as f32));
    }
    let levels = Level::pyramid(layer, source);
    let mut x: Vec<Tensor> = Vec::new();
    let mut result = (0, 0.0);
    for (k, level) in levels.iter().enumerate().rev() {
        let guess = if x.is_empty() {
            vec![[0.0; 6]; level.source.len()]
        } else {
            level.parent.iter().map(|&c| x[c as usize]).collect()
        };
        x = guess;
        // Laplacian weights halve with the edge: h³ / h² against the finest grid's.
        result = level.solve(&mut x, (1u32 << k) as f32);
    }
    TensorVolume { tensors: x, iterations: result.0, residual: result.1 }
}

/// Shares a point among the up to eight active voxels around it, trilinearly; shares sum to one.
fn splat(layer: &Layer, at: Vec3, mut add: impl FnMut(usize, f64)) {
    let eight = layer.around(at);
    let total: f64 = eight.iter().filter(|e| e.0 != NO_VOXEL).map(|e| f64::from(e.1)).sum();
    if total > 0.0 {
        for (voxel, w) in eight.into_iter().filter(|e| e.0 != NO_VOXEL && e.1 > 0.0) {
            add(voxel as usize, f64::from(w) / total);
        }
    }
}

/// One grid of the diffusion.
struct Level {
    /// T, indexed `[voxel]`.
    source: Vec<Tensor>,
    /// Neighbours along ±x, ±y, ±z, `NO_VOXEL` for none.
    neighbours: Vec<[u32; 6]>,
    /// Voxel of the next coarser grid; empty on the coarsest.
    parent: Vec<u32>,
}

impl Level {
    fn pyramid(layer: &Layer, source: Vec<Tensor>) -> Vec<Level> {
        let mut voxels = layer.voxels.clone();
        let mut levels = vec![Level { source, neighbours: neighbours(&voxels), parent: Vec::new() }];
        while voxels.len() > COARSEST {
            let mut coarse: Vec<[u16; 3]> = voxels.iter().map(|v| v.map(|c| c / 2)).collect();
            coarse.sort_unstable_by_key(|v| [v[2], v[1], v[0]]);
            coarse.dedup();
            let fine = levels.last_mut().expect("there is a grid");
            let mut sum = vec![[0.0f32; 6]; coarse.len()];
            fine.parent = voxels
                .iter()
                .map(|v| {
                    let [x, y, z] = v.map(|c| c / 2);
                    coarse.binary_search_by_key(&[z, y, x], |v| [v[2], v[1], v[0]]).expect("its own parent")
                        as u32
                })
                .collect();
            for (t, &c) in fine.source.iter().zip(&fine.parent) {
                add_scaled(&mut sum[c as usize], t, 1.0);
            }
            levels.push(Level { source: sum, neighbours: neighbours(&coarse), parent: Vec::new() });
            voxels = coarse;
        }
        levels
    }

    /// (diag(c) + edge L) x, and its product with x, both a component.
    fn apply(&self, x: &[Tensor], edge: f32, out: &mut [Tensor]) -> [f64; 6] {
        let partial: Vec<[f64; 6]> = out
            .par_chunks_mut(CHUNK)
            .enumerate()
            .map(|(c, out)| {
                let mut dot = [0.0f64; 6];
                for (k, out) in out.iter_mut().enumerate() {
                    let i = c * CHUNK + k;
                    let own = x[i];
                    let held = trace(&self.source[i]);
                    let mut sum = [0.0f32; 6];
                    let mut degree = 0.0f32;
                    for &n in self.neighbours[i].iter().filter(|&&n| n != NO_VOXEL) {
                        add_scaled(&mut sum, &x[n as usize], 1.0);
                        degree += 1.0;
                    }
                    for a in 0..6 {
                        out[a] = (held + edge * degree) * own[a] - edge * sum[a];
                        dot[a] += f64::from(out[a]) * f64::from(own[a]);
                    }
                }
                dot
            })
            .collect();
        add_up(&partial)
    }

    /// Jacobi-preconditioned conjugate gradients from `x`, the six components side by side. Iterations and the largest
    /// relative residual.
    fn solve(&self, x: &mut [Tensor], edge: f32) -> (usize, f64) {
        let n = x.len();
        let inverse: Vec<f32> = (0..n)
            .map(|i| {
                let degree = self.neighbours[i].iter().filter(|&&k| k != NO_VOXEL).count() as f32;
                let d = trace(&self.source[i]) + edge * degree;
                // A voxel without source and neighbours stays zero.
                if d > 0.0 { 1.0 / d } else { 0.0 }
            })
            .collect();
        let mut product = vec![[0.0f32; 6]; n];
        self.apply(x, edge, &mut product);
        let mut r: Vec<Tensor> =
            self.source.iter().zip(&product).map(|(b, a)| std::array::from_fn(|k| b[k] - a[k])).collect();
        let norm = dots(&self.source, &self.source, None);
        let mut d: Vec<Tensor> = r.iter().zip(&inverse).map(|(r, m)| r.map(|v| v * m)).collect();
        let mut rz = dots(&r, &r, Some(&inverse));
        for iteration in 0..ITERATIONS {
            let rr = dots(&r, &r, None);
            let worst =
                (0..6).fold(0.0f64, |m, a| if norm[a] > 0.0 { m.max((rr[a] / norm[a]).sqrt()) } else { m });
            if worst <= RESIDUAL || iteration + 1 == ITERATIONS {
                return (iteration, worst);
            }
            let dad = self.apply(&d, edge, &mut product);
            let step: [f32; 6] =
                std::array::from_fn(|a| if dad[a] > 0.0 { (rz[a] / dad[a]) as f32 } else { 0.0 });
            x.par_chunks_mut(CHUNK).zip(r.par_chunks_mut(CHUNK)).enumerate().for_each(|(c, (x, r))| {
                for k in 0..x.len() {
                    let i = c * CHUNK + k;
                    for a in 0..6 {
                        x[k][a] += step[a] * d[i][a];
                        r[k][a] -= step[a] * product[i][a];
                    }
                }
            });
            let next = dots(&r, &r, Some(&inverse));
            let turn: [f32; 6] =
                std::array::from_fn(|a| if rz[a] > 0.0 { (next[a] / rz[a]) as f32 } else { 0.0 });
            d.par_chunks_mut(CHUNK).enumerate().for_each(|(c, d)| {
                for (k, d) in d.iter_mut().enumerate() {
                    let i = c * CHUNK + k;
                    for a in 0..6 {
                        d[a] = r[i][a] * inverse[i] + turn[a] * d[a];
                    }
                }
            });
            rz = next;
        }
        unreachable!("the last iteration returns")
    }
}

/// Voxels a chunk: sums are taken chunk by chunk in order, so that threads change no bit.
const CHUNK: usize = 4096;

fn add_up(partial: &[[f64; 6]]) -> [f64; 6] {
    partial.iter().fold([0.0; 6], |mut sum, p| {
        sum.iter_mut().zip(p).for_each(|(s, v)| *s += v);
        sum
    })
}

/// Dot products a component, each voxel's times `scale` if there is one.
fn dots(a: &[Tensor], b: &[Tensor], scale: Option<&[f32]>) -> [f64; 6] {
    let partial: Vec<[f64; 6]> = a
        .par_chunks(CHUNK)
        .zip(b.par_chunks(CHUNK))
        .enumerate()
        .map(|(c, (a, b))| {
            let mut sum = [0.0f64; 6];
            for k in 0..a.len() {
                let s = scale.map_or(1.0, |s| f64::from(s[c * CHUNK + k]));
                for i in 0..6 {
                    sum[i] += s * f64::from(a[k][i]) * f64::from(b[k][i]);
                }
            }
            sum
        })
        .collect();
    add_up(&partial)
}

/// Face neighbours of voxels that are sorted by z, y, x.
fn neighbours(voxels: &[[u16; 3]]) -> Vec<[u32; 6]> {
    let key = |v: &[u16; 3]| [v[2], v[1], v[0]];
    let find = |v: [i32; 3]| {
        if v.iter().any(|&c| !(0..=i32::from(u16::MAX)).contains(&c)) {
            return NO_VOXEL;
        }
        let wanted = v.map(|c| c as u16);
        voxels.binary_search_by_key(&key(&wanted), key).map_or(NO_VOXEL, |i| i as u32)
    };
    voxels
        .par_iter()
        .map(|v| {
            let [x, y, z] = v.map(i32::from);
            [[x - 1, y, z], [x + 1, y, z], [x, y - 1, z], [x, y + 1, z], [x, y, z - 1], [x, y, z + 1]]
                .map(find)
        })
        .collect()
}

/// A line of the field at a point: the principal direction of the trilinear mean of the active voxels' tensors.
pub fn line_at(layer: &Layer, volume: &TensorVolume, at: Vec3) -> Option<Vec3> {
    let mut sum = [0.0f32; 6];
    for (voxel, w) in layer.around(at).into_iter().filter(|e| e.0 != NO_VOXEL) {
        add_scaled(&mut sum, &volume.tensors[voxel as usize], w);
    }
    principal(&sum).map(|(_, line)| line)
}
