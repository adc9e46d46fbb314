//! Which lines a part of a tree of segments can hold: the smallest angle that any of them may have with a given line.

use glam::Vec3;
use strandbench_types::nearest::Tree;

/// Lines within an angle of an axis; the axis has no sign.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cone {
    /// Unit; zero in a cone that holds every line.
    axis: Vec3,
    /// Cosine of the angle.
    cos: f32,
}

/// Added to angles, which covers the rounding of 32-bit axes and cosines (some 1e-7, magnified near 0° to the root of it).
const SIN_MARGIN: f32 = 1e-3;
const COS_MARGIN: f32 = 1.0 - 0.5e-6;

const ALL: Cone = Cone { axis: Vec3::ZERO, cos: 0.0 };

impl Cone {
    fn of(line: Vec3) -> Cone {
        match line.try_normalize() {
            Some(axis) => Cone { axis, cos: COS_MARGIN },
            None => ALL,
        }
    }

    fn join(self, other: Cone) -> Cone {
        if self.axis == Vec3::ZERO || other.axis == Vec3::ZERO {
            return ALL;
        }
        let turned = if self.axis.dot(other.axis) < 0.0 { -other.axis } else { other.axis };
        let Some(axis) = (self.axis + turned).try_normalize() else { return ALL };
        // Cosine and sine of the sum of the angle to an axis and its cone's; both are less than a right angle.
        let sine = |cos: f32| (1.0 - cos * cos).max(0.0).sqrt();
        let reach = |of: Vec3, cone: Cone| {
            let to = axis.dot(of).clamp(0.0, 1.0);
            let (sin_to, sin) = (sine(to), sine(cone.cos));
            (to * cone.cos - sin_to * sin, sin_to * cone.cos + to * sin)
        };
        let [a, b] = [reach(self.axis, self), reach(turned, other)];
        let (cos, sin) = if a.0 < b.0 { a } else { b };
        let cos = cos * COS_MARGIN - sin * SIN_MARGIN;
        if cos <= 0.0 { ALL } else { Cone { axis, cos } }
    }

    /// Squared cosine that no line of the cone exceeds with the unit line `t`.
    pub fn most_cos2(self, t: Vec3) -> f64 {
        let c = self.axis.dot(t).abs().min(1.0);
        if self.axis == Vec3::ZERO || c >= self.cos {
            return 1.0;
        }
        // cos(a - b), a being the angle to the axis and b the cone's.
        let most = c * self.cos + ((1.0 - c * c) * (1.0 - self.cos * self.cos)).sqrt();
        f64::from(most * most)
    }
}

/// The cone of every node of a tree whose members have the given lines, by rank.
pub(super) fn cones(tree: &Tree, line: impl Fn(usize) -> Vec3 + Sync) -> Vec<Cone> {
    tree.fold(
        ALL,
        |ranks| ranks.map(|r| Cone::of(line(r))).reduce(Cone::join).unwrap_or(ALL),
        |a, b| a.join(*b),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use strandbench_rng::Rng;

    proptest! {
        #[test]
        fn no_line_of_a_tree_is_nearer_than_its_cones_say(seed in any::<u64>(), n in 1..120usize, spread in 0.0f32..1.5) {
            let mut rng = Rng::keyed(&[seed]);
            let mut vector = |by: f32| Vec3::new(rng.range(-by, by), rng.range(-by, by), rng.range(-by, by));
            let main = vector(1.0) + Vec3::splat(0.01);
            let lines: Vec<Vec3> = (0..n).map(|_| main + vector(spread)).collect();
            let places: Vec<Vec3> = (0..n).map(|_| vector(50.0)).collect();
            let t = (vector(1.0) + Vec3::splat(0.001)).normalize();
            let (tree, order) = Tree::new(n, |i| [places[i]; 2]);
            let line = |rank: usize| lines[order[rank] as usize] * if rank.is_multiple_of(2) { 1.0 } else { -1.0 };
            let all = cones(&tree, line);
            // The root holds every member.
            for l in &lines {
                let cos2 = f64::from(l.dot(t)).powi(2) / f64::from(l.length_squared());
                prop_assert!(cos2 <= all[0].most_cos2(t), "{cos2} against {}", all[0].most_cos2(t));
            }
            let found = tree.fold(
                0.0,
                |ranks| ranks.map(|r| f64::from(line(r).normalize().dot(t)).powi(2)).fold(0.0, f64::max),
                |a, b| a.max(*b),
            );
            for (node, best) in found.iter().enumerate() {
                prop_assert!(*best <= all[node].most_cos2(t) , "node {node}");
            }
        }
    }

    #[test]
    fn a_cone_of_lines_that_run_alike_is_narrow_and_forgets_their_sign() {
        let tree = Tree::new(6, |i| [Vec3::splat(i as f32); 2]).0;
        let all = cones(&tree, |r| {
            Vec3::new(1.0, 0.02 * r as f32, 0.0) * if r.is_multiple_of(2) { 1.0 } else { -1.0 }
        });
        assert!(all[0].most_cos2(Vec3::Y) < 0.2_f64.sin().powi(2), "{}", all[0].most_cos2(Vec3::Y));
        assert_eq!(all[0].most_cos2(Vec3::X), 1.0);
    }
}
