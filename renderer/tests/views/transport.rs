//! Light in closed scenes: furnaces, both ways of finding light, depth, and awkward places.

use crate::common::{EYE, fibre, fixed, light, plate, render, scene, tuft};
use glam::Vec3;
use strandbench_renderer::{Render, RenderScene, Settings, Skin, Strategy};
use strandbench_scenes::{AreaLight, Environment, FibreOptics, OpticsModel, Scene, SkinOptics, Surface};
use strandbench_types::{Plane, Silent, StrandSet, TriMesh};

/// Paths from every camera ray.
fn paths(samples: u32, depth: u32) -> Settings {
    Settings { depth, indirect_every: 1, ..fixed(samples) }
}

fn ball(radius: f32, n: u32) -> TriMesh {
    let mut mesh = TriMesh::default();
    for i in 0..=n {
        for j in 0..2 * n {
            let (a, b) =
                (i as f32 / n as f32 * std::f32::consts::PI, j as f32 / n as f32 * std::f32::consts::PI);
            mesh.vertices.push(Vec3::new(a.sin() * b.cos(), a.cos(), a.sin() * b.sin()) * radius);
        }
    }
    for i in 0..n {
        for j in 0..2 * n {
            let at = |i: u32, j: u32| i * 2 * n + j % (2 * n);
            mesh.triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
            mesh.triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
        }
    }
    mesh
}

/// Mean over the pixels of one channel, and the standard error of a view's mean from views of several seeds.
fn mean_of(s: &Scene, settings: &Settings, seeds: u64, pick: impl Fn(&Render) -> f64) -> (f64, f64) {
    let prepared = RenderScene::new(s).unwrap();
    let v: Vec<f64> =
        (0..seeds).map(|seed| pick(&prepared.render(0, settings, seed, &Silent).unwrap())).collect();
    spread(&v)
}

/// Mean and its standard error.
fn spread(v: &[f64]) -> (f64, f64) {
    let n = v.len() as f64;
    let mean = v.iter().sum::<f64>() / n;
    (mean, (v.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0) / n).sqrt())
}

fn average(r: &Render) -> f64 {
    let d = &r.radiance_rgb.data;
    d.iter().map(|c| f64::from(c[0])).sum::<f64>() / d.len() as f64
}

#[test]
fn a_white_matte_ball_in_a_constant_environment_cannot_be_seen() {
    // Each point of a convex white body sends what it gets, whatever way the light is found.
    let mut s = scene(StrandSet::new(), vec![Surface::plain(ball(6.0, 40), [1.0; 3])], Vec::new(), (24, 24));
    s.skin = SkinOptics { coat_reflectance: 0.0, ..SkinOptics::default() };
    s.environment = Some(Environment::constant([0.7, 0.5, 0.3]));
    s.background_rgb = [0.7, 0.5, 0.3];
    for strategy in [Strategy::Both, Strategy::Lights, Strategy::Scattering] {
        let settings = Settings { strategy, ..paths(64, 3) };
        let (mean, error) = mean_of(&s, &settings, 8, average);
        // Shading normals are smooth: where they and the facets disagree about the horizon, light is lost.
        let slack = 2e-3;
        assert!((mean - 0.7).abs() < 4.0 * error + slack, "{strategy:?}: {mean} ± {error}");
        assert!(error < 2e-3, "{strategy:?}: {error}");
    }
    // Directions of scattering alone find a constant environment without noise.
    let exact = render(&s, &Settings { strategy: Strategy::Scattering, ..paths(4, 3) }, 1);
    let middle = exact.radiance_rgb.data[12 * 24 + 12];
    assert!((middle[0] - 0.7).abs() < 1e-5 && (middle[2] - 0.3).abs() < 1e-5, "{middle:?}");
}

#[test]
fn skin_between_two_walls_gathers_the_series_of_its_reflections() {
    // Inside a closed matte ball with albedo a around a small lamp, radiance after n scatterings grows as
    // 1 + a + ... + a^(n-1): every point of the wall sees the whole wall alike.
    let mut mesh = ball(50.0, 60);
    // The camera stands inside, so that it needs no window.
    mesh.vertices.iter_mut().for_each(|v| v.z += 900.0);
    let lamp = |facing: f32| AreaLight {
        centre_mm: Vec3::new(0.0, 0.0, 900.0),
        half_u_mm: Vec3::X * 5.0 * facing,
        half_v_mm: Vec3::Y * 5.0,
        radiance_rgb: [3.0; 3],
    };
    for albedo in [0.8f64, 0.1] {
        let wall = Surface::plain(mesh.clone(), [albedo as f32; 3]);
        let mut s = scene(StrandSet::new(), vec![wall], vec![lamp(1.0), lamp(-1.0)], (6, 6));
        s.skin = SkinOptics { coat_reflectance: 0.0, ..SkinOptics::default() };
        // Dim light gets its shadow rays too.
        s.sensor.full_scale_radiance = 1e-6;
        // Direct light has the same bits for one seed whatever the depth: it cancels.
        let prepared = RenderScene::new(&s).unwrap();
        let of = |depth: u32, seed| average(&prepared.render(0, &paths(128, depth), seed, &Silent).unwrap());
        let beyond_first =
            |depth: u32| spread(&(0..12).map(|seed| of(depth, seed) - of(1, seed)).collect::<Vec<_>>());
        // Two rectangles light the wall as |cos|: the second scattering sees the mean of that, which is the flux
        // over the wall's area.
        let flux = 2.0 * 100.0 * std::f64::consts::PI * 3.0;
        let even = albedo * flux / (4.0 * std::f64::consts::PI * 2500.0) / std::f64::consts::PI;
        let second = albedo * even;
        // Dark walls end paths early: what goes on stands for what does not.
        for (depth, want) in [(2, second), (5, second * (1.0 + albedo + albedo.powi(2) + albedo.powi(3)))] {
            let (got, error) = beyond_first(depth);
            // The ball of 60 by 120 facets has 0.3 % less area and its shading normals bend by 1.5 degrees.
            assert!((got - want).abs() < 4.0 * error + 0.005 * want, "{depth}: {got} ± {error}, {want}");
            assert!(error < 0.01 * want, "{error} of {want}");
        }
    }
}

#[test]
fn rays_that_leave_a_fibre_do_not_meet_it_again() {
    // A straight fibre hides nothing from itself, though its segments meet end to end: with any depth its light is
    // that of one scattering, bit for bit, on the side of the light and through the fibre.
    let sky: Vec<[f32; 3]> = (0..32).map(|i| [0.1 + (i % 7) as f32; 3]).collect();
    for model in [OpticsModel::Marschner, OpticsModel::Chiang] {
        let mut s = scene(fibre(0.3, 1.0), Vec::new(), Vec::new(), (12, 12));
        s.optics.model = model;
        s.environment =
            Some(Environment { radiance_rgb: Plane::from_vec(8, 4, sky.clone()), azimuth_deg: 0.0 });
        let (one, six) = (render(&s, &paths(32, 1), 1), render(&s, &paths(32, 6), 1));
        assert!(average(&one) > 0.1);
        assert_eq!(one.radiance_rgb, six.radiance_rgb, "{model:?}");
    }
}

/// A tuft before a plate of skin.
fn hairy(lights: Vec<AreaLight>) -> Scene {
    let mut s = scene(tuft(300), vec![Surface::plain(plate(20.0, -9.0), [0.5, 0.4, 0.3])], lights, (24, 24));
    s.pigments.iter_mut().for_each(|p| p.eumelanin = 0.1);
    s
}

#[test]
fn all_ways_of_finding_light_agree() {
    // A large near light (weighed between both ways), a small far one (left to points on it), and a sky.
    let sky = || {
        let texels =
            (0..32).map(|i| [0.3 + 0.2 * (i % 5) as f32, 0.4, if i == 9 { 9.0 } else { 0.2 }]).collect();
        Environment { radiance_rgb: Plane::from_vec(8, 4, texels), azimuth_deg: 40.0 }
    };
    let near = light(Vec3::new(100.0, 150.0, 180.0), 90.0, 3.0);
    let far = light(Vec3::new(-400.0, 300.0, 700.0), 60.0, 60.0);
    for (lights, environment) in [
        (vec![near], None),
        (vec![near, far], Some(sky())),
        (vec![near; 12], None),
        (vec![near; 9], Some(sky())),
    ] {
        let mut s = hairy(lights);
        s.environment = environment;
        for depth in [1, 3] {
            let each = [(Strategy::Both, 8), (Strategy::Lights, 8), (Strategy::Scattering, 32)].map(
                |(strategy, samples)| {
                    let settings = Settings { strategy, indirect_every: 2, ..paths(samples, depth) };
                    mean_of(&s, &settings, 12, average)
                },
            );
            for a in 0..3 {
                for b in 0..a {
                    let error = (each[a].1.powi(2) + each[b].1.powi(2)).sqrt();
                    // Welch's t with some 20 degrees of freedom: 4.5 in 24 comparisons is one in five hundred.
                    assert!(
                        (each[a].0 - each[b].0).abs() < 4.5 * error,
                        "{} lights, depth {depth}: {each:?}",
                        s.lights.len()
                    );
                    assert!(error < 0.05 * each[a].0, "{each:?}");
                }
            }
        }
    }
}

#[test]
fn following_fewer_rays_changes_noise_and_not_light() {
    let s = hairy(vec![light(Vec3::new(300.0, 300.0, 700.0), 80.0, 60.0)]);
    let all = mean_of(&s, &Settings { indirect_every: 1, ..paths(16, 6) }, 16, average);
    let some = mean_of(&s, &Settings { indirect_every: 8, ..paths(16, 6) }, 32, average);
    let direct = mean_of(&s, &paths(16, 1), 16, average);
    let error = (all.1.powi(2) + some.1.powi(2)).sqrt();
    assert!((all.0 - some.0).abs() < 4.0 * error, "{all:?} {some:?}");
    assert!(
        all.0 - direct.0 > 20.0 * error,
        "there is light to follow: {all:?}, direct {direct:?}, {some:?}"
    );
}

#[test]
fn light_grows_with_depth_and_converges() {
    let s = hairy(vec![light(Vec3::new(300.0, 300.0, 700.0), 80.0, 60.0)]);
    let at = |depth| mean_of(&s, &paths(16, depth), 16, average);
    let (one, two, eight, thirty) = (at(1), at(2), at(8), at(30));
    let noise = |a: (f64, f64), b: (f64, f64)| (a.1.powi(2) + b.1.powi(2)).sqrt();
    assert!(two.0 - one.0 > 5.0 * noise(one, two), "{one:?} {two:?}");
    assert!(eight.0 - two.0 > 5.0 * noise(eight, two), "{two:?} {eight:?}");
    // A thin tuft: what is left beyond eight scatterings is below a twentieth.
    let rest = thirty.0 - eight.0;
    assert!(
        rest > -4.0 * noise(eight, thirty) && rest < 0.05 * thirty.0 + 4.0 * noise(eight, thirty),
        "{eight:?} {thirty:?}"
    );
}

#[test]
fn a_clamp_darkens_and_only_what_is_followed() {
    let s = hairy(vec![light(Vec3::new(300.0, 300.0, 700.0), 80.0, 60.0)]);
    let free = average(&render(&s, &paths(16, 6), 1));
    let clamped = average(&render(&s, &Settings { clamp: 1e-4, ..paths(16, 6) }, 1));
    let direct = average(&render(&s, &paths(16, 1), 1));
    assert!(clamped < free && (clamped - direct).abs() < 2e-4, "{free} {clamped} {direct}");
    let loose = average(&render(&s, &Settings { clamp: 1e6, ..paths(16, 6) }, 1));
    assert_eq!(loose, free);
}

#[test]
fn bounce_rays_see_lights_and_cameras_do_not() {
    // A mirror-like coat on black skin shows a large light to the camera: the light itself is behind the camera.
    let lamp = light(Vec3::new(0.0, 0.0, 1200.0), 600.0, 1.0);
    let mut s = scene(StrandSet::new(), vec![Surface::plain(plate(30.0, 0.0), [0.0; 3])], vec![lamp], (8, 8));
    s.skin = SkinOptics { coat_reflectance: 0.2, coat_roughness: 0.05, scatter_mm: 0.0 };
    let coat = Skin::new(&s.skin).unwrap();
    let (n, p) = (600, Vec3::new(0.25, -0.25, 0.0));
    let eye = (EYE.as_vec3() - p).normalize();
    let mut want = 0.0;
    for k in 0..n * n {
        let q = |k: i32| (2.0 * (k as f32 + 0.5) / n as f32 - 1.0) * 600.0;
        let to = Vec3::new(q(k % n), q(k / n), 1200.0) - p;
        let wi = to.normalize();
        let f = f64::from(coat.scatter(Vec3::Z, wi, eye, [0.0; 3])[0]);
        want += f * f64::from(wi.z * wi.z / to.length_squared()) * f64::from(1200.0 / n as f32).powi(2);
    }
    for strategy in [Strategy::Both, Strategy::Lights, Strategy::Scattering] {
        let settings = Settings { strategy, ..paths(1024, 1) };
        let seen = f64::from(render(&s, &settings, 3).radiance_rgb.data[4 * 8 + 4][0]);
        // The quadrature and 1024 stratified points are good to a few per mille.
        assert!((seen / want - 1.0).abs() < 0.01, "{strategy:?}: {seen}, {want}");
    }
    // A light between camera and plate, shining at the plate, is not seen and casts no shadow.
    let small = AreaLight {
        centre_mm: Vec3::new(0.0, 0.0, 700.0),
        half_u_mm: Vec3::NEG_X * 50.0,
        half_v_mm: Vec3::Y * 50.0,
        radiance_rgb: [5.0; 3],
    };
    let facing_camera = AreaLight { half_u_mm: Vec3::X * 50.0, ..small };
    let dark = scene(
        StrandSet::new(),
        vec![Surface::plain(plate(30.0, 0.0), [0.5; 3])],
        vec![facing_camera],
        (4, 4),
    );
    assert_eq!(average(&render(&dark, &paths(16, 2), 1)), 0.0);
}

#[test]
fn white_fibres_in_a_constant_environment_cannot_be_seen() {
    // Without absorption the near-field model sends on all that it gets, whatever the neighbours do: paths of any
    // length, through fibres and out again, must end with the environment's radiance.
    let furnace = |strands: StrandSet| {
        let mut s = scene(strands, Vec::new(), Vec::new(), (24, 24));
        s.pigments.iter_mut().for_each(|p| p.eumelanin = 0.0);
        s.environment = Some(Environment::constant([1.0; 3]));
        s.background_rgb = [1.0; 3];
        s.optics = FibreOptics { model: OpticsModel::Chiang, shift_r_deg: 0.0, ..FibreOptics::default() };
        s
    };
    let hair = |r: &Render| {
        let (mut sum, mut n) = (0.0, 0.0);
        for i in
            (0..r.radiance_rgb.data.len()).filter(|&i| r.hits.pixel(i).len() == usize::from(r.hits.rays[i]))
        {
            sum += f64::from(r.radiance_rgb.data[i][0]);
            n += 1.0;
        }
        assert!(n > 40.0, "{n} pixels full of hair");
        sum / n
    };
    let one = mean_of(&furnace(fibre(0.0, 3.0)), &paths(64, 1), 8, hair);
    let mut bundle = StrandSet::new();
    for k in 0..60u64 {
        let mut rng = strandbench_rng::Rng::keyed(&[77, k]);
        let mut end = |y: f32| Vec3::new(rng.range(-4.0, 4.0), y, rng.range(-4.0, 4.0));
        let (a, b) = (end(-12.0), end(12.0));
        bundle.push(&(0..=8).map(|i| a.lerp(b, i as f32 / 8.0)).collect::<Vec<_>>(), 0.4);
    }
    let s = furnace(bundle);
    let (few, all) = (mean_of(&s, &paths(64, 2), 8, hair), mean_of(&s, &paths(64, 200), 8, hair));
    // The model's own loss or gain at one scattering is taken from one fibre; a dozen scatterings may each repeat it.
    let own = (one.0 - 1.0).abs() + 4.0 * one.1;
    assert!(own < 0.01, "one fibre: {one:?}");
    assert!((all.0 - 1.0).abs() < 12.0 * own + 4.0 * all.1, "all: {all:?}, one: {one:?}");
    assert!(all.1 < 0.01 && few.0 < 0.95, "two scatterings leave a deficit: {few:?}");
}
