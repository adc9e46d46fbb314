//! The history file.

use super::*;
use strandbench_score::Score;

fn row(scene: &str, seed: u64, median: Option<f64>) -> Row {
    Row {
        scene: scene.to_owned(),
        variant: "luo".to_owned(),
        seed,
        outcome: if median.is_some() { Outcome::Ok } else { Outcome::NotRun },
        protocol: "v3 0".to_owned(),
        scores: median
            .iter()
            .map(|&v| Score {
                subject: "method".to_owned(),
                metric: "A1.median".to_owned(),
                value: v.is_finite().then_some(v),
                unit: "mm".to_owned(),
                lower_is_better: true,
                coverage: 1.0,
                wanted: 7,
            })
            .collect(),
        costs: [("score".to_owned(), crate::Cost { wall_s: 1.5, cpu_s: None, peak_mib: Some(3.0) })].into(),
        reused: vec!["score".to_owned()],
        report: None,
        score_dir: None,
    }
}

#[test]
fn runs_come_back_in_their_order() {
    let dir = tempfile::tempdir().unwrap();
    append(
        dir.path(),
        "run",
        &[row("a+seed=9", u64::MAX, Some(1.0 / 3.0)), row("b", 1, Some(f64::INFINITY))],
    )
    .unwrap();
    append(dir.path(), "run", &[row("b", 1, None)]).unwrap();
    let all = read(dir.path(), &Query::default()).unwrap();
    let brief: Vec<_> =
        all.iter().map(|e| (e.run, e.scene.as_str(), e.seed, e.outcome.as_str(), e.value)).collect();
    assert_eq!(
        brief,
        [(1, "a", u64::MAX, "ok", Some(1.0 / 3.0)), (1, "b", 1, "ok", None), (2, "b", 1, "not-run", None)]
    );
    let only = Query { scenes: vec!["b".to_owned()], metrics: vec!["A1.p90".to_owned()], ..Query::default() };
    assert_eq!(read(dir.path(), &only).unwrap().len(), 1, "what was not run is the worst of every metric");
    assert!(csv(&all).starts_with(
        "run,unix_time_s,commit,scene,variant,seed,outcome,protocol,metric,unit,value,coverage,job\n1,"
    ));
    assert!(table(&all).contains("run 2: b by luo, seed 1: not-run"));
    let page = dir.path().join("history.html");
    draw(&all, &page).unwrap();
    assert!(std::fs::read_to_string(page).unwrap().contains("A1.median · a"));
}

#[test]
fn a_history_of_the_version_before_is_read_and_brought_up_to_date() {
    let dir = tempfile::tempdir().unwrap();
    append(dir.path(), "run", &[row("a", 1, Some(1.0))]).unwrap();
    let connection = Connection::open(dir.path().join(HISTORY)).unwrap();
    connection.execute_batch("ALTER TABLE runs DROP COLUMN job; PRAGMA user_version = 1").unwrap();
    let jobs = || -> Vec<(i64, String)> {
        let all = read(dir.path(), &Query::default()).unwrap();
        all.into_iter().map(|e| (e.run, e.job)).collect()
    };
    assert_eq!(jobs(), [(1, "run".to_owned())]);
    append(dir.path(), "ablate gamma (small)", &[row("a", 1, Some(2.0))]).unwrap();
    append(dir.path(), "run", &[row("a", 1, Some(2.0))]).unwrap();
    let found = jobs();
    let wanted = [(1, "run"), (2, "ablate gamma (small)"), (3, "run")];
    assert_eq!(found, wanted.map(|(run, job)| (run, job.to_owned())));
}

#[test]
fn lines_cannot_be_changed_or_deleted() {
    let dir = tempfile::tempdir().unwrap();
    append(dir.path(), "run", &[row("a", 1, Some(1.0))]).unwrap();
    let connection = Connection::open(dir.path().join(HISTORY)).unwrap();
    for change in [
        "UPDATE figures SET value = 0",
        "DELETE FROM figures",
        "DELETE FROM runs",
        "UPDATE cells SET seed = '2'",
    ] {
        let error = connection.execute(change, []).unwrap_err().to_string();
        assert!(error.contains("append-only"), "{change}: {error}");
    }
}

#[test]
fn many_writers_at_once_lose_nothing() {
    let dir = tempfile::tempdir().unwrap();
    std::thread::scope(|scope| {
        for t in 0..8 {
            let path = dir.path();
            scope.spawn(move || {
                (0..5).for_each(|i| append(path, "run", &[row("a", t * 5 + i, Some(1.0))]).unwrap())
            });
        }
    });
    let all = read(dir.path(), &Query::default()).unwrap();
    let seeds: std::collections::BTreeSet<u64> = all.iter().map(|e| e.seed).collect();
    assert_eq!((all.len(), seeds.len(), all.last().unwrap().run), (40, 40, 40));
}

#[test]
fn a_writer_that_breaks_off_leaves_no_part_of_a_run() {
    let dir = tempfile::tempdir().unwrap();
    append(dir.path(), "run", &[row("a", 1, Some(1.0))]).unwrap();
    let twice = row("b", 1, Some(2.0));
    let doubled = Row { scores: [twice.scores.clone(), twice.scores.clone()].concat(), ..twice };
    assert!(append(dir.path(), "run", &[row("a", 1, Some(3.0)), doubled]).is_err(), "the same figure twice");
    let all = read(dir.path(), &Query::default()).unwrap();
    assert_eq!(all.len(), 1, "{all:?}");
}

#[test]
fn damaged_and_foreign_files_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join(HISTORY);
    let refused = |want: &str| {
        for error in [
            append(dir.path(), "run", &[row("a", 1, Some(1.0))]).unwrap_err(),
            read(dir.path(), &Query::default()).unwrap_err(),
        ] {
            let text = error.to_string();
            assert!(text.contains(want) && text.contains(HISTORY), "{text} does not say {want}");
        }
    };
    assert!(read(dir.path(), &Query::default()).unwrap_err().to_string().contains("no history"));
    std::fs::write(
        &file,
        b"this is not a database, and long enough to be looked at closely, sixteen bytes and more",
    )
    .unwrap();
    refused("damaged");
    std::fs::remove_file(&file).unwrap();
    Connection::open(&file).unwrap().execute_batch("CREATE TABLE t (x)").unwrap();
    refused("another program");
    std::fs::remove_file(&file).unwrap();
    append(dir.path(), "run", &[row("a", 1, Some(1.0))]).unwrap();
    Connection::open(&file).unwrap().pragma_update(None, "user_version", 3).unwrap();
    refused("version 3");
    std::fs::remove_file(&file).unwrap();
    for i in 0..300 {
        append(dir.path(), "run", &[row("a", i, Some(1.0))]).unwrap();
    }
    let bytes = std::fs::read(&file).unwrap();
    std::fs::write(&file, &bytes[..bytes.len() / 2 + 100]).unwrap();
    refused("damaged");
}
