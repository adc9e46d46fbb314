use super::*;
use glam::Vec3;

/// Tests on real files need STRANDBENCH_DATA; without it they are ignored, and say so.
fn data(file: &str) -> Option<std::path::PathBuf> {
    let Some(root) = std::env::var_os("STRANDBENCH_DATA") else {
        println!("ignored, no data: set STRANDBENCH_DATA");
        return None;
    };
    Some(Path::new(&root).join(file))
}

#[test]
fn real_hair_has_its_known_size_and_hangs_down_behind_the_face() {
    let Some(path) = data("hair/cem_yuksel/straight.hair") else { return };
    let options = ImportOptions::preset("yuksel").unwrap();
    let t = std::time::Instant::now();
    let (set, report) = read_strands(&path, &options).unwrap();
    println!("{report:?} in {:?}", t.elapsed());
    assert_eq!((report.strands_in_file, report.points_in_file), (10_000, 160_000));
    assert_eq!((report.zero_length_strands, report.repeated_points), (0, 0));
    // The file's own bounds, x -32.5..30.9, y -33.9..24.1, z -22.7..63.7, at 2.5 mm, up z, forward y; the
    // spline may bulge a little beyond its points.
    let [lo, hi] = report.bounds_mm;
    for (got, want) in lo.iter().chain(&hi).zip([-77.25, -56.77, -84.75, 81.24, 159.19, 60.18]) {
        assert!((got - want).abs() < 1.5, "{:?}", report.bounds_mm);
    }
    let mean = |k: fn(&[Vec3]) -> Vec3| set.iter().map(k).sum::<Vec3>() / set.len() as f32;
    let (root, tip) = (mean(|s| s[0]), mean(|s| s[s.len() - 1]));
    assert!(root.y - tip.y > 150.0, "roots above tips: {root} {tip}");
    assert!(root.z - tip.z > 15.0, "tips behind roots: {root} {tip}");
    let longest = set.iter().flat_map(|s| s.windows(2)).map(|w| w[0].distance(w[1])).fold(0.0, f32::max);
    assert!(longest <= 5.0001, "{longest}");
    assert!(report.points_resampled > 400_000 && report.points_resampled < 1_500_000, "{report:?}");
}
