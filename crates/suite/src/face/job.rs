//! Which face, from where, with which overrides.

use crate::scene_job::{Source, overridden, with_changes};
use crate::settings::{Setting, label};
use crate::{SuiteError, hash};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use strandbench_scenes::face::{FaceScene, FaceStage};

/// A face to render: its whole description as TOML with the overrides applied.
#[derive(Clone, Debug)]
pub struct FaceJob {
    /// Catalogue name or file stem.
    pub name: String,
    /// Folder name: the name and what was overridden.
    pub label: String,
    /// The scene as TOML, overrides applied.
    pub toml: String,
    /// The file it came from; empty for a catalogue scene.
    pub path: PathBuf,
    /// As parsed.
    pub spec: FaceScene,
}

impl FaceJob {
    /// A scene of the catalogue of faces by name, or of a `.toml` file with a table `[face]`; `None` for a scene of hair.
    ///
    /// # Errors
    /// If there is no such scene, or its text has an unknown key or an impossible value.
    pub fn open(scene: &str, settings: &[Setting]) -> Result<Option<FaceJob>, SuiteError> {
        let source = Source::find(scene)?;
        if !source.is_face() {
            return Ok(None);
        }
        FaceJob::from_toml(&source.name, &source.path, &source.text, settings).map(Some)
    }

    /// A face from its TOML text; `path` is where relative file names start and what errors name.
    ///
    /// # Errors
    /// If the text has an unknown key or an impossible value.
    pub fn from_toml(
        name: &str,
        path: &Path,
        text: &str,
        settings: &[Setting],
    ) -> Result<FaceJob, SuiteError> {
        let file = PathBuf::from(format!("{name}.toml"));
        let shown = if path.as_os_str().is_empty() { file } else { path.to_owned() };
        let mut spec = FaceScene::parse(text, &shown)?;
        let (text, changes) = overridden(name, text, settings)?;
        if !changes.is_empty() {
            spec = FaceScene::parse(&text, &with_changes(&shown, &changes))?;
        }
        spec.name = name.to_owned();
        Ok(FaceJob {
            name: name.to_owned(),
            label: label(name, &changes),
            toml: text,
            path: path.to_owned(),
            spec,
        })
    }

    /// Where relative file names start.
    pub(super) fn base(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new(""))
    }

    /// Whether the description names files.
    pub(super) fn names_files(&self) -> bool {
        self.spec.hair.files().next().is_some()
    }

    /// The person with hair; the same bits for the same seed.
    ///
    /// # Errors
    /// If a groom map cannot be used.
    pub fn stage(&self, seed: u64) -> Result<FaceStage, SuiteError> {
        Ok(FaceStage::new(&self.spec, seed, Some(self.base()))?)
    }

    /// What a render depends on: the description and the content of every file that it names.
    pub(super) fn inputs(&self) -> Result<BTreeMap<String, String>, SuiteError> {
        let mut inputs = BTreeMap::from([("scene".to_owned(), hash::of_bytes(self.toml.as_bytes()))]);
        for file in self.spec.hair.files() {
            let path = self.base().join(file);
            inputs.insert(format!("file {}", path.display()), hash::of_file(&path)?);
        }
        Ok(inputs)
    }
}
