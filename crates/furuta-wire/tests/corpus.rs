//! The properties of the fuzz targets (fuzz/), on the corpus that the fuzzer left.

#[path = "../../../fuzz/properties.rs"]
mod properties;

fn each(target: &str, property: fn(&[u8])) {
    let folder = format!("{}/../../fuzz/corpus/{target}", env!("CARGO_MANIFEST_DIR"));
    let mut files = 0;
    for entry in std::fs::read_dir(folder).expect("a corpus") {
        let bytes = std::fs::read(entry.expect("readable").path()).expect("readable");
        property(&bytes);
        // And what a fuzzer would try first: each beginning of it.
        (0..bytes.len()).for_each(|end| property(&bytes[..end]));
        files += 1;
    }
    assert!(files > 10, "{files} files for {target}");
}

#[test]
fn decoder() {
    each("decoder", properties::decoder);
}

#[test]
fn message() {
    each("message", properties::message);
}

#[test]
fn round_trip() {
    each("round_trip", properties::round_trip);
}
