//! Numbers of the temporal half of the method: 4.4's de-noising, and section 5.

use crate::parameters::{not_negative, parameters, positive};
use serde::Serialize;
use strandbench_solve::deform::RegisterOptions;

parameters! {
    /// How frames are brought together (4.4, temporal de-noising).
    TemporalParameters;
    /// Whether depth maps are averaged with their unwarped neighbours. Concerns sequences alone.
    denoise: bool = true, |_| true, "true or false";
    /// How many frames before and after a frame are averaged with it. The paper averages "multiple frames" and gives no
    /// number; reports/moving.md has figures.
    reach: usize = 3, |v| (1..=8).contains(&v), "a whole number from 1 to 8";
    /// Distance between nodes of the deformation graph, mm (4.4: 15).
    node_spacing_mm: f32 = 15.0, |v| positive(v) && v >= 2.0, "a number of at least 2";
    /// Points of the envelope that the registration uses for each node. The paper gives no number; more change
    /// nothing but time, since neighbouring pixels' depths are not independent.
    samples_per_node: usize = 20, |v| (4..=400).contains(&v), "a whole number from 4 to 400";
    /// α_rigid of Li et al. 2009 at the start of a registration; see `strandbench_solve::deform::RegisterOptions`.
    rigid_start: f32 = 1000.0, positive, "a number above 0";
    /// α_rigid at the end. Li et al. relax to 1, and α_smooth to 0.1; a graph that soft follows the stereo's noise, whose
    /// patches are nearly as large as the nodes' spacing, and averages less of it away. SWEEPS.md has figures.
    rigid_end: f32 = 10.0, positive, "a number above 0, at most rigid_start";
    /// α_smooth at the start.
    smooth_start: f32 = 100.0, positive, "a number above 0";
    /// α_smooth at the end.
    smooth_end: f32 = 1.0, positive, "a number above 0, at most smooth_start";
    /// Largest distance between partners, mm. At 100 frames a second 20 mm is hair at 2 m/s.
    partner_mm: f32 = 20.0, positive, "a number above 0";
    /// Largest angle between partners' normals, degrees.
    partner_deg: f32 = 60.0, |v| positive(v) && v <= 180.0, "a number above 0, up to 180";
    /// Depth difference beyond which an unwarped neighbour shows another surface and has no say, mm. The paper is
    /// silent; this is the step at which the envelope is cut.
    gate_mm: f32 = 10.0, positive, "a number above 0";
}

parameters! {
    /// From envelope to strands (section 5).
    StrandParameters;
    /// Passes of the bilateral temporal filter over the 3-D orientation (5.1: 5).
    orientation_passes: usize = 5, |v| v <= 20, "a whole number up to 20";
    /// σ_t of Eq. 11, mm. The paper gives no number; 5 mm a frame at 100 frames a second is 0.5 m/s.
    temporal_sigma_mm: f32 = 5.0, positive, "a number above 0";
    /// Whether Eq. 11's update takes w_t T_t where the paper prints T_t. As printed the weights sum to
    /// 1 + w_(t-1) + w_(t+1), so that a line that persists grows and counts for more in the diffusion.
    convex_filter: bool = false, |_| true, "true or false";
    /// Edge of the voxels in which orientation is diffused, mm. The paper's 200x100x100 grid over hair of 30 cm
    /// has voxels of 1.5 mm.
    voxel_mm: f32 = 1.5, |v| positive(v) && v >= 0.2, "a number of at least 0.2";
    /// Length over which diffusion smooths lines of strength 1 on the surface, mm. The paper gives no number.
    diffusion_mm: f32 = 0.5, positive, "a number above 0";
    /// Thickness of the hair layer below the envelope, mm (5.3: 20 to 30).
    layer_mm: f32 = 25.0, |v| positive(v) && v <= 200.0, "a number above 0, up to 200";
    /// Seeds on the envelope, each frame anew (5.2).
    surface_seeds: usize = 40_000, |v| v <= 2_000_000, "a whole number up to 2000000";
    /// Seeds in the layer, drawn once (5.2).
    interior_seeds: usize = 40_000, |v| v <= 2_000_000, "a whole number up to 2000000";
    /// Strength |O| from which a place of the envelope takes surface seeds; 1 is what `unit_quantile` says. The
    /// paper gives no number.
    seed_strength: f32 = 0.4, not_negative, "a number of at least 0";
    /// Which random numbers place the seeds.
    seed: u64 = 0, |_| true, "a whole number";
    /// How far the template reaches beyond the visible hair on each side, as a share of the hair's extent (5.3:
    /// somewhat larger).
    template_margin: f32 = 0.1, |v| not_negative(v) && v <= 2.0, "a number from 0 to 2";
    /// Distance between the template's vertices, mm.
    template_spacing_mm: f32 = 4.0, |v| positive(v) && v >= 0.5, "a number of at least 0.5";
    /// α_rigid while the template is tracked, constant (5.3). The paper gives no number.
    track_rigid: f32 = 10.0, positive, "a number above 0";
    /// α_smooth while the template is tracked, constant (5.3). The paper gives no number.
    track_smooth: f32 = 1.0, positive, "a number above 0";
    /// Weight of equal displacements of neighbouring vertices in the template's detail (5.3) against a unit weight
    /// of the surface.
    detail_smoothness: f32 = 0.1, positive, "a number above 0";
    /// Farthest that a template vertex looks for the surface along its normal, mm.
    detail_mm: f32 = 10.0, positive, "a number above 0";
    /// Distance between the nodes that carry the interior seeds, mm (5.3 leaves the choice: coarser is smoother).
    cage_spacing_mm: f32 = 15.0, |v| positive(v) && v >= 2.0, "a number of at least 2";
    /// Nodes that carry a seed (5.3: 8).
    cage_nodes: usize = 8, |v| (1..=32).contains(&v), "a whole number from 1 to 32";
    /// Step of the forward Euler march, mm. The paper gives no number.
    step_mm: f32 = 1.0, |v| positive(v) && v >= 0.05, "a number of at least 0.05";
    /// Longest strand, mm: stopping rule 1 (5.4).
    length_mm: f32 = 200.0, |v| positive(v) && v <= 5_000.0, "a number above 0, up to 5000";
    /// Largest turn T_ψ within one step, degrees: stopping rule 3 (5.4). The paper gives no number.
    turn_deg: f32 = 20.0, |v| positive(v) && v <= 90.0, "a number above 0, up to 90";
    /// Shortest strand that is kept, mm.
    shortest_mm: f32 = 5.0, not_negative, "a number of at least 0";
    /// Fibre radius of the strands, mm; nothing measures it.
    radius_mm: f32 = 0.04, positive, "a number above 0";
}

/// Most points that all strands of a frame may have at full length: 1.2 GB, and as much while they are put together.
const MOST_POINTS: f64 = 1e8;

impl StrandParameters {
    /// What asks for more than memory holds: name, value and what is wanted.
    pub(crate) fn excess(&self) -> Option<(&'static str, String, String)> {
        let each = f64::from(self.length_mm) / f64::from(self.step_mm) + 1.0;
        let points = (self.surface_seeds + self.interior_seeds) as f64 * each;
        let wanted = format!(
            "(surface_seeds + interior_seeds) · (length_mm / step_mm + 1) of at most {MOST_POINTS:e} points, not {points:e}"
        );
        (points > MOST_POINTS).then(|| ("length_mm", self.length_mm.to_string(), wanted))
    }
}

impl TemporalParameters {
    /// The first pair of values that disagree: name, value and what is wanted.
    pub(crate) fn disagreement(&self) -> Option<(&'static str, String, String)> {
        let above = |name, end: f32, start: f32, which: &str| {
            (end > start).then(|| (name, end.to_string(), format!("at most {which} = {start}")))
        };
        above("rigid_end", self.rigid_end, self.rigid_start, "rigid_start")
            .or_else(|| above("smooth_end", self.smooth_end, self.smooth_start, "smooth_start"))
    }

    /// Options of the registration of neighbouring frames.
    pub fn registration(&self) -> RegisterOptions {
        RegisterOptions {
            node_spacing_mm: f64::from(self.node_spacing_mm),
            rigid: (f64::from(self.rigid_start), f64::from(self.rigid_end)),
            smooth: (f64::from(self.smooth_start), f64::from(self.smooth_end)),
            distance_mm: f64::from(self.partner_mm),
            angle_deg: f64::from(self.partner_deg),
            ..RegisterOptions::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_reads_back_what_it_prints_and_defaults_are_in_range() {
        assert_eq!((TemporalParameters::LUO.fault(), StrandParameters::LUO.fault()), (None, None));
        assert_eq!(TemporalParameters::LUO.disagreement(), None);
        TemporalParameters::LUO.registration().validate().unwrap();
        for (key, value) in TemporalParameters::LUO.entries() {
            let mut p = TemporalParameters::LUO;
            assert_eq!(p.set(key, &value), Some(Ok(())), "{key}");
            assert_eq!(p, TemporalParameters::LUO);
        }
        for (key, value) in StrandParameters::LUO.entries() {
            let mut p = StrandParameters::LUO;
            assert_eq!(p.set(key, &value), Some(Ok(())), "{key}");
            assert_eq!(p, StrandParameters::LUO);
        }
        let many = StrandParameters { step_mm: 0.05, length_mm: 5000.0, ..StrandParameters::LUO };
        assert!(many.excess().is_some() && StrandParameters::LUO.excess().is_none());
        let soft = TemporalParameters { rigid_start: 0.5, ..TemporalParameters::LUO };
        assert_eq!(soft.disagreement().map(|d| d.0), Some("rigid_end"));
    }

    #[test]
    fn no_name_is_used_twice() {
        let mut all: Vec<&str> = crate::Parameters::KEYS.to_vec();
        all.extend(TemporalParameters::KEYS);
        all.extend(StrandParameters::KEYS);
        let mut once = all.clone();
        once.sort_unstable();
        once.dedup();
        assert_eq!(once.len(), all.len());
    }
}
