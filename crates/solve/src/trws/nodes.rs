//! What a sweep does at the nodes of one diagonal.

use crate::GridProblem;
use crate::layout::{Layout, NONE};
use crate::message::{BIG, Padded, largest, least};

/// What rounding can add to a term of the bound, as a share of the sizes of costs and messages in it: the sum
/// of five costs (4 roundings of 2^-24), its normalisation (2), the share less a message (3), the parabola
/// added (9: three, at up to three times the size) and the message's normalisation (3) make 21.
const BOUND_SLACK: f64 = 32.0 / 16_777_216.0;

#[inline(always)]
pub(super) fn best_label(
    unary: &[f32],
    right: &[f32],
    down: &[f32],
    pull: [f32; 4],
    cost: &mut [f32],
) -> u16 {
    let [wl, xl, wu, xu] = pull;
    for l in 0..cost.len() {
        let (a, b) = (l as i32 as f32 - xl, l as i32 as f32 - xu);
        cost[l] = unary[l] + right[l] + down[l] + (wl * a * a + wu * b * b);
    }
    let min = least(cost);
    cost.iter().position(|&c| c == min).unwrap_or(0) as u16
}

#[inline(always)]
pub(super) fn forward_nodes(
    problem: &GridProblem<'_>,
    layout: &Layout,
    stride: usize,
    first: usize,
    right_before: &[f32],
    down_before: &[f32],
    right: &mut [f32],
    down: &mut [f32],
) {
    let mut theta = vec![BIG; stride];
    let mut share = Padded::new(stride);
    for (k, (r, dn)) in right.chunks_exact_mut(stride).zip(down.chunks_exact_mut(stride)).enumerate() {
        let i = first + k;
        let (has_right, has_down) = (layout.right[i] != NONE, layout.down[i] != NONE);
        if !has_right && !has_down {
            continue;
        }
        theta[..problem.labels].copy_from_slice(problem.costs(layout.pixel[i] as usize));
        for l in 0..stride {
            theta[l] += r[l] + dn[l];
        }
        for (j, messages) in [(layout.left[i], right_before), (layout.up[i], down_before)] {
            if j != NONE {
                add(&mut theta, &messages[j as usize * stride..][..stride]);
            }
        }
        theta[problem.labels..].fill(BIG);
        let gamma = layout.gamma(i);
        for (has, message, weight) in
            [(has_right, r, layout.weight_right[i]), (has_down, dn, layout.weight_down[i])]
        {
            if has {
                let h = share.values();
                for l in 0..stride {
                    h[l] = gamma * theta[l] - message[l];
                }
                share.min_convolve(weight, message);
            }
        }
    }
}

/// What a backward sweep has found on the diagonal after the one that it works on.
pub(super) struct After<'a> {
    pub start: usize,
    pub theta: &'a [f32],
    pub bounds: &'a [(f64, f32)],
}

#[inline(always)]
pub(super) fn backward_nodes(
    problem: &GridProblem<'_>,
    layout: &Layout,
    stride: usize,
    first: usize,
    after: &After<'_>,
    [right_before, down_before]: [&[f32]; 2],
    [right, down]: [&mut [f32]; 2],
    theta: &mut [f32],
    bounds: &mut [(f64, f32)],
) {
    let mut share = Padded::new(stride);
    let messages = right.chunks_exact_mut(stride).zip(down.chunks_exact_mut(stride));
    for (k, ((r, dn), t)) in messages.zip(theta.chunks_exact_mut(stride)).enumerate() {
        let i = first + k;
        let mut bound = 0.0;
        let costs = problem.costs(layout.pixel[i] as usize);
        t[..problem.labels].copy_from_slice(costs);
        t[problem.labels..].fill(BIG);
        let mut size = largest(costs);
        for (j, messages) in [(layout.left[i], right_before), (layout.up[i], down_before)] {
            if j != NONE {
                let m = &messages[j as usize * stride..][..stride];
                size += largest(&m[..problem.labels]);
                add(t, m);
            }
        }
        let edges =
            [(layout.right[i], r, layout.weight_right[i]), (layout.down[i], dn, layout.weight_down[i])];
        for (j, message, weight) in edges {
            if j == NONE {
                continue;
            }
            let gamma = layout.gamma(j as usize);
            let nth = j as usize - after.start;
            let other = &after.theta[nth * stride..][..stride];
            let edge_size = after.bounds[nth].1 + largest(&message[..problem.labels]);
            let h = share.values();
            for l in 0..stride {
                h[l] = gamma * other[l] - message[l];
            }
            bound += f64::from(share.min_convolve(weight, message)) - BOUND_SLACK * f64::from(edge_size);
            size += largest(&message[..problem.labels]);
            add(t, message);
        }
        let min = least(&t[..problem.labels]);
        for v in t.iter_mut() {
            *v -= min;
        }
        bounds[k] = (bound + f64::from(min) - BOUND_SLACK * f64::from(size), size);
    }
}

/// Adds a message to costs.
#[inline(always)]
fn add(theta: &mut [f32], message: &[f32]) {
    for (t, m) in theta.iter_mut().zip(message) {
        *t += m;
    }
}
