//! The properties of the fuzz targets for files (fuzz/readers.rs), on the corpus, on each beginning of it and with
//! single bytes changed.

#[path = "../../fuzz/readers.rs"]
mod properties;

fn each(target: &str, property: fn(&[u8])) {
    let folder = format!("{}/../fuzz/corpus/{target}", env!("CARGO_MANIFEST_DIR"));
    let mut files = 0;
    for entry in std::fs::read_dir(folder).expect("a corpus") {
        let mut bytes = std::fs::read(entry.expect("readable").path()).expect("readable");
        property(&bytes);
        for end in (0..bytes.len()).step_by(17) {
            property(&bytes[..end]);
        }
        for at in (0..bytes.len()).step_by(37) {
            let old = bytes[at];
            for new in [0, b'"', b'\n', 0x1b, 0xff, old ^ 1] {
                bytes[at] = new;
                property(&bytes);
            }
            bytes[at] = old;
        }
        files += 1;
    }
    assert!(files >= 2, "{files} files for {target}");
}

#[test]
fn csv() {
    each("csv", properties::csv);
}

#[test]
fn mcap() {
    each("mcap", properties::mcap);
}

#[test]
fn rig_file() {
    each("rig_file", properties::rig_file);
}

#[test]
fn controller_file() {
    each("controller_file", properties::controller_file);
}
