//! Rays against triangles.

use super::{DISTANCE_MM, PRIMITIVE_SHARE};
use crate::stats::quantile;
use crate::{Bundle, Case, CrossError, Gate};
use glam::Vec3;
use rayon::prelude::*;
use strandbench_renderer::accel::{Accel, Hit};
use strandbench_types::{StrandSet, TriMesh};

/// Triangles share edges, so that a ray through an edge belongs to both.
pub(super) fn judge(
    case: &Case,
    answer: &Bundle,
    origins: &[Vec3],
    directions: &[Vec3],
) -> Result<Vec<Gate>, CrossError> {
    let n = origins.len();
    let triangles: Vec<u32> = case.input.get("triangles", &[0, 3])?;
    let mesh = TriMesh {
        vertices: case.input.vec3("vertices", 0)?,
        triangles: triangles.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
    };
    mesh.validate().map_err(CrossError::Ours)?;
    let accel = Accel::new(&StrandSet::new(), &[&mesh])?;
    let t: Vec<f32> = answer.get("t", &[n])?;
    let primitive: Vec<i32> = answer.get("primitive", &[n])?;
    let uv: Vec<f32> = answer.get("uv", &[n, 2])?;
    let found: Vec<_> = (0..n).into_par_iter().map(|i| accel.closest(origins[i], directions[i])).collect();
    let (mut hits, mut edges, mut unexplained) = (0u64, 0u64, 0u64);
    let (mut dt, mut duv) = (Vec::new(), Vec::new());
    // A share of an edge's length: what single precision leaves of a barycentric weight at 150 mm.
    const EDGE: f32 = 1e-3;
    for i in 0..n {
        hits += u64::from(primitive[i] >= 0);
        match found[i] {
            Some(Hit::Mesh { t: mine, triangle, uv: w, .. }) => {
                let weights = [w[0], w[1], 1.0 - w[0] - w[1]];
                if triangle as i32 == primitive[i] {
                    dt.push(f64::from((mine - t[i]).abs()));
                    duv.push(f64::from((w[0] - uv[2 * i]).abs().max((w[1] - uv[2 * i + 1]).abs())));
                } else if weights.iter().any(|w| *w < EDGE) {
                    edges += 1;
                } else {
                    unexplained += 1;
                }
            }
            _ if primitive[i] < 0 => {}
            _ => {
                let (u, v) = (uv[2 * i], uv[2 * i + 1]);
                if [u, v, 1.0 - u - v].iter().any(|w| *w < EDGE) { edges += 1 } else { unexplained += 1 }
            }
        }
    }
    let total = n as f64;
    let at_most = |what: &str, v: f64, l: f64, unit: &str| Gate::at_most(1, &case.name, what, v, l, unit);
    Ok(vec![
        Gate::shown(1, &case.name, "rays", total, "rays")
            .because(format!("{hits} hit; {} triangles", mesh.triangles.len())),
        Gate::at_least(1, &case.name, "share of rays that hit", hits as f64 / total, 0.2, ""),
        at_most("through an edge, the neighbour named", edges as f64 / total, PRIMITIVE_SHARE, "of rays"),
        at_most("distance, 99th percentile", quantile(&mut dt, 0.99), DISTANCE_MM, "mm"),
        at_most("barycentric weights, 99th percentile", quantile(&mut duv, 0.99), 1e-3, ""),
        at_most("disagreements without a reason", unexplained as f64, 0.0, "rays"),
    ])
}
