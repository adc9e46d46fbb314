//! Why two renderers say different things of a ray: each disagreement is looked at in double precision.

use crate::referee::{Ray, Segment};
use glam::Vec3;

/// Impact over radius above which a ray grazes.
const GRAZE: f64 = 0.99;
/// Distances (mm) that single precision cannot tell apart at 400 mm, with a margin of ten units in the last place.
const TIE_MM: f64 = 3e-4;

/// What one renderer says of one ray.
#[derive(Clone, Copy, Debug)]
pub(super) struct Answer {
    pub t: f32,
    /// -1 for a miss.
    pub primitive: i32,
    pub normal: Vec3,
    pub position: Vec3,
}

/// Why two answers differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Reason {
    /// A fibre is grazed that one of them misses.
    Silhouette,
    /// Two segments of one strand share the surface.
    Joint,
    /// Two surfaces at one distance.
    Tie,
    /// The ray starts within a fibre or within rounding of its surface.
    Start,
    /// The hit lies on the sphere around an end of a segment, where it is not the hull's side.
    Cap,
    /// None of these.
    Unexplained,
}

impl Reason {
    pub fn name(self) -> &'static str {
        match self {
            Reason::Silhouette => "silhouette (impact above 0.99 of the radius)",
            Reason::Joint => "joint (neighbouring segments of a strand)",
            Reason::Tie => "tie (two surfaces within rounding)",
            Reason::Start => "start (origin in or on that fibre)",
            Reason::Cap => "cap (sphere around a segment's end)",
            Reason::Unexplained => "unexplained",
        }
    }
}

pub(super) struct Context<'a> {
    pub segments: &'a [Segment],
    /// Strand of each segment.
    pub strand: Vec<u32>,
}

impl Context<'_> {
    fn impact(&self, ray: &Ray, primitive: i32) -> f64 {
        usize::try_from(primitive).map_or(0.0, |i| self.segments[i].impact(ray))
    }

    fn on_a_cap(&self, ray: &Ray, a: &Answer) -> bool {
        // Beyond the segment's ends along its axis.
        usize::try_from(a.primitive).is_ok_and(|i| self.segments[i].beyond_an_end(ray, f64::from(a.t)))
    }

    /// Whether the ray starts in or on a segment or one of its neighbours: of overlapping neighbours Embree leaves
    /// out what lies within the other, so that such a ray may leave through both without meeting a front face.
    fn starts_inside(&self, ray: &Ray, primitive: i32) -> bool {
        let Ok(i) = usize::try_from(primitive) else { return false };
        let around = i.saturating_sub(1)..(i + 2).min(self.segments.len());
        around
            .filter(|&k| self.strand[k] == self.strand[i])
            .any(|k| self.segments[k].distance(ray.origin) < TIE_MM)
    }

    pub fn reason(&self, ray: &Ray, a: &Answer, b: &Answer) -> Reason {
        let nearer = if a.t <= b.t { a } else { b };
        if self.impact(ray, nearer.primitive) >= GRAZE {
            return Reason::Silhouette;
        }
        let neighbours = a.primitive >= 0
            && b.primitive >= 0
            && a.primitive.abs_diff(b.primitive) == 1
            && self.strand[a.primitive as usize] == self.strand[b.primitive as usize];
        let dt = f64::from((a.t - b.t).abs());
        if neighbours && dt < TIE_MM {
            return Reason::Joint;
        }
        if dt < TIE_MM {
            return Reason::Tie;
        }
        if self.starts_inside(ray, a.primitive) || self.starts_inside(ray, b.primitive) {
            return Reason::Start;
        }
        if self.on_a_cap(ray, nearer) {
            return Reason::Cap;
        }
        Reason::Unexplained
    }

    /// Why the two say different things of a shadow ray.
    pub fn shadow_reason(&self, ray: &Ray, tmax: f64) -> Reason {
        let mut grazed = false;
        let mut tied = false;
        for (i, s) in self.segments.iter().enumerate() {
            let impact = s.impact(ray);
            if impact > 1.0 / GRAZE {
                continue;
            }
            let Some(t) = s.entry(ray) else {
                grazed = true;
                continue;
            };
            if t.abs() < TIE_MM || (t - tmax).abs() < TIE_MM {
                tied = true;
            } else if t > 0.0 && t < tmax {
                if impact >= GRAZE {
                    grazed = true;
                } else if self.starts_inside(ray, i as i32) {
                    tied = true;
                } else {
                    // It is blocked beyond doubt: whoever says otherwise is wrong.
                    return Reason::Unexplained;
                }
            }
        }
        match (grazed, tied) {
            (true, _) => Reason::Silhouette,
            (_, true) => Reason::Start,
            _ => Reason::Unexplained,
        }
    }
}
