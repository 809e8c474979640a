//! Files are written whole or not at all, behind links, with the permissions that they had.

use std::fs;
use std::io::{Seek, SeekFrom, Write};
use std::path::Path;

use furuta_file::{FileError, GrowingFile, Kind, Place, WholeFile, write};

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder");
    let mut names: Vec<_> = entries
        .map(|e| {
            e.expect("an entry")
                .file_name()
                .into_string()
                .expect("UTF-8")
        })
        .collect();
    names.sort();
    names
}

#[test]
fn until_it_is_complete_the_older_file_stays() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("rig.toml");
    write(&path, b"older").expect("written");
    let mut file = WholeFile::create(&path).expect("writable");
    file.write_all(b"newer, and half of it").expect("room");
    file.flush().expect("room");
    assert_eq!(fs::read(&path).expect("there"), b"older");
    drop(file);
    assert_eq!(names(folder.path()), ["rig.toml"]);
    assert_eq!(fs::read(&path).expect("there"), b"older");
    let mut file = WholeFile::create(&path).expect("writable");
    file.write_all(b"Newer").expect("room");
    file.seek(SeekFrom::Start(0)).expect("a file");
    file.write_all(b"n").expect("room");
    file.commit().expect("complete");
    assert_eq!(fs::read(&path).expect("there"), b"newer");
    assert_eq!(names(folder.path()), ["rig.toml"]);
}

#[test]
fn a_folder_that_goes_away_is_an_error() {
    let folder = tempfile::tempdir().expect("a folder");
    let gone = folder.path().join("gone");
    fs::create_dir(&gone).expect("a folder");
    let path = gone.join("page.html");
    let mut file = WholeFile::create(&path).expect("writable");
    file.write_all(b"<!doctype html>").expect("room");
    fs::remove_dir_all(&gone).expect("a folder");
    let error = file.commit().expect_err("no folder");
    assert!(matches!(error, FileError::Write { .. }), "{error}");
    let error = write(&path, b"").expect_err("no folder");
    assert!(
        error.to_string().contains("choose a folder that exists"),
        "{error}"
    );
}

#[cfg(unix)]
#[test]
fn a_link_stays_a_link_and_permissions_stay() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let folder = tempfile::tempdir().expect("a folder");
    let [file, link, dangling] = ["run.csv", "link", "dangling"].map(|n| folder.path().join(n));
    write(&file, b"t,u").expect("written");
    let mode = |path: &Path| fs::metadata(path).expect("there").permissions().mode() & 0o777;
    assert_ne!(mode(&file), 0o600, "as any new file");
    fs::set_permissions(&file, fs::Permissions::from_mode(0o640)).expect("ours");
    symlink("run.csv", &link).expect("a link");
    symlink("new.csv", &dangling).expect("a link");
    write(&link, b"t,u,theta").expect("written");
    write(&dangling, b"t").expect("written");
    assert!(fs::symlink_metadata(&link).is_ok_and(|m| m.is_symlink()));
    assert_eq!(fs::read(&file).expect("there"), b"t,u,theta");
    assert_eq!(mode(&file), 0o640);
    assert_eq!(
        names(folder.path()),
        ["dangling", "link", "new.csv", "run.csv"]
    );
    for other in [&file, &link] {
        assert!(Place::of(&link).expect("a file").is(other));
        assert!(!Place::of(&dangling).expect("a file").is(other));
    }
}

#[test]
fn what_may_be_replaced_is_told_by_its_first_bytes() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("file");
    let kinds = [Kind::Page, Kind::Picture, Kind::Json, Kind::Data];
    for (content, replaced_by) in [
        ("", &kinds[..]),
        ("<!DOCTYPE html>\n<html>", &[Kind::Page]),
        ("<svg xmlns=\"\">", &[Kind::Picture]),
        ("\n {\"schema\": 1}", &[Kind::Json]),
        ("[controller]\nkind = \"lqr\"\n", &[]),
        ("t,u,theta,alpha\n", &[]),
        ("\u{89}MCAP0\r\n", &[]),
    ] {
        write(&path, content.as_bytes()).expect("written");
        let place = Place::of(&path).expect("a file");
        for kind in kinds {
            let may = place.may_be_replaced_by(kind).is_ok();
            assert_eq!(may, replaced_by.contains(&kind), "{content} by {kind:?}");
        }
    }
    write(&path, b"{}").expect("written");
    let mut permissions = fs::metadata(&path).expect("there").permissions();
    permissions.set_readonly(true);
    fs::set_permissions(&path, permissions).expect("ours");
    let refused = Place::of(&path)
        .expect("a file")
        .may_be_replaced_by(Kind::Json);
    assert!(matches!(refused, Err(FileError::Protected { .. })));
}

#[test]
fn a_growing_file_is_read_while_it_grows() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    // Nothing there: at its place.
    let (mut file, log) = GrowingFile::create(&path).expect("writable");
    file.write_all(b"first").expect("room");
    assert_eq!(
        (log.path(), fs::read(&path).expect("there")),
        (&*path, b"first".to_vec())
    );
    log.keep().expect("complete");
    // An older one there: beside it, until it is kept.
    let (mut file, log) = GrowingFile::create(&path).expect("writable");
    file.write_all(b"second").expect("room");
    assert_eq!(fs::read(&path).expect("there"), b"first");
    assert_eq!(fs::read(log.path()).expect("there"), b"second");
    log.keep().expect("complete");
    assert_eq!(fs::read(&path).expect("there"), b"second");
    // Nothing came of it.
    let (_, log) = GrowingFile::create(&path).expect("writable");
    log.discard();
    assert_eq!(fs::read(&path).expect("there"), b"second");
    assert_eq!(names(folder.path()), ["run.mcap"]);
    let other = folder.path().join("other.mcap");
    let (_, log) = GrowingFile::create(&other).expect("writable");
    log.discard();
    assert_eq!(names(folder.path()), ["run.mcap"]);
}
