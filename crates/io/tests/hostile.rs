//! Every parser against bytes that nobody meant well with: whatever comes, an error or a value, and soon.

use proptest::prelude::*;
use std::io::Write;
use std::path::Path;
use strandbench_io::*;

/// What a parser found, reduced to whether it accepted.
type Parser = fn(&[u8]) -> bool;

const PARSERS: &[(&str, Parser)] = &[
    ("hair", |b| parse_hair(b).is_ok()),
    ("monohair", |b| parse_monohair(b).is_ok()),
    ("data", |b| parse_usc_data(b).is_ok()),
    ("tfx", |b| parse_tfx(b).is_ok()),
    ("ply strands", |b| parse_ply_strands(b, Some(2)).is_ok()),
    ("ply mesh", |b| parse_ply_mesh(b).is_ok()),
    ("obj mesh", |b| parse_obj_mesh(b).is_ok()),
    ("obj strands", |b| parse_obj_strands(b).is_ok()),
    ("exr", |b| parse_exr(b).is_ok()),
    ("png", |b| parse_png_grey(b).is_ok()),
    ("visibility", |b| parse_visibility(b).is_ok()),
    ("strand ids", |b| parse_strand_ids(b).is_ok()),
    ("flo", |b| parse_flo(b).is_ok()),
    ("hair roots", |b| parse_hair_roots(b).is_ok()),
    ("uv mesh", |b| parse_uv_mesh(b).is_ok()),
    ("rig", |b| parse_rig(Path::new("rig.json"), b).is_ok()),
    ("frame", |b| parse_frame_json(Path::new("frame.json"), b).is_ok()),
    ("colour frame", |b| parse_colour_json(Path::new("frame.json"), b).is_ok()),
    ("seen by", |b| parse_seen_by(b, 7).is_ok()),
    ("npz", |b| {
        let npz = Npz::parse(Path::new("a.npz"), b);
        npz.is_ok_and(|n| n.floats("values").is_ok() && n.texts("names").is_ok())
    }),
];

/// An OBJ of lines that say nothing is a mesh of no faces; who reads the file refuses it.
const OPEN: [&str; 2] = ["obj mesh", "uv mesh"];

/// A small valid file for each parser, made by this crate's writers where it writes the format.
fn seed(name: &str) -> Vec<u8> {
    let dir = tempfile::tempdir().unwrap();
    let mut strands = strandbench_types::StrandSet::new();
    let p = |x: f32, y: f32| glam::Vec3::new(x, y, 0.5);
    strands.push(&[p(0.0, 0.0), p(1.0, 2.0), p(2.0, 3.0)], 0.04);
    strands.push(&[p(5.0, 0.0), p(6.0, 2.0)], 0.03);
    let mesh = strandbench_types::TriMesh {
        vertices: vec![p(0.0, 0.0), p(1.0, 0.0), p(0.0, 1.0)],
        triangles: vec![[0, 1, 2]],
    };
    let via = |file: &str, write: &dyn Fn(&Path)| {
        let path = dir.path().join(file);
        write(&path);
        std::fs::read(path).unwrap()
    };
    let hair = |file: &str| via(file, &|p| write_strands(p, &strands).unwrap());
    let image = strandbench_types::Plane::from_vec(5, 3, (0..15).map(|i| i as f32).collect());
    match name {
        "hair" => hair("a.hair"),
        "data" => hair("a.data"),
        "ply strands" => hair("a.ply"),
        "obj strands" => hair("a.obj"),
        "ply mesh" => via("m.ply", &|p| write_mesh(p, &mesh).unwrap()),
        "obj mesh" => via("m.obj", &|p| write_mesh(p, &mesh).unwrap()),
        "exr" => via("a.exr", &|p| write_exr(p, &[("Y", &image), ("a.Z", &image)]).unwrap()),
        "png" => via("a.png", &|p| write_png_grey(p, &image.map(|&v| v as u8)).unwrap()),
        "monohair" => {
            let mut b = [2u32.to_le_bytes(), 5u32.to_le_bytes()].concat();
            b.extend([3u16, 2].into_iter().flat_map(u16::to_le_bytes));
            b.extend((0..15).flat_map(|i| (i as f32).to_le_bytes()));
            b
        }
        "tfx" => {
            let mut b = 4.0f32.to_le_bytes().to_vec();
            b.extend([2u32, 4, 160, 0, 0, 288, 0].into_iter().flat_map(u32::to_le_bytes));
            b.resize(160, 0);
            b.extend((0..34).flat_map(|i| (i as f32).to_le_bytes()));
            b
        }
        "visibility" => {
            let mut b = b"SBVISIB1".to_vec();
            b.extend([1u32, 2, 3, 0, 3, 0, 0, 1, 3].into_iter().flat_map(u32::to_le_bytes));
            b.extend([1u16, 0, 700].into_iter().flat_map(u16::to_le_bytes));
            b
        }
        "strand ids" => {
            let mut b = b"SBSTRID1".to_vec();
            b.extend([1u32, 0, 2, 0, 5, 0, 6, 1].into_iter().flat_map(u32::to_le_bytes));
            b
        }
        "flo" => {
            let mut b = b"PIEH".to_vec();
            b.extend([2u32, 1, 0, 0, 0, 0].into_iter().flat_map(u32::to_le_bytes));
            b
        }
        "hair roots" => {
            let root = "0 0 1 3 0.2 0.3 0.5 4.5 1 30\n";
            let header = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n\
                property float z\nproperty uint triangle\nproperty float b0\nproperty float b1\n\
                property float b2\nproperty float length_mm\nproperty uchar kind\n\
                property float density_per_cm2\nend_header\n";
            format!("{header}{root}{root}").into_bytes()
        }
        "uv mesh" => via("m.obj", &|p| {
            let (uvs, uv_triangles) = (vec![glam::Vec2::ZERO; 2], vec![[0, 1, 0]]);
            write_uv_mesh(p, &UvMesh { mesh: mesh.clone(), uvs, uv_triangles }).unwrap();
        }),
        "rig" => br#"{"format":"strandbench-rig","version":1,"near_mm":1.0,"far_mm":2.0,"frame_rate_hz":100,
            "exposure_s":0.001,"cameras":[{"name":"a","width":4,"height":3,"K":[[5,0,2],[0,5,1.5],[0,0,1]],
            "R":[[1,0,0],[0,1,0],[0,0,1]],"t_mm":[0,0,9]}]}"#
            .to_vec(),
        "frame" => br#"{"format":"strandbench-frame","version":1,"index":0,
            "cameras":[{"name":"a","image":"a.exr","mask":"a_mask.png"}]}"#
            .to_vec(),
        "colour frame" => br#"{"format":"strandbench-colour-frame","version":1,"index":0,
            "cameras":[{"name":"a","image":"a.png","polarised":false}]}"#
            .to_vec(),
        "seen by" => {
            let mut b = b"SBSEENBY".to_vec();
            b.extend([1u32, 0x3fff, 4, 0, 3].into_iter().flat_map(u32::to_le_bytes));
            b
        }
        "npz" => {
            let values = via("a.npy", &|p| write_npy(p, &[2, 3], &[0.5; 6]).unwrap());
            let mut names = values.clone();
            // The same header length, one text of six characters.
            let header = String::from_utf8_lossy(&values[10..values.len() - 24]).into_owned();
            let header = header.replace("<f4", "<U6").replace("(2, 3,)", "(1,)   ");
            names[10..values.len() - 24].copy_from_slice(header.as_bytes());
            names.truncate(values.len() - 24);
            names.extend("jaw\0\0\0".chars().flat_map(|c| u32::from(c).to_le_bytes()));
            let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
            let packed = zip::write::SimpleFileOptions::default();
            for (name, bytes) in [("values.npy", values), ("names.npy", names)] {
                zip.start_file(name, packed.compression_method(zip::CompressionMethod::Deflated)).unwrap();
                zip.write_all(&bytes).unwrap();
            }
            zip.finish().unwrap().into_inner()
        }
        other => panic!("no seed for {other}"),
    }
}

#[test]
fn every_seed_is_valid_and_every_parser_refuses_nothing_at_all() {
    for (name, parse) in PARSERS {
        assert!(parse(&seed(name)), "the seed for {name} must be a valid file");
        assert!(!parse(b"") || OPEN.contains(name), "{name} took an empty file for valid");
    }
}

#[test]
fn no_prefix_of_a_valid_file_harms_and_binary_prefixes_are_refused() {
    let whole_only = [
        "hair",
        "monohair",
        "data",
        "tfx",
        "exr",
        "visibility",
        "strand ids",
        "flo",
        "rig",
        "frame",
        "ply strands",
        "colour frame",
        "seen by",
        "npz",
    ];
    for (name, parse) in PARSERS {
        let b = seed(name);
        for n in 0..b.len() {
            let accepted = parse(&b[..n]);
            assert!(!(accepted && whole_only.contains(name)), "{name}: {n} of {} bytes", b.len());
        }
    }
}

/// Each aligned word of a valid file set to a value that counts and offsets should not have.
#[test]
fn no_word_of_a_valid_file_can_be_set_to_do_harm() {
    for (name, parse) in PARSERS {
        let good = seed(name);
        for at in 0..good.len().saturating_sub(3) {
            for v in [0u32, 1, 0x7fff_ffff, 0x8000_0000, 0xffff_fffe, u32::MAX, f32::NAN.to_bits()] {
                let mut b = good.clone();
                b[at..at + 4].copy_from_slice(&v.to_le_bytes());
                parse(&b);
                b[at..at + 4].copy_from_slice(&v.to_be_bytes());
                parse(&b);
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(
        std::env::var("PROPTEST_CASES").ok().and_then(|v| v.parse().ok()).unwrap_or(200)
    ))]

    #[test]
    fn random_bytes_do_no_harm(bytes in prop::collection::vec(any::<u8>(), 0..600)) {
        for (name, parse) in PARSERS {
            if !OPEN.contains(name) {
                prop_assert!(!parse(&bytes), "{} took random bytes for valid", name);
            }
            parse(&bytes);
        }
    }

    #[test]
    fn damaged_files_do_no_harm(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
        cut in any::<prop::sample::Index>(),
        insert in prop::collection::vec(any::<u8>(), 0..5),
    ) {
        for (name, parse) in PARSERS {
            let mut b = seed(name);
            for (at, v) in &changes {
                let i = at.index(b.len());
                b[i] = *v;
            }
            parse(&b);
            let at = cut.index(b.len());
            b.splice(at..at, insert.iter().copied());
            parse(&b);
            b.truncate(at);
            parse(&b);
        }
    }

    /// What an import accepts is valid strands within the bounds that it reports.
    #[test]
    fn what_is_imported_is_valid(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..4),
        which in 0usize..5,
    ) {
        let (name, ending) =
            [("hair", "hair"), ("data", "data"), ("ply strands", "ply"), ("tfx", "tfx"), ("obj strands", "obj")][which];
        let mut b = seed(name);
        for (at, v) in &changes {
            let i = at.index(b.len());
            b[i] = *v;
        }
        let options = ImportOptions { max_segment_mm: 1e36, ..Default::default() };
        if let Ok((set, report)) = parse_strands(&b, ending, None).and_then(|r| r.into_world(&options)) {
            prop_assert_eq!(set.validate(), Ok(()));
            prop_assert!(set.iter().all(|s| s.windows(2).all(|w| w[0] != w[1])));
            let [lo, hi] = report.bounds_mm.map(glam::Vec3::from_array);
            prop_assert!(set.points.iter().all(|p| p.cmpge(lo).all() && p.cmple(hi).all()));
        }
    }
}
