//! The scenes that come with the program.

use crate::{SceneError, SceneSpec, parse};
use std::path::PathBuf;

/// A scene that comes with the program.
#[derive(Clone, Copy, Debug)]
pub struct CatalogEntry {
    /// Name, unique.
    pub name: &'static str,
    /// Text of its file.
    pub toml: &'static str,
}

macro_rules! catalog {
    ($($name:literal),* $(,)?) => {
        &[$(CatalogEntry { name: $name, toml: include_str!(concat!("../catalog/", $name, ".toml")) }),*]
    };
}

static CATALOG: &[CatalogEntry] = catalog![
    "straight-blonde",
    "straight-brown-bob",
    "straight-black-long",
    "straight-red-layers",
    "straight-brown-short",
    "wavy-brown",
    "wavy-red",
    "wavy-blonde-bob",
    "curly-blonde",
    "curly-brown",
    "curly-black-afro",
    "messy-red",
    "messy-brown-short",
    "messy-black-long",
];

/// The scene that `run` takes when none is named.
pub const DEFAULT_SCENE: &str = "straight-blonde";

/// All scenes that come with the program.
pub fn catalog() -> &'static [CatalogEntry] {
    CATALOG
}

impl CatalogEntry {
    /// The scene, checked.
    ///
    /// # Errors
    /// As [`parse`]; the program's own tests see that there are none.
    pub fn spec(&self) -> Result<SceneSpec, SceneError> {
        parse(self.toml, &PathBuf::from(format!("catalog/{}.toml", self.name)))
    }
}
