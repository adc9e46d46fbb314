//! The optics of a scene file: two models, each with its own keys.

use std::path::Path;
use strandbench_scenes::{
    DEFAULT_SCENE, FibreOptics, OpticsModel, OpticsRoots, SceneError, SceneSpec, catalog, parse,
};

fn with(optics: &str) -> Result<SceneSpec, SceneError> {
    let entry = catalog().iter().find(|e| e.name == DEFAULT_SCENE).expect("the default scene");
    assert!(!entry.toml.contains("[optics]"));
    parse(&format!("{}\n[optics]\n{optics}\n", entry.toml), Path::new("hair.toml"))
}

#[test]
fn both_models_are_read_and_written_again() {
    let o = with("model = \"chiang\"\nindex = 1.6\nlongitudinal_roughness = 0.2\nscale_tilt_deg = -3.0")
        .unwrap()
        .optics;
    let want = FibreOptics {
        model: OpticsModel::Chiang,
        index: 1.6,
        longitudinal_roughness: Some(0.2),
        scale_tilt_deg: Some(-3.0),
        ..FibreOptics::default()
    };
    assert_eq!(o, want);
    let m = with("roots = \"cubic\"\nrest = true\neccentricity = 0.9").unwrap().optics;
    let want =
        FibreOptics { roots: OpticsRoots::Cubic, rest: true, eccentricity: 0.9, ..FibreOptics::default() };
    assert_eq!(m, want);
    for optics in [o, m, FibreOptics::default()] {
        assert_eq!(toml::from_str::<FibreOptics>(&toml::to_string(&optics).unwrap()).unwrap(), optics);
    }
}

#[test]
fn keys_of_the_other_model_unknown_ones_and_values_out_of_range_are_named() {
    for (text, named) in [
        ("model = \"chiang\"\nglint_scale = 2.0", "optics.glint_scale"),
        ("model = \"chiang\"\nrest = true", "optics.rest"),
        ("azimuthal_roughness = 0.3", "optics.azimuthal_roughness"),
        ("mitsuba_bessel = true", "optics.mitsuba_bessel"),
        ("model = \"chiang\"\nlongitudinal_roughness = 0.0", "optics.longitudinal_roughness"),
        ("model = \"chiang\"\nazimuthal_roughness = nan", "optics.azimuthal_roughness"),
        ("model = \"chiang\"\nscale_tilt_deg = 45.0", "optics.scale_tilt_deg"),
        ("index = 1.0", "optics.index"),
        ("model = \"kajiya\"", "kajiya"),
        ("beta_m = 0.3", "beta_m"),
    ] {
        let error = with(text).expect_err(text).to_string();
        assert!(error.contains(named) && error.contains("hair.toml"), "{text}: {error}");
    }
}
