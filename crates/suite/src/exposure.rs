//! A light meter: the exposure of a scene that states none.

use crate::{SceneJob, SuiteError};
use serde::{Deserialize, Serialize};
use strandbench_renderer::{Render, RenderError, RenderScene, Settings};
use strandbench_scenes::{Scene, Sensor};
use strandbench_types::Monitor;

/// Where on the sensor's scale the bright hair is put: room for highlights above, little noise below.
pub const METERED_SHARE: f64 = 0.7;
/// Share of the hair's blocks that stay below [`METERED_SHARE`].
const QUANTILE_PERCENT: usize = 99;
/// Rays through each pixel of the pilot, one of which is followed beyond its first scattering.
const PILOT_SAMPLES: u32 = 8;
/// Side of the blocks whose mean is read, px: with a path a pixel, the light of paths is noisy, and the brightest
/// pixels of a noisy image are not the brightest hair. 64 pixels make that noise small.
const BLOCK_PX: usize = 8;

/// What the light meter found: `metered` in `render.json`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Metered {
    /// Radiance that was made the sensor's full scale.
    pub full_scale_radiance: f32,
    /// The 99th percentile of the hair's radiance in the sensor's response, over the means of blocks of 8x8 pixels
    /// that are mostly hair (of single pixels, if there is no such block).
    pub bright_radiance: f32,
    /// Pixels of the reference view of which at least half is hair.
    pub hair_pixels: u64,
    /// Rays through each pixel of the pilot.
    pub samples_per_pixel: u32,
}

/// Meters the hair in the reference view if the scene's description has no `sensor.full_scale_radiance`: a pilot
/// of few rays a pixel, then the exposure that puts the 99th percentile of the hair (blocks of 8x8 pixels) at seven
/// tenths of full scale. Light is followed as far as `render` says, without its clamp.
///
/// # Errors
/// If the scene cannot be rendered, the reference view shows no hair or only black hair, or the work is
/// cancelled.
pub(crate) fn meter(
    job: &SceneJob,
    scene: &mut Scene,
    render: &Settings,
    seed: u64,
    monitor: &dyn Monitor,
) -> Result<Option<Metered>, SuiteError> {
    if !job.metered() {
        return Ok(None);
    }
    let failed = |problem: String| SuiteError::Render { scene: job.name.clone(), problem };
    let settings = Settings {
        samples_per_pixel: PILOT_SAMPLES,
        max_samples_per_pixel: PILOT_SAMPLES,
        indirect_every: PILOT_SAMPLES,
        // A limit on radiance would be relative to the exposure that is looked for.
        clamp: 0.0,
        ..render.clone()
    };
    let pilot = RenderScene::new(scene)
        .and_then(|traced| traced.render(0, &settings, seed, monitor))
        .map_err(|e| match e {
            RenderError::Cancelled(_) => SuiteError::Cancelled,
            other => failed(other.to_string()),
        })?;
    let found = read(&pilot, &scene.sensor).ok_or_else(|| {
        let camera = &scene.rig.cameras[0].name;
        failed(format!(
            "nothing to meter: camera {camera} sees no hair (no pixel is covered by half) or no light comes from \
             it; check the rig's distance, direction and focal length, the hair's scale and place, and the lights"
        ))
    })?;
    scene.sensor.full_scale_radiance = found.full_scale_radiance;
    Ok(Some(found))
}

/// The reading of a pilot; `None` without hair or without light.
fn read(pilot: &Render, sensor: &Sensor) -> Option<Metered> {
    let hits = &pilot.hits;
    let is_hair = |i: usize| 2 * (hits.offsets[i + 1] - hits.offsets[i]) >= u32::from(hits.rays[i]);
    let weigh = |rgb: &[f32; 3]| (0..3).map(|c| f64::from(sensor.response_rgb[c]) * f64::from(rgb[c])).sum();
    let (width, height) = pilot.radiance_rgb.size();
    let lit = |i: usize| {
        let value: f64 = weigh(&pilot.radiance_rgb.data[i]);
        (is_hair(i) && value.is_finite()).then_some(value)
    };
    let pixels: Vec<f64> = (0..width * height).filter_map(lit).collect();
    let mut light = Vec::new();
    for y in (0..height).step_by(BLOCK_PX) {
        for x in (0..width).step_by(BLOCK_PX) {
            let rows = y..(y + BLOCK_PX).min(height);
            let block = rows.flat_map(|y| (x..(x + BLOCK_PX).min(width)).map(move |x| y * width + x));
            let values: Vec<f64> = block.filter_map(lit).collect();
            if 2 * values.len() >= BLOCK_PX * BLOCK_PX {
                light.push(values.iter().sum::<f64>() / values.len() as f64);
            }
        }
    }
    let hair_pixels = pixels.len() as u64;
    if light.is_empty() {
        light = pixels;
    }
    light.sort_unstable_by(f64::total_cmp);
    let rank = (light.len() * QUANTILE_PERCENT).div_ceil(100).max(1);
    let bright = *light.get(rank - 1)?;
    (bright > 0.0).then(|| Metered {
        full_scale_radiance: (bright / METERED_SHARE) as f32,
        bright_radiance: bright as f32,
        hair_pixels,
        samples_per_pixel: PILOT_SAMPLES,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use strandbench_types::{Plane, SampleHit, SampleHits};

    /// Pixels in a row: hits of 8 rays and radiance.
    fn pilot(pixels: &[(u32, f32)]) -> Render {
        let n = pixels.len();
        let mut offsets = vec![0];
        for p in pixels {
            offsets.push(offsets[offsets.len() - 1] + p.0);
        }
        let hit = SampleHit { strand: 0, segment: 0, along: 0.0, depth_mm: 1.0 };
        let hits = vec![hit; offsets[n] as usize];
        Render {
            radiance_rgb: Plane::from_vec(n, 1, pixels.iter().map(|p| [p.1, 0.0, 3.0 * p.1]).collect()),
            variance: Plane::filled(n, 1, 0.0),
            hits: SampleHits { width: n, height: 1, rays: vec![8; n], offsets, hits },
            stats: Default::default(),
        }
    }

    #[test]
    fn the_bright_hair_fills_seven_tenths_and_skin_does_not_count() {
        let sensor = Sensor { response_rgb: [0.5, 0.2, 0.5], ..Sensor::default() };
        // A hundred hair pixels of radiance 1 to 100 (response: twice that), and brighter pixels of less hair.
        let mut pixels: Vec<(u32, f32)> = (1..=100).map(|i| (4 + i % 5, i as f32)).collect();
        pixels.extend([(3, 900.0); 50]);
        let found = read(&pilot(&pixels), &sensor).unwrap();
        assert_eq!((found.hair_pixels, found.bright_radiance), (100, 198.0));
        assert!((f64::from(found.full_scale_radiance) * METERED_SHARE - 198.0).abs() < 1e-4);
    }

    #[test]
    fn single_bright_pixels_are_noise_and_bright_blocks_are_hair() {
        let sensor = Sensor { response_rgb: [1.0, 0.0, 0.0], ..Sensor::default() };
        // 20 by 10 blocks; one pixel in 64 is bright, and two blocks (the top 1 %) are.
        let (width, height) = (160, 80);
        let block = |i: usize| (i % width / 8, i / width / 8);
        let value = |i: usize| match (block(i), i % 8, i / width % 8) {
            ((3, 4) | (9, 2) | (10, 2), ..) => 3.0,
            (_, 2, 5) => 33.0,
            _ => 0.5,
        };
        let n = width * height;
        let mut pilot = pilot(&(0..n).map(|i| (8, value(i))).collect::<Vec<_>>());
        pilot.radiance_rgb = Plane::from_vec(width, height, pilot.radiance_rgb.data);
        let found = read(&pilot, &sensor).unwrap();
        assert_eq!((found.hair_pixels, found.bright_radiance), (n as u64, 3.0));
    }

    #[test]
    fn no_hair_and_no_light_are_no_reading() {
        assert_eq!(read(&pilot(&[(3, 5.0), (0, 1.0)]), &Sensor::default()), None);
        assert_eq!(read(&pilot(&[(8, 0.0)]), &Sensor::default()), None);
    }
}
