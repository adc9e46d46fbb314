//! Light from all around from its parameters or a file.

use crate::Environment;
use crate::spec::EnvironmentSpec;
use std::path::Path;
use strandbench_io::read_exr;
use strandbench_types::Plane;

/// Rows of a gradient's map: steps of one in 128 of its range, below what light on hair can show.
const GRADIENT_ROWS: usize = 128;
/// Widest map accepted, px: 32 M texels.
const MAX_WIDTH_PX: usize = 8192;

/// Makes the environment; `file` is the map's place if there is one.
///
/// # Errors
/// The problem and its remedy, if the map cannot be read, is not a lat-long map, or holds a value that is no
/// radiance.
pub(crate) fn environment(spec: &EnvironmentSpec, file: Option<&Path>) -> Result<Environment, String> {
    let radiance_rgb = match file {
        Some(path) => map(path, spec.rgb)?,
        None if spec.zenith_rgb.is_none() && spec.nadir_rgb.is_none() => Plane::filled(1, 1, spec.rgb),
        None => gradient(spec),
    };
    Ok(Environment { radiance_rgb, azimuth_deg: spec.azimuth_deg })
}

/// Linear in the sine of the elevation; each row has its mean over the row's solid angle.
fn gradient(spec: &EnvironmentSpec) -> Plane<[f32; 3]> {
    let edge = |row: usize| libm::cos(std::f64::consts::PI * row as f64 / GRADIENT_ROWS as f64);
    let rows = (0..GRADIENT_ROWS).map(|row| {
        let sine = (0.5 * (edge(row) + edge(row + 1))) as f32;
        let end = if sine > 0.0 { spec.zenith_rgb } else { spec.nadir_rgb }.unwrap_or(spec.rgb);
        std::array::from_fn(|c| spec.rgb[c] + (end[c] - spec.rgb[c]) * sine.abs())
    });
    Plane::from_vec(1, GRADIENT_ROWS, rows.collect())
}

fn map(path: &Path, factor: [f32; 3]) -> Result<Plane<[f32; 3]>, String> {
    let mut channels = read_exr(path).map_err(|e| e.to_string())?;
    let fault = |what: String| format!("{}: {what}", path.display());
    let mut take = |name: &str| {
        let at = channels.iter().position(|c| c.0 == name);
        at.map(|i| channels.swap_remove(i).1)
            .ok_or_else(|| fault(format!("channel {name} is missing; a map has R, G and B")))
    };
    let [r, g, b] = [take("R")?, take("G")?, take("B")?];
    let (width, height) = r.size();
    if width > MAX_WIDTH_PX || width != 2 * height {
        return Err(fault(format!(
            "{width}x{height} px; a lat-long map is twice as wide as high and at most {MAX_WIDTH_PX} px wide"
        )));
    }
    let texels: Vec<[f32; 3]> = (0..width * height)
        .map(|i| {
            let rgb = [r.data[i], g.data[i], b.data[i]];
            std::array::from_fn(|c| rgb[c] * factor[c])
        })
        .collect();
    let bad = |rgb: &[f32; 3]| rgb.iter().any(|&v| !(0.0..=1e9).contains(&v));
    if let Some(i) = texels.iter().position(bad) {
        let (x, y) = (i % width, i / width);
        return Err(fault(format!("texel ({x}, {y}) is {:?}; radiance lies in 0..1e9", texels[i])));
    }
    Ok(Plane::from_vec(width, height, texels))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spec() -> EnvironmentSpec {
        EnvironmentSpec {
            rgb: [1.0, 2.0, 3.0],
            zenith_rgb: None,
            nadir_rgb: None,
            file: None,
            azimuth_deg: 0.0,
        }
    }

    #[test]
    fn one_radiance_is_one_texel_and_a_gradient_has_its_ends() {
        assert_eq!(environment(&spec(), None).unwrap().radiance_rgb, Plane::filled(1, 1, [1.0, 2.0, 3.0]));
        let sky = EnvironmentSpec { zenith_rgb: Some([3.0, 0.0, 3.0]), ..spec() };
        let map = environment(&sky, None).unwrap().radiance_rgb;
        let top = map.data[0];
        assert!((top[0] - 3.0).abs() < 1e-3 && top[1] < 1e-3, "{top:?}");
        // Thirty degrees up is half of the way; the mean of the sphere is a quarter of it.
        let up30 = map.data[GRADIENT_ROWS / 3];
        assert!((up30[0] - 2.0).abs() < 0.02, "{up30:?}");
        assert_eq!(map.data[GRADIENT_ROWS - 1], [1.0, 2.0, 3.0]);
    }

    #[test]
    fn a_map_is_read_with_its_factor_and_bad_ones_are_named() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("sky.exr");
        let write = |w: usize, h: usize, value: f32, names: [&str; 3]| {
            let plane = Plane::from_vec(w, h, (0..w * h).map(|i| value * (1 + i) as f32).collect());
            let channels: Vec<(&str, &Plane<f32>)> = names.iter().map(|n| (*n, &plane)).collect();
            strandbench_io::write_exr(&path, &channels).unwrap();
        };
        let named = EnvironmentSpec { file: Some(path.clone()), ..spec() };
        let expect = |part: &str| {
            let e = environment(&named, Some(&path)).unwrap_err();
            assert!(e.contains(part) && e.contains("sky.exr"), "{e} lacks {part}");
        };
        expect("sky.exr");
        write(4, 2, 0.5, ["R", "G", "B"]);
        let map = environment(&named, Some(&path)).unwrap().radiance_rgb;
        assert_eq!((map.size(), map.data[5]), ((4, 2), [3.0, 6.0, 9.0]));
        write(4, 2, -0.5, ["R", "G", "B"]);
        expect("texel (0, 0)");
        write(4, 2, f32::NAN, ["R", "G", "B"]);
        expect("texel (0, 0)");
        write(4, 4, 0.5, ["R", "G", "B"]);
        expect("twice as wide as high");
        write(4, 2, 0.5, ["R", "G", "Y"]);
        expect("channel B is missing");
    }
}
