use super::*;

const HEAD: &str = "comment made by hand\nobj_info x\nelement vertex 2\nproperty double x\nproperty uchar y\n\
    element face 2\nproperty list uint8 int16 vertex_indices\nproperty float w\nend_header\n";

fn ascii() -> Vec<u8> {
    format!("ply\r\nformat ascii 1.0\r\n{HEAD}0.1 7\n-2 255\n3 -1 2 3 0.5\n0 1e-3\n").into_bytes()
}

fn binary(big: bool) -> Vec<u8> {
    let name = if big { "big" } else { "little" };
    let mut b = format!("ply\nformat binary_{name}_endian 1.0\n{HEAD}").into_bytes();
    let mut put = |bytes: &[u8]| {
        let mut v = bytes.to_vec();
        if big {
            v.reverse();
        }
        b.extend(v);
    };
    put(&0.1f64.to_le_bytes());
    put(&[7]);
    put(&(-2.0f64).to_le_bytes());
    put(&[255]);
    put(&[3]);
    for v in [-1i16, 2, 3] {
        put(&v.to_le_bytes());
    }
    put(&0.5f32.to_le_bytes());
    put(&[0]);
    put(&1e-3f32.to_le_bytes());
    b
}

#[test]
fn the_three_encodings_hold_the_same() {
    for b in [ascii(), binary(false), binary(true)] {
        let p = parse_ply(&b, |_, _| true).unwrap();
        assert_eq!(p.comments, ["made by hand", "x"]);
        let (v, f) = (p.element("vertex").unwrap(), p.element("face").unwrap());
        assert_eq!(v.scalar("x").unwrap(), [0.1, -2.0]);
        assert_eq!(v.scalar("y").unwrap(), [7.0, 255.0]);
        assert_eq!(f.list(&["vertex_indices"]).unwrap(), (&[0, 3, 3][..], &[-1.0, 2.0, 3.0][..]));
        assert_eq!(f.scalar("w").unwrap(), [0.5, f64::from(1e-3f32)]);
        let some = parse_ply(&b, |_, p| p == "y").unwrap();
        assert_eq!(some.element("vertex").unwrap().scalar("y").unwrap(), [7.0, 255.0]);
        assert!(some.element("vertex").unwrap().scalar("x").is_none());
        assert!(some.element("vertex").unwrap().has("x"));
    }
}

#[test]
fn every_truncation_is_an_error() {
    for b in [ascii(), binary(false), binary(true)] {
        // Text that ends within its last number, "1" of "1e-3\n", cannot be told from whole text.
        let least = if b.ends_with(b"\n") { b.len() - 4 } else { b.len() };
        for n in 0..least {
            assert!(parse_ply(&b[..n], |_, _| true).is_err(), "{n} bytes");
        }
    }
}

#[test]
fn claims_beyond_the_bytes_are_refused_before_anything_is_allocated() {
    for kind in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for count in ["4294967295", "18446744073709551615"] {
            let b = format!(
                "ply\nformat {kind} 1.0\nelement vertex {count}\nproperty float x\nend_header\n1 2 3 4"
            );
            let e = parse_ply(b.as_bytes(), |_, _| true).unwrap_err();
            assert!(e.fault.contains(&format!("claims {count} items")), "{e}");
        }
        let b = format!("ply\nformat {kind} 1.0\nelement void 18446744073709551615\nend_header\n");
        assert_eq!(parse_ply(b.as_bytes(), |_, _| true).unwrap().elements[0].count, 0);
    }
}

#[test]
fn bad_headers_and_numbers_name_their_place() {
    let e = |text: &str| parse_ply(text.as_bytes(), |_, _| true).unwrap_err().to_string();
    assert!(e("plx\n").starts_with("line 1: the magic"));
    assert!(e("ply\nformat ascii 2.0\nend_header\n").starts_with("line 2"));
    assert!(e("ply\nformat text 1.0\n").contains("unknown format"));
    assert!(e("ply\nend_header\n").contains("no format line"));
    assert!(e("ply\nproperty float x\n").contains("before any element"));
    assert!(e("ply\nelement vertex -1\n").contains("not a number"));
    assert!(e("ply\nelement vertex 1\nproperty half x\n").starts_with("line 3: cannot read"));
    assert!(e("ply\nelement vertex 1\nproperty list float int x\n").contains("cannot read"));
    let body = |t: &str| {
        e(&format!("ply\nformat ascii 1.0\nelement a 1\nproperty list char int v\nend_header\n{t}"))
    };
    assert!(body("2 1 x").contains("element a 0, property v") && body("2 1 x").contains("\"x\""));
    assert!(body("2 1").contains("ends before it"));
    assert!(body("-2 1").contains("list length -2"));
    assert!(body("1.5 1").contains("not a number of its type"));
}
