use super::*;
use strandbench_types::Silent;

const RADIUS: f64 = 40.0;
const OPTIONS: PoissonOptions = PoissonOptions { cell_mm: 2.0, screening: 4.0, samples_per_node: 1.5 };

/// Points of a sphere on a golden spiral.
fn sphere(n: usize) -> Vec<Oriented> {
    (0..n)
        .map(|i| {
            let z = 1.0 - (2.0 * i as f64 + 1.0) / n as f64;
            let turn = i as f64 * std::f64::consts::PI * (3.0 - 5f64.sqrt());
            let r = (1.0 - z * z).sqrt();
            let normal = DVec3::new(r * turn.cos(), r * turn.sin(), z);
            Oriented { position: normal * RADIUS + DVec3::new(5.0, -3.0, 700.0), normal }
        })
        .collect()
}

fn radii(mesh: &TriMesh) -> Vec<f64> {
    let centre = DVec3::new(5.0, -3.0, 700.0);
    mesh.vertices.iter().map(|v| v.as_dvec3().distance(centre)).collect()
}

#[test]
fn samples_of_a_sphere_give_the_sphere() {
    // 10 mm² a sample, 3.2 mm apart: smoothed over cells of 4 mm. A piecewise linear χ misses an arc of chord 4 mm by up to
    // 4² / 8r = 0.05 mm, which is what the middle one of the vertices may be off; between samples, which nothing holds, the
    // surface may sag by a quarter of a cell of 2 mm.
    let solved = poisson(&sphere(2000), &OPTIONS, &Silent).unwrap();
    assert!(solved.residual < 0.02, "{}", solved.residual);
    let mut off: Vec<f64> = radii(&solved.mesh).iter().map(|r| (r - RADIUS).abs()).collect();
    assert!(off.len() > 5000);
    off.sort_unstable_by(f64::total_cmp);
    let (middle, worst) = (off[off.len() / 2], off[off.len() - 1]);
    assert!(middle < 0.05 && worst < 0.25 * OPTIONS.cell_mm, "{middle} and {worst} mm");
    let area: f64 = solved.area_mm2.iter().sum();
    let whole = 4.0 * std::f64::consts::PI * RADIUS * RADIUS;
    assert!((area / whole - 1.0).abs() < 0.1, "{area} of {whole}");
    // Wound outwards.
    let centre = glam::Vec3::new(5.0, -3.0, 700.0);
    for t in &solved.mesh.triangles {
        let [a, b, c] = t.map(|i| solved.mesh.vertices[i as usize]);
        let n = (b - a).cross(c - a);
        assert!(n.dot(a - centre) >= -1e-3 * n.length(), "{t:?}");
    }
}

#[test]
fn screening_pulls_the_surface_to_the_samples() {
    // Two spheres' samples mixed do not agree: without screening χ at the samples scatters more.
    let mut samples = sphere(1500);
    for (i, s) in samples.iter_mut().enumerate() {
        s.position += s.normal * 1.5 * ((i as f64) * 0.05).sin();
    }
    let residual = |screening: f64| {
        poisson(&samples, &PoissonOptions { screening, ..OPTIONS }, &Silent).unwrap().residual
    };
    let (without, with, much) = (residual(1e-6), residual(4.0), residual(40.0));
    assert!(with < 0.7 * without && much < with, "{without} {with} {much}");
}

#[test]
fn an_open_sheet_leaves_the_box_and_threads_change_nothing() {
    let sheet: Vec<Oriented> = (0..900)
        .map(|i| Oriented {
            position: DVec3::new(f64::from(i % 30), f64::from(i / 30), 0.0) * 3.0,
            normal: DVec3::Z,
        })
        .collect();
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| poisson(&sheet, &OPTIONS, &Silent).unwrap().mesh)
    };
    let mesh = run(1);
    let inner = mesh.vertices.iter().filter(|v| v.x > 6.0 && v.x < 81.0 && v.y > 6.0 && v.y < 81.0);
    // A plane is a linear function on either side of one layer of cells: on it but for the solver's residual.
    assert!(inner.clone().count() > 1000);
    assert!(inner.clone().all(|v| v.z.abs() < 0.1), "{:?}", inner.map(|v| v.z.abs()).fold(0.0, f32::max));
    assert_eq!(mesh, run(2));
}

#[test]
fn too_few_samples_and_too_many_nodes_are_errors() {
    assert!(matches!(
        poisson(&sphere(5), &OPTIONS, &Silent),
        Err(BaselineError::FewPatches { found: 5, .. })
    ));
    let fine = PoissonOptions { cell_mm: 0.01, ..OPTIONS };
    let fault = poisson(&sphere(100), &fine, &Silent).unwrap_err().to_string();
    assert!(fault.contains("cell_mm"), "{fault}");
    let mut bad = sphere(100);
    bad[7].position.x = f64::NAN;
    assert!(poisson(&bad, &OPTIONS, &Silent).is_err());
}

#[test]
fn trimming_leaves_no_loose_vertex() {
    let solved = poisson(&sphere(300), &PoissonOptions { cell_mm: 4.0, ..OPTIONS }, &Silent).unwrap();
    let cut = trim(&solved.mesh, |t| t.iter().all(|&i| solved.mesh.vertices[i].z < 700.0));
    cut.validate().unwrap();
    assert!(!cut.triangles.is_empty() && cut.triangles.len() < solved.mesh.triangles.len());
    let mut used = vec![false; cut.vertices.len()];
    cut.triangles.iter().flatten().for_each(|&i| used[i as usize] = true);
    assert!(used.iter().all(|u| *u) && cut.vertices.iter().all(|v| v.z < 700.0));
}
