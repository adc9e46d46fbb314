use super::*;

#[test]
fn rows_are_named_once_and_valid() {
    for (i, v) in VARIANTS.iter().enumerate() {
        v.validate().unwrap();
        assert!(!v.asks.is_empty());
        assert_eq!(Variant::named(v.name).unwrap(), *v);
        assert!(VARIANTS[..i].iter().all(|o| o.name != v.name), "{} twice", v.name);
        assert!(VARIANTS[..i].iter().all(|o| o.entries() != v.entries()), "{} differs in nothing", v.name);
    }
}

#[test]
fn overrides_change_one_value_and_refuse_the_rest() {
    let v = LUO.with("lambda", "0.2").unwrap().with("views", "0,2").unwrap().with("cost", "ncc").unwrap();
    assert_eq!((v.parameters.lambda, v.views, v.cost), (0.2, Views::Subset(0b101), MatchCost::Ncc));
    assert_eq!(LUO.with("minimiser", "trws").unwrap().minimiser, Minimiser::Trws);
    for (key, value) in v.entries() {
        assert_eq!(v.with(key, &value).unwrap(), v, "{key}={value}");
    }
    let grown = LUO.with("voxel_mm", "2").unwrap();
    assert_eq!(grown.strands, Some(StrandParameters { voxel_mm: 2.0, ..StrandParameters::LUO }));
    for (key, value) in grown.entries() {
        assert_eq!(grown.with(key, &value).unwrap(), grown, "{key}={value}");
    }
    assert_eq!(grown.with("strands", "off").unwrap(), LUO);
    let unknown = LUO.with("lamda", "1").unwrap_err().to_string();
    assert!(
        unknown.contains("lamda") && unknown.contains("lambda") && unknown.contains("views"),
        "{unknown}"
    );
    for (key, value) in [
        ("lambda", "-1"),
        ("lambda", "NaN"),
        ("lambda", "inf"),
        ("lambda", ""),
        ("labels", "0"),
        ("labels", "99999999999999999999"),
        ("levels", "9"),
        ("sigma_px", "2.0"),
        ("aggregate", "maybe"),
        ("cost", "ssd"),
        ("views", "0,x"),
        ("views", "0,40"),
        ("minimiser", "luck"),
        ("strands", "many"),
        ("voxel_mm", "0"),
        ("interior_seeds", "-1"),
        ("rigid_end", "5000"),
        ("step_mm", "0.06"),
    ] {
        assert!(matches!(LUO.with(key, value), Err(ReconError::Parameter { .. })), "{key}={value} was taken");
    }
}

#[test]
fn views_name_their_cameras() {
    assert_eq!(Views::All.others(4).unwrap(), [1, 2, 3]);
    assert_eq!(Views::Two.others(4).unwrap(), [1]);
    assert_eq!(Views::Subset(0b1001).others(4).unwrap(), [3]);
    for (v, n) in [(Views::All, 1), (Views::Two, 1), (Views::Subset(0b10), 4), (Views::Subset(0b10001), 4)] {
        assert!(matches!(v.others(n), Err(ReconError::Views { .. })), "{v:?} of {n}");
    }
    assert!(Views::Subset(1).others(4).is_err() && Views::Subset(0).others(4).is_err());
}
