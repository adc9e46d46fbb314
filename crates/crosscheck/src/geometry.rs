//! Level 1: shared rays against fibres and triangles, every disagreement with its reason.

use crate::referee::{Ray, Segment, segments_of};
use crate::stats::quantile;
use crate::{Bundle, Case, CrossError, Gate, Size, fixed};
use glam::Vec3;
use rayon::prelude::*;
use std::collections::BTreeMap;
use strandbench_renderer::accel::{Accel, Hit, LastBlockers};
use strandbench_types::{StrandSet, TriMesh};

/// Share of rays that one hits and the other misses.
const MISS_SHARE: f64 = 3e-4;
/// Share of rays that name another segment.
const PRIMITIVE_SHARE: f64 = 1.5e-3;
/// 99th percentile of the difference in distance, mm.
const DISTANCE_MM: f64 = 5e-4;
/// 99th percentile of the angle between normals, in units of what rounding of the hit's distance to single
/// precision does to it: half a unit in the last place of the longest ray, over a typical fibre's radius. Measured
/// 1.5 at 400 mm and 2.7 at 900 mm.
const NORMAL_ROUNDINGS: f64 = 4.0;
/// Impact over radius above which a ray grazes.
const GRAZE: f64 = 0.99;
/// Distances (mm) that single precision cannot tell apart at 400 mm, with a margin of ten units in the last place.
const TIE_MM: f64 = 3e-4;

pub(crate) fn cases(size: Size) -> Result<Vec<Case>, CrossError> {
    let view = fixed::camera(320, 240, 42.0);
    let small = fixed::tuft(200, 24);
    let hair = |name: &str, strands: &StrandSet, camera: u32, each: u32| {
        let rays = fixed::joined(fixed::camera_rays(&view, camera), fixed::scattered_rays(strands, each));
        fibres(name, strands, &rays)
    };
    let mesh = |name: &str, mesh: &TriMesh, count: u32| {
        let rays = fixed::joined(fixed::sphere_rays(count), fixed::camera_rays(&view, count / 2));
        triangles(name, mesh, &rays)
    };
    let bumpy = fixed::bumpy(120, 60);
    Ok(match size {
        Size::Fixture => vec![hair("tuft", &small, 4_000, 1_500), mesh("bumpy", &bumpy, 4_000)],
        Size::Quick => vec![hair("tuft", &small, 40_000, 20_000), mesh("bumpy", &bumpy, 40_000)],
        Size::Full => {
            let entry = &strandbench_scenes::catalog()[0];
            let ours = |e: strandbench_scenes::SceneError| CrossError::Ours(e.to_string());
            let spec = entry.spec().map_err(ours)?.with_strands(4_000);
            let scene = strandbench_scenes::build(&spec, 1, None).map_err(ours)?;
            let head = &scene.surfaces[0].mesh;
            let view = &scene.rig.cameras[0];
            let hairstyle = fixed::joined(
                fixed::camera_rays(view, 400_000),
                fixed::scattered_rays(&scene.strands, 200_000),
            );
            let around = fixed::joined(fixed::camera_rays(view, 200_000), fixed::sphere_rays(200_000));
            vec![
                hair("tuft", &small, 200_000, 100_000),
                fibres("hairstyle", &scene.strands, &hairstyle),
                mesh("bumpy", &bumpy, 200_000),
                triangles("head", head, &around),
            ]
        }
    })
}

fn with_rays(input: Bundle, rays: &fixed::Rays) -> Bundle {
    input.with_vec3("origins", &rays.origins).with_vec3("directions", &rays.directions).with(
        "tmax",
        &[rays.tmax.len()],
        rays.tmax.iter().copied(),
    )
}

pub(crate) fn with_strands(input: Bundle, strands: &StrandSet) -> Bundle {
    input
        .with_vec3("points", &strands.points)
        .with("radii", &[strands.radii_mm.len()], strands.radii_mm.iter().copied())
        .with("offsets", &[strands.offsets.len()], strands.offsets.iter().copied())
}

pub(crate) fn strands_of(input: &Bundle) -> Result<StrandSet, CrossError> {
    let set = StrandSet {
        points: input.vec3("points", 0)?,
        radii_mm: input.get("radii", &[0])?,
        offsets: input.get("offsets", &[0])?,
    };
    set.validate().map_err(|e| CrossError::Ours(e.to_string()))?;
    Ok(set)
}

fn fibres(name: &str, strands: &StrandSet, rays: &fixed::Rays) -> Case {
    let input = with_rays(with_strands(Bundle::new(name), strands), rays);
    Case { level: 1, name: name.to_owned(), job: "geometry", input }
}

fn triangles(name: &str, mesh: &TriMesh, rays: &fixed::Rays) -> Case {
    let input = with_rays(Bundle::new(name), rays).with_vec3("vertices", &mesh.vertices).with(
        "triangles",
        &[mesh.triangles.len(), 3],
        mesh.triangles.iter().flatten().copied(),
    );
    Case { level: 1, name: name.to_owned(), job: "triangles", input }
}

/// What one renderer says of one ray.
#[derive(Clone, Copy, Debug)]
struct Answer {
    t: f32,
    /// -1 for a miss.
    primitive: i32,
    normal: Vec3,
    position: Vec3,
}

/// Why two answers differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Reason {
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
    fn name(self) -> &'static str {
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

/// The segment's index, as Mitsuba counts them: strands in order, without gaps.
fn segment_index(strand: u32, point: u32) -> i32 {
    (point - strand) as i32
}

fn ours(accel: &Accel, strands: &StrandSet, origin: Vec3, direction: Vec3) -> Answer {
    match accel.closest(origin, direction) {
        Some(Hit::Fibre { t, strand, point, along }) => {
            let i = point as usize;
            let centre = strands.points[i].lerp(strands.points[i + 1], along);
            let position = origin + direction * t;
            Answer {
                t,
                primitive: segment_index(strand, point),
                normal: (position - centre).normalize_or_zero(),
                position,
            }
        }
        _ => Answer { t: f32::INFINITY, primitive: -1, normal: Vec3::ZERO, position: Vec3::ZERO },
    }
}

struct Context<'a> {
    segments: &'a [Segment],
    /// Strand of each segment.
    strand: Vec<u32>,
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

    fn reason(&self, ray: &Ray, a: &Answer, b: &Answer) -> Reason {
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
    fn shadow_reason(&self, ray: &Ray, tmax: f64) -> Reason {
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

pub(crate) fn judge(case: &Case, answer: &Bundle) -> Result<Vec<Gate>, CrossError> {
    let origins = case.input.vec3("origins", 0)?;
    let n = origins.len();
    let directions = case.input.vec3("directions", n)?;
    let tmax: Vec<f32> = case.input.get("tmax", &[n])?;
    if case.job == "triangles" {
        return judge_triangles(case, answer, &origins, &directions);
    }
    let strands = strands_of(&case.input)?;
    let accel = Accel::new(&strands, &[])?;
    let theirs: Vec<Answer> = {
        let t: Vec<f32> = answer.get("t", &[n])?;
        let primitive: Vec<i32> = answer.get("primitive", &[n])?;
        let normal = answer.vec3("normal", n)?;
        let position = answer.vec3("position", n)?;
        (0..n)
            .map(|i| Answer { t: t[i], primitive: primitive[i], normal: normal[i], position: position[i] })
            .collect()
    };
    let blocked: Vec<u8> = answer.get("blocked", &[n])?;
    let segments = segments_of(&strands);
    if let Some(p) = theirs.iter().map(|a| a.primitive).find(|&p| p >= segments.len() as i32) {
        return Err(CrossError::Array {
            job: case.name.clone(),
            name: "primitive".into(),
            fault: format!("names segment {p} of {}", segments.len()),
        });
    }
    let strand = (0..strands.len()).flat_map(|s| strands.range(s).skip(1).map(move |_| s as u32)).collect();
    let context = Context { segments: &segments, strand };
    // Per ray: what differs in first hits, and in shadow.
    let verdicts: Vec<(Answer, Option<Reason>, Option<Reason>)> = (0..n)
        .into_par_iter()
        .map(|i| {
            let mine = ours(&accel, &strands, origins[i], directions[i]);
            let ray = Ray { origin: origins[i].as_dvec3(), direction: directions[i].as_dvec3().normalize() };
            let differs = mine.primitive != theirs[i].primitive;
            let reason = differs.then(|| context.reason(&ray, &mine, &theirs[i]));
            let shadow = tmax[i].is_finite().then(|| {
                accel.occluded(origins[i], directions[i], tmax[i], None, &mut LastBlockers::default())
            });
            let flip = shadow
                .filter(|&b| u8::from(b) != blocked[i])
                .map(|_| context.shadow_reason(&ray, f64::from(tmax[i])));
            (mine, reason, flip)
        })
        .collect();
    let mut tally: BTreeMap<Reason, u64> = BTreeMap::new();
    let mut flips: BTreeMap<Reason, u64> = BTreeMap::new();
    let (mut hits, mut missed, mut renamed) = (0u64, 0u64, 0u64);
    let (mut dt, mut dn, mut dp) = (Vec::new(), Vec::new(), Vec::new());
    for ((mine, reason, flip), other) in verdicts.iter().zip(&theirs) {
        hits += u64::from(other.primitive >= 0);
        if let Some(r) = reason {
            *tally.entry(*r).or_default() += 1;
            if mine.primitive < 0 || other.primitive < 0 { missed += 1 } else { renamed += 1 }
        } else if mine.primitive >= 0 {
            dt.push(f64::from((mine.t - other.t).abs()));
            dn.push(f64::from(mine.normal.angle_between(other.normal).to_degrees()));
            dp.push(f64::from(mine.position.distance(other.position)));
        }
        if let Some(r) = flip {
            *flips.entry(*r).or_default() += 1;
        }
    }
    let shadows = tmax.iter().filter(|t| t.is_finite()).count() as f64;
    let flipped: u64 = flips.values().sum();
    let unexplained =
        tally.get(&Reason::Unexplained).unwrap_or(&0) + flips.get(&Reason::Unexplained).unwrap_or(&0);
    let list = |t: &BTreeMap<Reason, u64>| {
        t.iter().map(|(r, n)| format!("{n} {}", r.name())).collect::<Vec<_>>().join("; ")
    };
    let farthest = theirs.iter().map(|a| f64::from(a.t)).filter(|t| t.is_finite()).fold(0.0, f64::max);
    let mut radii: Vec<f64> = strands.radii_mm.iter().map(|r| f64::from(*r)).collect();
    let rounding = farthest * f64::from(f32::EPSILON) * 0.5 / quantile(&mut radii, 0.5);
    let normal_limit = (NORMAL_ROUNDINGS * rounding).to_degrees();
    // What to look at first if something has no reason.
    let odd = (0..n).find(|&i| {
        let (_, reason, flip) = &verdicts[i];
        [reason, flip].contains(&&Some(Reason::Unexplained))
    });
    let odd = odd.map_or(String::new(), |i| {
        let (mine, ..) = &verdicts[i];
        let ray = Ray { origin: origins[i].as_dvec3(), direction: directions[i].as_dvec3().normalize() };
        let nearest = segments
            .iter()
            .enumerate()
            .filter_map(|(k, s)| s.entry(&ray).filter(|t| *t > 0.0).map(|t| (t, k, s.impact(&ray))))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        format!(
            "; ray {i} from {} along {} to {}: ours {} at {}, theirs {} at {} (blocked: {}), nearest in double precision {nearest:?}",
            origins[i], directions[i], tmax[i], mine.primitive, mine.t, theirs[i].primitive, theirs[i].t, blocked[i]
        )
    });
    let at_most = |what: &str, v: f64, l: f64, unit: &str| Gate::at_most(1, &case.name, what, v, l, unit);
    let total = n as f64;
    Ok(vec![
        Gate::shown(1, &case.name, "rays", total, "rays")
            .because(format!("{hits} of them hit; {shadows} shadow rays; {} segments", segments.len())),
        Gate::at_least(1, &case.name, "share of rays that hit", hits as f64 / total, 0.2, "")
            .because("rays that miss everything prove little"),
        at_most("hit against miss", missed as f64 / total, MISS_SHARE, "of rays").because(list(&tally)),
        at_most("another segment", renamed as f64 / total, PRIMITIVE_SHARE, "of rays").because(list(&tally)),
        at_most("shadow against light", flipped as f64 / shadows.max(1.0), MISS_SHARE, "of shadow rays")
            .because(list(&flips)),
        at_most("distance, 99th percentile", quantile(&mut dt, 0.99), DISTANCE_MM, "mm"),
        at_most("position, 99th percentile", quantile(&mut dp, 0.99), DISTANCE_MM, "mm"),
        at_most("normal, 99th percentile", quantile(&mut dn, 0.99), normal_limit, "degrees"),
        at_most("disagreements without a reason", unexplained as f64, 0.0, "rays").because(format!(
            "{} disagreements examined in double precision{odd}",
            missed + renamed + flipped
        )),
    ])
}

/// Triangles share edges, so that a ray through an edge belongs to both.
fn judge_triangles(
    case: &Case,
    answer: &Bundle,
    origins: &[Vec3],
    directions: &[Vec3],
) -> Result<Vec<Gate>, CrossError> {
    let n = origins.len();
    let triangles: Vec<u32> = case.input.get("triangles", &[0, 3])?;
    let mesh = TriMesh {
        vertices: case.input.vec3("vertices", 0)?,
        triangles: triangles.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
    };
    mesh.validate().map_err(CrossError::Ours)?;
    let accel = Accel::new(&StrandSet::new(), &[&mesh])?;
    let t: Vec<f32> = answer.get("t", &[n])?;
    let primitive: Vec<i32> = answer.get("primitive", &[n])?;
    let uv: Vec<f32> = answer.get("uv", &[n, 2])?;
    let found: Vec<_> = (0..n).into_par_iter().map(|i| accel.closest(origins[i], directions[i])).collect();
    let (mut hits, mut edges, mut unexplained) = (0u64, 0u64, 0u64);
    let (mut dt, mut duv) = (Vec::new(), Vec::new());
    // A share of an edge's length: what single precision leaves of a barycentric weight at 150 mm.
    const EDGE: f32 = 1e-3;
    for i in 0..n {
        hits += u64::from(primitive[i] >= 0);
        match found[i] {
            Some(Hit::Mesh { t: mine, triangle, uv: w, .. }) => {
                let weights = [w[0], w[1], 1.0 - w[0] - w[1]];
                if triangle as i32 == primitive[i] {
                    dt.push(f64::from((mine - t[i]).abs()));
                    duv.push(f64::from((w[0] - uv[2 * i]).abs().max((w[1] - uv[2 * i + 1]).abs())));
                } else if weights.iter().any(|w| *w < EDGE) {
                    edges += 1;
                } else {
                    unexplained += 1;
                }
            }
            _ if primitive[i] < 0 => {}
            _ => {
                let (u, v) = (uv[2 * i], uv[2 * i + 1]);
                if [u, v, 1.0 - u - v].iter().any(|w| *w < EDGE) { edges += 1 } else { unexplained += 1 }
            }
        }
    }
    let total = n as f64;
    let at_most = |what: &str, v: f64, l: f64, unit: &str| Gate::at_most(1, &case.name, what, v, l, unit);
    Ok(vec![
        Gate::shown(1, &case.name, "rays", total, "rays")
            .because(format!("{hits} hit; {} triangles", mesh.triangles.len())),
        Gate::at_least(1, &case.name, "share of rays that hit", hits as f64 / total, 0.2, ""),
        at_most("through an edge, the neighbour named", edges as f64 / total, PRIMITIVE_SHARE, "of rays"),
        at_most("distance, 99th percentile", quantile(&mut dt, 0.99), DISTANCE_MM, "mm"),
        at_most("barycentric weights, 99th percentile", quantile(&mut duv, 0.99), 1e-3, ""),
        at_most("disagreements without a reason", unexplained as f64, 0.0, "rays"),
    ])
}
