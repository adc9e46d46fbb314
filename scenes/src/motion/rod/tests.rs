//! Rods against closed solutions of mechanics.

use super::*;
use crate::motion::rest::{GRAVITY, Pose, rod};
use std::f64::consts::{PI, TAU};
use strandbench_rng::Rng;

const HELD: Clamp = Clamp { anchor: DVec3::ZERO, rotation: DQuat::IDENTITY };

/// A rod that is straight at rest, of `n` segments.
fn straight(n: usize, length_mm: f64, direction: DVec3, bend: f64) -> Rod {
    let l = length_mm / n as f64;
    let q = DQuat::from_rotation_arc(DVec3::Z, direction);
    let mut rest = vec![DQuat::IDENTITY; n];
    rest[0] = q;
    let stiffness = (0..n).map(|j| [if j == 0 { 2.0 } else { 1.0 } * bend / l; 2]).collect();
    Rod {
        length_mm: vec![l; n],
        mass: vec![l; n],
        rest,
        stiffness,
        x: (0..n).map(|k| direction * (l * (k as f64 + 0.5))).collect(),
        q: vec![q; n],
        v: vec![DVec3::ZERO; n],
        w: vec![DVec3::ZERO; n],
    }
}

/// Steps under uniform acceleration; `keep` is the share of velocity kept a step.
fn run(
    rod: &mut Rod,
    steps: usize,
    dt: f64,
    clamp: Clamp,
    pull: DVec3,
    keep: f64,
    mut see: impl FnMut(&Rod),
) {
    let mut s = Scratch { acceleration: vec![pull; rod.len()], ..Scratch::default() };
    for _ in 0..steps {
        rod.step(dt, [clamp; 2], 0.0, &mut s, |_, _, _| {});
        for v in rod.v.iter_mut().chain(&mut rod.w) {
            *v *= keep;
        }
        see(rod);
    }
}

/// Mean time between upward crossings of zero.
fn period(samples: &[f64], dt: f64) -> f64 {
    let mut at = Vec::new();
    for (i, w) in samples.windows(2).enumerate() {
        if w[0] < 0.0 && w[1] >= 0.0 {
            at.push((i as f64 + w[0] / (w[0] - w[1])) * dt);
        }
    }
    (at[at.len() - 1] - at[0]) / (at.len() - 1) as f64
}

#[test]
fn a_single_segment_is_a_physical_pendulum() {
    let (l, amplitude, dt) = (40.0, 0.1f64, 2e-4);
    let direction = DVec3::new(amplitude.sin(), -amplitude.cos(), 0.0);
    let mut rod = straight(1, l, direction, 1e-9);
    let mut seen = Vec::new();
    run(&mut rod, 15_000, dt, HELD, DVec3::NEG_Y * GRAVITY, 1.0, |r| seen.push(r.x[0].x));
    let got = period(&seen, dt);
    // Inertia m l²/3 about the end; the second term is the finite amplitude's.
    let exact = TAU * (2.0 * l / (3.0 * GRAVITY)).sqrt() * (1.0 + amplitude * amplitude / 16.0);
    // The implicit step damps the amplitude by exp(-ω² dt t / 2), which takes the second term with it (6e-4),
    // and shifts the period by less than (ω dt)².
    assert!((got / exact - 1.0).abs() < 7e-4, "{got} s for {exact} s");
}

#[test]
fn a_hanging_chain_swings_in_its_first_mode() {
    let (n, length, dt) = (40, 300.0, 1e-3);
    let mut rod = straight(n, length, DVec3::NEG_Y, 1e-9);
    // The mode is J0(j01 sqrt(s / L)), s counted from the free end; ω = (j01 / 2) sqrt(g / L).
    let j01 = 2.404_825_557_695_773;
    let shape = |s: f64| 0.02 * length * libm::j0(j01 * (s / length).sqrt());
    let nodes: Vec<DVec3> = (0..=n)
        .scan(DVec3::ZERO, |p, k| {
            let l = length / n as f64;
            if k > 0 {
                let across = shape(length - l * k as f64) - shape(length - l * (k as f64 - 1.0));
                *p += DVec3::new(across, -(l * l - across * across).sqrt(), 0.0);
            }
            Some(*p)
        })
        .collect();
    for k in 0..n {
        rod.x[k] = (nodes[k] + nodes[k + 1]) * 0.5;
        rod.q[k] = DQuat::from_rotation_arc(DVec3::Z, (nodes[k + 1] - nodes[k]).normalize());
    }
    let energy = |r: &Rod| -> f64 {
        (0..n)
            .map(|k| {
                let across = r.w[k] - r.tangent(k) * r.tangent(k).dot(r.w[k]);
                0.5 * r.mass[k] * r.v[k].length_squared()
                    + 0.5 * r.inertia(k) * across.length_squared()
                    + r.mass[k] * GRAVITY * r.x[k].y
            })
            .sum()
    };
    let lowest = energy(&straight(n, length, DVec3::NEG_Y, 1e-9));
    let start = energy(&rod) - lowest;
    let (mut seen, mut energies) = (Vec::new(), Vec::new());
    run(&mut rod, 5000, dt, HELD, DVec3::NEG_Y * GRAVITY, 1.0, |r| {
        seen.push(r.end(n - 1).x);
        energies.push(energy(r) - lowest);
    });
    let omega = 0.5 * j01 * (GRAVITY / length).sqrt();
    let got = TAU / period(&seen, dt);
    // Rigid links are linear elements: the error of a frequency is of second order in their length.
    assert!((got / omega - 1.0).abs() < 2.0 / (n * n) as f64, "{got} rad/s for {omega} rad/s");
    // An implicit step of an oscillator takes the share ω² dt² of its energy, which swings between its two forms
    // by ω dt within a cycle.
    for (i, e) in energies.iter().enumerate() {
        let t = dt * (i + 1) as f64;
        let expected = start * (-omega * omega * dt * t).exp();
        let band = 2.0 * omega * dt + 0.02;
        assert!((e / expected - 1.0).abs() < band, "after {t} s: {e} for {expected}");
    }
}

#[test]
fn a_cantilever_sags_as_beam_theory_says() {
    let (n, length, bend) = (16, 80.0, 1.18e9);
    let mut rod = straight(n, length, DVec3::X, bend);
    // A pull that gives a tip deflection of a hundredth of the length.
    let pull = 0.01 * length * 8.0 * bend / length.powi(4);
    run(&mut rod, 4000, 1e-3, HELD, DVec3::NEG_Y * pull, 0.97, |_| {});
    let tip = -rod.end(n - 1).y;
    // q L⁴ / 8 EI; joints of a chain are the trapezoid rule of its integral, too large by (l / L)². Large
    // deflection adds terms of the deflection's square, 1e-4.
    let exact = pull * length.powi(4) / (8.0 * bend) * (1.0 + 1.0 / (n * n) as f64);
    assert!((tip / exact - 1.0).abs() < 5e-4, "{tip} mm for {exact} mm");
}

/// A fibre of hair, held level, that hangs down under its weight: the heavy elastica, integrated by itself.
#[test]
fn a_hair_held_level_hangs_as_the_elastica() {
    let (n, length, bend) = (40, 120.0, 1.18e9);
    let mut rod = straight(n, length, DVec3::X, bend);
    run(&mut rod, 20_000, 1e-3, HELD, DVec3::NEG_Y * GRAVITY, 0.98, |_| {});
    // θ'' = -(g / EI)(L - s) cos θ from the level, θ(0) = 0, θ'(L) = 0, θ below the horizon positive.
    let shoot = |slope: f64| -> (f64, DVec3) {
        let m = 4000;
        let h = length / f64::from(m);
        let f = |s: f64, y: [f64; 2]| [y[1], -GRAVITY / bend * (length - s) * y[0].cos()];
        let (mut y, mut p) = ([0.0, slope], DVec3::ZERO);
        for i in 0..m {
            let s = f64::from(i) * h;
            let k1 = f(s, y);
            let k2 = f(s + h / 2.0, [y[0] + h / 2.0 * k1[0], y[1] + h / 2.0 * k1[1]]);
            let k3 = f(s + h / 2.0, [y[0] + h / 2.0 * k2[0], y[1] + h / 2.0 * k2[1]]);
            let k4 = f(s + h, [y[0] + h * k3[0], y[1] + h * k3[1]]);
            let middle = y[0] + h / 2.0 * k1[0];
            p += DVec3::new(middle.cos(), -middle.sin(), 0.0) * h;
            for c in 0..2 {
                y[c] += h / 6.0 * (k1[c] + 2.0 * k2[c] + 2.0 * k3[c] + k4[c]);
            }
        }
        (y[1], p)
    };
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if shoot(middle).0 > 0.0 { high = middle } else { low = middle }
    }
    let exact = shoot(low).1;
    let tip = rod.end(n - 1);
    // The chain's error is of second order in its segments' length: (l / L)² of the length, a few times.
    assert!(exact.y < -0.6 * length, "the case is one of large deflection: {exact}");
    assert!(tip.distance(exact) < 3.0 * length / (n * n) as f64, "{tip} for {exact}");
}

/// A curl: helix of radius 6 mm and pitch 30 mm about a slanting axis.
fn helix(n: usize) -> Vec<DVec3> {
    let turn = DQuat::from_rotation_z(0.7) * DQuat::from_rotation_x(2.0);
    let at = |k: usize| {
        let a = k as f64 * 0.5;
        turn * DVec3::new(6.0 * a.cos() - 6.0, 6.0 * a.sin(), 30.0 * a / TAU)
    };
    (0..=n).map(at).collect()
}

#[test]
fn groomed_hair_is_at_rest() {
    let mut r = Rng::keyed(&[5]);
    let mut wander = vec![DVec3::ZERO];
    let mut heading = DVec3::new(0.8, -0.3, 0.0).normalize();
    for _ in 0..30 {
        // Turns down within a few segments, as hair does; a long lever held out level would be unstable.
        let kick = DVec3::new(r.f64() - 0.5, r.f64() - 1.8, r.f64() - 0.5);
        heading = (heading + kick * 0.5).normalize();
        wander.push(wander[wander.len() - 1] + heading * 10.0);
    }
    // Pushes that keep their direction hold nothing in place; a curl under them would buckle.
    for (nodes, borne) in [(wander, 10), (helix(60), 0)] {
        let n = nodes.len() - 1;
        let pile: Vec<DVec3> = (0..n).map(|k| if k < borne { DVec3::Y } else { DVec3::ZERO }).collect();
        let mass = nodes[0].distance(nodes[1]);
        let pose = Pose { nodes: &nodes, mass, bend: 1.18e9, twist: 0.85e9, pile: &pile };
        let (mut rod, pushes, _) = rod(&pose, &HELD, DVec3::NEG_Y * GRAVITY);
        assert!(pushes.iter().all(|p| (0.0..=3.0 * GRAVITY).contains(p)));
        assert!(pushes[borne..].iter().all(|p| *p == 0.0));
        let acceleration = (0..n).map(|k| DVec3::NEG_Y * GRAVITY + pile[k] * pushes[k]).collect();
        let mut s = Scratch { acceleration, ..Scratch::default() };
        let start = rod.x.clone();
        for _ in 0..2000 {
            rod.step(1.25e-3, [HELD; 2], 0.004, &mut s, |_, _, _| {});
        }
        // Rounding of positions is 1e-13 mm; the worst conditioned solves lose six digits of it.
        for k in 0..n {
            let moved = rod.x[k].distance(start[k]);
            assert!(moved < 1e-6, "segment {k} of {n}: {moved} mm");
        }
        // Without its pushes or its rest shape it is not at rest.
        s.acceleration.iter_mut().for_each(|a| *a *= 1.1);
        for _ in 0..400 {
            rod.step(1.25e-3, [HELD; 2], 0.004, &mut s, |_, _, _| {});
        }
        assert!(rod.x[n - 1].distance(start[n - 1]) > 0.1);
    }
}

#[test]
fn a_curl_turns_with_its_root_as_a_rigid_body() {
    let nodes = helix(50);
    let n = nodes.len() - 1;
    let pile = vec![DVec3::ZERO; n];
    let mass = nodes[0].distance(nodes[1]);
    let pose = Pose { nodes: &nodes, mass, bend: 1.18e9, twist: 0.85e9, pile: &pile };
    let (mut rod, _, _) = rod(&pose, &HELD, DVec3::ZERO);
    let start = rod.x.clone();
    let turn = DQuat::from_rotation_y(PI / 3.0) * DQuat::from_rotation_x(0.4);
    let (steps, dt) = (12_000, 1e-3);
    let mut s = Scratch { acceleration: vec![DVec3::ZERO; n], ..Scratch::default() };
    let held = |i: usize| {
        let t = (i as f64 / steps as f64 * 6.0).min(1.0);
        Clamp { anchor: DVec3::ZERO, rotation: DQuat::IDENTITY.slerp(turn, t) }
    };
    for i in 0..steps {
        rod.step(dt, [held(i), held(i + 1)], 0.01, &mut s, |_, _, _| {});
        for v in rod.v.iter_mut().chain(&mut rod.w) {
            *v *= 0.99;
        }
    }
    for k in 0..n {
        let expected = turn * start[k];
        assert!(rod.x[k].distance(expected) < 1e-3, "segment {k}: {} for {expected}", rod.x[k]);
    }
}

#[test]
fn joints_stay_together_in_violent_motion() {
    let n = 30;
    let mut rod = straight(n, 300.0, DVec3::NEG_Y, 1.18e9);
    let mut s = Scratch { acceleration: vec![DVec3::NEG_Y * GRAVITY; n], ..Scratch::default() };
    let dt = 1.25e-3;
    // 40 mm to either side four times a second: up to 2.6 g at the root.
    let at = |t: f64| Clamp { anchor: DVec3::X * (40.0 * (TAU * 4.0 * t).sin()), rotation: DQuat::IDENTITY };
    let (mut open, mut fastest) = (0.0f64, 0.0f64);
    for i in 0..1600 {
        let t = f64::from(i) * dt;
        rod.step(dt, [at(t), at(t + dt)], 0.004, &mut s, |_, _, _| {});
        for k in 1..n {
            let inner = rod.end(k - 1);
            let outer = rod.x[k] - rod.tangent(k) * (0.5 * rod.length_mm[k]);
            open = open.max(inner.distance(outer));
            fastest = fastest.max(rod.w[k].length());
        }
    }
    // Linearised over a step, a segment that turns by φ leaves a gap of about l φ² / 2, twice at a joint.
    let turn = fastest * dt;
    assert!(open < 10.0 * turn * turn, "{open} mm at {fastest} rad/s");
    assert!(fastest > 5.0 && fastest < 500.0, "{fastest} rad/s");
}
