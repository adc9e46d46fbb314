//! A pixel's camera rays and what they meet.

use super::View;
use crate::accel::{Beam, Hit};
use crate::lens::CameraRay;
use crate::sampler::PixelSampler;
use crate::tile::Tile;
use strandbench_rng::Rng;
use strandbench_types::SampleHit;

/// As many camera rays of a pixel pay for gathering what they may meet.
const BEAM: u32 = 8;

impl View<'_> {
    /// The random key of a pixel.
    pub(crate) fn key(&self, x: usize, y: usize) -> u64 {
        Rng::keyed(&[self.seed, self.camera as u64, (y * self.width + x) as u64]).next_u64()
    }

    /// A pixel's camera ray with this index.
    pub(crate) fn camera_ray(&self, (x, y): (usize, usize), sampler: &PixelSampler, n: u32) -> CameraRay {
        let [fx, fy] = sampler.film(n);
        let (x, y) = (x as f64 + f64::from(fx), y as f64 + f64::from(fy));
        match self.pinhole {
            true => self.maker.ray(x, y),
            false => self.maker.lens_ray(x, y, sampler.lens(n)),
        }
    }

    /// Gathers what camera rays of a pixel may meet for so many of them; false if that does not pay, or if they do not
    /// all leave one point.
    pub(crate) fn begin(&self, beam: &mut Beam, at: (usize, usize), rays: u32) -> bool {
        let begun = self.pinhole && rays >= BEAM;
        if begun {
            let (ray, spread) = self.maker.beam(at);
            self.scene.accel.begin(beam, ray.origin, ray.direction, ray.start, spread);
        }
        begun
    }

    /// What a camera ray meets first, looked for in its pixel's beam if that was begun.
    pub(crate) fn meet(&self, ray: &CameraRay, beam: Option<&mut Beam>, tile: &mut Tile) -> Option<Hit> {
        tile.work.primary += 1;
        let accel = &self.scene.accel;
        match beam {
            Some(beam) => accel.closest_in(beam, ray.origin, ray.direction, ray.start),
            None => accel.closest(ray.origin, ray.direction),
        }
    }

    /// The identity of the fibre that a camera ray's hit is on; behind a lens, of what a pinhole amid the exposure sees at
    /// the same place of the film.
    pub(crate) fn identity(
        &self,
        (x, y): (usize, usize),
        sampler: &PixelSampler,
        n: u32,
        (ray, hit): (&CameraRay, Option<&Hit>),
        tile: &mut Tile,
    ) -> Option<SampleHit> {
        if self.pinhole {
            return hit.and_then(|hit| self.seen(ray, hit));
        }
        let [fx, fy] = sampler.film(n);
        let ray = self.maker.ray(x as f64 + f64::from(fx), y as f64 + f64::from(fy));
        self.meet(&ray, None, tile).and_then(|hit| self.seen(&ray, &hit))
    }

    /// The identity of what a camera ray met, if that is a fibre.
    fn seen(&self, ray: &CameraRay, hit: &Hit) -> Option<SampleHit> {
        let Hit::Fibre { t, strand, point, along } = *hit else {
            return None;
        };
        let depth = ray.depth_at_start + (ray.start + f64::from(t)) * ray.depth_per_t;
        Some(SampleHit {
            strand,
            segment: point - self.scene.scene.strands.offsets[strand as usize],
            along,
            depth_mm: depth as f32,
        })
    }
}
