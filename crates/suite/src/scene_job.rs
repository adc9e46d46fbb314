//! Which scene, from where, with which overrides.

use crate::settings::{Part, Setting, label, put};
use crate::{SuiteError, framing, hash};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use strandbench_io::ImportOptions;
use strandbench_scenes::face::FaceScene;
use strandbench_scenes::{CatalogEntry, Scene, SceneSpec};

/// A scene to render: its whole description as TOML with the overrides applied.
#[derive(Clone, Debug)]
pub struct SceneJob {
    /// Catalogue name or file stem.
    pub name: String,
    /// Folder name: the name and what was overridden.
    pub label: String,
    /// The scene as TOML, overrides applied.
    pub toml: String,
    /// The file it came from; empty for a catalogue scene.
    pub path: PathBuf,
    /// What was decided here because nobody said it, in words; it stands in `toml`.
    pub notes: Vec<String>,
    spec: SceneSpec,
}

impl SceneJob {
    /// A scene of the catalogue by name, or of a `.toml` file by path, with the overrides of [`Part::Scene`].
    ///
    /// # Errors
    /// If there is no such scene, or its text has an unknown key or an impossible value.
    pub fn open(scene: &str, settings: &[Setting]) -> Result<SceneJob, SuiteError> {
        let source = Source::find(scene)?;
        if source.is_face() {
            let problem = "is a face: `strandbench render` renders it; no method takes faces yet".to_owned();
            return Err(SuiteError::Scene { scene: scene.to_owned(), problem });
        }
        SceneJob::from_toml(&source.name, &source.path, &source.text, settings)
    }

    /// A scene from its TOML text; `path` is where relative file names start and what errors name.
    ///
    /// # Errors
    /// If the text has an unknown key or an impossible value.
    pub fn from_toml(
        name: &str,
        path: &Path,
        text: &str,
        settings: &[Setting],
    ) -> Result<SceneJob, SuiteError> {
        let shown =
            if path.as_os_str().is_empty() { PathBuf::from(format!("{name}.toml")) } else { path.to_owned() };
        let mut spec = strandbench_scenes::parse(text, &shown)?;
        let (text, changes) = overridden(name, text, settings)?;
        if !changes.is_empty() {
            let shown = with_changes(&shown, &changes);
            spec = strandbench_scenes::parse(&text, &shown)?;
        }
        Ok(SceneJob {
            name: name.to_owned(),
            label: label(name, &changes),
            toml: text,
            path: path.to_owned(),
            notes: Vec::new(),
            spec,
        })
    }

    /// Real strands on the default rig, turned to the hair and zoomed until it fills the image; `head` is a
    /// mesh in the hair file's own units. Without `import.radius_mm` the fibres are as thick as their number
    /// asks for: 0.04 mm for a full head, the same volume of hair for fewer. The exposure is metered.
    ///
    /// # Errors
    /// If an option or an override does not fit. A file that cannot be read is an error of the build.
    pub fn from_hair(
        path: &Path,
        import: ImportOptions,
        head: Option<PathBuf>,
        settings: &[Setting],
    ) -> Result<SceneJob, SuiteError> {
        if !path.is_file() {
            return Err(SuiteError::file(path, "there is no such hair file"));
        }
        let stated = import.radius_mm;
        let import = ImportOptions { radius_mm: stated.or(ImportOptions::default().radius_mm), ..import };
        let mut spec = SceneSpec::from_hair_file(path, import, head);
        // Errors name the option: there is no scene file that a user could correct.
        let shown = PathBuf::from(format!("--hair {}", path.display()));
        strandbench_scenes::parse(&spec.to_toml(), &shown)?;
        let mut job = SceneJob::from_toml(&spec.name, Path::new(""), &without_exposure(&spec), settings)?;
        let Ok(scene) = job.build(0) else { return Ok(job) };
        let set = |key: &str| settings.iter().any(|s| s.part == Part::Scene && s.key == key);
        let mut notes = vec![framing::size_note(&scene.strands)];
        let rig = framing::frame(&job.spec.rig, &scene, set("rig.target_mm"));
        spec = SceneSpec { rig, ..job.spec.clone() };
        notes.push(format!(
            "the cameras look at ({}) with a focal length of {} px, so that the hair fills the image",
            spec.rig.target_mm.map(|v| format!("{v:.0}")).join(", "),
            spec.rig.focal_px
        ));
        if let Some(file) = spec.hair_file.as_mut().filter(|_| stated.is_none()) {
            let strands = scene.strands.len();
            let radius = framing::radius_mm(strands);
            file.import.radius_mm = Some(radius);
            notes.push(format!(
                "fibre radius {radius} mm: {strands} strands with the volume of a full head of hair (--radius-mm \
                 states another)"
            ));
        }
        notes.push("the exposure is metered on the hair".to_owned());
        job = SceneJob {
            label: job.label,
            ..SceneJob::from_toml(&job.name, Path::new(""), &without_exposure(&spec), settings)?
        };
        job.notes = notes;
        Ok(job)
    }

    /// Whether the description leaves the exposure to a light meter.
    pub(crate) fn metered(&self) -> bool {
        let table: Option<toml::Table> = toml::from_str(&self.toml).ok();
        let sensor = table.as_ref().and_then(|t| t.get("sensor")).and_then(toml::Value::as_table);
        sensor.is_none_or(|s| !s.contains_key("full_scale_radiance"))
    }

    /// Whether the scene has more than one pose.
    pub fn moves(&self) -> bool {
        self.spec.motion.is_some()
    }

    /// The scene as parsed.
    pub fn spec(&self) -> &SceneSpec {
        &self.spec
    }

    /// Where relative file names start.
    pub(crate) fn base(&self) -> Option<&Path> {
        self.path.parent()
    }

    /// Geometry, rig and lights; the same bits for the same seed.
    ///
    /// # Errors
    /// If a file that the scene names cannot be used, or nothing grows.
    pub fn build(&self, seed: u64) -> Result<Scene, SuiteError> {
        Ok(strandbench_scenes::build(&self.spec, seed, self.base())?)
    }

    /// Whether the description names files.
    pub(crate) fn names_files(&self) -> bool {
        self.files().next().is_some()
    }

    fn files(&self) -> impl Iterator<Item = &PathBuf> {
        let hair = self.spec.hair_file.iter().map(|h| &h.path);
        let map = self.spec.environment.iter().filter_map(|e| e.file.as_ref());
        hair.chain(&self.spec.head.mesh_file).chain(map)
    }

    /// What a render depends on: the description and the content of every file that it names.
    pub(crate) fn inputs(&self) -> Result<BTreeMap<String, String>, SuiteError> {
        let mut inputs = BTreeMap::from([("scene".to_owned(), hash::of_bytes(self.toml.as_bytes()))]);
        for file in self.files() {
            let file = self.base().unwrap_or(Path::new("")).join(file);
            inputs.insert(format!("file {}", file.display()), hash::of_file(&file)?);
        }
        Ok(inputs)
    }
}

/// The scenes that come with the program, those of one pose first.
pub fn all_scenes() -> impl Iterator<Item = &'static CatalogEntry> {
    strandbench_scenes::catalog().iter().chain(strandbench_scenes::moving_catalog())
}

/// The scene as TOML, its exposure left to the light meter.
fn without_exposure(spec: &SceneSpec) -> String {
    let mut table: toml::Table = toml::from_str(&spec.to_toml()).expect("a scene writes TOML");
    if let Some(sensor) = table.get_mut("sensor").and_then(toml::Value::as_table_mut) {
        sensor.remove("full_scale_radiance");
    }
    toml::to_string_pretty(&table).expect("a table of TOML is TOML")
}

/// A scene file's text, and where it came from.
pub(crate) struct Source {
    /// Catalogue name or file stem.
    pub name: String,
    /// The file; empty for a catalogue scene.
    pub path: PathBuf,
    /// TOML.
    pub text: String,
}

impl Source {
    /// A scene of a catalogue by name, or a `.toml` file by path.
    ///
    /// # Errors
    /// If there is no such scene, or the file cannot be read.
    pub fn find(scene: &str) -> Result<Source, SuiteError> {
        let mut entries = all_scenes().chain(strandbench_scenes::face::catalog());
        if let Some(entry) = entries.find(|e| e.name == scene) {
            return Ok(Source {
                name: entry.name.to_owned(),
                path: PathBuf::new(),
                text: entry.toml.to_owned(),
            });
        }
        let path = Path::new(scene);
        if path.extension().is_none_or(|e| e != "toml") {
            let faces = strandbench_scenes::face::catalog();
            let names: Vec<&str> = all_scenes().chain(faces).map(|e| e.name).collect();
            let problem = format!("not in the catalogue ({}), and not a .toml file", names.join(", "));
            return Err(SuiteError::Scene { scene: scene.to_owned(), problem });
        }
        let text = std::fs::read_to_string(path).map_err(|e| {
            SuiteError::file(
                path,
                format!("cannot read this scene: {e}; `strandbench scenes show NAME` prints one"),
            )
        })?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Source { name, path: path.to_owned(), text })
    }

    /// Whether it is a scene of a face.
    pub fn is_face(&self) -> bool {
        FaceScene::is(&self.text)
    }
}

/// What errors name where a file's text was changed by overrides.
pub(crate) fn with_changes(path: &Path, changes: &[String]) -> PathBuf {
    let changes: Vec<String> = changes.iter().map(|c| format!("scene.{c}")).collect();
    PathBuf::from(format!("{} with {}", path.display(), changes.join(", ")))
}

/// A scene's text with the overrides of [`Part::Scene`], and these as `key=value`.
pub(crate) fn overridden(
    name: &str,
    text: &str,
    settings: &[Setting],
) -> Result<(String, Vec<String>), SuiteError> {
    let overrides: Vec<&Setting> = settings.iter().filter(|s| s.part == Part::Scene).collect();
    if overrides.is_empty() {
        return Ok((text.to_owned(), Vec::new()));
    }
    let fault =
        |e: &dyn std::fmt::Display| SuiteError::Scene { scene: name.to_owned(), problem: e.to_string() };
    let mut table: toml::Table = toml::from_str(text).map_err(|e| fault(&e))?;
    for setting in &overrides {
        put(&mut table, setting)?;
    }
    let text = toml::to_string(&table).map_err(|e| fault(&e))?;
    Ok((text, overrides.iter().map(|s| format!("{}={}", s.key, s.value)).collect()))
}
