//! The moving scenes that come with the program.

use crate::CatalogEntry;

macro_rules! catalog {
    ($($name:literal),* $(,)?) => {
        &[$(CatalogEntry { name: $name, toml: include_str!(concat!("../../catalog/", $name, ".toml")) }),*]
    };
}

static CATALOG: &[CatalogEntry] = catalog![
    "moving-straight-blonde",
    "moving-messy-red",
    "moving-curly-blonde",
    "moving-wavy-shake",
    "moving-bob-flick",
    "moving-straight-wind",
    "moving-still",
];

/// All moving scenes that come with the program, apart from [`crate::catalog`], whose scenes are one pose. The
/// first three are of the kinds and lengths that Luo et al. 2013 show; `moving-still` is the control, in which
/// nothing moves.
pub fn moving_catalog() -> &'static [CatalogEntry] {
    CATALOG
}
