use super::*;
use std::io::Error;

fn names(dir: &Path) -> Vec<String> {
    let mut v: Vec<String> =
        fs::read_dir(dir).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    v.sort();
    v
}

#[test]
fn a_failed_write_leaves_the_old_file_and_nothing_else() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.txt");
    atomic_write(&path, |w| w.write_all(b"old")).unwrap();
    let e = atomic_write(&path, |w| {
        w.write_all(b"new")?;
        Err(Error::other("power cut"))
    })
    .unwrap_err();
    assert!(e.path == path && e.problem.contains("power cut"), "{e}");
    assert_eq!((fs::read(&path).unwrap(), names(dir.path())), (b"old".to_vec(), vec!["a.txt".to_owned()]));
    atomic_write(&path, |w| w.write_all(b"new")).unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"new");
    assert!(
        atomic_write(&dir.path().join("no/b.txt"), |_| Ok(()))
            .unwrap_err()
            .problem
            .contains("check the path")
    );
    assert!(atomic_write(Path::new("/"), |_| Ok(())).is_err());
}

#[cfg(unix)]
#[test]
fn permissions_are_those_of_a_plain_create() {
    use std::os::unix::fs::PermissionsExt as _;
    let dir = tempfile::tempdir().unwrap();
    let mode = |n: &str| fs::metadata(dir.path().join(n)).unwrap().permissions().mode();
    fs::write(dir.path().join("plain"), b"").unwrap();
    atomic_write(&dir.path().join("atomic"), |_| Ok(())).unwrap();
    assert_eq!(mode("plain"), mode("atomic"));
    fs::create_dir(dir.path().join("folder")).unwrap();
    atomic_folder(&dir.path().join("folder2"), |_| Ok::<(), IoError>(())).unwrap();
    assert_eq!(mode("folder"), mode("folder2"));
}

#[test]
fn a_folder_is_replaced_whole_at_the_end_or_not_at_all() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("x/out");
    let fill = |name: &'static str, fail: bool| {
        atomic_folder(&out, |tmp| {
            fs::write(tmp.join(name), name).unwrap();
            assert!(!out.join(name).exists(), "it must not be seen before the end");
            if fail { Err(IoError::new(tmp, "cancelled")) } else { Ok(7) }
        })
    };
    assert!(fill("a", true).is_err());
    assert_eq!(names(&dir.path().join("x")), Vec::<String>::new());
    assert_eq!(fill("a", false).unwrap(), 7);
    assert!(fill("b", true).is_err());
    assert_eq!(names(&out), ["a"]);
    fill("b", false).unwrap();
    assert_eq!((names(&out), names(&dir.path().join("x"))), (vec!["b".to_owned()], vec!["out".to_owned()]));
    fs::write(dir.path().join("file"), b"").unwrap();
    let e = atomic_folder(&dir.path().join("file"), |_| Ok::<(), IoError>(())).unwrap_err();
    assert!(e.problem.contains("a file stands"), "{e}");
}

#[test]
fn merging_replaces_its_own_files_and_leaves_the_others() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    let write = |list: &'static [&'static str], text: &'static str| {
        merge_folder(
            &out,
            |n| n.starts_with("mine"),
            |tmp| {
                list.iter().for_each(|n| fs::write(tmp.join(n), text).unwrap());
                Ok(())
            },
        )
    };
    write(&["mine1", "mine2"], "1").unwrap();
    fs::write(out.join("other"), b"o").unwrap();
    write(&["mine2", "mine3"], "2").unwrap();
    assert_eq!(names(&out), ["mine2", "mine3", "other"]);
    assert_eq!(fs::read(out.join("mine2")).unwrap(), b"2");
    let e = merge_folder(&out, |_| true, |tmp| Err(IoError::new(tmp, "stop")));
    assert!(e.is_err());
    assert_eq!(
        (names(&out), names(dir.path())),
        (vec!["mine2".into(), "mine3".into(), "other".to_owned()], vec!["out".to_owned()])
    );
    fs::write(out.join(INCOMPLETE), b"").unwrap();
    assert!(check_folder(&out).unwrap_err().problem.contains("half-written"));
    write(&["mine2"], "3").unwrap();
    check_folder(&out).unwrap();
    assert!(check_folder(&dir.path().join("none")).is_err());
}
