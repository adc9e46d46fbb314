//! What the head and the air do, as functions of time.

use super::body::HeadTurn;
use crate::spec::{HeadDrive, MotionSpec, Swing, WindSpec};
use glam::{DQuat, DVec3};
use strandbench_rng::Rng;

/// Time in which wind comes up and dies down, s.
const WIND_RAMP_S: f64 = 0.5;

/// Frequencies of gusts, Hz, spread over two octaves either side of 1 Hz, where hair answers.
const GUST_HZ: [f64; 6] = [0.31, 0.53, 0.87, 1.3, 2.1, 3.7];

/// Rest to rest over 0..1 with the least jerk.
fn least_jerk(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * t * (10.0 + t * (6.0 * t - 15.0))
}

fn swing_deg(s: &Swing, t: f64) -> f64 {
    let phase = (t - s.start_s) * s.frequency_hz;
    if phase <= 0.0 || phase >= s.cycles {
        return 0.0;
    }
    // Grows in the first half cycle and fades in the last.
    let envelope = least_jerk(2.0 * phase) * least_jerk(2.0 * (s.cycles - phase));
    s.amplitude_deg * envelope * libm::sin(std::f64::consts::TAU * phase)
}

/// Rotation about an axis of the world.
fn about(axis: DVec3, deg: f64) -> DQuat {
    let half = 0.5 * deg.to_radians();
    let v = axis * libm::sin(half);
    DQuat::from_xyzw(v.x, v.y, v.z, libm::cos(half))
}

/// The head at a time (s).
pub(super) fn head(motion: &MotionSpec, t: f64) -> HeadTurn {
    let rotation = match &motion.head {
        HeadDrive::Still => DQuat::IDENTITY,
        HeadDrive::Shake(s) => about(DVec3::Y, swing_deg(s, t)),
        HeadDrive::Nod(s) => about(DVec3::X, swing_deg(s, t)),
        HeadDrive::Turn { angle_deg, duration_s, start_s } => {
            about(DVec3::Y, angle_deg * least_jerk((t - start_s) / duration_s))
        }
        HeadDrive::Flick { forward_deg, back_deg, duration_s, start_s } => {
            let part = |k: f64| least_jerk((t - start_s) / duration_s - k);
            // The chin goes down, the head is thrown back in half that time, and comes upright.
            let thrown = least_jerk(((t - start_s) / duration_s - 1.0) * 2.0);
            about(
                DVec3::X,
                forward_deg * part(0.0) - (forward_deg + back_deg) * thrown + back_deg * part(1.8),
            )
        }
    };
    HeadTurn { rotation }
}

/// The air's velocity as a function of place and time: gusts are carried by the mean wind without change
/// (Taylor's frozen turbulence).
pub(super) struct Wind {
    spec: Option<WindSpec>,
    /// Direction that it blows to, and across it.
    along: DVec3,
    across: DVec3,
    phases: [[f64; 2]; GUST_HZ.len()],
}

impl Wind {
    pub fn new(spec: Option<WindSpec>, seed: u64) -> Wind {
        let from = spec.map_or(0.0, |w| w.from_deg.to_radians());
        let along = -DVec3::new(libm::sin(from), 0.0, libm::cos(from));
        let mut rng = Rng::keyed(&[seed]);
        let phases = std::array::from_fn(|_| std::array::from_fn(|_| std::f64::consts::TAU * rng.f64()));
        Wind { spec, along, across: DVec3::Y.cross(along), phases }
    }

    /// Velocity far from the head, mm/s.
    pub fn at(&self, p: DVec3, t: f64) -> DVec3 {
        let Some(w) = &self.spec else { return DVec3::ZERO };
        let strength =
            least_jerk((t - w.start_s) / WIND_RAMP_S) * (1.0 - least_jerk((t - w.end_s) / WIND_RAMP_S));
        if strength == 0.0 || w.speed_m_s == 0.0 {
            return DVec3::ZERO;
        }
        let mean = w.speed_m_s * 1e3;
        let carried = t - p.dot(self.along) / mean;
        // A sum of n sines of unit amplitude has variance n / 2.
        let unit = libm::sqrt(2.0 / GUST_HZ.len() as f64);
        let sum = |k: usize| -> f64 {
            GUST_HZ
                .iter()
                .zip(&self.phases)
                .map(|(f, phase)| libm::sin(std::f64::consts::TAU * f * carried + phase[k]))
                .sum::<f64>()
                * unit
        };
        let gusts = if w.gusts > 0.0 { [sum(0), sum(1)] } else { [0.0; 2] };
        (self.along * (1.0 + w.gusts * gusts[0]) + self.across * (0.5 * w.gusts * gusts[1]))
            * (mean * strength)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn angle(motion: &MotionSpec, t: f64) -> f64 {
        let q = head(motion, t).rotation;
        2.0 * libm::asin(if q.w < 0.0 { -1.0 } else { 1.0 } * (q.x + q.y)).to_degrees()
    }

    #[test]
    fn every_motion_begins_and_ends_at_rest_and_reaches_what_it_states() {
        let swing = Swing { amplitude_deg: 25.0, frequency_hz: 1.5, cycles: 3.0, start_s: 0.2 };
        let turn = HeadDrive::Turn { angle_deg: 50.0, duration_s: 0.6, start_s: 0.2 };
        let flick = HeadDrive::Flick { forward_deg: 30.0, back_deg: 15.0, duration_s: 0.5, start_s: 0.2 };
        for (drive, low, high, last) in [
            (HeadDrive::Shake(swing), -25.0, 25.0, 0.0),
            (HeadDrive::Nod(swing), -25.0, 25.0, 0.0),
            (turn, 0.0, 50.0, 50.0),
            (flick, -15.0, 30.0, 0.0),
        ] {
            let m = MotionSpec { frames: 1, head: drive, wind: None, solver: Default::default() };
            let samples: Vec<f64> = (0..40_000).map(|i| angle(&m, f64::from(i) * 1e-4)).collect();
            let least = samples.iter().copied().fold(f64::INFINITY, f64::min);
            let most = samples.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            assert!((least - low).abs() < 0.5 && (most - high).abs() < 0.5, "{drive:?}: {least} to {most}");
            assert!(samples[..2000].iter().all(|a| *a == 0.0), "{drive:?}");
            assert!((samples[39_999] - last).abs() < 1e-9, "{drive:?}");
            // Least-jerk pieces have bounded acceleration: no step in velocity.
            for w in samples.windows(3) {
                let acceleration = (w[0] - 2.0 * w[1] + w[2]) * 1e8;
                assert!(acceleration.abs() < 2e4, "{drive:?}: {acceleration} deg/s²");
            }
        }
    }

    #[test]
    fn wind_blows_away_from_where_it_comes_and_gusts_have_their_spread() {
        let spec = WindSpec { speed_m_s: 3.0, from_deg: 90.0, gusts: 0.0, start_s: 1.0, end_s: 1e9 };
        let wind = Wind::new(Some(spec), 7);
        assert_eq!(wind.at(DVec3::ZERO, 1.0), DVec3::ZERO);
        assert!(wind.at(DVec3::ZERO, 1.6).distance(DVec3::new(-3000.0, 0.0, 0.0)) < 1e-6);
        let wind = Wind::new(Some(WindSpec { gusts: 0.4, ..spec }), 7);
        let n = 200_000;
        let speeds: Vec<f64> =
            (0..n).map(|i| -wind.at(DVec3::ZERO, 2.0 + f64::from(i) * 0.01).x / 3000.0).collect();
        let mean = speeds.iter().sum::<f64>() / f64::from(n);
        let sd = (speeds.iter().map(|s| (s - mean) * (s - mean)).sum::<f64>() / f64::from(n)).sqrt();
        // Over 2000 s each sine has hundreds of periods: its mean is below 1 / (2π f T) of its amplitude.
        assert!((mean - 1.0).abs() < 2e-3 && (sd - 0.4).abs() < 4e-3, "{mean} {sd}");
    }
}
