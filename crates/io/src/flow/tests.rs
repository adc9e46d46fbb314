use super::*;
use proptest::prelude::*;

const N: f32 = f32::NAN;

fn flow() -> FlowMap {
    use FlowState::{Absent, Occluded, Outside, Seen};
    let flows = vec![[0.5, -1.25], [N, N], [3e-5, 700.0], [-0.0, 1.0], [1.0, 2.0], [N, N]];
    let states = vec![Seen, Absent, Outside, Occluded, Seen, Absent];
    FlowMap { flow_px: Plane::from_vec(3, 2, flows), state: Plane::from_vec(3, 2, states) }
}

#[test]
fn a_flow_comes_back_bit_for_bit_with_what_became_of_each_pixel() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("flow.exr");
    write_flow(&path, &flow()).unwrap();
    assert_eq!(read_flow(&path).unwrap(), flow());
    let names: Vec<String> = read_exr(&path).unwrap().into_iter().map(|c| c.0).collect();
    assert_eq!(names, ["occluded", "u", "v", "valid"], "OpenEXR sorts by name");
    let other = FlowMap { state: Plane::filled(2, 3, FlowState::Absent), ..flow() };
    assert!(write_flow(&path, &other).unwrap_err().problem.contains("its state (2, 3) px"));
}

#[test]
fn what_contradicts_is_refused_with_its_pixel() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("flow.exr");
    for (u, valid, occluded) in
        [(N, 1.0, 0.0), (2.0, 0.0, 1.0), (2.0, 0.5, 0.0), (f32::INFINITY, 0.0, 0.0), (2.0, N, 0.0)]
    {
        let plane = |v: f32| Plane::from_vec(2, 1, vec![if v.is_nan() { v } else { v.min(0.0) }, v]);
        let (u, ok) = (Plane::from_vec(2, 1, vec![0.0, u]), plane(0.0));
        let planes =
            [u, ok, Plane::from_vec(2, 1, vec![1.0, valid]), Plane::from_vec(2, 1, vec![0.0, occluded])];
        write_exr_owned(&path, CHANNELS.into_iter().zip(planes).collect()).unwrap();
        let e = read_flow(&path).unwrap_err().problem;
        assert!(e.contains("pixel (1, 0)") && e.contains(REMEDY), "{e}");
    }
    let lone = Plane::filled(2, 1, 0.0);
    write_exr_owned(&path, vec![("u", lone)]).unwrap();
    assert!(read_flow(&path).unwrap_err().problem.contains("channel v is missing"));
}

#[test]
fn a_flo_file_is_what_the_format_says() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.flo");
    write_flo(&path, &flow()).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    // Baker et al.: the magic is 202021.25 as a float; width, height; u and v by turns, row by row.
    assert_eq!(bytes[..4], 202_021.25f32.to_le_bytes());
    assert_eq!((bytes.len(), bytes[4], bytes[8]), (12 + 48, 3, 2));
    assert_eq!(bytes[12..20], [0.5f32.to_le_bytes(), (-1.25f32).to_le_bytes()].concat());
    assert_eq!(bytes[20..24], 1e10f32.to_le_bytes());
    let back = read_flo(&path).unwrap();
    let bits = |p: &Plane<[f32; 2]>| p.map(|f| f.map(f32::to_bits));
    assert_eq!(bits(&back), bits(&flow().flow_px));
    for n in 0..bytes.len() {
        assert!(parse_flo(&bytes[..n]).is_err(), "{n} bytes");
    }
    let with = |at: usize, v: &[u8]| {
        let mut b = bytes.clone();
        b[at..at + v.len()].copy_from_slice(v);
        parse_flo(&b).unwrap_err().to_string()
    };
    assert!(with(0, b"X").contains("no .flo"));
    assert!(with(4, &[0xff; 8]).contains("outside 1..16384"));
    assert!(with(4, &[0, 0x40, 0, 0, 0, 0x40]).contains("the flow needs"), "claims allocate nothing");
    assert!(with(4, &[2]).contains("16 bytes too many"));
}

proptest! {
    #[test]
    fn damage_never_panics(changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6)) {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("flow.exr");
        write_flow(&path, &flow()).unwrap();
        let mut b = std::fs::read(&path).unwrap();
        for (at, v) in changes {
            let i = at.index(b.len());
            b[i] = v;
        }
        std::fs::write(&path, b).unwrap();
        let _ = read_flow(&path);
    }
}
