//! The faces that come with the program: five subjects, as in Winberg et al. 2022.

use crate::CatalogEntry;

macro_rules! faces {
    ($($name:literal),* $(,)?) => {
        &[$(CatalogEntry { name: $name, toml: include_str!(concat!("../../../catalog/faces/", $name, ".toml")) }),*]
    };
}

static FACES: &[CatalogEntry] =
    faces!["face-stubble", "face-sparse-short", "face-moustache-goatee", "face-medium", "face-full-beard"];

/// The faces that come with the program. Each performs what its file says; `face.performance` changes it.
pub fn catalog() -> &'static [CatalogEntry] {
    FACES
}
