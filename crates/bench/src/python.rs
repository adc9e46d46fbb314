//! Other tracers in a Python process of their own, driven by one line of JSON a command.

use crate::error::BenchError;
use serde_json::{Value, json};
use std::cell::RefCell;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

const PROGRAM: &str = include_str!("../python/tracer.py");
/// Where libLLVM of a version that Dr.Jit works with may lie, if `DRJIT_LIBLLVM_PATH` does not say.
const LLVM: [&str; 5] = [
    "/usr/lib/x86_64-linux-gnu/libLLVM.so.19.1",
    "/usr/lib/aarch64-linux-gnu/libLLVM.so.19.1",
    "/usr/lib/llvm-19/lib/libLLVM.so",
    "/usr/lib64/libLLVM.so.19.1",
    "/usr/lib/x86_64-linux-gnu/libLLVM.so.22.1",
];

/// Seconds that a command took in the other process.
#[derive(Clone, Copy, Debug, Default)]
pub struct Spent {
    /// By the clock.
    pub wall_s: f64,
    /// Of all its threads.
    pub cpu_s: f64,
}

/// A tracer in a Python process.
pub struct Python {
    name: String,
    folder: PathBuf,
    child: Child,
    pipes: RefCell<(ChildStdin, BufReader<ChildStdout>)>,
    /// What it says of itself.
    pub version: String,
}

impl Python {
    /// Starts `python` with `variant` of Mitsuba, or `embreex`; exchanged arrays lie in `folder`.
    ///
    /// # Errors
    /// If Python, the package or what the variant needs is missing: with the remedy.
    pub fn start(python: &Path, variant: &str, folder: &Path) -> Result<Python, BenchError> {
        let program = folder.join("tracer.py");
        std::fs::write(&program, PROGRAM).map_err(BenchError::file(&program))?;
        let mut command = Command::new(python);
        command.arg(&program).arg(variant).stdin(Stdio::piped()).stdout(Stdio::piped());
        command.stderr(Stdio::null());
        if variant.starts_with("llvm")
            && std::env::var_os("DRJIT_LIBLLVM_PATH").is_none()
            && let Some(llvm) = LLVM.iter().find(|p| Path::new(p).exists())
        {
            command.env("DRJIT_LIBLLVM_PATH", llvm);
        }
        let fail = |reason: String| BenchError::Tracer { tracer: variant.into(), reason };
        let mut child = command.spawn().map_err(|e| {
            fail(format!("{} cannot be started ({e}); name a Python 3 with --python", python.display()))
        })?;
        let (input, output) = (child.stdin.take(), child.stdout.take());
        let (Some(input), Some(output)) = (input, output) else {
            return Err(fail("its pipes are missing".into()));
        };
        let pipes = RefCell::new((input, BufReader::new(output)));
        let mut made =
            Python { name: variant.into(), folder: folder.into(), child, pipes, version: String::new() };
        let hello = made.ask(json!({"do": "hello"})).map_err(|e| {
            let remedy = match variant {
                "embreex" => "pip install embreex",
                v if v.starts_with("llvm") => {
                    "pip install mitsuba, and libLLVM 19 (Debian: libllvm19) named by DRJIT_LIBLLVM_PATH"
                }
                _ => "pip install mitsuba",
            };
            fail(format!("{e}; to have it: {remedy}"))
        })?;
        made.version = hello["version"].as_str().unwrap_or_default().to_owned();
        Ok(made)
    }

    /// Sends a command, waits for the answer.
    ///
    /// # Errors
    /// If the process is gone or answers with an error.
    pub fn ask(&self, command: Value) -> Result<Value, BenchError> {
        let fail = |reason: String| BenchError::Tracer { tracer: self.name.clone(), reason };
        let mut pipes = self.pipes.borrow_mut();
        let (input, output) = &mut *pipes;
        let mut line = String::new();
        writeln!(input, "{command}")
            .and_then(|()| input.flush())
            .and_then(|()| output.read_line(&mut line))
            .map_err(|e| fail(format!("does not answer ({e})")))?;
        if line.is_empty() {
            return Err(fail(format!("ended without an answer to {}", command["do"])));
        }
        let answer: Value =
            serde_json::from_str(&line).map_err(|e| fail(format!("answered {line:?} ({e})")))?;
        match answer["error"].as_str() {
            Some(error) => Err(fail(error.to_owned())),
            None => Ok(answer),
        }
    }

    /// The same, for commands that are timed.
    ///
    /// # Errors
    /// As [`Python::ask`].
    pub fn timed(&self, command: Value) -> Result<(Spent, Value), BenchError> {
        let answer = self.ask(command)?;
        let number = |key: &str| answer[key].as_f64().unwrap_or(f64::NAN);
        Ok((Spent { wall_s: number("wall_s"), cpu_s: number("cpu_s") }, answer))
    }

    /// Name of the variant.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Folder of the exchanged arrays.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Writes an array of 32-bit numbers.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write<T: Copy>(
        &self,
        name: &str,
        values: impl Iterator<Item = T>,
        bytes: impl Fn(T) -> [u8; 4],
    ) -> Result<(), BenchError> {
        write_array(&self.folder, name, values, bytes)
    }

    /// Reads an array of 32-bit floats.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn read(&self, name: &str) -> Result<Vec<f32>, BenchError> {
        let path = self.folder.join(name);
        let bytes = std::fs::read(&path).map_err(BenchError::file(&path))?;
        Ok(bytes.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect())
    }
}

/// Writes an array of 32-bit numbers into `folder`.
///
/// # Errors
/// If the file cannot be written.
pub fn write_array<T: Copy>(
    folder: &Path,
    name: &str,
    values: impl Iterator<Item = T>,
    bytes: impl Fn(T) -> [u8; 4],
) -> Result<(), BenchError> {
    let path = folder.join(name);
    let data: Vec<u8> = values.flat_map(bytes).collect();
    std::fs::write(&path, data).map_err(BenchError::file(&path))
}

impl Drop for Python {
    fn drop(&mut self) {
        // Nothing is lost with it: whatever was asked has been answered.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
