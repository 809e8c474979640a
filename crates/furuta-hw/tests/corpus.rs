//! The properties of the fuzz targets `rig` and `host` (fuzz/), on the corpus that the fuzzer left and on its
//! beginnings.

#[path = "../../../fuzz/both_ends.rs"]
mod both_ends;

fn each(target: &str, property: fn(&[u8])) {
    let folder = format!("{}/../../fuzz/corpus/{target}", env!("CARGO_MANIFEST_DIR"));
    let mut files = 0;
    for entry in std::fs::read_dir(folder).expect("a corpus") {
        let bytes = std::fs::read(entry.expect("readable").path()).expect("readable");
        property(&bytes);
        (0..bytes.len().min(16)).for_each(|end| property(&bytes[..end]));
        files += 1;
    }
    assert!(files > 10, "{files} files for {target}");
}

#[test]
fn rig() {
    each("rig", both_ends::rig);
}

#[test]
fn host() {
    each("host", both_ends::host);
}
