use super::*;

fn lattice() -> Lattice {
    Lattice { origin: DVec3::new(-3.0, 2.0, 1.0), cell_mm: 1.5, size: [17, 17, 17] }
}

#[test]
fn the_operator_is_the_energy_of_linear_functions() {
    // Of a linear function the energy is gradient² times volume, and nothing acts on the inner nodes.
    let l = lattice();
    let level = Level::new(l.clone(), &[]);
    let g = DVec3::new(0.3, -0.7, 0.2);
    let u: Vec<f64> = (0..l.count()).map(|i| l.node(i).dot(g)).collect();
    let mut out = vec![0.0; u.len()];
    level.apply(&u, &mut out);
    let energy: f64 = u.iter().zip(&out).map(|(a, b)| a * b).sum();
    let volume = (16.0f64 * 1.5).powi(3);
    assert!((energy / (g.length_squared() * volume) - 1.0).abs() < 1e-12, "{energy}");
    for i in 0..l.count() {
        let at = [i % 17, i / 17 % 17, i / 289];
        if at.iter().all(|c| (1..16).contains(c)) {
            assert!(out[i].abs() < 1e-12, "{at:?}: {}", out[i]);
        }
    }
}

#[test]
fn the_solution_is_the_one_that_was_put_in_whatever_the_number_of_threads() {
    let l = lattice();
    let samples: Vec<(DVec3, f64)> = (0..200)
        .map(|i| {
            let t = f64::from(i);
            let at = DVec3::new((t * 0.37).sin(), (t * 0.73).cos(), (t * 1.1).sin()) * 9.0;
            (l.origin + DVec3::splat(12.0) + at, 1.0 + (t * 0.2).sin().abs() * 5.0)
        })
        .collect();
    let want: Vec<f64> = (0..l.count()).map(|i| (i as f64 * 0.01).sin()).collect();
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut grids = Multigrid::new(&l, halvings([16; 3]), &samples).unwrap();
            assert!(grids.levels.len() > 1);
            let mut rhs = vec![0.0; want.len()];
            grids.levels[0].apply(&want, &mut rhs);
            grids.solve(&rhs, 1e-10, 100, &|| Ok(())).unwrap()
        })
    };
    let (got, steps, left) = run(1);
    assert!(left <= 1e-10 && steps < 40, "{steps} steps to {left}");
    let worst = got.iter().zip(&want).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(worst < 1e-6, "{worst}");
    assert!(got.iter().zip(&run(3).0).all(|(a, b)| a.to_bits() == b.to_bits()));
}
