//! Non-rigid registration of one surface to another (Li et al. 2009, as Luo et al. 4.4 and 5.3 use it).

use super::energy::{Aim, Deformer, Weights};
use super::graph::{DeformationGraph, Skinning, carry_normal, sample_uniformly};
use super::surface::{Surface, check};
use crate::Cancelled;
use crate::sparse::SparseError;
use glam::DVec3;
use rayon::prelude::*;

/// Why surfaces were not registered.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DeformError {
    /// A surface has no points, or arrays of different lengths, or a number that is not finite.
    #[error("{surface} surface: {fault}")]
    Surface {
        /// Which of the two: `source` or `target`.
        surface: &'static str,
        /// What is wrong.
        fault: String,
    },
    /// An option is out of range.
    #[error("registration option {name} = {value}: wants {wanted}")]
    Option {
        /// Name of the option.
        name: &'static str,
        /// Value given.
        value: f64,
        /// What would fit.
        wanted: &'static str,
    },
    /// The graph would have too many nodes.
    #[error("{nodes} nodes are more than {limit}; use a wider node spacing")]
    TooManyNodes {
        /// Nodes wanted.
        nodes: usize,
        /// Nodes allowed.
        limit: usize,
    },
    /// No point of the source has a partner on the target.
    #[error(
        "none of {points} points has a partner within {distance_mm} mm and {angle_deg} degrees; the surfaces are too far apart"
    )]
    NoPartners {
        /// Points of the source.
        points: usize,
        /// Largest distance allowed.
        distance_mm: f64,
        /// Largest angle between normals allowed.
        angle_deg: f64,
    },
    /// The linear system.
    #[error(transparent)]
    Sparse(#[from] SparseError),
    /// Stopped from outside.
    #[error("cancelled")]
    Cancelled,
}

/// Most nodes a graph may have: 12 unknowns each, and a factor of a few gigabytes at most.
pub const MAX_NODES: usize = 20_000;

/// How surfaces are registered.
///
/// The stiffness schedule is the one of Li et al. 2008 and 2009: α_rigid from 1000 to 1 and α_smooth from 100 to
/// 0.1, both divided by ten whenever the energy has settled; α_point 0.1 and α_plane 1. The publications give no
/// unit and no sampling density; here lengths are millimetres, and the fit term is scaled as if each node carried
/// `samples_per_node` points, so that the balance depends on neither.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RegisterOptions {
    /// Distance between nodes, mm (Luo et al. 4.4: 15).
    pub node_spacing_mm: f64,
    /// Nodes that carry a point (Sumner et al. 2007: 4).
    pub nodes_per_point: usize,
    /// Points that the fit term counts for each node.
    pub samples_per_node: f64,
    /// α_point.
    pub point: f64,
    /// α_plane.
    pub plane: f64,
    /// α_rigid at the start and at the end.
    pub rigid: (f64, f64),
    /// α_smooth at the start and at the end.
    pub smooth: (f64, f64),
    /// Factor between stages, above 1.
    pub relaxation: f64,
    /// Relative change of the energy below which a stage has settled.
    pub settled: f64,
    /// Searches for partners in a stage at most.
    pub iterations: usize,
    /// Largest distance between partners, mm.
    pub distance_mm: f64,
    /// Largest angle between partners' normals, degrees.
    pub angle_deg: f64,
}

impl Default for RegisterOptions {
    fn default() -> RegisterOptions {
        RegisterOptions {
            node_spacing_mm: 15.0,
            nodes_per_point: 4,
            samples_per_node: 10.0,
            point: 0.1,
            plane: 1.0,
            rigid: (1000.0, 1.0),
            smooth: (100.0, 0.1),
            relaxation: 10.0,
            settled: 0.001,
            iterations: 20,
            distance_mm: 20.0,
            angle_deg: 60.0,
        }
    }
}

impl RegisterOptions {
    /// Says which option is out of range, if one is.
    ///
    /// # Errors
    /// The first option at fault and what is wanted.
    pub fn validate(&self) -> Result<(), DeformError> {
        let positive = |v: f64| v.is_finite() && v > 0.0;
        let rows = [
            ("node_spacing_mm", self.node_spacing_mm, positive(self.node_spacing_mm), "a number above 0"),
            (
                "nodes_per_point",
                self.nodes_per_point as f64,
                (1..=32).contains(&self.nodes_per_point),
                "1 to 32",
            ),
            ("samples_per_node", self.samples_per_node, positive(self.samples_per_node), "a number above 0"),
            ("point", self.point, self.point >= 0.0 && self.point.is_finite(), "a number of at least 0"),
            ("plane", self.plane, self.plane >= 0.0 && self.plane.is_finite(), "a number of at least 0"),
            ("point + plane", self.point + self.plane, self.point + self.plane > 0.0, "a number above 0"),
            ("rigid start", self.rigid.0, positive(self.rigid.0), "a number above 0"),
            (
                "rigid end",
                self.rigid.1,
                positive(self.rigid.1) && self.rigid.1 <= self.rigid.0,
                "at most the start",
            ),
            ("smooth start", self.smooth.0, positive(self.smooth.0), "a number above 0"),
            (
                "smooth end",
                self.smooth.1,
                positive(self.smooth.1) && self.smooth.1 <= self.smooth.0,
                "at most the start",
            ),
            (
                "relaxation",
                self.relaxation,
                self.relaxation.is_finite() && self.relaxation > 1.0,
                "a number above 1",
            ),
            (
                "settled",
                self.settled,
                self.settled.is_finite() && self.settled >= 0.0,
                "a number of at least 0",
            ),
            ("iterations", self.iterations as f64, (1..=1000).contains(&self.iterations), "1 to 1000"),
            ("distance_mm", self.distance_mm, positive(self.distance_mm), "a number above 0"),
            (
                "angle_deg",
                self.angle_deg,
                positive(self.angle_deg) && self.angle_deg <= 180.0,
                "above 0, up to 180",
            ),
        ];
        match rows.into_iter().find(|r| !r.2) {
            Some((name, value, _, wanted)) => Err(DeformError::Option { name, value, wanted }),
            None => Ok(()),
        }
    }
}

/// How a registration went.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Registered {
    /// Searches for partners.
    pub searches: usize,
    /// Linear systems solved.
    pub steps: usize,
    /// Source points with a partner in the last search.
    pub partners: usize,
    /// Root mean square distance to the partners' planes at the end, mm.
    pub plane_rms_mm: f64,
}

/// What a registration goes for.
#[derive(Clone, Copy)]
enum Goal<'a> {
    Surface(&'a Surface),
    Aims(&'a [Option<Aim>]),
}

/// A source surface embedded in a deformation graph.
#[derive(Debug)]
pub struct Registration {
    deformer: Deformer,
    normals: Vec<DVec3>,
    options: RegisterOptions,
}

impl Registration {
    /// Embeds points with unit normals (zero where unknown) in a graph at rest whose nodes are sampled from them.
    ///
    /// # Errors
    /// If an option, the points or the number of nodes do not fit.
    pub fn new(
        points: Vec<DVec3>,
        normals: Vec<DVec3>,
        options: RegisterOptions,
    ) -> Result<Registration, DeformError> {
        options.validate()?;
        check("source", &points, &normals)?;
        let picked = sample_uniformly(&points, options.node_spacing_mm);
        if picked.len() > MAX_NODES {
            return Err(DeformError::TooManyNodes { nodes: picked.len(), limit: MAX_NODES });
        }
        let nodes: Vec<DVec3> = picked.iter().map(|&i| points[i]).collect();
        let skin = Skinning::new(&points, &nodes, options.nodes_per_point);
        let graph = DeformationGraph::new(nodes, &skin, options.nodes_per_point);
        Ok(Registration { deformer: Deformer::new(graph, points, skin)?, normals, options })
    }

    /// The graph in its present state.
    pub fn graph(&self) -> &DeformationGraph {
        &self.deformer.graph
    }

    /// The graph, for setting its state.
    pub fn graph_mut(&mut self) -> &mut DeformationGraph {
        &mut self.deformer.graph
    }

    /// Replaces points and normals at rest; nodes and weights stay.
    pub fn set_rest(&mut self, points: Vec<DVec3>, normals: Vec<DVec3>) {
        assert_eq!(points.len(), normals.len(), "one normal a point");
        self.deformer.set_points(points);
        self.normals = normals;
    }

    /// Where the source's points are now, mm, and their unit normals.
    pub fn carried(&self) -> (Vec<DVec3>, Vec<DVec3>) {
        let d = &self.deformer;
        let carry = |i: usize| {
            let (at, linear) = d.graph.carry(d.skin(), i, d.points()[i]);
            (at, carry_normal(linear, self.normals[i]))
        };
        (0..d.points().len()).into_par_iter().map(carry).unzip()
    }

    /// Partners on the target of each source point in its present place.
    pub fn partners(&self, target: &Surface) -> Vec<Option<Aim>> {
        let min_cos = self.options.angle_deg.to_radians().cos();
        let (points, normals) = self.carried();
        let find = |(&at, &n): (&DVec3, &DVec3)| target.partner(at, n, self.options.distance_mm, min_cos);
        points.par_iter().zip(&normals).map(find).collect()
    }

    fn weights(&self, rigid: f64, smooth: f64) -> Weights {
        let o = &self.options;
        let points = self.deformer.points().len() as f64;
        let fit = o.samples_per_node * self.deformer.graph.len() as f64 / points;
        Weights { fit, point: o.point, plane: o.plane, rigid, smooth }
    }

    /// Registers to a target, from the present state, stiff first and relaxed stage by stage.
    ///
    /// # Errors
    /// If no point has a partner, or the work is cancelled.
    pub fn register(&mut self, target: &Surface, cancelled: Cancelled) -> Result<Registered, DeformError> {
        self.relax(Goal::Surface(target), cancelled)
    }

    /// Registers to given aims, one or none a point, stiff first and relaxed stage by stage.
    ///
    /// # Errors
    /// If there are no aims, or the work is cancelled.
    pub fn fit(&mut self, aims: &[Option<Aim>], cancelled: Cancelled) -> Result<Registered, DeformError> {
        self.relax(Goal::Aims(aims), cancelled)
    }

    /// Follows a target from the present state with the final stiffness throughout (Luo et al. 5.3: constant
    /// weights, no re-initialisation).
    ///
    /// # Errors
    /// If no point has a partner, or the work is cancelled.
    pub fn track(&mut self, target: &Surface, cancelled: Cancelled) -> Result<Registered, DeformError> {
        let mut report = Registered::default();
        let stiffness = (self.options.rigid.1, self.options.smooth.1);
        self.settle(Goal::Surface(target), stiffness, &mut report, cancelled)?;
        Ok(report)
    }

    fn relax(&mut self, goal: Goal<'_>, cancelled: Cancelled) -> Result<Registered, DeformError> {
        let (mut rigid, mut smooth) = (self.options.rigid.0, self.options.smooth.0);
        let mut report = Registered::default();
        loop {
            self.settle(goal, (rigid, smooth), &mut report, cancelled)?;
            if rigid <= self.options.rigid.1 && smooth <= self.options.smooth.1 {
                return Ok(report);
            }
            rigid = (rigid / self.options.relaxation).max(self.options.rigid.1);
            smooth = (smooth / self.options.relaxation).max(self.options.smooth.1);
        }
    }

    fn settle(
        &mut self,
        goal: Goal<'_>,
        (rigid, smooth): (f64, f64),
        report: &mut Registered,
        cancelled: Cancelled,
    ) -> Result<(), DeformError> {
        let weights = self.weights(rigid, smooth);
        let mut last = f64::INFINITY;
        for _ in 0..self.options.iterations {
            if cancelled() {
                return Err(DeformError::Cancelled);
            }
            let found = match goal {
                Goal::Surface(target) => self.partners(target),
                Goal::Aims(_) => Vec::new(),
            };
            let aims = match goal {
                Goal::Surface(_) => &found,
                Goal::Aims(given) => given,
            };
            report.partners = aims.iter().flatten().count();
            if report.partners == 0 {
                return Err(DeformError::NoPartners {
                    points: aims.len(),
                    distance_mm: self.options.distance_mm,
                    angle_deg: self.options.angle_deg,
                });
            }
            let descent = self.deformer.minimise(aims, &weights, STEPS_PER_SEARCH, self.options.settled)?;
            report.searches += 1;
            report.steps += descent.steps;
            report.plane_rms_mm = self.plane_rms_mm(aims);
            // Stiff stages only bring the surfaces near; the last one decides.
            let last_stage = rigid <= self.options.rigid.1 && smooth <= self.options.smooth.1;
            let settled = self.options.settled * if last_stage { 1.0 } else { STIFF_SETTLED };
            if (last - descent.after).abs() <= settled * descent.after {
                break;
            }
            last = descent.after;
        }
        Ok(())
    }

    fn plane_rms_mm(&self, aims: &[Option<Aim>]) -> f64 {
        let at = self.deformer.carried();
        let errors = at.iter().zip(aims).filter_map(|(p, a)| a.map(|a| (*p - a.point).dot(a.normal)));
        let (n, sum) = errors.fold((0usize, 0.0), |(n, s), e| (n + 1, s + e * e));
        (sum / n.max(1) as f64).sqrt()
    }
}

/// How much sooner a stage before the last counts as settled.
const STIFF_SETTLED: f64 = 10.0;

/// Gauss-Newton steps between searches for partners.
const STEPS_PER_SEARCH: usize = 1;
