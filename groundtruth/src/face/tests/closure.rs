//! Depth, identity and flow against one another and against positions.

use super::*;
use glam::DVec2;
use strandbench_types::{DepthMap, FaceView, FirstHit, FlowState, LABEL_HAIR, LABEL_SKIN, Sight};

fn centre(i: usize, w: usize) -> DVec2 {
    DVec2::new((i % w) as f64 + 0.5, (i / w) as f64 + 0.5)
}

/// Weights of the corners nearest to a point, by the normal equations.
fn weights([a, b, c]: [DVec3; 3], p: DVec3) -> [f64; 3] {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d00, d01, d11) = (ab.dot(ab), ab.dot(ac), ac.dot(ac));
    let (d20, d21) = (ap.dot(ab), ap.dot(ac));
    let det = d00 * d11 - d01 * d01;
    let (v, w) = ((d11 * d20 - d01 * d21) / det, (d00 * d21 - d01 * d20) / det);
    [1.0 - v - w, v, w]
}

type Views = Vec<(Camera, FaceView, FaceView)>;

/// Each camera's views of now and of the reference, with flow to the other.
static VIEWS: LazyLock<Views> = LazyLock::new(|| {
    let (there, here) = (PAIR.reference.refs(), PAIR.now.refs());
    let (reference, now) = (moment(&PAIR.reference, &there), moment(&PAIR.now, &here));
    let none = StrandSet::new();
    let all = [&PAIR.reference, &PAIR.now].map(|s| Probe::new(&s.strands, &s.refs()).unwrap());
    let bare = [&PAIR.reference, &PAIR.now].map(|s| Probe::new(&none, &s.refs()).unwrap());
    cameras()
        .into_iter()
        .map(|c| {
            let view = |shot: &Shot, from, to, k: usize| {
                let frames = Frames {
                    now: from,
                    reference: to,
                    kinds: &PAIR.kinds,
                    sight: &all[k],
                    bare_sight: &bare[k],
                };
                let (seen, behind) = planes(shot, &c);
                face_view(&frames, &c, seen, behind, &Silent).unwrap()
            };
            let forward = view(&PAIR.now, now, reference, 0);
            let back = view(&PAIR.reference, reference, now, 1);
            (c, forward, back)
        })
        .collect()
});

#[test]
fn pixel_to_depth_to_material_point_to_reference_is_pixel_plus_flow() {
    let (mut visible, mut off, mut worst, mut hairs) = (0, 0, 0.0f64, 0);
    for (c, v, _) in VIEWS.iter() {
        let w = c.width as usize;
        for (plane, flow) in [(&v.seen, &v.flow), (&v.bare, &v.bare_flow)] {
            for i in 0..w * w {
                let Some(z) = plane.depth.get_index(i) else { continue };
                let place = c.unproject(centre(i, w), f64::from(z));
                // Nothing of the crate's own is asked: triangles by the normal equations, hairs by their follicle.
                let there = match plane.hits.data[i] {
                    FirstHit::Nothing => panic!("depth without a hit"),
                    FirstHit::Mesh { surface, triangle, .. } => {
                        let corners = |s: &Shot| {
                            let m = &s.meshes[surface as usize];
                            m.triangles[triangle as usize].map(|k| m.vertices[k as usize].as_dvec3())
                        };
                        let b = weights(corners(&PAIR.now), place);
                        corners(&PAIR.reference).iter().zip(b).map(|(p, b)| *p * b).sum()
                    }
                    // Hairs of odd index move by themselves too.
                    FirstHit::Fibre { strand, .. } if strand % 2 == 1 => continue,
                    FirstHit::Fibre { strand, .. } => {
                        hairs += 1;
                        let [a, b] = [&PAIR.now, &PAIR.reference].map(|s| &s.frames[strand as usize]);
                        let local = a.axes.as_dmat3().transpose() * (place - a.position.as_dvec3());
                        b.position.as_dvec3() + b.axes.as_dmat3() * local
                    }
                };
                let (px, _) = c.project(there).unwrap();
                let f = flow.flow_px.data[i];
                let error = (px - centre(i, w) - DVec2::new(f64::from(f[0]), f64::from(f[1]))).length();
                visible += 1;
                off += usize::from(error.is_nan() || error > 0.01);
                worst = worst.max(error);
            }
        }
    }
    println!("{visible} points, {hairs} on hair that follows, {off} beyond 0.01 px, worst {worst:.2e} px");
    assert!(visible > 400_000 && hairs > 10_000, "{visible} {hairs}");
    assert!(1000 * off <= visible, "{off} of {visible}, worst {worst} px");
}

#[test]
fn flow_is_the_difference_of_the_vertices_positions_interpolated() {
    let mut count = 0;
    for (c, v, _) in VIEWS.iter() {
        let w = c.width as usize;
        for i in 0..w * w {
            let FirstHit::Mesh { surface, triangle, uv } = v.bare.hits.data[i] else { continue };
            let corners = |s: &Shot| {
                let m = &s.meshes[surface as usize];
                m.triangles[triangle as usize].map(|k| c.project(m.vertices[k as usize].as_dvec3()).unwrap())
            };
            let (now, then) = (corners(&PAIR.now), corners(&PAIR.reference));
            let moved: [DVec2; 3] = std::array::from_fn(|k| then[k].0 - now[k].0);
            let b = [1.0 - uv[0] - uv[1], uv[0], uv[1]].map(f64::from);
            let want: DVec2 = moved.iter().zip(b).map(|(m, b)| *m * b).sum();
            let f = v.bare_flow.flow_px.data[i];
            let error = (DVec2::new(f64::from(f[0]), f64::from(f[1])) - want).length();
            // Weights in the image differ from those in space by at most the relative spread of depth, at both
            // moments, over the triangle's extent there.
            let slack = |t: &[(DVec2, f64); 3]| {
                let z = t.map(|p| p.1);
                let spread =
                    z.iter().fold(f64::MIN, |a, b| a.max(*b)) - z.iter().fold(f64::MAX, |a, b| a.min(*b));
                let extent = (0..3).map(|k| t[k].0.distance(t[(k + 1) % 3].0)).fold(0.0, f64::max);
                spread / z[0] * extent
            };
            assert!(error <= slack(&now) + slack(&then) + 1e-3, "{error} px at pixel {i} of {}", c.name);
            count += 1;
        }
    }
    assert!(count > 200_000, "{count}");
}

#[test]
fn there_and_back_is_where_it_began() {
    let (there, here) = (PAIR.reference.refs(), PAIR.now.refs());
    let (reference, now) = (moment(&PAIR.reference, &there), moment(&PAIR.now, &here));
    let (mut worst, mut pairs) = (0.0f64, 0);
    for (c, v, back) in VIEWS.iter() {
        let w = c.width as usize;
        for i in 0..w * w {
            let Some(z) = v.seen.depth.get_index(i) else { continue };
            let (place, hit) = (c.unproject(centre(i, w), f64::from(z)), v.seen.hits.data[i]);
            let again = carry(&reference, &now, carry(&now, &reference, place, hit).unwrap(), hit).unwrap();
            // Axes are orthonormal to single precision; a mesh's point is on the triangle to that of its weights.
            worst = worst.max(again.distance(place));
            // By the planes of both directions: between four neighbours on the skin the way back is their mean's, up to
            // what they differ by.
            if v.flow.state.data[i] != FlowState::Seen || v.labels.data[i] != LABEL_SKIN {
                continue;
            }
            let f = v.flow.flow_px.data[i].map(f64::from);
            let to = centre(i, w) + DVec2::from_array(f) - 0.5;
            let (x, y) = (to.x.floor(), to.y.floor());
            if x < 0.0 || y < 0.0 || x as usize + 1 >= w || y as usize + 1 >= w {
                continue;
            }
            let corner = |k: usize| (y as usize + k / 2) * w + x as usize + k % 2;
            let near = |k: usize| match v.seen.hits.data[i] {
                FirstHit::Mesh { triangle, .. } => {
                    matches!(back.seen.hits.data[corner(k)], FirstHit::Mesh { surface: 0, triangle: t, .. } if t == triangle)
                }
                _ => false,
            };
            if !(0..4).all(near) {
                continue;
            }
            let ways = [0, 1, 2, 3].map(|k| {
                let f = back.flow.flow_px.data[corner(k)];
                DVec2::new(f64::from(f[0]), f64::from(f[1]))
            });
            let (a, b) = (to.x - x, to.y - y);
            let mean = ways[0] * (1.0 - a) * (1.0 - b)
                + ways[1] * a * (1.0 - b)
                + ways[2] * (1.0 - a) * b
                + ways[3] * a * b;
            let spread = ways.iter().map(|w| w.distance(mean)).fold(0.0, f64::max);
            let error = (mean + DVec2::from_array(f)).length();
            assert!(error <= 0.01 * spread + 0.002, "{error} px with a spread of {spread} px");
            pairs += 1;
        }
    }
    assert!(worst < 2e-4, "{worst} mm");
    assert!(pairs > 20_000, "{pairs}");
}

#[test]
fn skin_under_hair_is_the_mesh_alone() {
    let c = &cameras()[1];
    let (seen, bare) = planes(&PAIR.now, c);
    let mut all = TriMesh::default();
    for m in &PAIR.now.meshes {
        let n = all.vertices.len() as u32;
        all.vertices.extend(&m.vertices);
        all.triangles.extend(m.triangles.iter().map(|t| t.map(|i| i + n)));
    }
    // A rasteriser in double precision that shares nothing with rays.
    let want = DepthMap::of_mesh(c, &all).unwrap();
    let (mut under, mut apart) = (0, 0);
    for i in 0..(c.width * c.height) as usize {
        under += usize::from(matches!(seen.hits.data[i], FirstHit::Fibre { .. }));
        match (bare.depth.get_index(i), want.get_index(i)) {
            (None, None) => {}
            // One step of single precision at 700 mm is 6e-5 mm.
            (Some(a), Some(b)) if (a - b).abs() <= 1.5e-4 => {}
            // Rays pass an edge on the one or the other side by 5e-5 mm, of triangles of some 0.5 mm.
            _ => apart += 1,
        }
        if !matches!(seen.hits.data[i], FirstHit::Fibre { .. }) {
            assert_eq!(seen.hits.data[i], bare.hits.data[i]);
        }
    }
    println!("{under} pixels of hair, {apart} differ");
    assert!(under > 5_000 && 2000 * apart < (c.width * c.height) as usize, "{under} {apart}");
}

#[test]
fn hits_lie_on_their_fibre_and_labels_are_its_kind() {
    let mut fibres = 0;
    for (c, v, _) in VIEWS.iter() {
        let w = c.width as usize;
        for i in 0..w * w {
            let FirstHit::Fibre { strand, segment, along } = v.seen.hits.data[i] else { continue };
            let s = &PAIR.now.strands;
            let k = s.range(strand as usize).start + segment as usize;
            let [a, b] = [k, k + 1].map(|k| s.points[k].as_dvec3());
            let radius = f64::from(s.radii_mm[k] + (s.radii_mm[k + 1] - s.radii_mm[k]) * along);
            let z = f64::from(v.seen.depth.get_index(i).unwrap());
            let off = c.unproject(centre(i, w), z).distance(a.lerp(b, f64::from(along))) - radius;
            assert!(off.abs() < 1e-4, "{off} mm off the fibre");
            assert_eq!(v.labels.data[i], LABEL_HAIR + PAIR.kinds[strand as usize]);
            assert!(v.bare.depth.get_index(i).is_none_or(|skin| f64::from(skin) > z - 1e-4));
            fibres += 1;
        }
    }
    assert!(fibres > 20_000, "{fibres}");
}

#[test]
fn a_fibre_that_bends_keeps_a_points_distance_from_its_axis_and_place_along_it() {
    let (there, here) = (PAIR.reference.refs(), PAIR.now.refs());
    let (reference, now) = (moment(&PAIR.reference, &there), moment(&PAIR.now, &here));
    let mut turned = 0;
    for strand in (1..PAIR.kinds.len()).step_by(2) {
        let range = PAIR.now.strands.range(strand);
        for segment in 0..range.len() - 1 {
            let k = range.start + segment;
            let ends = |s: &Shot| [k, k + 1].map(|k| s.strands.points[k].as_dvec3());
            let ([a, b], [c, d]) = (ends(&PAIR.now), ends(&PAIR.reference));
            let (t, u) = ((b - a).normalize(), (d - c).normalize());
            let place = a.lerp(b, 0.3) + t.any_orthonormal_vector() * 0.04;
            let hit = FirstHit::Fibre { strand: strand as u32, segment: segment as u32, along: 0.3 };
            let off = carry(&now, &reference, place, hit).unwrap() - c.lerp(d, 0.3);
            assert!((off.length() - 0.04).abs() < 1e-6 && off.dot(u).abs() < 1e-6, "{off}");
            turned += 1;
        }
    }
    assert!(turned > 1000);
}

#[test]
fn states_say_what_the_reference_frame_hides_with_hair_and_without() {
    let (there, here) = (PAIR.reference.refs(), PAIR.now.refs());
    let (reference, now) = (moment(&PAIR.reference, &there), moment(&PAIR.now, &here));
    let none = StrandSet::new();
    let all = Probe::new(&PAIR.reference.strands, &there).unwrap();
    let bare = Probe::new(&none, &there).unwrap();
    let mut count = [[0usize; 4]; 2];
    for (c, v, _) in VIEWS.iter() {
        let w = c.width as usize;
        for (k, (plane, flow, sight)) in
            [(&v.seen, &v.flow, &all), (&v.bare, &v.bare_flow, &bare)].into_iter().enumerate()
        {
            for i in (0..w * w).step_by(5) {
                let want = match plane.depth.get_index(i) {
                    None => FlowState::Absent,
                    Some(z) => {
                        let (place, hit) = (c.unproject(centre(i, w), f64::from(z)), plane.hits.data[i]);
                        let to = carry(&now, &reference, place, hit).unwrap();
                        match c.project(to).unwrap().0 {
                            px if px.min_element() < 0.0 || px.max_element() >= w as f64 => {
                                FlowState::Outside
                            }
                            _ if sight.sees(c, to, hit.element().unwrap()) => FlowState::Seen,
                            _ => FlowState::Occluded,
                        }
                    }
                };
                assert_eq!(flow.state.data[i], want, "pixel {i} of {}, planes {k}", c.name);
                count[k][want as usize] += 1;
            }
        }
    }
    // The window shows something everywhere. Hair hides more.
    assert!(count.iter().all(|n| n[1] > 1000 && n[2] > 5 && n[3] > 1000), "{count:?}");
    assert!(count[0][2] > 100 * count[1][2], "{count:?}");
}
