//! Patch optimisation: depth and normal that agree best with the views (3.1.3 of the paper).

use super::photo::Window;
use super::view::View;
use super::{Patch, PatchStereo, bits};
use glam::{DVec2, DVec3};

/// First steps of the search: pixels of disparity, and radians of either angle.
const STEP_PX: f64 = 0.7;
const STEP_RAD: f64 = 0.25;
/// Most evaluations of the objective.
const MOST_EVALUATIONS: usize = 90;
/// Spread of the objective over the simplex at which the search ends.
const SPREAD: f64 = 1e-4;
/// Cost of a view that a patch leaves, of one without texture, and of a patch that turns away: that of the worst match.
const WORST: f64 = 2.0;

/// A patch's window and the views it is compared in.
pub(super) struct Matching<'a> {
    views: &'a [View],
    window: Window<'a>,
    p: &'a PatchStereo,
}

impl<'a> Matching<'a> {
    /// `None` where the window of the patch in its reference view leaves the image or has no texture.
    pub fn new(views: &'a [View], patch: &Patch, p: &'a PatchStereo) -> Option<Matching<'a>> {
        let (pixel, _) = views[patch.reference].camera.project(patch.centre)?;
        Some(Matching { views, window: Window::new(views, patch.reference, pixel, p.window_px)?, p })
    }

    /// 1 - NCC with each view of a set, the reference view's being 0; and the set of those at most `limit`.
    pub fn agreeing(&self, patch: &Patch, of: u32, limit: f64) -> u32 {
        bits(of)
            .filter(|&v| v == patch.reference || self.cost(v, patch.centre, patch.normal) <= limit)
            .fold(0, |set, v| set | 1 << v)
    }

    fn cost(&self, view: usize, centre: DVec3, normal: DVec3) -> f64 {
        self.window.ncc(view, centre, normal).map_or(WORST, |n| 1.0 - f64::from(n))
    }

    /// Mean of 1 - NCC over a set's views other than the reference (Eq. 1).
    pub fn mean_cost(&self, of: u32, centre: DVec3, normal: DVec3) -> f64 {
        let (mut sum, mut n) = (0.0, 0.0);
        for v in bits(of).filter(|&v| v != self.window.reference) {
            sum += self.cost(v, centre, normal);
            n += 1.0;
        }
        if n > 0.0 { sum / n } else { WORST }
    }

    /// Moves the centre along the reference view's ray and turns the normal until [`Matching::mean_cost`] over the
    /// views that agree now is least.
    pub fn refine(&self, patch: &mut Patch) {
        let view = &self.views[patch.reference];
        let ray = view.camera.ray_direction(self.window.pixel);
        let depth = view.camera.to_camera(patch.centre).z;
        let Some(step_mm) = self.pixel_step_mm(patch, ray) else { return };
        let (longitude, latitude) = angles(view.camera.camera_from_world * patch.normal);
        let least = self.p.angle_deg.to_radians().cos();
        let place = |x: &[f64; 3]| {
            let centre = view.centre + ray * (depth + x[0] * step_mm);
            let normal =
                view.camera.camera_from_world.transpose() * normal_of(longitude + x[1], latitude + x[2]);
            (centre, normal)
        };
        let objective = |x: &[f64; 3]| {
            let (centre, normal) = place(x);
            if depth + x[0] * step_mm <= 0.0 || normal.dot(view.towards(centre)) < least {
                return WORST;
            }
            self.mean_cost(patch.agreeing, centre, normal)
        };
        let best = simplex(objective, [STEP_PX, STEP_RAD, STEP_RAD]);
        (patch.centre, patch.normal) = place(&best);
    }

    /// Depth along the ray that moves the patch by a pixel in the other agreeing views, on average.
    fn pixel_step_mm(&self, patch: &Patch, ray: DVec3) -> Option<f64> {
        let (mut sum, mut n) = (0.0, 0.0);
        for v in bits(patch.agreeing).filter(|&v| v != patch.reference) {
            let at =
                |t: f64| -> Option<DVec2> { Some(self.views[v].camera.project(patch.centre + ray * t)?.0) };
            sum += at(0.5)?.distance(at(-0.5)?);
            n += 1.0;
        }
        (sum > 0.0).then(|| n / sum)
    }
}

/// Angles of a unit vector in camera coordinates that faces the camera: 0, 0 is straight at it.
fn angles(n: DVec3) -> (f64, f64) {
    (libm::atan2(n.x, -n.z), libm::asin(n.y.clamp(-1.0, 1.0)))
}

fn normal_of(longitude: f64, latitude: f64) -> DVec3 {
    let ((sa, ca), (sb, cb)) = (libm::sincos(longitude), libm::sincos(latitude));
    DVec3::new(sa * cb, sb, -ca * cb)
}

/// The minimiser of Nelder and Mead 1965 from zero, with their coefficients.
fn simplex(f: impl Fn(&[f64; 3]) -> f64, steps: [f64; 3]) -> [f64; 3] {
    let mut corners: Vec<(f64, [f64; 3])> = vec![(f(&[0.0; 3]), [0.0; 3])];
    for a in 0..3 {
        let mut x = [0.0; 3];
        x[a] = steps[a];
        corners.push((f(&x), x));
    }
    let mut evaluations = 4;
    loop {
        corners.sort_by(|a, b| a.0.total_cmp(&b.0));
        if corners[3].0 - corners[0].0 <= SPREAD || evaluations >= MOST_EVALUATIONS {
            return corners[0].1;
        }
        let middle: [f64; 3] =
            std::array::from_fn(|a| corners[..3].iter().map(|c| c.1[a]).sum::<f64>() / 3.0);
        let worst = corners[3].1;
        let along = |t: f64| -> [f64; 3] { std::array::from_fn(|a| middle[a] + t * (worst[a] - middle[a])) };
        let try_at = |t: f64| {
            let x = along(t);
            (f(&x), x)
        };
        let reflected = try_at(-1.0);
        evaluations += 1;
        if reflected.0 < corners[0].0 {
            let expanded = try_at(-2.0);
            evaluations += 1;
            corners[3] = if expanded.0 < reflected.0 { expanded } else { reflected };
        } else if reflected.0 < corners[2].0 {
            corners[3] = reflected;
        } else {
            let contracted = try_at(if reflected.0 < corners[3].0 { -0.5 } else { 0.5 });
            evaluations += 1;
            if contracted.0 < corners[3].0.min(reflected.0) {
                corners[3] = contracted;
            } else {
                let best = corners[0].1;
                for c in &mut corners[1..] {
                    c.1 = std::array::from_fn(|a| 0.5 * (best[a] + c.1[a]));
                    c.0 = f(&c.1);
                }
                evaluations += 3;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_simplex_finds_the_bottom_of_a_bowl() {
        let bottom = [0.4, -0.1, 0.2];
        let f = |x: &[f64; 3]| {
            let d: [f64; 3] = std::array::from_fn(|a| x[a] - bottom[a]);
            d[0] * d[0] + 2.0 * d[1] * d[1] + 0.5 * d[2] * d[2] + 0.3 * d[0] * d[1]
        };
        let x = simplex(f, [0.7, 0.25, 0.25]);
        // It ends when the values differ by 1e-4: a distance of 0.02 along the flattest axis.
        assert!(f(&x) < 2e-4, "{x:?}");
    }

    #[test]
    fn angles_and_normals_are_each_others_inverse() {
        for n in
            [DVec3::NEG_Z, DVec3::new(0.3, -0.5, -0.7).normalize(), DVec3::new(-0.8, 0.1, -0.2).normalize()]
        {
            let (a, b) = angles(n);
            assert!(normal_of(a, b).distance(n) < 1e-12);
        }
    }
}
