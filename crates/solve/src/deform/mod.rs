//! Embedded deformation (Sumner et al. 2007) and non-rigid registration with it (Li et al. 2009).
//!
//! [`Registration`] embeds a surface in a graph and brings it to a [`Surface`]; [`Skinning`] carries any other
//! points along.

mod energy;
mod graph;
mod register;
mod surface;
mod tree;

#[cfg(test)]
mod tests;

pub use energy::{Aim, Deformer, Descent, Weights};
pub use graph::{DeformationGraph, Skinning, carry_normal, sample_uniformly};
pub use register::{DeformError, MAX_NODES, RegisterOptions, Registered, Registration};
pub use surface::{Nearest, Surface, border_points};
pub use tree::PointTree;
