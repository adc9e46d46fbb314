//! Non-rigid registration of one surface to another (Li et al. 2009, as Luo et al. 4.4 and 5.3 use it).

mod options;

use super::energy::{Aim, Deformer, Weights};
use super::graph::{DeformationGraph, Skinning, carry_normal, sample_uniformly};
use super::surface::{Surface, check};
use crate::Cancelled;
use glam::DVec3;
pub use options::{DeformError, MAX_NODES, RegisterOptions};
use rayon::prelude::*;

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
