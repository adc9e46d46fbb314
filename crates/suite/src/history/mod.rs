//! An append-only index of all runs into an output folder: `OUT/history.sqlite`.
//!
//! Table `runs` holds one line a run or ablation (`job`, time, program, machine), `cells` one a cell (outcome, protocol), `figures` the method's
//! figures, `costs` what each stage cost. Triggers refuse changing or deleting a line. Any program that reads SQLite reads
//! it: `pandas.read_sql("select * from figures join cells using (run, cell)", sqlite3.connect(path))`.

mod page;

#[cfg(test)]
mod tests;

use crate::cell::{Outcome, Row};
use crate::report::tables::format_value;
use crate::results::{to_csv, without_seed};
use crate::{Provenance, SuiteError};
use rusqlite::{Connection, OpenFlags, Transaction, params};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::time::Duration;

/// The file's name.
pub const HISTORY: &str = "history.sqlite";

/// "strb": marks the file as ours (SQLite's `application_id`).
const APPLICATION: i32 = 0x7374_7262;
/// Version of the tables (SQLite's `user_version`).
const VERSION: i32 = 2;
/// The version before runs had a `job`; it is brought up to date by the next run.
const WITHOUT_JOB: i32 = 1;
/// How long to wait for another process that is writing.
const PATIENCE: Duration = Duration::from_secs(20);

const TABLES: &str = "
    CREATE TABLE runs (run INTEGER PRIMARY KEY, unix_time_s INTEGER NOT NULL, version TEXT NOT NULL, commit_id TEXT NOT NULL,
        target TEXT NOT NULL, cpu TEXT NOT NULL, threads INTEGER NOT NULL, os TEXT NOT NULL, job TEXT NOT NULL DEFAULT 'run') STRICT;
    CREATE TABLE cells (run INTEGER NOT NULL REFERENCES runs, cell INTEGER NOT NULL, scene TEXT NOT NULL, variant TEXT NOT NULL,
        seed TEXT NOT NULL, outcome TEXT NOT NULL, trouble TEXT, protocol TEXT NOT NULL, PRIMARY KEY (run, cell)) STRICT;
    CREATE TABLE figures (run INTEGER NOT NULL, cell INTEGER NOT NULL, metric TEXT NOT NULL, unit TEXT NOT NULL, value REAL,
        coverage REAL NOT NULL, wanted INTEGER NOT NULL, PRIMARY KEY (run, cell, metric),
        FOREIGN KEY (run, cell) REFERENCES cells (run, cell)) STRICT;
    CREATE TABLE costs (run INTEGER NOT NULL, cell INTEGER NOT NULL, stage TEXT NOT NULL, wall_s REAL NOT NULL, cpu_s REAL,
        peak_mib REAL, reused INTEGER NOT NULL, PRIMARY KEY (run, cell, stage),
        FOREIGN KEY (run, cell) REFERENCES cells (run, cell)) STRICT;
";

/// One figure of one run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// Number of the run in the file.
    pub run: i64,
    /// When it ended, seconds since 1970 (UTC).
    pub unix_time_s: i64,
    /// Commit of the program; empty if unknown.
    pub commit: String,
    /// Scene with overrides, without its seed.
    pub scene: String,
    /// Variant.
    pub variant: String,
    /// Seed.
    pub seed: u64,
    /// `ok`, or how the cell ended.
    pub outcome: String,
    /// Protocol; empty if the cell was not scored.
    pub protocol: String,
    /// Metric; empty if the cell was not scored.
    pub metric: String,
    /// Unit.
    pub unit: String,
    /// Value; `None` is the worst answer.
    pub value: Option<f64>,
    /// Share answered, 0..1.
    pub coverage: f64,
    /// `run`, or the ablation that the cell belongs to: `ablate NAME (SET)`.
    pub job: String,
}

/// Which entries; empty lists ask for all.
#[derive(Clone, Debug, Default)]
pub struct Query {
    /// Metrics.
    pub metrics: Vec<String>,
    /// Scenes.
    pub scenes: Vec<String>,
    /// Variants.
    pub variants: Vec<String>,
}

/// Adds a run, or what else `job` names. All of it or nothing is in the file, whatever happens meanwhile; several processes
/// may add at once.
///
/// # Errors
/// If the file is not a history, is damaged, of another version, or cannot be written.
pub fn append<'a>(out: &Path, job: &str, rows: impl IntoIterator<Item = &'a Row>) -> Result<(), SuiteError> {
    let path = out.join(HISTORY);
    let told = |e: rusqlite::Error| fault(&path, &e);
    let mut connection = Connection::open(&path).map_err(told)?;
    connection.busy_timeout(PATIENCE).map_err(told)?;
    let transaction =
        connection.transaction_with_behavior(rusqlite::TransactionBehavior::Immediate).map_err(told)?;
    match version(&transaction, &path)? {
        0 => create(&transaction).map_err(told)?,
        WITHOUT_JOB => add_job(&transaction).map_err(told)?,
        _ => {}
    }
    insert(&transaction, job, rows).map_err(told)?;
    transaction.commit().map_err(told)
}

/// Entries in the order of runs and cells. A cell that was not scored is an entry without a metric.
///
/// # Errors
/// If there is no history, or it is damaged or of another version.
pub fn read(out: &Path, query: &Query) -> Result<Vec<Entry>, SuiteError> {
    let path = if out.is_dir() { out.join(HISTORY) } else { out.to_owned() };
    if !path.is_file() {
        return Err(SuiteError::file(&path, "there is no history; every `strandbench run` adds to it"));
    }
    let told = |e: rusqlite::Error| fault(&path, &e);
    // Not read-only: a journal that a killed run left behind must be played back first.
    let flags = OpenFlags::SQLITE_OPEN_READ_WRITE | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let connection = Connection::open_with_flags(&path, flags)
        .or_else(|_| Connection::open_with_flags(&path, OpenFlags::SQLITE_OPEN_READ_ONLY))
        .map_err(told)?;
    connection.busy_timeout(PATIENCE).map_err(told)?;
    let job = match version(&connection, &path)? {
        0 => return Err(SuiteError::file(&path, "holds no run yet")),
        WITHOUT_JOB => "'run'",
        _ => "job",
    };
    let mut found = Vec::new();
    let mut select = connection
        .prepare(&format!(
            "SELECT run, unix_time_s, commit_id, scene, variant, seed, outcome, protocol, coalesce(metric, ''), \
             coalesce(unit, ''), value, coalesce(coverage, 0.0), {job} \
             FROM runs JOIN cells USING (run) LEFT JOIN figures USING (run, cell) ORDER BY run, cell, figures.rowid"
        ))
        .map_err(told)?;
    let mut rows = select.query([]).map_err(told)?;
    while let Some(row) = rows.next().map_err(told)? {
        let get = || -> rusqlite::Result<Entry> {
            let seed: String = row.get(5)?;
            Ok(Entry {
                run: row.get(0)?,
                unix_time_s: row.get(1)?,
                commit: row.get(2)?,
                scene: row.get(3)?,
                variant: row.get(4)?,
                seed: seed.parse().unwrap_or(0),
                outcome: row.get(6)?,
                protocol: row.get(7)?,
                metric: row.get(8)?,
                unit: row.get(9)?,
                value: row.get(10)?,
                coverage: row.get(11)?,
                job: row.get(12)?,
            })
        };
        let entry = get().map_err(told)?;
        let wanted = |list: &[String], name: &str| list.is_empty() || list.iter().any(|l| l == name);
        // What was not scored belongs to every metric: it has the worst of each.
        let metric = entry.metric.is_empty() || wanted(&query.metrics, &entry.metric);
        if metric && wanted(&query.scenes, &entry.scene) && wanted(&query.variants, &entry.variant) {
            found.push(entry);
        }
    }
    Ok(found)
}

/// The entries as CSV.
pub fn csv(entries: &[Entry]) -> String {
    to_csv(entries)
}

/// A line for each scene, variant, seed and metric: first and last value, and what they moved by, in the order of first runs.
pub fn table(entries: &[Entry]) -> String {
    let mut lines: Vec<(String, Vec<&Entry>)> = Vec::new();
    for e in entries.iter().filter(|e| !e.metric.is_empty()) {
        let name = format!("{} {} by {}, seed {}", e.metric, e.scene, e.variant, e.seed);
        match lines.iter_mut().find(|l| l.0 == name) {
            Some(line) => line.1.push(e),
            None => lines.push((name, vec![e])),
        }
    }
    let width = lines.iter().map(|l| l.0.chars().count()).max().unwrap_or(0);
    let value = |e: &Entry| format_value(e.value, &e.unit);
    let mut text = String::new();
    for (name, of) in &lines {
        let (first, last) = (of[0], of[of.len() - 1]);
        let runs = if of.len() == 1 { "1 run ".to_owned() } else { format!("{} runs", of.len()) };
        text += &format!("{name:<width$}  {runs}  first {}, last {}\n", value(first), value(last));
    }
    let trouble = entries.iter().filter(|e| e.metric.is_empty());
    for e in trouble {
        text += &format!("run {}: {} by {}, seed {}: {}\n", e.run, e.scene, e.variant, e.seed, e.outcome);
    }
    text
}

/// Writes a page with a chart for each scene and metric of the entries, the lines being variants and seeds.
///
/// # Errors
/// If the file cannot be written.
pub fn draw(entries: &[Entry], file: &Path) -> Result<(), SuiteError> {
    let text = page::page(entries);
    Ok(strandbench_io::atomic_write(file, |w| w.write_all(text.as_bytes()))?)
}

/// 0 for an empty file, else the version of a history that this program reads.
fn version(connection: &Connection, path: &Path) -> Result<i32, SuiteError> {
    let number = |name: &str| connection.pragma_query_value(None, name, |row| row.get::<_, i32>(0));
    let told = |e: rusqlite::Error| fault(path, &e);
    let tables: i64 =
        connection.query_row("SELECT count(*) FROM sqlite_schema", [], |row| row.get(0)).map_err(told)?;
    match (number("application_id").map_err(told)?, number("user_version").map_err(told)?) {
        (0, 0) if tables == 0 => Ok(0),
        (APPLICATION, known @ (WITHOUT_JOB | VERSION)) => Ok(known),
        (APPLICATION, other) => Err(SuiteError::file(
            path,
            format!(
                "is a history of version {other}, this program knows {VERSION}; move it away, the next run begins a new one"
            ),
        )),
        _ => Err(SuiteError::file(path, "is a database of another program; move it away")),
    }
}

fn create(transaction: &Transaction) -> rusqlite::Result<()> {
    transaction.execute_batch(TABLES)?;
    for table in ["runs", "cells", "figures", "costs"] {
        for change in ["UPDATE", "DELETE"] {
            transaction.execute_batch(&format!(
                "CREATE TRIGGER {table}_no_{change} BEFORE {change} ON {table} \
                 BEGIN SELECT RAISE(ABORT, 'the history is append-only'); END;"
            ))?;
        }
    }
    transaction.pragma_update(None, "application_id", APPLICATION)?;
    transaction.pragma_update(None, "user_version", VERSION)
}

fn add_job(transaction: &Transaction) -> rusqlite::Result<()> {
    transaction.execute_batch("ALTER TABLE runs ADD COLUMN job TEXT NOT NULL DEFAULT 'run'")?;
    transaction.pragma_update(None, "user_version", VERSION)
}

fn insert<'a>(
    transaction: &Transaction,
    job: &str,
    rows: impl IntoIterator<Item = &'a Row>,
) -> rusqlite::Result<()> {
    let here = Provenance::here();
    transaction.execute(
        "INSERT INTO runs (unix_time_s, version, commit_id, target, cpu, threads, os, job) VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
        params![
            here.unix_time_s as i64,
            here.version,
            here.commit,
            here.target,
            here.cpu,
            here.threads as i64,
            here.os,
            job
        ],
    )?;
    let run = transaction.last_insert_rowid();
    let mut cell = transaction.prepare("INSERT INTO cells VALUES (?, ?, ?, ?, ?, ?, ?, ?)")?;
    let mut figure = transaction.prepare("INSERT INTO figures VALUES (?, ?, ?, ?, ?, ?, ?)")?;
    let mut cost = transaction.prepare("INSERT INTO costs VALUES (?, ?, ?, ?, ?, ?, ?)")?;
    for (row, i) in rows.into_iter().zip(0i64..) {
        // Seeds are unsigned 64-bit numbers, which SQLite's integers are not.
        let (scene, seed) = (without_seed(&row.scene), row.seed.to_string());
        let trouble = row.outcome.trouble();
        cell.execute(params![run, i, scene, row.variant, seed, kind(&row.outcome), trouble, row.protocol])?;
        for s in row.scores.iter().filter(|s| s.subject == "method") {
            figure.execute(params![run, i, s.metric, s.unit, s.value, s.coverage, s.wanted as i64])?;
        }
        for (stage, c) in &row.costs {
            cost.execute(params![run, i, stage, c.wall_s, c.cpu_s, c.peak_mib, row.reused.contains(stage)])?;
        }
    }
    Ok(())
}

fn kind(outcome: &Outcome) -> &'static str {
    match outcome {
        Outcome::Ok => "ok",
        Outcome::Failed { .. } => "failed",
        Outcome::TimedOut { .. } => "timed-out",
        Outcome::NotRun => "not-run",
    }
}

fn fault(path: &Path, error: &rusqlite::Error) -> SuiteError {
    use rusqlite::ErrorCode::{DatabaseBusy, DatabaseCorrupt, NotADatabase};
    let remedy = match error.sqlite_error_code() {
        Some(NotADatabase | DatabaseCorrupt) => {
            "; it is damaged: move it away, the next run begins a new one"
        }
        Some(DatabaseBusy) => "; another process has been writing to it for too long",
        _ => "",
    };
    SuiteError::file(path, format!("{error}{remedy}"))
}
