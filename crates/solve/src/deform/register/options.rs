//! How surfaces are registered, and why they were not.

use crate::sparse::SparseError;

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
