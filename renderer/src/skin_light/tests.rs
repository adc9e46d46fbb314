//! Spreading on meshes whose answer is known, and points around a vertex.

use super::*;
use strandbench_types::TriMesh;

/// A square of (n + 1)² vertices, `step` mm apart.
fn sheet(n: usize, step: f32) -> TriMesh {
    let at = |k: usize| Vec3::new((k % (n + 1)) as f32 * step, (k / (n + 1)) as f32 * step, 0.0);
    let corner = |k: usize| (k / n * (n + 1) + k % n) as u32;
    let m = n as u32 + 1;
    TriMesh {
        vertices: (0..(n + 1) * (n + 1)).map(at).collect(),
        triangles: (0..n * n)
            .map(corner)
            .flat_map(|k| [[k, k + 1, k + m + 1], [k, k + m + 1, k + m]])
            .collect(),
    }
}

#[test]
fn a_point_spreads_by_the_stated_variance_and_nothing_is_lost() {
    let (n, step) = (120usize, 0.5f32);
    let mesh = sheet(n, step);
    let sheet = Sheet::new(&mesh);
    for variance in [0.3, 4.0, 7.41] {
        let mut values = vec![[0.0; 3]; mesh.vertices.len()];
        let middle = n / 2 * (n + 1) + n / 2;
        values[middle] = [1.0, 2.0, 0.0];
        sheet.spread(&mut values, variance);
        let (mut total, mut squares) = ([0.0f64; 3], [0.0f64; 2]);
        let at = mesh.vertices[middle].as_dvec3();
        for (i, v) in values.iter().enumerate() {
            let d = mesh.vertices[i].as_dvec3() - at;
            (0..3).for_each(|c| total[c] += sheet.mass[i] * v[c]);
            squares[0] += sheet.mass[i] * v[0] * d.x * d.x;
            squares[1] += sheet.mass[i] * v[1] * d.y * d.y;
            assert!(v[0] > -1e-9, "light is not negative: {}", v[0]);
        }
        // On a regular grid each implicit step adds exactly its variance. The solver leaves 1e-7 of the right side's
        // norm, which a square of distance (30 mm)² over the variance may magnify.
        let mass = sheet.mass[middle];
        for (c, want) in [1.0, 2.0, 0.0].into_iter().enumerate() {
            assert!((total[c] - want * mass).abs() < 1e-5 * mass, "{variance}: total {total:?}");
        }
        for c in 0..2 {
            let got = squares[c] / total[c];
            assert!((got / variance - 1.0).abs() < 2e-3, "{variance}: {got}");
        }
    }
}

#[test]
fn profile_sums_to_one_and_red_goes_farthest() {
    let mut mean = [0.0f64; 3];
    for c in 0..3 {
        let sum: f64 = PROFILE.iter().map(|g| g.1[c]).sum();
        assert!((sum - 1.0).abs() < 1e-9, "channel {c}: {sum}");
        mean[c] = PROFILE.iter().map(|g| g.1[c] * g.0).sum();
    }
    assert!(mean[0] > 10.0 * mean[1] && mean[1] > 2.0 * mean[2], "{mean:?}");
}

#[test]
fn triangles_and_places_around_a_vertex_follow_its_hat_function() {
    // A vertex between a small and a large triangle.
    let mesh = TriMesh {
        vertices: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::NEG_X * 3.0, Vec3::ONE * 9.0],
        triangles: vec![[0, 1, 2], [2, 3, 0]],
    };
    let patches = Patches::new(&mesh);
    let n = 4000;
    let (mut large, mut sum, mut squares) = (0u32, 0.0f64, 0.0f64);
    for k in 0..n {
        let u = (k as f32 + 0.5) / n as f32;
        large += u32::from(patches.draw(0, u) == Some(1));
        let b = f64::from(hat(u));
        assert!((0.0..=1.0).contains(&b));
        // The distribution function of the density 6 b (1 - b).
        assert!((b * b * (3.0 - 2.0 * b) - f64::from(u)).abs() < 1e-5, "{u}: {b}");
        sum += b;
        squares += b * b;
    }
    assert_eq!(large, 3000, "areas are as 1 to 3");
    assert_eq!(patches.draw(4, 0.5), None);
    // Mean 1/2, mean square 3/10; the midpoint rule is good to 1 / n².
    let n = f64::from(n);
    assert!((sum / n - 0.5).abs() < 1e-5 && (squares / n - 0.3).abs() < 1e-5);
}
