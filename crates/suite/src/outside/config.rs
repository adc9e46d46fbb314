//! `strandbench.toml`: methods that are programs of their own.

use crate::settings::label;
use crate::{SuiteError, hash};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use strandbench_baselines::Baseline;
use strandbench_recon::VARIANTS;

/// The file that is looked for in the working directory.
pub const CONFIG_FILE: &str = "strandbench.toml";
/// What stands in a command for the folder to read, the folder to write and the number of threads.
pub const PLACEHOLDERS: [&str; 3] = ["{input}", "{output}", "{threads}"];

/// The configuration of a working directory.
#[derive(Clone, Debug, Default)]
pub struct Config {
    /// Methods from outside, by name.
    pub methods: Vec<Outside>,
}

/// A method that is a program of its own, in any language: it reads a dataset folder and writes an answer's folder.
#[derive(Clone, Debug, PartialEq)]
pub struct Outside {
    /// Its name; no built-in variant has it.
    pub name: String,
    /// What it asks or is, for lists.
    pub asks: String,
    /// Program and arguments as they stand in the configuration.
    pub command: Vec<String>,
    /// Folder of the configuration: the program works there, and relative names start there.
    pub folder: PathBuf,
    /// Longest that it may work on a cell, s.
    pub time_limit_s: Option<f64>,
    /// Most resident memory that the program and the processes of its group may have together, MiB.
    pub memory_limit_mib: Option<f64>,
    /// Whether it is given head and scalp, which no built-in method is.
    pub head: bool,
    /// More files that its answer depends on.
    pub files: Vec<PathBuf>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ConfigFile {
    #[serde(default)]
    method: BTreeMap<String, MethodFile>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MethodFile {
    command: Words,
    #[serde(default)]
    asks: String,
    time_limit_s: Option<f64>,
    memory_limit_mib: Option<f64>,
    #[serde(default)]
    head: bool,
    #[serde(default)]
    files: Vec<PathBuf>,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "a command is a text or an array of texts")]
enum Words {
    Line(String),
    List(Vec<String>),
}

impl Config {
    /// Reads `file`, or [`CONFIG_FILE`] of the working directory if there is one.
    ///
    /// # Errors
    /// If the file cannot be read, has an unknown key, or a method cannot be what it says; the text names the file.
    pub fn load(file: Option<&Path>) -> Result<Config, SuiteError> {
        let path = match file {
            Some(path) => path,
            None if Path::new(CONFIG_FILE).is_file() => Path::new(CONFIG_FILE),
            None => return Ok(Config::default()),
        };
        let text = std::fs::read_to_string(path).map_err(|e| {
            SuiteError::file(
                path,
                format!("cannot read this configuration: {e}; `strandbench baselines` writes one"),
            )
        })?;
        Config::parse(&text, path)
    }

    /// Reads the text of a configuration; `path` is where relative names start and what errors name.
    ///
    /// # Errors
    /// As [`Config::load`].
    pub fn parse(text: &str, path: &Path) -> Result<Config, SuiteError> {
        let file: ConfigFile = toml::from_str(text).map_err(|e| SuiteError::file(path, e))?;
        let whole = std::path::absolute(path).map_err(|e| SuiteError::file(path, e))?;
        let folder = whole.parent().unwrap_or(Path::new("/")).to_owned();
        let methods = file.method.into_iter().map(|(name, m)| {
            let fault = |problem: String| SuiteError::file(path, format!("[method.{name}]: {problem}"));
            Outside::check(&name, m, &folder).map_err(fault)
        });
        Ok(Config { methods: methods.collect::<Result<_, _>>()? })
    }

    /// The method of that name.
    pub fn method(&self, name: &str) -> Option<&Outside> {
        self.methods.iter().find(|m| m.name == name)
    }
}

impl Outside {
    fn check(name: &str, m: MethodFile, folder: &Path) -> Result<Outside, String> {
        if label(name, &[]) != name {
            return Err("the name is a folder's: letters, digits and ._-+= alone, no leading dot".into());
        }
        if VARIANTS.iter().any(|v| v.name == name) || Baseline::named(name).is_some() {
            return Err("is the name of a built-in variant; choose another".into());
        }
        let command = match m.command {
            Words::List(words) => words,
            Words::Line(line) => shlex::split(&line)
                .ok_or_else(|| format!("command {line:?} has a quotation mark that nothing closes"))?,
        };
        if command.first().is_none_or(String::is_empty) {
            return Err("the command is empty; name a program".into());
        }
        for word in &command {
            if let Some(unknown) = placeholders(word).find(|p| !PLACEHOLDERS.contains(p)) {
                return Err(format!("{unknown} stands for nothing; known are {}", PLACEHOLDERS.join(", ")));
            }
        }
        for needed in &PLACEHOLDERS[..2] {
            if !command.iter().any(|w| w.contains(needed)) {
                return Err(format!("the command does not say {needed}, so the program cannot know it"));
            }
        }
        for (key, value) in [("time_limit_s", m.time_limit_s), ("memory_limit_mib", m.memory_limit_mib)] {
            if value.is_some_and(|v| !(v.is_finite() && v > 0.0)) {
                return Err(format!("{key} must be a positive number"));
            }
        }
        if m.memory_limit_mib.is_some() && !cfg!(target_os = "linux") {
            return Err("memory_limit_mib is kept on Linux alone; remove it here".into());
        }
        Ok(Outside {
            name: name.to_owned(),
            asks: m.asks,
            command,
            folder: folder.to_owned(),
            time_limit_s: m.time_limit_s,
            memory_limit_mib: m.memory_limit_mib,
            head: m.head,
            files: m.files,
        })
    }

    /// The program's file: as it is named from the configuration's folder, or found in PATH.
    ///
    /// # Errors
    /// If there is none.
    pub(crate) fn program(&self) -> Result<PathBuf, String> {
        let name = Path::new(&self.command[0]);
        if name.components().count() > 1 {
            let path: PathBuf = self.folder.join(name).components().collect();
            return if path.is_file() {
                Ok(path)
            } else {
                Err(format!("cannot be started: there is no program {}", path.display()))
            };
        }
        let path = std::env::var_os("PATH").unwrap_or_default();
        let found = std::env::split_paths(&path).map(|dir| dir.join(name)).find(|p| p.is_file());
        found.ok_or_else(|| format!("cannot be started: there is no program {} in PATH", name.display()))
    }

    /// What its answer depends on beside the images, by name: the command, the program's file, every file that an
    /// argument names, and [`Outside::files`].
    pub(crate) fn inputs(&self) -> Result<BTreeMap<String, String>, SuiteError> {
        let program = self.program().map_err(|problem| self.fault(problem))?;
        let mut inputs = BTreeMap::from([
            ("outside.command".to_owned(), self.command.join("\u{1f}")),
            ("outside.program".to_owned(), hash::of_file(&program)?),
            ("outside.head".to_owned(), self.head.to_string()),
        ]);
        let named = self.command[1..].iter().map(PathBuf::from).filter(|p| self.folder.join(p).is_file());
        for file in named.chain(self.files.iter().cloned()) {
            inputs
                .insert(format!("outside.file {}", file.display()), hash::of_file(&self.folder.join(&file))?);
        }
        Ok(inputs)
    }

    /// Program and arguments with folders and threads in their places.
    pub(crate) fn arguments(&self, input: &Path, output: &Path, threads: usize) -> Vec<String> {
        let (input, output) = (input.display().to_string(), output.display().to_string());
        let fill = |word: &String| {
            let word = word.replace("{threads}", &threads.to_string());
            // One pass for both, so that a folder's name is never taken for a placeholder.
            word.split("{input}")
                .map(|part| part.replace("{output}", &output))
                .collect::<Vec<_>>()
                .join(&input)
        };
        self.command[1..].iter().map(fill).collect()
    }

    pub(crate) fn fault(&self, problem: String) -> SuiteError {
        SuiteError::Outside { method: self.name.clone(), problem, said: String::new() }
    }
}

/// Names in braces: `{` letters or `_` `}`.
fn placeholders(word: &str) -> impl Iterator<Item = &str> {
    word.match_indices('{').filter_map(|(i, _)| {
        let inner = &word[i + 1..];
        let end = inner.find('}')?;
        let name = &inner[..end];
        (end > 0 && name.bytes().all(|b| b.is_ascii_lowercase() || b == b'_')).then(|| &word[i..i + end + 2])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Config, String> {
        Config::parse(text, Path::new("/nowhere/strandbench.toml")).map_err(|e| e.to_string())
    }

    #[test]
    fn a_command_is_a_line_or_a_list_and_no_shell_reads_it() {
        let config = parse(
            "[method.one]\ncommand = \"prog 'a b' {input} --out={output} $HOME *.py -j {threads}\"\n\
             time_limit_s = 5\n[method.two]\ncommand = [\"./p\", \"{input}\", \"{output}\", \"{}\"]\nhead = true\n",
        )
        .unwrap();
        let one = config.method("one").unwrap();
        let args = one.arguments(Path::new("/in"), Path::new("/o{input}"), 3);
        assert_eq!(args, ["a b", "/in", "--out=/o{input}", "$HOME", "*.py", "-j", "3"]);
        assert_eq!(
            (one.time_limit_s, one.head, one.folder.as_path()),
            (Some(5.0), false, Path::new("/nowhere"))
        );
        assert_eq!(config.method("two").unwrap().command.len(), 4);
        assert_eq!(config.method("three"), None);
        assert!(parse("").unwrap().methods.is_empty());
    }

    #[test]
    fn what_cannot_be_is_refused_and_named() {
        for (text, words) in [
            ("[method.a]\ncommand = \"p {input}\"", &["[method.a]", "{output}"][..]),
            ("[method.a]\ncommand = \"p {input} {output} {frame}\"", &["{frame} stands for nothing"]),
            ("[method.a]\ncommand = \"p 'x {input} {output}\"", &["quotation mark"]),
            ("[method.a]\ncommand = []", &["empty"]),
            ("[method.a]\ncommand = 7", &["a text or an array"]),
            ("[method.a]\n", &["command"]),
            ("[method.a]\ncommand = \"p {input} {output}\"\ntime_limit_s = 0", &["time_limit_s", "positive"]),
            ("[method.a]\ncommand = \"p {input} {output}\"\nmemory_limit_mib = nan", &["memory_limit_mib"]),
            ("[method.a]\ncommand = \"p {input} {output}\"\nlimit = 1", &["line 3", "unknown field `limit`"]),
            ("[method.luo]\ncommand = \"p {input} {output}\"", &["built-in"]),
            ("[method.\"../x\"]\ncommand = \"p {input} {output}\"", &["letters, digits"]),
            ("[methods.a]\n", &["unknown field `methods`"]),
        ] {
            let e = parse(text).unwrap_err();
            for word in words.iter().chain(&["strandbench.toml"]) {
                assert!(e.contains(word), "{text}: {word} is not in: {e}");
            }
        }
    }

    #[cfg(unix)]
    #[test]
    fn the_key_follows_the_program_and_every_file_it_names() {
        let dir = tempfile::tempdir().unwrap();
        let file = |name: &str, text: &str| std::fs::write(dir.path().join(name), text).unwrap();
        file("m.py", "one");
        file("weights.bin", "w");
        file("tool", "t");
        let text = "[method.a]\ncommand = \"./tool m.py {input} {output}\"\nfiles = [\"weights.bin\"]";
        let config = Config::parse(text, &dir.path().join("c.toml")).unwrap();
        let inputs = || config.methods[0].inputs().unwrap();
        let before = inputs();
        assert_eq!(before, inputs());
        for (name, other) in [("m.py", "two"), ("weights.bin", "v"), ("tool", "u")] {
            let was = inputs();
            file(name, other);
            assert_ne!(was, inputs(), "{name}");
        }
        std::fs::remove_file(dir.path().join("tool")).unwrap();
        assert!(config.methods[0].inputs().unwrap_err().to_string().contains("there is no program"));
    }
}
