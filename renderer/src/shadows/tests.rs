//! Places and their weights.

use super::places::{On, Place, Places};
use crate::accel::Hit;
use glam::Vec3;
use std::collections::HashMap;
use strandbench_types::{StrandSet, TriMesh};

/// Two strands near a square, and one square far from both.
fn world() -> (StrandSet, Vec<TriMesh>) {
    let mut strands = StrandSet::new();
    strands.push(&[Vec3::ZERO, Vec3::X, Vec3::new(1.0, 2.5, 0.0), Vec3::new(1.0, 2.5, 0.1)], 0.04);
    strands.push(&[Vec3::Z, Vec3::Z * 1.05], 0.04);
    let square = |x: f32| TriMesh {
        vertices: [(0.0, 0.0), (2.0, 0.0), (2.0, 1.5), (0.0, 1.5)]
            .map(|(u, v)| Vec3::new(x + u, v, -1.0))
            .to_vec(),
        triangles: vec![[0, 1, 2], [2, 3, 0]],
    };
    (strands, vec![square(0.0), square(500.0)])
}

fn at(strands: &StrandSet, meshes: &[TriMesh], places: &Places, place: &Place) -> Vec3 {
    match place.on {
        On::Fibre { point, along: 0.0, .. } => strands.points[point as usize],
        On::Fibre { point, along, .. } => {
            strands.points[point as usize].lerp(strands.points[point as usize + 1], along)
        }
        On::Mesh => {
            let (surface, triangle, uv) = places.on_mesh(place.index);
            on_mesh(&meshes[surface as usize], triangle, uv)
        }
    }
}

fn on_mesh(mesh: &TriMesh, triangle: u32, [u, v]: [f32; 2]) -> Vec3 {
    let [a, b, c] = mesh.triangles[triangle as usize].map(|k| mesh.vertices[k as usize]);
    a + (b - a) * u + (c - a) * v
}

/// Hits all over everything, and where they are.
fn hits(strands: &StrandSet, meshes: &[TriMesh]) -> Vec<(Hit, Vec3)> {
    let mut hits = Vec::new();
    for strand in 0..strands.len() {
        let range = strands.range(strand);
        for point in range.start..range.end - 1 {
            for k in 0..=50 {
                let (strand, point, along) = (strand as u32, point as u32, k as f32 / 50.0);
                let end = strands.points[point as usize].lerp(strands.points[point as usize + 1], along);
                hits.push((Hit::Fibre { t: 1.0, strand, point, along }, end));
            }
        }
    }
    for surface in 0..meshes.len() as u32 {
        for triangle in 0..2 {
            for (i, j) in (0..=40).flat_map(|i| (0..=40 - i).map(move |j| (i, j))) {
                let uv = [i as f32 / 40.0, j as f32 / 40.0];
                let end = on_mesh(&meshes[surface as usize], triangle, uv);
                hits.push((Hit::Mesh { t: 1.0, surface, triangle, uv }, end));
            }
        }
    }
    hits
}

#[test]
fn what_varies_evenly_is_interpolated_exactly_from_points_as_near_as_asked() {
    let (strands, meshes) = world();
    let refs: Vec<_> = meshes.iter().collect();
    for spacing in [0.07, 0.4, 3.0] {
        let places = Places::new(&strands, &refs, spacing, 1 << 20).unwrap();
        let mut known = HashMap::new();
        for (hit, want) in hits(&strands, &meshes) {
            let around = places.around(&hit);
            let (mut sum, mut total) = (Vec3::ZERO, 0.0);
            for (place, weight) in around.iter().filter(|(_, w)| *w != 0.0) {
                let p = at(&strands, &meshes, &places, place);
                assert!((0.0..=1.0).contains(weight) && (place.index as usize) < places.len());
                // A number is one point, whoever asks.
                let same = known.entry(place.index).or_insert(*place);
                assert_eq!(at(&strands, &meshes, &places, same), p);
                let far = match hit {
                    Hit::Fibre { .. } => 2.0,
                    // Longest edges over sides of squares of twice the area.
                    Hit::Mesh { surface, .. } => 1.45 * [1.0, 4.0][surface as usize],
                };
                assert!(p.distance(want) <= far * spacing * 1.001, "{p} is far from {want}");
                sum += p * *weight;
                total += weight;
            }
            assert!((total - 1.0).abs() < 1e-5 && sum.distance(want) < 1e-3, "{hit:?}: {sum} for {want}");
        }
        assert_eq!(known.len(), places.len(), "all points are of use");
    }
}

#[test]
fn hits_beyond_a_rim_by_rounding_have_points() {
    let (strands, meshes) = world();
    let places = Places::new(&strands, &meshes.iter().collect::<Vec<_>>(), 0.1, 1 << 20).unwrap();
    for uv in [[1.000_001, 0.0], [0.0, 1.000_001], [0.500_001, 0.500_001], [-1e-6, 1.0], [-1e-6, -1e-6]] {
        let around = places.around(&Hit::Mesh { t: 1.0, surface: 1, triangle: 1, uv });
        let total: f32 = around.iter().map(|(_, w)| w).sum();
        assert!((total - 1.0).abs() < 1e-5);
        assert!(around.iter().all(|(p, w)| *w >= 0.0 && (p.index as usize) < places.len()), "{around:?}");
    }
}

#[test]
fn points_are_farther_apart_than_asked_where_there_would_be_too_many() {
    let (strands, meshes) = world();
    let refs: Vec<_> = meshes.iter().collect();
    let count = |most: usize| Places::new(&strands, &refs, 0.01, most).map(|p| p.len());
    let all = count(1 << 20).unwrap();
    let fewer = count(all / 3).unwrap();
    assert!(fewer > all / 6 && fewer <= all / 3, "{fewer} of {all}");
    // Six points of strands and eight corners are left at any distance.
    assert_eq!([count(14), count(13)], [Some(14), None]);
}
