//! A beam's rays meet what they meet in the tree.

use super::Beam;
use crate::accel::{Accel, Hit};
use glam::Vec3;
use strandbench_rng::Rng;
use strandbench_types::{StrandSet, TriMesh};

fn vector(rng: &mut Rng, size: f32) -> Vec3 {
    Vec3::new(rng.range(-size, size), rng.range(-size, size), rng.range(-size, size))
}

/// Curved fibres in a box of 80 mm, every ninth of them twice, over and under a rough sheet of triangles.
fn scene(seed: u64, fibres: usize) -> Accel {
    let mut rng = Rng::keyed(&[seed]);
    let mut strands = StrandSet::default();
    for i in 0..fibres {
        let (mut at, mut step) = (vector(&mut rng, 40.0), vector(&mut rng, 1.5));
        let points: Vec<Vec3> = (0..12)
            .map(|_| {
                step += vector(&mut rng, 0.3);
                at += step;
                at
            })
            .collect();
        let radii: Vec<f32> = points.iter().map(|_| rng.range(0.03, 0.06)).collect();
        for _ in 0..1 + usize::from(i % 9 == 0) {
            strands.push_tapered(&points, &radii);
        }
    }
    let side = 24u32;
    let vertices = (0..side * side)
        .map(|k| Vec3::new((k % side) as f32, (k / side) as f32, 0.0) * 4.0 - 46.0 + vector(&mut rng, 1.5))
        .map(|v| v.with_z(v.z + 46.0));
    let triangles = (0..(side - 1) * (side - 1)).flat_map(|k| {
        let a = k / (side - 1) * side + k % (side - 1);
        [[a, a + 1, a + side], [a + 1, a + side + 1, a + side]]
    });
    let mesh = TriMesh { vertices: vertices.collect(), triangles: triangles.collect() };
    Accel::new(&strands, &[&mesh]).unwrap()
}

/// Rays of beams of this spread through the scene that meet a fibre, a mesh, nothing: each meets the same in the tree.
fn agree(accel: &Accel, seed: u64, spread: f32) -> [usize; 3] {
    let mut rng = Rng::keyed(&[seed, 1]);
    let (mut beam, mut met) = (Beam::default(), [0; 3]);
    for round in 0..400 {
        // From afar, from amid the fibres, along an axis.
        let toward = vector(&mut rng, 35.0);
        let away = vector(&mut rng, 1.0).normalize_or(Vec3::X);
        let away = if round % 7 == 0 { [Vec3::X, Vec3::NEG_Y, Vec3::Z][round % 3] } else { away };
        let eye = toward + away * if round % 4 == 0 { rng.range(0.5, 20.0) } else { rng.range(100.0, 900.0) };
        let middle = -away;
        // A camera's rays start where the scene does, or before it.
        let (centre, radius) = accel.bounding_sphere();
        let ahead = |rng: &mut Rng, direction: Vec3| {
            ((centre - eye).dot(direction) - radius).max(0.0)
                * if rng.below(2) == 0 { 1.0 } else { rng.range(0.0, 1.0) }
        };
        let start = ahead(&mut rng, middle);
        accel.begin(&mut beam, eye + middle * start, middle, f64::from(start), spread);
        let (a, b) = middle.any_orthonormal_pair();
        for i in 0..40u32 {
            let angle = rng.range(0.0, std::f32::consts::TAU);
            // As far out as the beam goes, as well.
            let out = spread * if i % 3 == 0 { 1.0 } else { rng.range(0.0, 1.0) };
            let direction = (middle + (a * angle.cos() + b * angle.sin()) * out).normalize();
            let start = ahead(&mut rng, direction);
            let origin = eye + direction * start;
            let want = accel.closest(origin, direction);
            assert_eq!(
                accel.closest_in(&mut beam, origin, direction, f64::from(start)),
                want,
                "beam {round}, ray {i}"
            );
            met[match want {
                Some(Hit::Fibre { .. }) => 0,
                Some(Hit::Mesh { .. }) => 1,
                None => 2,
            }] += 1;
        }
    }
    met
}

#[test]
fn a_ray_of_a_beam_meets_what_it_meets_in_the_tree() {
    // From a pixel that is much finer than a fibre to one across which there are hundreds.
    for (seed, spread) in [(1, 1e-5f32), (2, 2e-4), (3, 3e-3), (4, 0.05)] {
        let accel = scene(seed, 3000);
        let wide = agree(&accel, seed, spread);
        let portable = agree(&accel.portable(), seed, spread);
        assert_eq!(wide, portable);
        assert!(wide.iter().all(|&n| n > 500), "{wide:?}");
    }
}

#[test]
fn a_beam_that_is_not_finite_meets_nothing() {
    let accel = scene(5, 20);
    let mut beam = Beam::default();
    accel.begin(&mut beam, Vec3::splat(f32::NAN), Vec3::Z, 0.0, 1e-3);
    assert_eq!(accel.closest_in(&mut beam, Vec3::new(0.0, 0.0, -100.0), Vec3::Z, 0.0), None);
    accel.begin(&mut beam, Vec3::new(0.0, 0.0, -100.0), Vec3::Z, 0.0, 1e-3);
    assert_eq!(accel.closest_in(&mut beam, Vec3::splat(f32::NAN), Vec3::Z, 0.0), None);
}
