use super::*;
use proptest::prelude::*;

#[derive(Clone, Debug)]
struct Graph {
    nodes: usize,
    terminals: Vec<(u32, u32)>,
    edges: Vec<(usize, usize, u32, u32)>,
}

fn graphs(max_nodes: usize, density: usize) -> impl Strategy<Value = Graph> {
    (2..=max_nodes).prop_flat_map(move |n| {
        (
            prop::collection::vec((0u32..20, 0u32..20), n),
            prop::collection::vec((0..n, 1..n, 0u32..20, 0u32..20), 0..density * n),
        )
            .prop_map(move |(terminals, edges)| Graph {
                nodes: n,
                terminals,
                edges: edges.into_iter().map(|(a, b, c, r)| (a, (a + b) % n, c, r)).collect(),
            })
    })
}

fn solve(g: &Graph) -> (f64, Vec<bool>) {
    let mut flow = MaxFlow::new(g.nodes);
    for (i, &(s, t)) in g.terminals.iter().enumerate() {
        flow.add_terminal(i, f64::from(s), f64::from(t));
    }
    for &(a, b, c, r) in &g.edges {
        flow.add_edge(a, b, f64::from(c), f64::from(r));
    }
    let value = flow.run(&|| false).expect("nobody cancels");
    (value, (0..g.nodes).map(|i| flow.on_source_side(i)).collect())
}

/// Capacity over the cut with these nodes on the source's side.
fn cut(g: &Graph, source: impl Fn(usize) -> bool) -> f64 {
    let mut sum = 0;
    for (i, &(s, t)) in g.terminals.iter().enumerate() {
        sum += if source(i) { t } else { s };
    }
    for &(a, b, c, r) in &g.edges {
        match (source(a), source(b)) {
            (true, false) => sum += c,
            (false, true) => sum += r,
            _ => {}
        }
    }
    f64::from(sum)
}

/// Maximum flow by shortest augmenting paths on a capacity matrix (Edmonds and Karp 1972).
fn edmonds_karp(g: &Graph) -> f64 {
    let (s, t, n) = (g.nodes, g.nodes + 1, g.nodes + 2);
    let mut room = vec![vec![0i64; n]; n];
    for (i, &(a, b)) in g.terminals.iter().enumerate() {
        room[s][i] += i64::from(a);
        room[i][t] += i64::from(b);
    }
    for &(a, b, c, r) in &g.edges {
        room[a][b] += i64::from(c);
        room[b][a] += i64::from(r);
    }
    let mut total = 0;
    loop {
        let mut from = vec![usize::MAX; n];
        from[s] = s;
        let mut queue = VecDeque::from([s]);
        while let Some(i) = queue.pop_front() {
            for j in 0..n {
                if from[j] == usize::MAX && room[i][j] > 0 {
                    from[j] = i;
                    queue.push_back(j);
                }
            }
        }
        if from[t] == usize::MAX {
            return total as f64;
        }
        let path = || std::iter::successors(Some(t), |&j| (j != s).then(|| from[j])).take_while(|&j| j != s);
        let push = path().map(|j| room[from[j]][j]).min().expect("the sink is on the path");
        for j in path() {
            room[from[j]][j] -= push;
            room[j][from[j]] += push;
        }
        total += push;
    }
}

proptest! {
    #[test]
    fn equals_the_least_of_all_cuts(g in graphs(9, 3)) {
        let least = (0u32..1 << g.nodes).map(|m| cut(&g, |i| m >> i & 1 == 1)).fold(f64::INFINITY, f64::min);
        let (value, side) = solve(&g);
        prop_assert_eq!(value, least);
        prop_assert_eq!(cut(&g, |i| side[i]), least);
    }

    #[test]
    fn equals_augmenting_paths(g in graphs(60, 4)) {
        let (value, side) = solve(&g);
        prop_assert_eq!(value, edmonds_karp(&g));
        prop_assert_eq!(cut(&g, |i| side[i]), value);
    }
}

#[test]
fn no_arcs_no_nodes_and_infinite_arcs() {
    assert_eq!(MaxFlow::new(0).run(&|| false), Ok(0.0));
    let mut g = MaxFlow::new(2);
    g.add_terminal(0, 5.0, 2.0);
    assert_eq!(g.run(&|| false), Ok(2.0));
    assert!(g.on_source_side(0) && !g.on_source_side(1));
    g.reset(2);
    g.add_terminal(0, 7.0, 0.0);
    g.add_terminal(1, 0.0, 3.0);
    g.add_edge(0, 1, f64::INFINITY, 0.0);
    assert_eq!(g.run(&|| false), Ok(3.0));
    assert!(g.on_source_side(1), "an infinite arc is never cut");
}

#[test]
fn stops_when_asked() {
    let n = 300;
    let mut g = MaxFlow::new(n * n);
    for i in 0..n * n {
        g.add_terminal(i, ((i * 7919) % 13) as f64, ((i * 104_729) % 13) as f64);
        if i % n + 1 < n {
            g.add_edge(i, i + 1, 3.0, 3.0);
        }
    }
    assert_eq!(g.run(&|| true), Err(SolveError::Cancelled));
}
