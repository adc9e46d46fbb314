use super::*;

const DRAWS: usize = 2;

/// `n` lights around +z, of different sizes and colours.
fn lights(n: usize) -> Lights {
    let make = |i: usize| {
        let x = i as f32;
        AreaLight {
            centre_mm: Vec3::new(300.0 * (1.7 * x).sin(), 250.0 * (2.3 * x).cos(), 700.0),
            half_u_mm: Vec3::NEG_X * (40.0 + 10.0 * x),
            half_v_mm: Vec3::Y * 60.0,
            radiance_rgb: [1.0 + x, 2.0, 0.5 * x],
        }
    };
    Lights::new(&(0..n).map(make).collect::<Vec<_>>()).unwrap()
}

/// A lobe, so that lights and places on them differ.
fn reflect(d: Vec3) -> [f32; 3] {
    let lobe = d.dot(Vec3::new(0.3, 0.2, 0.93)).max(0.0).powi(40);
    [lobe, 0.5 * lobe + 0.01, 0.02]
}

#[test]
fn a_ray_to_a_drawn_point_finds_it_with_its_density_and_the_weights_add_up_to_one() {
    // Oblique rectangles with slanted edges, seen from the side.
    let slanted = AreaLight {
        centre_mm: Vec3::new(80.0, 300.0, 200.0),
        half_u_mm: Vec3::new(-150.0, 30.0, 20.0),
        half_v_mm: Vec3::new(40.0, 120.0, -60.0),
        radiance_rgb: [4.0, 2.0, 1.0],
    };
    let lights = Lights::new(&[slanted]).unwrap();
    let (e, point) = (&lights.emitters[0], Vec3::new(10.0, -20.0, 30.0));
    let facing = if e.sample([0.5; 2], point).is_some() { 1.0 } else { -1.0 };
    let lights = Lights::new(&[AreaLight { half_u_mm: slanted.half_u_mm * facing, ..slanted }]).unwrap();
    let e = &lights.emitters[0];
    assert!(!e.is_small(point));
    let (lobe_pdf, mix) = (0.7, Mix { strategy: Strategy::Both, share: 0.25 });
    for k in 0..400 {
        let u = [(k % 20) as f32 / 20.0 + 0.02, (k / 20) as f32 / 20.0 + 0.02];
        let s = e.sample(u, point).unwrap();
        let (distance, pdf) = e.meet(point, s.direction).unwrap();
        assert!((distance / s.distance - 1.0).abs() < 1e-4 && (pdf / s.pdf - 1.0).abs() < 1e-3);
        // What scattering is given and what the point is given are the light's radiance together.
        let seen = lights.seen(point, s.direction, f32::INFINITY, lobe_pdf, mix)[0];
        let drawn = lights.choose::<1>([0.0, u[0], u[1]], point, 0.0, mix, |_| ([1.0; 3], lobe_pdf));
        let drawn = drawn[0].unwrap().radiance_rgb[0] * s.pdf;
        assert!(((seen + drawn) / 4.0 - 1.0).abs() < 1e-3, "{seen} + {drawn}");
        assert!(seen > 0.01 && drawn > 0.01);
        assert_eq!(lights.seen(point, s.direction, distance * 0.99, lobe_pdf, mix), [0.0; 3]);
    }
    assert!(e.meet(point, Vec3::NEG_Y).is_none());
    assert!(e.meet(e.centre - e.normal * 100.0, e.normal).is_none(), "the dark side is not seen");
    let past = (slanted.centre_mm + slanted.half_u_mm * 1.01 - point).normalize();
    assert!(e.meet(point, past).is_none(), "just past an edge");
}

#[test]
fn drawn_points_add_up_to_all_lights_also_behind_a_screen() {
    for (n, dim) in [(3, 0.0f32), (3, 0.01), (WEIGHED - 3, 0.01), (WEIGHED + 4, 0.0), (WEIGHED + 4, 0.01)] {
        let lights = lights(n);
        // Half of the directions are hidden after the draw.
        let seen = |d: Vec3| d.x < 0.2;
        let (mut want, mut got, mut squares) = ([0.0f64; 3], [0.0f64; 3], [0.0f64; 3]);
        let cells = 64u32;
        for k in 0..cells * cells {
            let at = |n: u32| (n as f32 + 0.5) / cells as f32;
            for e in &lights.emitters {
                if let Some(s) =
                    e.sample([at(k % cells), at(k / cells)], Vec3::ZERO).filter(|s| seen(s.direction))
                {
                    let f = reflect(s.direction);
                    for c in 0..3 {
                        want[c] += f64::from(f[c] * s.weight_rgb[c]) / f64::from(cells * cells);
                    }
                }
            }
        }
        let sampler = crate::sampler::PixelSampler::new(n as u64);
        let only = Mix { strategy: Strategy::Lights, share: 1.0 };
        let rays = 65_536u32;
        let mut drawn = 0;
        for i in 0..rays {
            let choices =
                lights.choose::<DRAWS>(sampler.light(i), Vec3::ZERO, dim, only, |d| (reflect(d), 0.0));
            drawn += choices.iter().flatten().count();
            for k in 0..3 {
                let seen = choices.iter().flatten().filter(|c| seen(c.direction));
                let sum = seen.map(|c| f64::from(c.radiance_rgb[k])).sum::<f64>();
                got[k] += sum / f64::from(rays);
                squares[k] += sum * sum / f64::from(rays);
            }
        }
        for c in 0..3 {
            let error = ((squares[c] - got[c] * got[c]) / f64::from(rays)).sqrt();
            assert!(error < 0.02 * want[c], "channel {c}: standard error {error} of {}", want[c]);
            assert!((got[c] - want[c]).abs() < 4.0 * error, "{n} lights, dim {dim}: {got:?}, {want:?}");
        }
        assert!(dim == 0.0 || drawn < rays as usize * DRAWS, "dim light is left out now and then");
    }
}
