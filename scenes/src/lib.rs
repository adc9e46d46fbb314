//! Synthetic scenes: hair grown on a head, lights, cameras and the cameras' faults, from a TOML file and a seed.

mod scene;

pub use scene::{AreaLight, FibreOptics, Pigment, Scene, Sensor, Surface};
