//! Where hair is combed to, and what it must go around.

use super::noise::ramp;
use crate::head::Head;
use crate::spec::{Parting, StyleSpec};
use glam::Vec3;

/// Places on a head of reference breadth, mm: where a parting meets the forehead, and the whorl at the crown.
const PART_FRONT_Z: f32 = 84.0;
const CROWN: Vec3 = Vec3::new(0.0, 66.0, -62.0);

/// Combing as a direction on the scalp.
pub(crate) struct Comb {
    parting: Parting,
    direction: Vec3,
    part_x: f32,
    scale: f32,
    sweep_back: f32,
    whorl_rad: f32,
    face_window: f32,
}

impl Comb {
    pub fn new(style: &StyleSpec, head: &Head) -> Comb {
        let part_x = match style.parting {
            Parting::None | Parting::Centre => 0.0,
            Parting::Left => style.part_offset_mm,
            Parting::Right => -style.part_offset_mm,
        };
        Comb {
            parting: style.parting,
            direction: Vec3::from_array(style.comb).normalize_or(Vec3::NEG_Z),
            part_x,
            scale: head.scale(),
            sweep_back: style.sweep_back,
            whorl_rad: style.whorl_deg.to_radians(),
            face_window: style.face_window_mm * head.scale(),
        }
    }

    /// Nearest point of the parting, in the plane seen from above: it runs from the forehead to the crown,
    /// bending to the middle there.
    fn nearest_on_part(&self, p: Vec3) -> (f32, f32) {
        let (front, back) = (PART_FRONT_Z * self.scale, CROWN.z * self.scale);
        let z = p.z.clamp(back, front);
        let t = ((z - back) / (front - back)).clamp(0.0, 1.0);
        (self.part_x * ramp(t, 0.0, 0.45), z)
    }

    /// Unit direction of combing at a point of the scalp with this outward normal, tangent to it.
    pub fn at(&self, p: Vec3, normal: Vec3) -> Vec3 {
        let tangent = |v: Vec3| v - normal * v.dot(normal);
        // Hair runs down where the head is steep, whatever way it was combed on the top.
        let steep = 1.0 - normal.y.max(0.0);
        let crown = CROWN * self.scale;
        let aside = match self.parting {
            Parting::None => {
                // Behind the crown everything falls back and down.
                let behind = ramp(crown.z - p.z, -10.0, 40.0);
                self.direction * (1.0 - behind) + Vec3::NEG_Z * behind
            }
            _ => {
                let (x, z) = self.nearest_on_part(p);
                let away = Vec3::new(p.x - x, 0.0, p.z - z);
                let away = away.normalize_or(Vec3::NEG_Z);
                // In front of the parting's end hair goes sideways too, or it would fall over the face.
                let ahead = ramp(p.z, z, 12.0);
                let side = Vec3::X * if p.x >= x { 1.0 } else { -1.0 };
                (away * (1.0 - ahead) + side * ahead).normalize_or(side)
            }
        };
        let front = ramp(p.z, -10.0 * self.scale, 70.0 * self.scale);
        let swept = if self.parting == Parting::None {
            aside
        } else {
            aside + Vec3::NEG_Z * (self.sweep_back * front)
        };
        let mut out = tangent(swept + Vec3::NEG_Y * (0.25 + 1.2 * steep)).normalize_or(tangent(Vec3::NEG_Y));
        // The whorl turns what is near the crown.
        let near = 1.0 - ramp(p.distance(crown), 0.0, 55.0 * self.scale);
        if near > 0.0 && self.whorl_rad != 0.0 {
            let a = self.whorl_rad * near;
            out = out * libm::cosf(a) + normal.cross(out) * libm::sinf(a);
        }
        out.normalize_or(Vec3::NEG_Y)
    }

    /// Extra angle (radians) at which hair stands up beside the parting and about the crown.
    pub fn rise(&self, p: Vec3) -> f32 {
        let crown = 1.0 - ramp(p.distance(CROWN * self.scale), 5.0, 45.0 * self.scale);
        let part = match self.parting {
            Parting::None => 0.0,
            _ => {
                let (x, z) = self.nearest_on_part(p);
                1.0 - ramp(libm::hypotf(p.x - x, p.z - z), 0.0, 9.0)
            }
        };
        0.2 * crown.max(part)
    }

    /// Distance (mm) from where hair of this place would begin, at the parting or the whorl: waves of hairs
    /// that lie over each other are in step if phase counts from there.
    pub fn way_mm(&self, p: Vec3) -> f32 {
        let (x, z) = match self.parting {
            Parting::None => (CROWN.x * self.scale, CROWN.z * self.scale),
            _ => self.nearest_on_part(p),
        };
        let top = CROWN.y * self.scale + 15.0;
        p.distance(Vec3::new(x, top, z))
    }

    /// Which side of the parting a root is on: -1, 0 (no parting) or 1.
    pub fn side(&self, p: Vec3) -> i32 {
        if self.parting == Parting::None || p.z < CROWN.z * self.scale {
            return 0;
        }
        if p.x >= self.nearest_on_part(p).0 { 1 } else { -1 }
    }

    /// Depth inside the window in front of the face (mm, positive inside) and the way out of it, which lies
    /// in the frontal plane.
    pub fn face_window(&self, p: Vec3) -> Option<(f32, Vec3)> {
        if self.face_window <= 0.0 {
            return None;
        }
        let centre = Vec3::new(0.0, -52.0, 42.0) * self.scale;
        let radii = Vec3::new(self.face_window, 96.0 * self.scale, 95.0 * self.scale);
        let mut q = (p - centre) / radii;
        // In front of the face the window has no end.
        q.z = q.z.min(0.0);
        let size = q.length();
        // Hair below the chin hangs where it likes.
        if size >= 1.0 || p.y < -150.0 * self.scale {
            return None;
        }
        let out =
            Vec3::new(if p.x >= 0.0 { q.x.max(0.15) } else { q.x.min(-0.15) }, q.y * 0.4, q.z).normalize();
        Some(((1.0 - size) * radii.x, out))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn combing_is_tangent_and_leads_away_from_the_parting() {
        let head = Head::new(155.0);
        for (parting, offset) in [(Parting::Centre, 0.0f32), (Parting::Left, 28.0), (Parting::Right, -28.0)] {
            let comb = Comb::new(&StyleSpec { parting, whorl_deg: 0.0, ..StyleSpec::default() }, &head);
            for root in head.scalp().roots(800, 1.0, &[3], 3) {
                let d = comb.at(root.position, root.normal);
                assert!(d.dot(root.normal).abs() < 1e-3 && (d.length() - 1.0).abs() < 1e-3);
                let x = root.position.x - offset;
                if root.position.z > 0.0 && root.position.y > 50.0 && x.abs() > 3.0 {
                    assert!(d.x * x > 0.0, "{:?} {d}", root.position);
                }
            }
        }
    }
}
