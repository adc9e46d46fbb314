//! Temporal de-noising (4.4): neighbouring frames are registered, and their unwarped depth maps averaged.
//!
//! The paper warps the neighbours' meshes onto the frame. Here the frame is warped onto each neighbour, by the same
//! energy with the roles exchanged, and the neighbour's depth is read where the warped ray of a pixel meets it. The
//! unwarped depth map is the same to first order in the distance between the warped surface and the neighbour's; no
//! mesh needs to be drawn, and each pixel learns which place of the neighbour is its own, which 5.1 asks for.

use crate::surface::FrameSurface;
use crate::{ReconError, TemporalParameters};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use strandbench_solve::deform::{
    DeformError, DeformationGraph, Registered, Registration, Skinning, sample_uniformly,
};
use strandbench_types::{Camera, DepthMap, Monitor, Plane};

/// Where one frame's vertices are in another frame.
#[derive(Clone, Debug)]
pub struct Correspondence {
    /// Time index of the other frame.
    pub other: u32,
    /// Place in the other frame's reference image, indexed `[vertex]`; `None` where it shows another surface.
    pub pixels: Vec<Option<DVec2>>,
    /// The other frame's depth unwarped to this one, mm along this frame's ray, indexed `[vertex]`; NaN where
    /// there is none.
    pub depth_mm: Vec<f32>,
    /// How the registration went.
    pub registered: Registered,
}

/// Rounds of the search for the place where a warped ray meets the neighbour.
const RAY_ROUNDS: usize = 4;

/// Registers a surface to its neighbours in time.
#[derive(Debug)]
pub struct FrameTracker<'a> {
    camera: &'a Camera,
    own: &'a FrameSurface,
    registration: Registration,
    rest: DeformationGraph,
    skin: Skinning,
    parameters: TemporalParameters,
}

impl<'a> FrameTracker<'a> {
    /// Embeds a frame's envelope in a deformation graph.
    ///
    /// # Errors
    /// If the graph cannot be made.
    pub fn new(
        camera: &'a Camera,
        own: &'a FrameSurface,
        p: &TemporalParameters,
    ) -> Result<FrameTracker<'a>, ReconError> {
        let make = || {
            let points: Vec<DVec3> = own.envelope.mesh.vertices.iter().map(|v| v.as_dvec3()).collect();
            let spacing = f64::from(p.node_spacing_mm) / (p.samples_per_node as f64).sqrt();
            let picked = sample_uniformly(&points, spacing);
            let samples = picked.iter().map(|&i| points[i]).collect();
            let normals = picked.iter().map(|&i| own.normals[i].as_dvec3()).collect();
            let registration = Registration::new(samples, normals, p.registration())?;
            let rest = registration.graph().clone();
            let skin = Skinning::new(&points, &rest.rest, p.registration().nodes_per_point);
            Ok((registration, rest, skin))
        };
        let (registration, rest, skin) = make().map_err(|e| fault(own.frame, e))?;
        Ok(FrameTracker { camera, own, registration, rest, skin, parameters: *p })
    }

    /// Nodes of the graph.
    pub fn nodes(&self) -> usize {
        self.rest.len()
    }

    /// Finds this frame's vertices in a neighbour; each call starts from rest.
    ///
    /// # Errors
    /// If the surfaces are too far apart, or the work is cancelled.
    pub fn find(
        &mut self,
        other: &FrameSurface,
        monitor: &dyn Monitor,
    ) -> Result<Correspondence, ReconError> {
        *self.registration.graph_mut() = self.rest.clone();
        let stop = || monitor.cancelled();
        let registered = other
            .target()
            .and_then(|target| self.registration.register(&target, &stop))
            .map_err(|e| fault(self.own.frame, e))?;
        let (graph, gate) = (self.registration.graph(), self.parameters.gate_mm);
        let find = |v: usize| {
            let pixel = self.own.centre_px(v);
            let at = self.own.envelope.mesh.vertices[v].as_dvec3();
            let (to, linear) = graph.carry(&self.skin, v, at);
            // The ray's camera-space z is 1, so a parameter along it is a depth in this frame.
            let along = linear * self.camera.ray_direction(pixel);
            let slope = (self.camera.camera_from_world * along).z;
            let mut s = 0.0;
            let mut place = None;
            for _ in 0..RAY_ROUNDS {
                let (q, z) = self.camera.project(to + along * s)?;
                let seen = other.depth_at(q, gate)?;
                place = Some(q);
                s += (seen - z) / slope;
                if !(s.is_finite() && s.abs() <= f64::from(gate)) {
                    return None;
                }
            }
            let own = self.own.depth.get_index(self.own.pixels[v] as usize)?;
            place.map(|q| (q, (f64::from(own) + s) as f32))
        };
        let found: Vec<Option<(DVec2, f32)>> = (0..self.own.len()).into_par_iter().map(find).collect();
        Ok(Correspondence {
            other: other.frame,
            pixels: found.iter().map(|f| f.map(|f| f.0)).collect(),
            depth_mm: found.iter().map(|f| f.map_or(f32::NAN, |f| f.1)).collect(),
            registered,
        })
    }
}

fn fault(frame: u32, e: DeformError) -> ReconError {
    match e {
        DeformError::Cancelled => ReconError::Cancelled(strandbench_types::Cancelled),
        source => ReconError::Deform { frame, stage: "registration with its neighbour", source },
    }
}

/// The mean, pixel by pixel, of a frame's depth and the unwarped depths of its neighbours where they have one. Pixels
/// without a vertex stay as they are.
pub fn average(own: &FrameSurface, neighbours: &[&Correspondence]) -> DepthMap {
    let (w, h) = own.depth.size();
    let mut raw = Plane::filled(w, h, f32::NAN);
    for (i, z) in raw.data.iter_mut().enumerate() {
        *z = own.depth.get_index(i).unwrap_or(f32::NAN);
    }
    for (v, &pixel) in own.pixels.iter().enumerate() {
        let z = &mut raw.data[pixel as usize];
        let (mut sum, mut count) = (f64::from(*z), 1.0);
        for d in neighbours.iter().map(|n| n.depth_mm[v]).filter(|d| !d.is_nan()) {
            sum += f64::from(d);
            count += 1.0;
        }
        *z = (sum / count) as f32;
    }
    DepthMap::from_raw(raw)
}
