//! The tests of a crate are modules of one program, which names them: a file that no program names would be left out
//! in silence.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// The folders of tests whose crates name their programs.
fn folders() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let crates = fs::read_dir(root.join("crates")).expect("the crates");
    let mut found: Vec<PathBuf> = crates.map(|c| c.expect("a folder").path()).collect();
    found.push(root.join("tests"));
    found.retain(|c| {
        let manifest = fs::read_to_string(c.join("Cargo.toml")).unwrap_or_default();
        manifest.contains("autotests = false")
    });
    found.iter().map(|c| c.join("tests")).collect()
}

/// The names of the modules that a folder holds, programs left out.
fn files(folder: &Path, programs: &[PathBuf]) -> BTreeSet<String> {
    fs::read_dir(folder)
        .expect("the tests")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| !programs.contains(path))
        .filter(|path| path.extension().is_some_and(|e| e == "rs") || path.join("mod.rs").exists())
        .map(|path| {
            path.file_stem()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned()
        })
        .collect()
}

#[test]
fn every_file_of_tests_is_in_a_program() {
    let folders = folders();
    assert!(folders.len() > 5, "{folders:?}");
    for folder in folders {
        let manifest = fs::read_to_string(folder.join("../Cargo.toml")).expect("a manifest");
        let programs: Vec<PathBuf> = manifest
            .lines()
            .filter_map(|line| line.strip_prefix("path = \"tests/")?.strip_suffix('"'))
            .map(|name| folder.join(name))
            .collect();
        let named: BTreeSet<String> = programs
            .iter()
            .flat_map(|program| {
                let text = fs::read_to_string(program).expect("a program of tests");
                let names = text
                    .lines()
                    .filter_map(|l| Some(l.strip_prefix("mod ")?.strip_suffix(';')?.to_owned()));
                names.collect::<Vec<_>>()
            })
            .collect();
        let missing: Vec<_> = files(&folder, &programs)
            .difference(&named)
            .cloned()
            .collect();
        assert!(
            missing.is_empty(),
            "{}: no program says `mod` of {missing:?}",
            folder.display()
        );
    }
}
