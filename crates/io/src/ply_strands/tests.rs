use super::*;
use crate::options::ImportOptions;

fn ply(rest: &str) -> Vec<u8> {
    format!("ply\nformat ascii 1.0\n{rest}").into_bytes()
}

const FIVE: &str = "element vertex 5\nproperty float x\nproperty float y\nproperty float z\n";
const FIVE_POINTS: &str = "0 0 0\n1 0 0\n2 0 0\n3 0 0\n4 0 0\n";

fn xs(raw: &RawStrands) -> Vec<Vec<f32>> {
    raw.offsets
        .windows(2)
        .map(|w| raw.points[w[0] as usize..w[1] as usize].iter().map(|p| p.x).collect())
        .collect()
}

fn edges(list: &str) -> Parsed<RawStrands> {
    let n = list.lines().count();
    let header = format!("element edge {n}\nproperty int vertex1\nproperty int vertex2\nend_header\n");
    parse_ply_strands(&ply(&format!("{FIVE}{header}{FIVE_POINTS}{list}")), None)
}

#[test]
fn edges_make_paths_that_begin_where_edges_set_out() {
    assert_eq!(xs(&edges("0 1\n1 2\n3 4\n").unwrap()), [vec![0.0, 1.0, 2.0], vec![3.0, 4.0]]);
    // Out of order, and from a higher to a lower index: 4 -> 2 -> 0.
    assert_eq!(xs(&edges("2 0\n4 2\n").unwrap()), [vec![4.0, 2.0, 0.0], vec![1.0], vec![3.0]]);
    // Directions that disagree: the lower index first.
    assert_eq!(xs(&edges("3 1\n3 4\n").unwrap())[1], [1.0, 3.0, 4.0]);
}

#[test]
fn branches_loops_and_strangers_are_errors() {
    assert!(edges("0 1\n1 2\n1 3\n").unwrap_err().fault.contains("third edge at vertex 1"));
    assert!(edges("0 1\n1 2\n2 0\n").unwrap_err().fault.contains("closed loop"));
    assert!(edges("0 1\n0 1\n").unwrap_err().fault.contains("closed loop"));
    assert!(edges("2 2\n").unwrap_err().fault.contains("closed loop"));
    assert!(edges("0 5\n").unwrap_err().fault.contains("vertex 5"));
    assert!(edges("0 -1\n").unwrap_err().fault.contains("vertex -1"));
}

#[test]
fn lists_ids_comments_and_options_divide_vertices_too() {
    let lists = format!(
        "{FIVE}element line 2\nproperty list int int vertex_indices\nend_header\n{FIVE_POINTS}3 4 3 1\n2 0 2\n"
    );
    assert_eq!(xs(&parse_ply_strands(&ply(&lists), None).unwrap()), [vec![4.0, 3.0, 1.0], vec![0.0, 2.0]]);
    let ids = |ids: [i32; 5]| {
        let rows: String = ids.iter().enumerate().map(|(i, id)| format!("{i} 0 0 {id}\n")).collect();
        parse_ply_strands(&ply(&format!("{FIVE}property int strand_id\nend_header\n{rows}")), None)
    };
    assert_eq!(xs(&ids([7, 7, 3, 3, 3]).unwrap()), [vec![0.0, 1.0], vec![2.0, 3.0, 4.0]]);
    assert!(ids([7, 7, 3, 3, 7]).unwrap_err().fault.contains("two places"));
    let runs = |comment: &str, option| {
        parse_ply_strands(&ply(&format!("{comment}{FIVE}end_header\n{FIVE_POINTS}")), option)
    };
    assert_eq!(runs("comment points_per_strand: 5\n", None).unwrap().offsets, [0, 5]);
    assert_eq!(runs("", Some(5)).unwrap().offsets, [0, 5]);
    assert!(runs("comment points_per_strand 2\n", None).unwrap_err().fault.contains("not a multiple of 2"));
}

#[test]
fn clouds_and_meshes_are_refused_by_name() {
    let e = |header: &str, rows: &str| {
        parse_ply_strands(&ply(&format!("{header}end_header\n{rows}")), None).unwrap_err().fault
    };
    assert!(e(FIVE, FIVE_POINTS).contains("point cloud"));
    let line_cloud = "element vertex 1\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\n\
        property float ny\nproperty float nz\n";
    assert!(e(line_cloud, "0 0 0 1 0 0\n").contains("line cloud"));
    let mesh = format!("{FIVE}element face 1\nproperty list uchar int vertex_indices\n");
    assert!(e(&mesh, &format!("{FIVE_POINTS}3 0 1 2\n")).contains("triangle mesh"));
    assert!(e("element vertex 1\nproperty float x\nproperty float y\n", "0 0\n").contains("lacks"));
    assert!(e("element face 0\nproperty list uchar int vertex_indices\n", "").contains("no element vertex"));
    assert!(e(FIVE, &FIVE_POINTS.replace('4', "nan")).contains("point cloud"));
    assert!(edges("0 1\n").is_ok());
    let nan = format!("{FIVE}end_header\n{}", FIVE_POINTS.replace('4', "nan"));
    assert!(parse_ply_strands(&ply(&nan), Some(5)).unwrap_err().fault.contains("not finite"));
}

#[test]
fn what_is_written_comes_back_with_radii_bit_for_bit() {
    let mut s = StrandSet::new();
    s.push_tapered(&[Vec3::ZERO, Vec3::new(0.1, -0.2, 1e-7), Vec3::new(3.3, 0.0, 1.0)], &[0.04, 0.03, 0.02]);
    s.push(&[Vec3::X, Vec3::Y], 0.05);
    let bytes = encode_ply_strands(&s);
    let raw = parse_ply_strands(&bytes, None).unwrap();
    assert_eq!(raw.into_exact().unwrap(), s);
    let options = ImportOptions { radius_mm: None, ..Default::default() };
    let (world, _) = parse_ply_strands(&bytes, None).unwrap().into_world(&options).unwrap();
    assert_eq!((world.len(), world.radii_mm[0]), (2, 0.04));
}
