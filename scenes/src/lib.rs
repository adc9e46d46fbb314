//! Synthetic scenes: hair grown on a head, lights, cameras and the cameras' faults, from a TOML file and a seed.
//!
//! [`parse`] reads a scene file into a [`SceneSpec`], [`catalog`] lists those that come with the program, and
//! [`build`] makes the [`Scene`] that a renderer and the ground truth work on. World coordinates are mm with
//! the origin in the middle of the cranium, +y up, the face towards +z, the subject's left at +x. The same
//! scene and seed give the same bits on every machine and any number of threads: trigonometric and
//! exponential functions come from `libm`, and every random number is a function of a key.

mod build;
mod capture;
mod catalog;
mod environment;
mod error;
pub mod face;
mod groom;
mod head;
mod motion;
mod scene;
mod spec;
mod subdivision;

pub use build::build;
pub use capture::rotation;
pub use catalog::{CatalogEntry, DEFAULT_SCENE, catalog};
pub use error::SceneError;
pub use face::{SkinDetail, SkinTexture};
pub use head::scalp_of;
pub use motion::{HeadPose, MotionCache, MotionError, MotionFrame, Simulation, moving_catalog};
pub use scene::{
    AreaLight, Environment, FibreOptics, Lens, OpticsModel, OpticsRoots, Pigment, RigMotion, Scene, Sensor,
    SkinOptics, Surface,
};
pub use spec::{
    CalibrationError, Clumping, Difficulty, Disorder, EnvironmentSpec, Family, Fringe, GroomSpec,
    HairFileSpec, HeadDrive, HeadSpec, LengthSpec, LensSpec, LightSpec, MAX_STRANDS, MotionSolver,
    MotionSpec, Parting, PigmentSpec, RigSpec, SceneSpec, StyleSpec, Swing, WaveSpec, WindSpec, parse,
};
