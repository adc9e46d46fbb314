//! Maximum-weight matching between two sets, exact, for sparse integer weights.
//!
//! Each row may stay alone at weight 0. Rows are added one after the other along shortest augmenting paths
//! (Dijkstra with node potentials, as Jonker and Volgenant do for the dense problem); a path ends at a free
//! column or by setting a row on it free. Weights are integers, so no rounding decides.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

const NONE: u32 = u32::MAX;

/// Weights of pairs: row by row, `(column, weight)` with positive weights.
pub(crate) struct Weights {
    pub columns: usize,
    /// Start of each row's entries, and their number as the last entry.
    pub offsets: Vec<u32>,
    pub entries: Vec<(u32, u64)>,
}

/// A matching and the proof that none is heavier.
pub(crate) struct Matching {
    /// Column of each row.
    pub column: Vec<Option<u32>>,
    /// Potentials of rows and columns, all of them 0 or more; a pair's weight is at most the sum of its two, and the
    /// weight of the matching is the sum of all.
    pub row_potential: Vec<i64>,
    pub column_potential: Vec<i64>,
}

impl Weights {
    fn row(&self, i: usize) -> &[(u32, u64)] {
        &self.entries[self.offsets[i] as usize..self.offsets[i + 1] as usize]
    }

    /// A matching of maximum weight; of several, the one that this order of work finds.
    pub fn matching(&self) -> Matching {
        let rows = self.offsets.len() - 1;
        let best = |i: usize| self.row(i).iter().map(|e| e.1 as i64).max().unwrap_or(0);
        let mut m = Matching {
            column: vec![None; rows],
            row_potential: (0..rows).map(best).collect(),
            column_potential: vec![0; self.columns],
        };
        let mut row_of = vec![NONE; self.columns];
        let mut search = Search {
            distance: vec![i64::MAX; self.columns],
            from: vec![NONE; self.columns],
            touched: Vec::new(),
            done: Vec::new(),
            heap: BinaryHeap::new(),
        };
        for i in 0..rows {
            self.augment(i as u32, &mut m, &mut row_of, &mut search);
        }
        m
    }

    /// Brings row `root` in by the cheapest alternating path, and keeps the potentials valid.
    fn augment(&self, root: u32, m: &mut Matching, row_of: &mut [u32], s: &mut Search) {
        // The cheapest way so far to end: at cost, by freeing a row, or at a free column.
        let mut end = (m.row_potential[root as usize], End::Row(root));
        let (mut row, mut at) = (root, 0);
        s.done.push((root, 0));
        loop {
            for &(c, w) in self.row(row as usize) {
                let slack = m.row_potential[row as usize] + m.column_potential[c as usize] - w as i64;
                debug_assert!(slack >= 0, "a potential is wrong");
                let d = at + slack;
                let known = &mut s.distance[c as usize];
                if d < *known && d < end.0 {
                    if *known == i64::MAX {
                        s.touched.push(c);
                    }
                    *known = d;
                    s.from[c as usize] = row;
                    if row_of[c as usize] == NONE {
                        // A free column has potential 0: ending there costs no more than reaching it.
                        end = (d, End::Column(c));
                    } else {
                        s.heap.push(Reverse((d, c)));
                    }
                }
            }
            let next = loop {
                match s.heap.pop() {
                    Some(Reverse((d, c))) if d == s.distance[c as usize] && d < end.0 => break Some((d, c)),
                    Some(_) => {}
                    None => break None,
                }
            };
            let Some((d, c)) = next else { break };
            row = row_of[c as usize];
            at = d;
            s.done.push((row, d));
            let free = d + m.row_potential[row as usize];
            if free < end.0 {
                end = (free, End::Row(row));
            }
        }
        let (cost, end) = end;
        for &(row, d) in &s.done {
            m.row_potential[row as usize] -= (cost - d).max(0);
        }
        for &c in &s.touched {
            let d = s.distance[c as usize];
            m.column_potential[c as usize] += (cost - d).max(0);
        }
        let mut column = match end {
            End::Column(c) => Some(c),
            End::Row(row) => m.column[row as usize].take(),
        };
        while let Some(c) = column {
            let row = s.from[c as usize];
            row_of[c as usize] = row;
            column = if row == root { None } else { m.column[row as usize] };
            m.column[row as usize] = Some(c);
        }
        s.clear();
    }
}

enum End {
    Row(u32),
    Column(u32),
}

/// What a search leaves behind for the next to reuse.
struct Search {
    distance: Vec<i64>,
    from: Vec<u32>,
    touched: Vec<u32>,
    done: Vec<(u32, i64)>,
    heap: BinaryHeap<Reverse<(i64, u32)>>,
}

impl Search {
    fn clear(&mut self) {
        for c in self.touched.drain(..) {
            self.distance[c as usize] = i64::MAX;
        }
        self.done.clear();
        self.heap.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use strandbench_rng::Rng;

    fn random(seed: u64, rows: usize, columns: usize, degree: u64, top: u64) -> Weights {
        let mut w = Weights { columns, offsets: vec![0], entries: Vec::new() };
        for i in 0..rows {
            let mut r = Rng::keyed(&[seed, i as u64]);
            let mut of_row: Vec<(u32, u64)> = (0..r.below(degree + 1))
                .map(|_| (r.below(columns as u64) as u32, 1 + r.below(top)))
                .collect();
            of_row.sort_unstable();
            of_row.dedup_by_key(|e| e.0);
            w.entries.extend(of_row);
            w.offsets.push(w.entries.len() as u32);
        }
        w
    }

    fn weight(w: &Weights, m: &Matching) -> i64 {
        let of = |(i, c): (usize, &Option<u32>)| {
            c.map_or(0, |c| w.row(i).iter().find(|e| e.0 == c).expect("a pair of the graph").1 as i64)
        };
        m.column.iter().enumerate().map(of).sum()
    }

    fn brute(w: &Weights, i: usize, used: &mut Vec<bool>) -> i64 {
        if i + 1 == w.offsets.len() {
            return 0;
        }
        let mut best = brute(w, i + 1, used);
        for &(c, v) in w.row(i) {
            if !used[c as usize] {
                used[c as usize] = true;
                best = best.max(v as i64 + brute(w, i + 1, used));
                used[c as usize] = false;
            }
        }
        best
    }

    /// Feasible potentials of the same total prove that no matching is heavier.
    fn proven(w: &Weights, m: &Matching) -> Result<(), String> {
        let (u, v) = (&m.row_potential, &m.column_potential);
        if u.iter().chain(v).any(|p| *p < 0) {
            return Err("a potential is negative".into());
        }
        for i in 0..u.len() {
            if w.row(i).iter().any(|&(c, x)| u[i] + v[c as usize] < x as i64) {
                return Err(format!("row {i} is worth more than its potentials"));
            }
        }
        let mut seen = vec![false; w.columns];
        for c in m.column.iter().flatten() {
            if std::mem::replace(&mut seen[*c as usize], true) {
                return Err(format!("column {c} is matched twice"));
            }
        }
        let (got, bound) = (weight(w, m), u.iter().sum::<i64>() + v.iter().sum::<i64>());
        if got == bound { Ok(()) } else { Err(format!("{got} of at most {bound}")) }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]
        #[test]
        fn small_ones_agree_with_trying_everything(
            seed in any::<u64>(), rows in 1..8usize, columns in 1..8usize, degree in 0..6u64, top in 1..12u64,
        ) {
            let w = random(seed, rows, columns, degree, top);
            let m = w.matching();
            prop_assert_eq!(weight(&w, &m), brute(&w, 0, &mut vec![false; columns]));
            prop_assert_eq!(proven(&w, &m), Ok(()));
        }
    }

    #[test]
    fn large_ones_carry_their_proof() {
        for (rows, columns, degree, top) in
            [(4000, 3000, 8, 1000), (3000, 3000, 3, 5), (2000, 50, 9, 1_000_000)]
        {
            let w = random(5, rows, columns, degree, top);
            assert_eq!(proven(&w, &w.matching()), Ok(()), "{rows} x {columns}");
        }
    }
}
