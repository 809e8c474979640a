//! Which files are opened, which are refused and in which words.

use std::fs::{self, File};
use std::path::PathBuf;
use std::process::Command;

use furuta_input::{Input, foreign, number, quoted, read_text};

struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("furuta-input-{name}-{}", std::process::id()));
        fs::create_dir_all(&path).expect("a folder");
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn refused(path: &std::path::Path) -> String {
    let error = Input::open(path, "a recording", 1 << 20).expect_err("must be refused");
    let text = error.to_string();
    assert!(!text.contains('\n'), "{text}");
    text
}

#[test]
fn what_is_no_regular_file_is_refused_by_its_kind() {
    let folder = Folder::new("kinds");
    let directory = refused(&folder.0);
    assert!(
        directory.contains("is a directory, not a recording: give"),
        "{directory}"
    );
    assert!(refused(&folder.0.join("absent.csv")).contains("absent.csv: "));
    let empty = folder.0.join("zeros.csv");
    fs::write(&empty, [0; 4096]).expect("written");
    assert!(
        refused(&empty).contains("zeros.csv is a file of zero bytes, not a recording"),
        "{}",
        refused(&empty)
    );
    let large = folder.0.join("large.csv");
    File::create(&large)
        .expect("created")
        .set_len(1 << 40)
        .expect("sparse");
    assert!(
        refused(&large).contains("1099511627776 bytes; at most 1048576"),
        "{}",
        refused(&large)
    );
    let sparse = folder.0.join("sparse.csv");
    File::create(&sparse)
        .expect("created")
        .set_len(1 << 20)
        .expect("sparse");
    assert!(
        refused(&sparse).contains("a sparse file of zero bytes"),
        "{}",
        refused(&sparse)
    );
}

/// To open a pipe would wait for its writer.
#[cfg(unix)]
#[test]
fn pipes_sockets_and_devices_are_refused_at_once() {
    let folder = Folder::new("special");
    let pipe = folder.0.join("pipe.csv");
    assert!(
        Command::new("mkfifo")
            .arg(&pipe)
            .status()
            .expect("runs")
            .success()
    );
    assert!(
        refused(&pipe).contains("is a pipe (FIFO), not a recording"),
        "{}",
        refused(&pipe)
    );
    let socket = folder.0.join("socket.csv");
    let _listener = std::os::unix::net::UnixListener::bind(&socket).expect("bound");
    assert!(refused(&socket).contains("is a socket"));
    assert!(refused("/dev/zero".as_ref()).contains("is a device"));
}

#[test]
fn text_is_text() {
    let folder = Folder::new("text");
    let path = folder.0.join("rig.toml");
    fs::write(&path, b"[rig]\nname = \"\xff\"\n").expect("written");
    let error = read_text(&path, "a rig file")
        .expect_err("no text")
        .to_string();
    assert!(error.contains("line 2: not UTF-8"), "{error}");
    fs::write(&path, "[rig]\n").expect("written");
    assert_eq!(read_text(&path, "a rig file").expect("text"), "[rig]\n");
}

#[test]
fn messages_hold_printable_characters_only() {
    for text in [
        "\u{1b}]0;title\u{7}",
        "a\nb\r\tc",
        "\u{202e}abc",
        "\u{9b}31m",
    ] {
        for shown in [quoted(text).to_string(), foreign(text).to_string()] {
            assert!(
                shown
                    .chars()
                    .all(|c| c == ' ' || furuta_input::is_printable(c)),
                "{shown:?}"
            );
        }
    }
    assert_eq!(quoted("Größe \"x\\y\"").to_string(), "Größe \"x\\y\"");
    let long = format!("unknown field `{}`, expected `a`", "k".repeat(100_000));
    assert_eq!(
        foreign(&long).to_string(),
        format!("unknown field `{}..., expected `a`", "k".repeat(80))
    );
    assert!(foreign(&"`".repeat(100_000)).to_string().len() < 2000);
    let shown = [1e300, -2.5e-7, 0.0, 12.5, f64::NAN].map(|x| number(x).to_string());
    assert_eq!(shown, ["1e300", "-2.5e-7", "0", "12.5", "NaN"]);
}
