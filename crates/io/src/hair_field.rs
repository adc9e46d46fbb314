//! A field of distances to hair: two NumPy arrays and what their axes mean.

use crate::atomic::{atomic_write, check_folder, merge_folder};
use crate::error::{FormatError, IoError, Result};
use crate::npy::{Array, header};
use crate::read::read_all;
use crate::rig_json::check_version;
use serde::{Deserialize, Serialize};
use std::path::Path;
use strandbench_types::HairField;

const DISTANCE: &str = "hair_distance.npy";
const STRAND: &str = "hair_strand.npy";
const ABOUT: &str = "hair_field.json";
const FORMAT: &str = "strandbench-hair-field";
const VERSION: u32 = 1;
const REMEDY: &str = "make the truth again";

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct About {
    format: String,
    version: u32,
    #[serde(default)]
    note: String,
    /// Order of the arrays' axes.
    axes: [String; 3],
    /// Centre of voxel (0, 0, 0).
    origin_mm: [f32; 3],
    voxel_mm: f32,
    size: [usize; 3],
}

/// Writes `hair_distance.npy` (float32, mm), `hair_strand.npy` (uint32) and `hair_field.json` (origin, voxel, axes) into
/// a folder whose other files stay. The arrays have shape (nx, ny, nz) in C order.
///
/// # Errors
/// If sizes contradict each other or a file cannot be written.
pub fn write_hair_field(dir: &Path, field: &HairField) -> Result<()> {
    check(dir, field)?;
    let about = About {
        format: FORMAT.into(),
        version: VERSION,
        note: "distance to the nearest fibre's axis, and its strand, at origin_mm + voxel_mm * (x, y, z)"
            .into(),
        axes: ["x", "y", "z"].map(String::from),
        origin_mm: field.origin_mm.to_array(),
        voxel_mm: field.voxel_mm,
        size: field.size,
    };
    merge_folder(
        dir,
        |_| false,
        |tmp| {
            atomic_write(&tmp.join(DISTANCE), |w| {
                w.write_all(&header("<f4", &field.size))?;
                field.distance_mm.iter().try_for_each(|d| w.write_all(&d.to_le_bytes()))
            })?;
            atomic_write(&tmp.join(STRAND), |w| {
                w.write_all(&header("<u4", &field.size))?;
                field.strand.iter().try_for_each(|s| w.write_all(&s.to_le_bytes()))
            })?;
            let text = serde_json::to_string_pretty(&about).expect("plain data") + "\n";
            atomic_write(&tmp.join(ABOUT), |w| w.write_all(text.as_bytes()))
        },
    )
}

/// Reads what [`write_hair_field`] wrote, bit for bit.
///
/// # Errors
/// Names the missing or inconsistent file.
pub fn read_hair_field(dir: &Path) -> Result<HairField> {
    check_folder(dir)?;
    let path = dir.join(ABOUT);
    let about: About = serde_json::from_slice(&read_all(&path)?)
        .map_err(|e| IoError::new(&path, format!("not a field of distances: {e}; {REMEDY}")))?;
    check_version(&path, (&about.format, about.version), (FORMAT, VERSION))?;
    if about.axes != ["x", "y", "z"] {
        let fault = format!("the axes are {:?}, not x, y, z; {REMEDY}", about.axes);
        return Err(IoError::new(&path, fault));
    }
    let array = |name: &str| Ok::<_, IoError>((dir.join(name), read_all(&dir.join(name))?));
    let sized = |a: &Array| {
        if a.shape == about.size {
            return Ok(());
        }
        let fault = format!("shape {} where {ABOUT} says {:?}", a.shown_shape(), about.size);
        Err(FormatError::new("header", fault, REMEDY))
    };
    let (path, bytes) = array(DISTANCE)?;
    let distances = Array::parse(&bytes).and_then(|a| sized(&a).and_then(|()| a.floats()));
    let distance_mm = distances.map_err(|e| e.in_file(&path))?;
    let (path, bytes) = array(STRAND)?;
    let strands = Array::parse(&bytes).and_then(|a| sized(&a).and_then(|()| a.indices()));
    let strand = strands.map_err(|e| e.in_file(&path))?;
    let (origin_mm, voxel_mm) = (about.origin_mm.into(), about.voxel_mm);
    let field = HairField { origin_mm, voxel_mm, size: about.size, distance_mm, strand };
    check(dir, &field)?;
    Ok(field)
}

fn check(dir: &Path, f: &HairField) -> Result<()> {
    let bad = |fault: String| Err(IoError::new(dir, format!("{fault}; {REMEDY}")));
    let voxels = f.size.iter().try_fold(1usize, |a, &n| a.checked_mul(n)).filter(|&n| n > 0);
    if voxels != Some(f.distance_mm.len()) || voxels != Some(f.strand.len()) {
        let (d, s) = (f.distance_mm.len(), f.strand.len());
        return bad(format!("a field of {:?} voxels has {d} distances and {s} strands", f.size));
    }
    if !(f.voxel_mm > 0.0 && f.voxel_mm.is_finite() && f.origin_mm.is_finite()) {
        return bad(format!("voxels of {} mm at {} are none", f.voxel_mm, f.origin_mm));
    }
    if let Some(i) = f.distance_mm.iter().position(|d| !(*d >= 0.0 && d.is_finite())) {
        return bad(format!("distance {i} is {} mm", f.distance_mm[i]));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use proptest::prelude::*;
    use std::fs;

    fn field() -> HairField {
        HairField {
            origin_mm: Vec3::new(-1.5, 0.1, 77.7),
            voxel_mm: 0.7,
            size: [2, 3, 4],
            distance_mm: (0..24).map(|i| i as f32 * 0.37).collect(),
            strand: (0..24).map(|i| u32::MAX - i).collect(),
        }
    }

    fn written() -> tempfile::TempDir {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join("else.txt"), "stays").unwrap();
        write_hair_field(dir.path(), &field()).unwrap();
        dir
    }

    #[test]
    fn a_field_comes_back_and_numpy_finds_its_values_where_they_should_be() {
        let dir = written();
        assert_eq!(read_hair_field(dir.path()).unwrap(), field());
        assert!(dir.path().join("else.txt").exists());
        let bytes = fs::read(dir.path().join(DISTANCE)).unwrap();
        // NumPy's format 1: magic, version, length of the header, which ends with a line feed at a multiple of 64.
        assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00");
        let start = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        assert!(start.is_multiple_of(64) && bytes[start - 1] == b'\n' && bytes.len() == start + 4 * 24);
        let dict = std::str::from_utf8(&bytes[10..start]).unwrap().trim_end();
        assert_eq!(dict, "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3, 4,), }");
        // Voxel (1, 2, 3) is the last.
        assert_eq!(bytes[bytes.len() - 4..], (23.0f32 * 0.37).to_le_bytes());
        let centre = field().centre_mm([1, 2, 3]);
        assert!(centre.distance(glam::DVec3::new(-0.8, 1.5, 79.8)) < 1e-5, "{centre}");
    }

    #[test]
    fn what_contradicts_is_named() {
        let said = |name: &str, change: &dyn Fn(Vec<u8>) -> Vec<u8>| {
            let dir = written();
            let path = dir.path().join(name);
            fs::write(&path, change(fs::read(&path).unwrap())).unwrap();
            read_hair_field(dir.path()).unwrap_err().to_string()
        };
        let swap = |from: &'static str, to: &'static str| {
            move |b: Vec<u8>| String::from_utf8(b).unwrap().replace(from, to).into_bytes()
        };
        assert!(said(ABOUT, &swap("\"version\": 1", "\"version\": 2")).contains("version 2"));
        assert!(said(ABOUT, &swap("\"voxel_mm\": 0.7", "\"voxel_mm\": 0.0")).contains("voxels of 0 mm"));
        assert!(said(ABOUT, &swap("\"x\"", "\"z\"")).contains("axes are"));
        assert!(said(ABOUT, &swap("note", "nota")).contains("nota"));
        assert!(said(ABOUT, &swap("2,\n    3", "3,\n    2")).contains("shape (2, 3, 4) where"));
        let cut = |b: Vec<u8>| b[..b.len() - 1].to_vec();
        assert!(said(STRAND, &cut).contains("95 bytes of values"));
        let nan = |mut b: Vec<u8>| {
            let n = b.len();
            b[n - 4..].copy_from_slice(&f32::NAN.to_le_bytes());
            b
        };
        assert!(said(DISTANCE, &nan).contains("distance 23 is NaN"));
        let dir = written();
        fs::copy(dir.path().join(DISTANCE), dir.path().join(STRAND)).unwrap();
        assert!(read_hair_field(dir.path()).unwrap_err().to_string().contains("no unsigned integers"));
        fs::remove_file(dir.path().join(STRAND)).unwrap();
        assert!(read_hair_field(dir.path()).unwrap_err().to_string().contains(STRAND));
        let lost = HairField { size: [2, 3, 5], ..field() };
        assert!(write_hair_field(dir.path(), &lost).unwrap_err().to_string().contains("24 distances"));
    }

    proptest! {
        #[test]
        fn damage_never_panics(
            which in 0usize..3,
            changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        ) {
            let dir = written();
            let path = dir.path().join([DISTANCE, STRAND, ABOUT][which]);
            let mut b = fs::read(&path).unwrap();
            for (at, v) in changes {
                let i = at.index(b.len());
                b[i] = v;
            }
            fs::write(&path, b).unwrap();
            if let Ok(f) = read_hair_field(dir.path()) {
                prop_assert_eq!(f.size.iter().product::<usize>(), f.strand.len());
            }
        }
    }
}
