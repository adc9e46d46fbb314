//! What hides what, against brute force over all primitives.

use super::*;
use strandbench_types::{Element, Sight, SkinCover};

/// Least distance between two segments: candidates are the ends' feet and where the lines are nearest (Ericson, Real-Time
/// Collision Detection, 5.1.9, gives the conditions; here all candidates are tried).
fn gap([a, b]: [DVec3; 2], [c, d]: [DVec3; 2]) -> f64 {
    let ends = [
        a.distance(foot(a, [c, d])),
        b.distance(foot(b, [c, d])),
        c.distance(foot(c, [a, b])),
        d.distance(foot(d, [a, b])),
    ];
    let (u, v, w) = (b - a, d - c, a - c);
    let n = u.cross(v);
    let nn = n.length_squared();
    let s = -w.cross(v).dot(n) / nn;
    let t = -w.cross(u).dot(n) / nn;
    let inner = (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t);
    let least = ends.into_iter().fold(f64::MAX, f64::min);
    if inner { least.min((a + u * s).distance(c + v * t)) } else { least }
}

/// Whether a segment crosses a triangle, and by what share of it the crossing is inside.
fn crossing([a, b]: [DVec3; 2], [p, q, r]: [DVec3; 3]) -> Option<f64> {
    let d = b - a;
    let side = |x: DVec3, y: DVec3| d.dot((x - a).cross(y - a));
    let s = [side(q, r), side(r, p), side(p, q)];
    let sum: f64 = s.iter().sum();
    let w = s.map(|v| v / sum);
    let at = p * w[0] + q * w[1] + r * w[2];
    let t = (at - a).dot(d) / d.length_squared();
    (t > 0.0 && t < 1.0).then(|| w.into_iter().fold(f64::MAX, f64::min))
}

/// Hairs and shingles in a box of 20 mm.
fn thicket() -> (StrandSet, TriMesh) {
    let mut r = Rng::keyed(&[31]);
    let mut v = |s: f32| Vec3::new(r.range(-s, s), r.range(-s, s), r.range(-s, s));
    let mut strands = StrandSet::new();
    for _ in 0..60 {
        let (a, step) = (v(10.0), v(1.5));
        strands.push(&(0..6).map(|k| a + step * k as f32 + v(0.3)).collect::<Vec<_>>(), 0.25);
    }
    let mut mesh = TriMesh::default();
    for _ in 0..25 {
        let n = mesh.vertices.len() as u32;
        let a = v(10.0);
        mesh.vertices.extend([a, a + v(4.0), a + v(4.0)]);
        mesh.triangles.push([n, n + 1, n + 2]);
    }
    (strands, mesh)
}

#[test]
fn hidden_is_what_brute_force_finds_hidden() {
    let (strands, mesh) = thicket();
    let probe = Probe::new(&strands, &[&mesh]).unwrap();
    let camera =
        Camera::look_at("c", (200, 200), 3000.0, DVec3::new(90.0, 40.0, 500.0), DVec3::ZERO, DVec3::NEG_Y);
    let eye = camera.centre_mm();
    let mut r = Rng::keyed(&[32]);
    let (mut seen, mut hidden, mut unclear) = (0, 0, 0);
    for trial in 0..6000 {
        let (place, element) = match trial % 3 {
            0 => {
                let (strand, segment) = ((r.f64() * 60.0) as u32, (r.f64() * 5.0) as u32);
                let k = strands.range(strand as usize).start + segment as usize;
                let [a, b] = [k, k + 1].map(|k| strands.points[k].as_dvec3());
                // On the side of the camera.
                let axis = a.lerp(b, r.f64());
                let out = (eye - axis).reject_from((b - a).normalize()).normalize();
                (axis + out * 0.25, Element::Segment { strand, segment })
            }
            1 => {
                let triangle = (r.f64() * 25.0) as u32;
                let [a, b, c] =
                    mesh.triangles[triangle as usize].map(|i| mesh.vertices[i as usize].as_dvec3());
                let (u, v) = (0.1 + 0.4 * r.f64(), 0.1 + 0.4 * r.f64());
                (a + (b - a) * u + (c - a) * v, Element::Triangle { surface: 0, triangle })
            }
            _ => {
                let vertex = (r.f64() * 75.0) as u32;
                (mesh.vertices[vertex as usize].as_dvec3(), Element::Vertex { surface: 0, vertex })
            }
        };
        let unit = (place - eye).normalize();
        let ray = [eye, place - unit * strandbench_renderer::NEAR_MM];
        // By how much something reaches over the ray, or stays clear of it if negative.
        let mut reach = f64::MIN;
        for s in 0..60u32 {
            for k in 0..5u32 {
                let own = matches!(element, Element::Segment { strand, segment }
                    if strand == s && segment.abs_diff(k) <= 1);
                if own {
                    continue;
                }
                let at = strands.range(s as usize).start + k as usize;
                let axis = [at, at + 1].map(|i| strands.points[i].as_dvec3());
                // Of the own strand what lies within three radii does not hide.
                let ray = match element {
                    Element::Segment { strand, .. } if strand == s => [eye, place - unit * 0.75],
                    _ => ray,
                };
                reach = reach.max(0.25 - gap(ray, axis));
            }
        }
        for (t, corners) in mesh.triangles.iter().enumerate() {
            let own = match element {
                Element::Triangle { triangle, .. } => triangle as usize == t,
                Element::Vertex { vertex, .. } => corners.contains(&vertex),
                Element::Segment { .. } => false,
            };
            if !own && let Some(inside) = crossing(ray, corners.map(|i| mesh.vertices[i as usize].as_dvec3()))
            {
                reach = reach.max(inside);
            }
        }
        let sees = probe.sees(&camera, place, element);
        // Rays in single precision are off by up to 5e-5 mm.
        match reach {
            _ if reach.abs() < 2e-4 => unclear += 1,
            _ if reach > 0.0 => {
                hidden += 1;
                assert!(!sees, "trial {trial}: {element:?} is hidden by {reach} mm");
            }
            _ => {
                seen += 1;
                assert!(sees, "trial {trial}: {element:?} is clear by {reach} mm");
            }
        }
    }
    println!("{seen} seen, {hidden} hidden, {unclear} unclear");
    assert!(seen > 1000 && hidden > 1000 && unclear < 60, "{seen} {hidden} {unclear}");
}

#[test]
fn what_a_pixel_shows_is_seen_and_what_it_hides_is_not() {
    let c = &cameras()[0];
    let (seen, bare) = planes(&PAIR.now, c);
    let probe = Probe::new(&PAIR.now.strands, &PAIR.now.refs()).unwrap();
    let w = c.width as usize;
    let (mut lost, mut shown, mut covered) = (0, 0, 0);
    for i in 0..w * w {
        let pixel = glam::DVec2::new((i % w) as f64 + 0.5, (i / w) as f64 + 0.5);
        let at = |plane: &HitPlane| {
            let z = f64::from(plane.depth.get_index(i)?);
            Some((c.unproject(pixel, z), plane.hits.data[i].element()?, z))
        };
        let Some((place, element, z)) = at(&seen) else { continue };
        shown += 1;
        lost += usize::from(!probe.sees(c, place, element));
        if let Some((skin, element, under)) = at(&bare).filter(|b| b.2 > z + 0.2) {
            covered += 1;
            assert!(!probe.sees(c, skin, element), "skin {} mm behind hair is seen", under - z);
        }
    }
    // The ray to the place is the pixel's own ray up to rounding, which decides at edges alone.
    assert!(shown > 100_000 && covered > 5_000 && 2000 * lost < shown, "{lost} of {shown}, {covered}");
}

#[test]
fn vertices_under_hair_are_told_from_bare_ones() {
    let skin = &PAIR.now.meshes[0];
    let none = StrandSet::new();
    let refs = PAIR.now.refs();
    let (all, bare) = (Probe::new(&PAIR.now.strands, &refs).unwrap(), Probe::new(&none, &refs).unwrap());
    let mut sightings = SkinSightings::new(skin.vertices.len());
    for camera in cameras().iter().enumerate() {
        sightings.add(camera, (0, skin), &all, &bare).unwrap();
    }
    let index = HairIndex::new(&PAIR.now.strands, |_| true).unwrap();
    let cover = skin_cover(skin, Some(&index), &sightings).unwrap();
    let count = |c: SkinCover| cover.iter().filter(|&&x| x == c).count();
    let [under, margin, far] = [SkinCover::Under, SkinCover::Margin, SkinCover::Bare].map(count);
    assert!(under > 2000 && margin > 500 && far > 20_000, "{under} {margin} {far}");
    let front = &cameras()[0];
    let segments: Vec<_> = (0..PAIR.now.strands.len())
        .flat_map(|s| PAIR.now.strands.range(s).skip(1))
        .map(|k| {
            let (p, r) = (&PAIR.now.strands.points, &PAIR.now.strands.radii_mm);
            ([p[k - 1].as_dvec3(), p[k].as_dvec3()], [r[k - 1], r[k]].map(f64::from))
        })
        .collect();
    let (mut hidden, mut seen, mut unclear) = (0, 0, 0);
    for (v, p) in skin.vertices.iter().enumerate().step_by(11) {
        assert_eq!(sightings.seen_by[v] & !sightings.bare_seen_by[v], 0, "hair does not uncover");
        let p = p.as_dvec3();
        let brute = segments.iter().map(|(s, _)| p.distance(foot(p, *s))).fold(f64::MAX, f64::min);
        let blocked = sightings.seen_by[v] != sightings.bare_seen_by[v];
        match cover[v] {
            SkinCover::Under => assert!(brute <= UNDER_MM || blocked),
            SkinCover::Margin => assert!(brute > UNDER_MM && brute < BARE_MM && !blocked),
            SkinCover::Bare => assert!(brute >= BARE_MM && !blocked),
        }
        if !front.project(p).is_some_and(|(px, _)| front.contains(px)) {
            assert_eq!(sightings.bare_seen_by[v] & 1, 0);
            continue;
        }
        let eye = front.centre_mm();
        let ray = [eye, p - (p - eye).normalize() * strandbench_renderer::NEAR_MM];
        // Of a cone its thinner end hides for certain, its thicker end perhaps.
        let (mut least, mut most) = (f64::MIN, f64::MIN);
        for (s, r) in &segments {
            let d = gap(ray, *s);
            least = least.max(r[0].min(r[1]) - d);
            most = most.max(r[0].max(r[1]) - d);
        }
        let mut inside = f64::MIN;
        for mesh in &PAIR.now.meshes {
            for t in &mesh.triangles {
                if std::ptr::eq(mesh, skin) && t.contains(&(v as u32)) {
                    continue;
                }
                let corners = t.map(|i| mesh.vertices[i as usize].as_dvec3());
                inside = inside.max(crossing(ray, corners).unwrap_or(f64::MIN));
            }
        }
        let bits = (sightings.seen_by[v] & 1 == 1, sightings.bare_seen_by[v] & 1 == 1);
        if inside.abs() < 1e-3 || (most > -1e-3 && least < 1e-3) {
            unclear += 1;
            continue;
        }
        assert_eq!(bits, (most < 0.0 && inside < 0.0, inside < 0.0), "vertex {v}: {inside} {least} {most}");
        if bits.0 { seen += 1 } else { hidden += 1 }
    }
    assert!(hidden > 100 && seen > 100 && unclear * 20 < hidden + seen, "{hidden} {seen} {unclear}");
}

#[test]
fn the_first_hit_is_the_nearest_of_all() {
    let (strands, mesh) = thicket();
    let probe = Probe::new(&strands, &[&mesh]).unwrap();
    let c = Camera::look_at("c", (61, 53), 1100.0, DVec3::new(90.0, 40.0, 500.0), DVec3::ZERO, DVec3::NEG_Y);
    let plane = probe.first_hits(&c, &Silent).unwrap();
    let (eye, mut met) = (c.centre_mm(), [0; 3]);
    let axes: Vec<[DVec3; 2]> = strands
        .iter()
        .flat_map(|s| s.windows(2).map(|w| [w[0].as_dvec3(), w[1].as_dvec3()]).collect::<Vec<_>>())
        .collect();
    for i in 0..61 * 53 {
        let d = c.ray_direction(glam::DVec2::new((i % 61) as f64 + 0.5, (i / 61) as f64 + 0.5));
        let z = plane.depth.get_index(i).map(f64::from);
        // Up to what is met, or through all, the ray is clear but for rounding.
        let ray = [eye, eye + d * (z.unwrap_or(1000.0) - strandbench_renderer::NEAR_MM)];
        let reach = axes.iter().map(|s| 0.25 - gap(ray, *s)).fold(f64::MIN, f64::max);
        let crossed = |t: &[u32; 3]| crossing(ray, t.map(|i| mesh.vertices[i as usize].as_dvec3()));
        let inside = mesh.triangles.iter().filter_map(crossed).fold(f64::MIN, f64::max);
        assert!(reach < 2e-4 && inside < 2e-4, "pixel {i}: {reach} mm, {inside}, {:?}", plane.hits.data[i]);
        met[match plane.hits.data[i] {
            strandbench_types::FirstHit::Nothing => 0,
            strandbench_types::FirstHit::Fibre { .. } => 1,
            strandbench_types::FirstHit::Mesh { .. } => 2,
        }] += 1;
        // And what is met is there.
        if let Some(z) = z {
            let beyond = [eye, eye + d * (z + 2e-4)];
            let touched = axes.iter().any(|s| gap(beyond, *s) < 0.25 + 2e-4)
                || mesh.triangles.iter().any(|t| {
                    crossing(beyond, t.map(|i| mesh.vertices[i as usize].as_dvec3()))
                        .is_some_and(|w| w > -2e-4)
                });
            assert!(touched, "pixel {i}: nothing at {z} mm");
        }
    }
    assert!(met.iter().all(|&n| n > 100), "{met:?}");
}

/// A roof of 2 x 2 x 2 triangles around a vertex in the middle, in the plane z = 0, and one more triangle below.
fn roof(below_mm: f32, turn: Mat3) -> TriMesh {
    let mut vertices: Vec<Vec3> =
        (0..9).map(|k| Vec3::new((k % 3) as f32 * 7.0 - 7.0, (k / 3) as f32 * 7.0 - 7.0, 0.0)).collect();
    vertices.extend([(-40.0, -30.0), (40.0, -30.0), (0.0, 50.0)].map(|(x, y)| Vec3::new(x, y, -below_mm)));
    let quad = |a: u32| [[a, a + 1, a + 4], [a, a + 4, a + 3]];
    let mut triangles = [0, 1, 3, 4].map(quad).concat();
    triangles.push([9, 10, 11]);
    TriMesh { vertices: vertices.into_iter().map(|v| turn * v).collect(), triangles }
}

#[test]
fn a_vertex_seen_at_a_grazing_angle_is_not_hidden_by_its_own_triangles() {
    let none = StrandSet::new();
    let mut r = Rng::keyed(&[33]);
    for trial in 0..300 {
        let turn =
            Mat3::from_euler(glam::EulerRot::XYZ, r.range(-3.0, 3.0), r.range(-1.5, 1.5), r.range(-3.0, 3.0));
        let mesh = roof(5.0, turn);
        let probe = Probe::new(&none, &[&mesh]).unwrap();
        // Half a degree above the roof: rounding of a ray makes up 5e-3 mm along it.
        let around = r.f64() * std::f64::consts::TAU;
        let to = DVec3::new(around.cos(), around.sin(), 0.5f64.to_radians()).normalize();
        let eye = turn.as_dmat3() * to * 777.0;
        let c = Camera::look_at("c", (9, 9), 1000.0, eye, DVec3::ZERO, turn.as_dmat3() * DVec3::Z);
        let middle = mesh.vertices[4].as_dvec3();
        assert!(probe.sees(&c, middle, Element::Vertex { surface: 0, vertex: 4 }), "trial {trial}");
    }
}

#[test]
fn what_lies_a_hundredth_of_a_millimetre_behind_is_hidden() {
    let none = StrandSet::new();
    let c = Camera::look_at("c", (9, 9), 1000.0, DVec3::new(3.0, 2.0, 800.0), DVec3::ZERO, DVec3::NEG_Y);
    for (below, seen) in [(0.01, false), (0.05, false), (2e-4, true)] {
        let mesh = roof(below, Mat3::IDENTITY);
        let probe = Probe::new(&none, &[&mesh]).unwrap();
        let place = DVec3::new(1.0, 2.0, -f64::from(below));
        assert_eq!(probe.sees(&c, place, Element::Triangle { surface: 0, triangle: 8 }), seen, "{below} mm");
        let mut strands = StrandSet::new();
        strands.push(&[Vec3::new(-9.0, 2.0, 0.5 + below), Vec3::new(9.0, 2.0, 0.5 + below)], 0.5);
        let flat = roof(5.0, Mat3::IDENTITY);
        let probe = Probe::new(&strands, &[&flat]).unwrap();
        let place = DVec3::new(1.0, 2.0, 0.0);
        let element = Element::Triangle { surface: 0, triangle: 7 };
        assert!(!probe.sees(&c, place, element), "a fibre of 1 mm in front of its place hides it");
    }
}
