//! Drawings of the rig.

use super::data::Data;
use super::views::Axes;
use glam::{DVec2, DVec3, Vec3};
use std::fmt::Write as _;
use strandbench_scenes::AreaLight;
use strandbench_types::Rig;

/// What a drawing of a rig shows.
pub(crate) struct Drawn<'a> {
    pub rig: &'a Rig,
    pub lights: &'a [AreaLight],
    /// Points of the hair, and of the head.
    pub hair: &'a [Vec3],
    pub head: &'a [Vec3],
}

/// Top and side view of cameras, lights, hair and the working volume, as two SVGs.
pub(crate) fn rig_drawings(data: &Data) -> [String; 2] {
    let drawn = Drawn {
        rig: &data.truth.rig,
        lights: &data.render.lights,
        hair: &data.truth.strands.points,
        head: data.truth.head.as_ref().map_or(&[], |h| &h.vertices),
    };
    let [top, side, _] = drawings(&drawn);
    [top, side]
}

/// Seen from above, from the left and from behind the reference, as SVGs.
pub(crate) fn drawings(drawn: &Drawn<'_>) -> [String; 3] {
    let axes = Axes::of(drawn.rig);
    let top = |p: DVec3| DVec2::new(p.dot(axes.right), -p.dot(axes.forward));
    let side = |p: DVec3| DVec2::new(-p.dot(axes.forward), -p.y);
    let front = |p: DVec3| DVec2::new(p.dot(axes.right), -p.y);
    [
        draw_rig(drawn, &top, "seen from above"),
        draw_rig(drawn, &side, "seen from the left"),
        draw_rig(drawn, &front, "seen from behind the reference"),
    ]
}

fn draw_rig(drawn: &Drawn<'_>, flat: &dyn Fn(DVec3) -> DVec2, title: &str) -> String {
    let rig = drawn.rig;
    let mut body = String::new();
    let mut all: Vec<DVec2> = Vec::new();
    let mut names: Vec<(DVec2, &str)> = Vec::new();
    let reference = &rig.cameras[0];
    let corners = |camera: &strandbench_types::Camera, z: f64| {
        let (w, h) = (f64::from(camera.width), f64::from(camera.height));
        [(0.0, 0.0), (w, 0.0), (w, h), (0.0, h)].map(|(x, y)| camera.unproject(DVec2::new(x, y), z))
    };
    let volume: Vec<DVec2> =
        [rig.near_mm, rig.far_mm].iter().flat_map(|&z| corners(reference, z)).map(flat).collect();
    let hull = convex_hull(volume);
    let _ = write!(body, "<polygon class=\"volume\" points=\"{}\"/>", points(&hull));
    all.extend(&hull);
    for (class, places, most) in [("hair", drawn.hair, 2500), ("head", drawn.head, 1500)] {
        if places.is_empty() {
            continue;
        }
        let mut dots = String::new();
        for p in places.iter().step_by((places.len() / most).max(1)) {
            let q = flat(p.as_dvec3());
            let _ = write!(dots, "M{:.0} {:.0}h0", q.x, q.y);
            all.push(q);
        }
        let _ = write!(body, "<path class=\"{class}\" d=\"{dots}\"/>");
    }
    for light in drawn.lights {
        let (c, u, v) = (light.centre_mm, light.half_u_mm, light.half_v_mm);
        let outline =
            convex_hull([c + u + v, c + u - v, c - u - v, c - u + v].map(|p| flat(p.as_dvec3())).to_vec());
        let _ = write!(body, "<polygon class=\"light\" points=\"{}\"/>", points(&outline));
        all.extend(&outline);
    }
    for camera in &rig.cameras {
        let eye = camera.centre_mm();
        let outline =
            convex_hull(std::iter::once(eye).chain(corners(camera, 90.0)).map(flat).collect::<Vec<_>>());
        let aim = flat(camera.unproject(camera.principal_px, reference_distance(rig, camera)));
        let (e, name) = (flat(eye), &camera.name);
        let _ = write!(
            body,
            "<line class=\"aim\" x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\"/>\
             <polygon class=\"camera\" points=\"{}\"/>",
            e.x,
            e.y,
            aim.x,
            aim.y,
            points(&outline)
        );
        names.push((e, name));
        all.extend(&outline);
        all.push(e + DVec2::new(190.0, 60.0));
    }
    let low = all.iter().copied().reduce(DVec2::min).unwrap_or_default() - 40.0;
    let mut size = all.iter().copied().reduce(DVec2::max).unwrap_or_default() + 40.0 - low;
    // Text and scale bar keep their size on the page whatever the extent of the rig.
    let unit = size.max_element() / 40.0;
    size.y += 2.5 * unit;
    for (at, text) in stacked(names, unit) {
        let (x, y) = (at.x + 0.6 * unit, at.y + 1.1 * unit);
        let _ = write!(
            body,
            "<text class=\"label\" font-size=\"{unit:.1}\" x=\"{x:.1}\" y=\"{y:.1}\">{text}</text>"
        );
    }
    let (bar_x, bar_y) = (low.x + unit, low.y + size.y - unit);
    let _ = write!(
        body,
        "<path class=\"bar\" d=\"M{bar_x:.0} {bar_y:.0}h200\"/>\
         <text class=\"label\" font-size=\"{unit:.1}\" x=\"{bar_x:.0}\" y=\"{:.0}\">200 mm · {title}</text>",
        bar_y - 0.5 * unit
    );
    format!(
        "<svg class=\"rig\" viewBox=\"{:.0} {:.0} {:.0} {:.0}\">{body}</svg>",
        low.x, low.y, size.x, size.y
    )
}

/// Where each name goes: those that would lie on one another under each other.
fn stacked(names: Vec<(DVec2, &str)>, line: f64) -> Vec<(DVec2, &str)> {
    let mut placed: Vec<(DVec2, &str)> = Vec::new();
    for (mut at, name) in names {
        // A letter is some six tenths of a line wide.
        let width = |text: &str| 0.6 * line * (text.chars().count() as f64 + 1.0);
        let near = |(p, other): &(DVec2, &str), at: DVec2| {
            let apart = if p.x < at.x { width(other) } else { width(name) };
            (p.x - at.x).abs() < apart && (p.y - at.y).abs() < 0.9 * line
        };
        while placed.iter().any(|p| near(p, at)) {
            at.y += line;
        }
        placed.push((at, name));
    }
    placed
}

fn reference_distance(rig: &Rig, camera: &strandbench_types::Camera) -> f64 {
    let reference = &rig.cameras[0];
    let middle = reference.unproject(reference.principal_px, 0.5 * (rig.near_mm + rig.far_mm));
    camera.to_camera(middle).z.max(1.0)
}

fn points(polygon: &[DVec2]) -> String {
    polygon.iter().map(|p| format!("{:.1},{:.1}", p.x, p.y)).collect::<Vec<_>>().join(" ")
}

/// Convex hull in order (Andrew's monotone chain).
fn convex_hull(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let half = |points: &mut dyn Iterator<Item = DVec2>| {
        let mut chain: Vec<DVec2> = Vec::new();
        for p in points {
            while chain.len() > 1 {
                let (a, b) = (chain[chain.len() - 2], chain[chain.len() - 1]);
                if (b - a).perp_dot(p - a) > 0.0 {
                    break;
                }
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let mut hull = half(&mut points.iter().copied());
    hull.extend(half(&mut points.iter().rev().copied()));
    hull
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hull_of_a_square_with_a_point_inside() {
        let p = [(0.0, 0.0), (2.0, 0.0), (1.0, 1.0), (2.0, 2.0), (0.0, 2.0)];
        let hull = convex_hull(p.iter().map(|&(x, y)| DVec2::new(x, y)).collect());
        assert_eq!(hull.len(), 4);
    }

    #[test]
    fn names_at_one_place_go_under_each_other() {
        let at = DVec2::new(5.0, 5.0);
        let placed = stacked(vec![(at, "a"), (at, "b"), (at + DVec2::new(100.0, 0.0), "c")], 10.0);
        assert_eq!(placed.iter().map(|p| p.0.y).collect::<Vec<_>>(), [5.0, 15.0, 5.0]);
    }
}
