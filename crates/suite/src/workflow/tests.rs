use super::*;
use crate::{Method, SceneJob, Setting};
use strandbench_types::Silent;

const MOVING: &str = "moving-straight-blonde";

fn cells(scenes: &[&str], settings: &[&str], seeds: &[u64]) -> Vec<Cell> {
    let settings: Vec<Setting> = settings.iter().map(|s| s.parse().unwrap()).collect();
    let scenes: Vec<SceneJob> = scenes.iter().map(|s| SceneJob::open(s, &settings).unwrap()).collect();
    let methods = ["luo", "luo-ncc"].map(|v| Method::find(v, &settings).unwrap());
    Cell::matrix(&scenes, &methods, seeds, &settings, None).unwrap()
}

fn planned(cells: &[Cell]) -> Result<Plan, String> {
    let around = Around {
        arguments: serde_json::Value::Null,
        out: "out".into(),
        root: "/".into(),
        program: "strandbench".into(),
        threads: 1,
        frames_per_job: 7,
    };
    plan(cells, around).map_err(|e| e.to_string())
}

#[test]
fn keys_follow_what_results_depend_on_and_nothing_else() {
    let base = planned(&cells(&["straight-blonde", "wavy-brown"], &[], &[1, 2])).unwrap();
    assert_eq!((base.renders.len(), base.cells.len()), (4, 8));
    assert_eq!(base.cells[0].render, base.cells[1].render, "variants share a render");
    let mut keys: Vec<&str> = base.cells.iter().map(|c| c.key.as_str()).collect();
    keys.sort_unstable();
    keys.dedup();
    assert_eq!(keys.len(), 8);
    let one = |settings: &[&str]| planned(&cells(&["straight-blonde"], settings, &[1])).unwrap();
    assert_eq!(one(&[]).cells[0], base.cells[0], "whatever else is in the matrix");
    let lambda = one(&["recon.lambda=0.3"]);
    assert_eq!(lambda.renders, one(&[]).renders);
    assert_ne!(lambda.cells[0].key, base.cells[0].key);
    for other in ["render.samples_per_pixel=5", "scene.rig.baseline_x_mm=211"] {
        let other = one(&[other]);
        assert_ne!(other.renders[0].key, base.renders[0].key);
        assert_ne!(other.cells[0].key, base.cells[0].key);
    }
    let changed = base.check(&lambda, Path::new("plan.json")).unwrap_err().to_string();
    assert!(changed.contains("write the workflow again"), "{changed}");
    base.check(&base.clone(), Path::new("plan.json")).unwrap();
}

#[test]
fn a_moving_scene_is_rendered_in_parts_that_hold_every_frame_once() {
    let moving = planned(&cells(&[MOVING], &["scene.motion.frames=20"], &[1])).unwrap();
    assert_eq!(moving.renders[0].parts, ["0..7", "7..14", "14..20"]);
    let short = planned(&cells(&[MOVING], &["scene.motion.frames=7"], &[1])).unwrap();
    assert!(short.renders[0].parts.is_empty(), "one job is enough");
    assert!(planned(&cells(&["straight-blonde"], &[], &[1])).unwrap().renders[0].parts.is_empty());
}

#[test]
fn what_cannot_be_a_matrix_is_refused() {
    assert!(planned(&[]).unwrap_err().contains("no cell"));
    let twice = planned(&cells(&["straight-blonde", "straight-blonde"], &[], &[1])).unwrap_err();
    assert!(twice.contains("straight-blonde by luo, seed 1") && twice.contains("twice"), "{twice}");
    let dir = tempfile::tempdir().unwrap();
    let text = strandbench_scenes::catalog()[0].toml;
    let mut files = Vec::new();
    for (sub, text) in [("a", text.to_owned()), ("b", format!("# another\n{text}"))] {
        std::fs::create_dir(dir.path().join(sub)).unwrap();
        let file = dir.path().join(sub).join("same.toml");
        std::fs::write(&file, text).unwrap();
        files.push(file.to_str().unwrap().to_owned());
    }
    let names: Vec<&str> = files.iter().map(String::as_str).collect();
    let error = planned(&cells(&names, &[], &[1])).unwrap_err();
    assert!(error.contains("other contents"), "{error}");
}

#[test]
fn a_workflow_is_brought_up_to_date_and_nothing_else_is_overwritten() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("flow");
    let plan = planned(&cells(&["straight-blonde"], &[], &[1])).unwrap();
    let files = write(&plan, &folder).unwrap();
    assert_eq!(files.all.len(), 5);
    assert_eq!(Plan::read(&files.plan).unwrap(), plan);
    let readme = std::fs::read_to_string(folder.join("README.md")).unwrap();
    assert!(readme.contains("snakemake==9") && readme.contains("plugin-slurm==2") && !readme.contains('{'));
    write(&plan, &folder).unwrap();
    std::fs::write(folder.join("Snakefile"), "rule all:\n").unwrap();
    assert!(write(&plan, &folder).unwrap_err().to_string().contains("not of this program"));
    std::fs::write(&files.plan, "{}").unwrap();
    assert!(Plan::read(&files.plan).is_err());
}

#[test]
fn a_missing_cell_is_an_error_that_names_it() {
    let dir = tempfile::tempdir().unwrap();
    let cells = cells(&["straight-blonde"], &[], &[3]);
    let plan = planned(&cells).unwrap();
    let error = merge(&plan, &cells, dir.path(), &Silent).unwrap_err().to_string();
    assert!(error.contains("straight-blonde+seed=3 by luo, seed 3 is missing"), "{error}");
}
