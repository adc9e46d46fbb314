//! Where hair is combed to, and what it must go around.

use super::noise::ramp;
use crate::head::Head;
use crate::spec::{Fringe, Parting, StyleSpec};
use glam::Vec3;

/// Places on a head of reference breadth, mm: where a parting meets the forehead and where it ends, and the
/// whorl at the crown.
const PART_FRONT_Z: f32 = 84.0;
const PART_END_Z: f32 = -44.0;
const CROWN: Vec3 = Vec3::new(0.0, 66.0, -62.0);

/// Radius of the head about the axis through the ears, mm, for lengths along the forehead and the top.
const VAULT_MM: f32 = 96.0;

/// Width (mm) to either side of the fringe's border over which hair turns forward.
const FRINGE_BLEND_MM: f32 = 9.0;

/// Angle between hair and the radius from the whorl at its centre.
const SPIRAL_RAD: f32 = 1.2;

/// Combing as a direction on the scalp.
pub(crate) struct Comb {
    parting: Parting,
    direction: Vec3,
    part_x: f32,
    scale: f32,
    sweep_back: f32,
    whorl_rad: f32,
    face_window: f32,
    fringe: Option<Fringe>,
    /// Angle of the hairline over the forehead about the axis through the ears, from +z up.
    hairline_rad: f32,
}

impl Comb {
    pub fn new(style: &StyleSpec, fringe: Option<Fringe>, head: &Head) -> Comb {
        let part_x = match style.parting {
            Parting::None | Parting::Centre => 0.0,
            Parting::Left => style.part_offset_mm,
            Parting::Right => -style.part_offset_mm,
        };
        let hairline = head.front_hairline();
        Comb {
            parting: style.parting,
            direction: Vec3::from_array(style.comb).normalize_or(Vec3::NEG_Z),
            part_x,
            scale: head.scale(),
            sweep_back: style.sweep_back,
            whorl_rad: style.whorl_deg.to_radians(),
            face_window: style.face_window_mm * head.scale(),
            fringe,
            hairline_rad: libm::atan2f(hairline.y, hairline.z),
        }
    }

    /// Nearest point of the parting, in the plane seen from above: it runs from the forehead to before the
    /// crown, bending to the middle there, and no comb draws it straighter than a millimetre or two.
    fn nearest_on_part(&self, p: Vec3) -> (f32, f32) {
        let (front, back) = (PART_FRONT_Z * self.scale, PART_END_Z * self.scale);
        let z = p.z.clamp(back, front);
        let t = ((z - back) / (front - back)).clamp(0.0, 1.0);
        let ragged = 0.8 * libm::sinf(z * 0.41 + 1.0) + 0.7 * libm::sinf(z * 0.93);
        (self.part_x * ramp(t, 0.0, 0.45) + ragged * self.scale, z)
    }

    /// Direction of combing beside and behind a parting, from above: outward and back at the forehead, more
    /// and more along the parting towards its end, where both sides run together to the back. So the hair of a
    /// parting's end covers the crown behind it.
    fn beside_part(&self, p: Vec3) -> Vec3 {
        let k = self.scale;
        let (x, z) = self.nearest_on_part(p);
        let t = (z - PART_END_Z * k) / ((PART_FRONT_Z - PART_END_Z) * k);
        let outward = (p.x - x).abs() + 10.0 * k * ramp(t, 0.0, 0.35);
        let back = k * (14.0 + 20.0 * (1.0 - ramp(t, 0.0, 0.5))) + (z - p.z).max(0.0);
        let side = Vec3::X * if p.x >= x { 1.0 } else { -1.0 };
        let way = (side * outward + Vec3::NEG_Z * back).normalize_or(side);
        // In front of the parting hair goes sideways, or it would fall over the face.
        let ahead = ramp(p.z, z, 12.0);
        (way * (1.0 - ahead) + side * ahead).normalize_or(side)
    }

    /// Combing without a parting: one direction, from a spiral at the crown if hair is combed forward.
    fn without_part(&self, p: Vec3, normal: Vec3) -> Vec3 {
        let crown = CROWN * self.scale;
        // Behind the crown everything falls back and down.
        let behind = ramp(crown.z - p.z, -10.0, 40.0);
        let combed = self.direction * (1.0 - behind) + Vec3::NEG_Z * behind;
        let near = ramp(self.direction.z, 0.0, 0.3) * (1.0 - ramp(p.distance(crown), 8.0, 34.0 * self.scale));
        if near == 0.0 {
            return combed;
        }
        let radial = p - crown;
        let radial = (radial - normal * radial.dot(normal)).normalize_or(combed);
        let a = SPIRAL_RAD * (1.0 - 0.5 * ramp(p.distance(crown), 0.0, 34.0 * self.scale));
        let spiral = radial * libm::cosf(a) + normal.cross(radial) * libm::sinf(a);
        combed * (1.0 - near) + spiral * near
    }

    /// Unit direction of combing at a point of the scalp with this outward normal, tangent to it.
    pub fn at(&self, p: Vec3, normal: Vec3) -> Vec3 {
        let tangent = |v: Vec3| v - normal * v.dot(normal);
        // Hair runs down where the head is steep, whatever way it was combed on the top.
        let steep = 1.0 - normal.y.max(0.0);
        let swept = if self.parting == Parting::None {
            self.without_part(p, normal)
        } else {
            let front = ramp(p.z, -10.0 * self.scale, 70.0 * self.scale);
            self.beside_part(p) + Vec3::NEG_Z * (self.sweep_back * front)
        };
        let mut out = tangent(swept + Vec3::NEG_Y * (0.25 + 1.2 * steep)).normalize_or(tangent(Vec3::NEG_Y));
        // The whorl turns what is near the crown.
        let near = 1.0 - ramp(p.distance(CROWN * self.scale), 0.0, 55.0 * self.scale);
        if near > 0.0 && self.whorl_rad != 0.0 {
            let a = self.whorl_rad * near;
            out = out * libm::cosf(a) + normal.cross(out) * libm::sinf(a);
        }
        out.normalize_or(Vec3::NEG_Y)
    }

    /// How far (mm) inside the fringe a root lies, negative outside; `None` without a fringe.
    pub fn fringe_mm(&self, root: Vec3) -> Option<f32> {
        let f = self.fringe?;
        let depth = f.depth_mm * (1.0 - root.x.abs() / f.half_width_mm);
        Some(depth - self.behind_hairline_mm(root))
    }

    /// How far (mm) over the vault of the head a root lies behind the hairline of the forehead.
    pub fn behind_hairline_mm(&self, root: Vec3) -> f32 {
        (libm::atan2f(root.y, root.z) - self.hairline_rad) * VAULT_MM * self.scale
    }

    /// Share (0..1) to which the hair of a root is combed forward into the fringe: the border is combed half
    /// forward, or it would part.
    pub fn forward(&self, root: Vec3) -> f32 {
        self.fringe_mm(root).map_or(0.0, |d| ramp(d, -FRINGE_BLEND_MM, 2.0 * FRINGE_BLEND_MM))
    }

    /// Combing at a point, for hair that is combed forward to this share.
    pub fn toward(&self, p: Vec3, normal: Vec3, forward: f32) -> Vec3 {
        let out = self.at(p, normal);
        if forward == 0.0 {
            return out;
        }
        let f = Vec3::new(0.12 * (p.x / 40.0).clamp(-1.0, 1.0), -0.5, 1.0);
        let f = (f - normal * f.dot(normal)).normalize_or(out);
        (out * (1.0 - forward) + f * forward).normalize_or(f)
    }

    /// Distance (mm) from the line of the parting, seen from above; infinite without one.
    #[cfg(test)]
    pub fn part_distance_mm(&self, p: Vec3) -> f32 {
        if self.parting == Parting::None {
            return f32::INFINITY;
        }
        let (x, z) = self.nearest_on_part(p);
        libm::hypotf(p.x - x, p.z - z)
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
        if self.parting == Parting::None || p.z < PART_END_Z * self.scale {
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
            let comb = Comb::new(&StyleSpec { parting, whorl_deg: 0.0, ..StyleSpec::default() }, None, &head);
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

    #[test]
    fn a_fringe_parts_from_nothing() {
        let head = Head::new(155.0);
        let fringe = Fringe { length_mm: 50.0, half_width_mm: 66.0, depth_mm: 44.0 };
        let style = StyleSpec { whorl_deg: 0.0, ..StyleSpec::default() };
        let comb = Comb::new(&style, Some(fringe), &head);
        let roots = head.scalp().roots(3000, 1.0, &[4], 3);
        let (mut inside, mut border) = (0, 0);
        for r in &roots {
            let d = comb.fringe_mm(r.position).expect("there is a fringe");
            let way = comb.toward(r.position, r.normal, comb.forward(r.position));
            if d > FRINGE_BLEND_MM {
                inside += 1;
                assert!(way.z > 0.0, "{:?} is combed {way}", r.position);
            } else if d < -FRINGE_BLEND_MM {
                assert_eq!(way, comb.at(r.position, r.normal));
            }
            // Beside the border and away from the parting the field turns by less than a quarter turn in 5 mm.
            if d.abs() < FRINGE_BLEND_MM && r.position.x.abs() > 12.0 {
                for o in roots.iter().filter(|o| o.position.distance(r.position) < 5.0) {
                    border += 1;
                    let other = comb.toward(o.position, o.normal, comb.forward(o.position));
                    assert!(way.dot(other) > 0.0, "{:?} {way}, {:?} {other}", r.position, o.position);
                }
            }
        }
        assert!(inside > 60 && border > 200, "{inside} inside, {border} pairs at the border");
    }

    #[test]
    fn a_whorl_is_a_spiral_that_turns_one_way() {
        let head = Head::new(155.0);
        let style = StyleSpec {
            parting: Parting::None,
            comb: [0.0, 0.0, 1.0],
            whorl_deg: 0.0,
            ..StyleSpec::default()
        };
        let comb = Comb::new(&style, None, &head);
        for r in head.scalp().roots(20_000, 1.0, &[6], 1) {
            let away = r.position - CROWN;
            let away = away - r.normal * away.dot(r.normal);
            if (3.0..12.0).contains(&away.length()) && r.position.distance(CROWN) < 20.0 {
                let way = comb.at(r.position, r.normal);
                let turn = r.normal.dot(away.cross(way)) / away.length();
                assert!(turn > 0.5, "{:?}: {turn}", r.position);
                assert!(way.dot(away) > 0.0, "{:?} is combed into the whorl", r.position);
            }
        }
    }
}
