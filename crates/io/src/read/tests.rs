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

#[test]
fn every_written_format_is_read_back_and_other_endings_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let mut s = StrandSet::new();
    s.push_tapered(
        &[Vec3::ZERO, Vec3::new(0.1, 1.0 / 3.0, -7e-8), Vec3::new(0.3, 0.9, 0.1)],
        &[0.05, 0.04, 0.03],
    );
    s.push(&[Vec3::X, Vec3::new(1.0, 2.5, 0.0)], 0.06);
    let options = |radius_mm| ImportOptions { radius_mm, max_segment_mm: 100.0, ..Default::default() };
    for (ending, holds_radii) in [("hair", true), ("ply", true), ("data", false), ("obj", false)] {
        let path = dir.path().join("s").with_extension(ending);
        write_strands(&path, &s).unwrap();
        let (back, report) = read_strands(&path, &options(Some(0.02))).unwrap();
        let given = |set: &StrandSet| set.points.iter().filter(|p| s.points.contains(p)).count();
        assert_eq!((back.len(), given(&back)), (2, 5), "{ending}: given points must stay");
        assert_eq!((report.points_in_file, back.radii_mm[0]), (5, 0.02));
        match read_strands(&path, &options(None)) {
            Ok((back, _)) => assert!(holds_radii && back.radii_mm[0] == 0.05, "{ending}"),
            Err(e) => assert!(!holds_radii && e.problem.contains("option radius_mm"), "{ending}: {e}"),
        }
        // A magic outweighs a wrong ending.
        if holds_radii {
            let other = dir.path().join("wrong.data");
            std::fs::copy(&path, &other).unwrap();
            assert_eq!(
                read_strands(&other, &options(None)).unwrap().0,
                read_strands(&path, &options(None)).unwrap().0
            );
        }
    }
    let e = write_strands(&dir.path().join("s.abc"), &s).unwrap_err();
    assert!(e.problem.contains("\"abc\"") && !dir.path().join("s.abc").exists(), "{e}");
    std::fs::write(dir.path().join("s.abc"), b"what").unwrap();
    let e = read_strands(&dir.path().join("s.abc"), &options(None)).unwrap_err();
    assert!(e.path.ends_with("s.abc") && e.problem.contains("give .hair"), "{e}");
    s.points[4].y = f32::NAN;
    let e = write_strands(&dir.path().join("nan.data"), &s).unwrap_err();
    assert!(e.problem.contains("strand 1, point 1") && !dir.path().join("nan.data").exists(), "{e}");
    let long = vec![Vec3::X; 65_537].iter().enumerate().map(|(i, p)| *p * i as f32).collect::<Vec<_>>();
    let mut s = StrandSet::new();
    s.push(&long[..65_536], 0.04);
    write_strands(&dir.path().join("long.hair"), &s).unwrap();
    assert_eq!(read_exact_hair(&dir.path().join("long.hair")).unwrap(), s);
    let mut s = StrandSet::new();
    s.push(&long, 0.04);
    assert!(write_strands(&dir.path().join("long.hair"), &s).unwrap_err().problem.contains("65537 points"));
}

#[test]
fn an_empty_or_missing_file_and_a_folder_are_named() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("e.hair");
    std::fs::write(&path, b"").unwrap();
    let e = |p: &Path| read_strands(p, &ImportOptions::default()).unwrap_err().to_string();
    assert!(e(&path).ends_with("e.hair: the file is empty; export or fetch it again"));
    assert!(e(&dir.path().join("none.hair")).contains("none.hair: cannot read"));
    assert!(e(dir.path()).contains("cannot read"));
}
