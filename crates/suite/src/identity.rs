//! The identity buffer condensed to one answer a pixel, for EXR viewers and other programs.

use glam::Vec3;
use std::path::Path;
use strandbench_io::IoError;
use strandbench_types::{Plane, SampleHits, StrandSet};

/// Writes `strand`, `segment`, `along`, `depth_mm`, `tangent.X/Y/Z` (unit, world) and `coverage` (share of the
/// pixel's rays that hit hair first). All but coverage describe the strand that most of the pixel's rays hit
/// (of several the one with the lowest index), at the hit nearest to the camera; without hair they are -1 or,
/// for depth and tangent, NaN and zero. 32-bit floats hold strand indices exactly up to 16,777,216.
pub(crate) fn write(path: &Path, hits: &SampleHits, strands: &StrandSet) -> Result<(), IoError> {
    let plane = |value: f32| Plane::filled(hits.width, hits.height, value);
    let (mut strand, mut segment, mut along) = (plane(-1.0), plane(-1.0), plane(-1.0));
    let (mut depth, mut coverage) = (plane(f32::NAN), plane(0.0));
    let mut tangent = [plane(0.0), plane(0.0), plane(0.0)];
    let mut ids = Vec::new();
    for i in 0..hits.width * hits.height {
        let of_pixel = hits.pixel(i);
        coverage.data[i] = of_pixel.len() as f32 / f32::from(hits.rays[i].max(1));
        let Some(id) = most_frequent(of_pixel.iter().map(|h| h.strand), &mut ids) else { continue };
        let Some(hit) =
            of_pixel.iter().filter(|h| h.strand == id).min_by(|a, b| a.depth_mm.total_cmp(&b.depth_mm))
        else {
            continue;
        };
        strand.data[i] = id as f32;
        segment.data[i] = hit.segment as f32;
        along.data[i] = hit.along;
        depth.data[i] = hit.depth_mm;
        let points = strands.strand(id as usize);
        let ends = points.get(hit.segment as usize).zip(points.get(hit.segment as usize + 1));
        let t = ends.map_or(Vec3::ZERO, |(a, b)| (*b - *a).normalize_or_zero());
        for (plane, v) in tangent.iter_mut().zip(t.to_array()) {
            plane.data[i] = v;
        }
    }
    strandbench_io::write_exr(
        path,
        &[
            ("strand", &strand),
            ("segment", &segment),
            ("along", &along),
            ("depth_mm", &depth),
            ("tangent.X", &tangent[0]),
            ("tangent.Y", &tangent[1]),
            ("tangent.Z", &tangent[2]),
            ("coverage", &coverage),
        ],
    )
}

fn most_frequent(values: impl Iterator<Item = u32>, sorted: &mut Vec<u32>) -> Option<u32> {
    sorted.clear();
    sorted.extend(values);
    sorted.sort_unstable();
    let runs = sorted.chunk_by(|a, b| a == b);
    // The first of the longest runs: max_by_key would take the last.
    runs.fold(None, |best: Option<&[u32]>, run| match best {
        Some(b) if b.len() >= run.len() => Some(b),
        _ => Some(run),
    })
    .map(|run| run[0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use strandbench_types::SampleHit;

    #[test]
    fn the_most_frequent_and_of_equals_the_lowest() {
        let mut scratch = Vec::new();
        assert_eq!(most_frequent([3, 1, 3, 2, 1].into_iter(), &mut scratch), Some(1));
        assert_eq!(most_frequent([3, 1, 3].into_iter(), &mut scratch), Some(3));
        assert_eq!(most_frequent([].into_iter(), &mut scratch), None);
    }

    #[test]
    fn a_pixel_shows_its_main_strand_at_the_nearest_hit() {
        let mut strands = StrandSet::new();
        strands.push(&[Vec3::ZERO, Vec3::X, Vec3::new(1.0, 2.0, 0.0)], 0.04);
        strands.push(&[Vec3::ZERO, Vec3::Z], 0.04);
        let hit = |strand, segment, depth_mm| SampleHit { strand, segment, along: 0.25, depth_mm };
        let hits = SampleHits {
            width: 2,
            height: 1,
            rays: vec![4, 4],
            offsets: vec![0, 3, 3],
            hits: vec![hit(1, 0, 90.0), hit(0, 0, 101.0), hit(0, 1, 100.0)],
        };
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.exr");
        write(&path, &hits, &strands).unwrap();
        let channels = strandbench_io::read_exr(&path).unwrap();
        let value = |name: &str, i: usize| channels.iter().find(|(n, _)| n == name).unwrap().1.data[i];
        let got = ["strand", "segment", "depth_mm", "tangent.Y", "coverage"].map(|n| value(n, 0));
        assert_eq!(got, [0.0, 1.0, 100.0, 1.0, 0.75]);
        assert!(value("strand", 1) == -1.0 && value("depth_mm", 1).is_nan() && value("coverage", 1) == 0.0);
    }
}
