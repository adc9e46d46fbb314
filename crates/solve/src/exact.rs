//! The global minimum by one cut (Ishikawa, PAMI 2003): an oracle for problems of small and middle size.

use std::time::Instant;

use crate::maxflow::MaxFlow;
use crate::{Cancelled, GridProblem, Solution, SolveError};

/// Edges that the graph of [`exact`] may have; each takes 32 bytes.
pub const MAX_EXACT_EDGES: u64 = 1 << 24;

/// The minimum of the energy, and, as the bound, the flow that proves it (less 1e-9 of its size for rounding).
///
/// Pixel p has a chain of nodes k = 1..labels-1, of which node k is on the source's side where l_p >= k; the
/// chain's arcs carry the data costs, and infinite arcs back keep it in order. As the difference of squares
/// has the second difference 2 w, w (l_p - l_q)² is the cut of arcs from p's node k to q's node m of capacity 2 w
/// for m < k, and w for m = k, and the same from q to p. So there are about labels² edges per pair of pixels,
/// at most [`MAX_EXACT_EDGES`] in all.
///
/// # Errors
/// If the problem is malformed, has too many edges, or the work is cancelled.
pub fn exact(problem: &GridProblem<'_>, cancelled: Cancelled<'_>) -> Result<Solution, SolveError> {
    problem.validate()?;
    let begin = Instant::now();
    let chain = problem.labels - 1;
    let mut first = vec![usize::MAX; problem.pixels()];
    let mut pixels = 0usize;
    for p in (0..problem.pixels()).filter(|&p| problem.active[p]) {
        first[p] = pixels * chain;
        pixels += 1;
    }
    let mut pairs = 0u128;
    problem.for_each_edge(|_, _, _| pairs += 1);
    let need = pixels as u128 * chain as u128 + pairs * (chain as u128).pow(2);
    if need > u128::from(MAX_EXACT_EDGES) {
        let limit = u128::from(MAX_EXACT_EDGES);
        return Err(SolveError::TooLarge { method: "exact", what: "edges", need, limit });
    }
    let mut graph = MaxFlow::new(pixels * chain);
    let (mut constant, mut size) = (0.0, 0.0);
    for p in (0..problem.pixels()).filter(|&p| problem.active[p]) {
        let costs = problem.costs(p);
        let min = f64::from(costs.iter().copied().fold(f32::INFINITY, f32::min));
        constant += min;
        size += min.abs();
        let Some(last) = chain.checked_sub(1) else { continue };
        let above = |l: usize| f64::from(costs[l]) - min;
        graph.add_terminal(first[p], above(0), 0.0);
        for k in 0..last {
            graph.add_edge(first[p] + k, first[p] + k + 1, above(k + 1), f64::INFINITY);
        }
        graph.add_terminal(first[p] + last, 0.0, above(chain));
    }
    problem.for_each_edge(|p, q, w| {
        let w = f64::from(w);
        for k in 0..chain {
            for m in 0..chain {
                let (there, back) = match m.cmp(&k) {
                    std::cmp::Ordering::Less => (2.0 * w, 0.0),
                    std::cmp::Ordering::Equal => (w, w),
                    std::cmp::Ordering::Greater => (0.0, 2.0 * w),
                };
                graph.add_edge(first[p] + k, first[q] + m, there, back);
            }
        }
    });
    let flow = graph.run(cancelled)?;
    let mut labels = vec![0u16; problem.pixels()];
    for p in (0..problem.pixels()).filter(|&p| problem.active[p]) {
        labels[p] = (0..chain).take_while(|&k| graph.on_source_side(first[p] + k)).count() as u16;
    }
    let energy = problem.energy(&labels);
    let bound = constant + flow - 1e-9 * (size + flow);
    let history = vec![(begin.elapsed().as_secs_f64(), energy, Some(bound))];
    Ok(Solution { labels, energy, lower_bound: Some(bound), history })
}
