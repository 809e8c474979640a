//! Recordings through the built binary: what is sound is converted without loss, what is not gives one clear line and exit code 1.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// An empty folder of its own for one test, removed afterwards.
struct Folder(PathBuf);

impl Folder {
    fn new(test: &str) -> Self {
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("recordings-{test}"));
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir_all(&path).expect("a folder");
        Self(path)
    }

    fn file(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.join(name);
        std::fs::write(&path, content).expect("a file");
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn convert(input: &Path, output: &Path, more: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_furuta"))
        .arg("convert")
        .args([input, output])
        .args(more)
        .output()
        .expect("the binary runs")
}

/// The one line on standard error of a command that fails as it should.
fn failure(output: &Output) -> String {
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert_eq!(stderr.trim_end().lines().count(), 1, "{stderr}");
    assert!(!stderr.contains("panicked"), "{stderr}");
    stderr
}

fn swing() -> String {
    let mut text = String::from("# bench 2\ncurrent,t,u,theta,alpha,lamp\n");
    for k in 0..2000 {
        let t = f64::from(k) * 0.004;
        text += &format!(
            "{},{t},{},{},{},{}\n",
            0.1 * t,
            (9.0 * t).cos(),
            0.1 * (9.0 * t).sin(),
            3.0 + 0.1 * (7.0 * t).cos(),
            ["on", "off"][k as usize % 2]
        );
    }
    text
}

#[test]
fn there_and_back_gives_the_same_file() {
    let folder = Folder::new("there-and-back");
    let csv = folder.file("run.csv", swing());
    let [mcap, again, first] =
        ["run.mcap", "again.csv", "first.csv"].map(|name| folder.0.join(name));
    let output = convert(&csv, &mcap, &[]);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(
        text.contains("2000 samples, 7.996 s, columns t, u, theta, alpha, current, lamp"),
        "{text}"
    );
    assert!(convert(&mcap, &again, &[]).status.success());
    // Once through our own writer, the order of the columns is settled.
    assert!(convert(&csv, &first, &[]).status.success());
    let read = |path: &Path| std::fs::read_to_string(path).expect("written");
    assert_eq!(read(&again), read(&first));
    assert!(read(&again).starts_with("# bench 2\nt,u,theta,alpha,current,lamp\n"));
}

#[test]
fn json_and_notices() {
    let folder = Folder::new("json");
    let text = swing();
    let lines: Vec<&str> = text.lines().collect();
    let gap = [&lines[..500], &lines[600..]].concat().join("\n");
    let input = folder.file("gap.csv", gap);
    let output = convert(&input, &folder.0.join("out.mcap"), &["--json"]);
    assert!(output.status.success());
    let answer: serde_json::Value =
        serde_json::from_slice(&output.stdout).expect("JSON on standard output");
    assert_eq!(answer["samples"], 1900);
    assert_eq!(answer["columns"][3], "alpha");
    assert!(
        answer["notices"][0]
            .as_str()
            .is_some_and(|notice| notice.contains("gap before row 501")),
        "{answer}"
    );
}

#[test]
fn bad_recordings_give_one_clear_line() {
    let folder = Folder::new("bad");
    let out = folder.0.join("out.mcap");
    let rows = |last: &str| format!("t,u,theta,alpha\n0,0,0,3.1\n0.1,0,0,3.1\n{last}\n");
    for (name, content, says) in [
        (
            "no-alpha.csv",
            "t,u,theta\n0,0,0\n".to_owned(),
            ["no column `alpha`", "found t, u, theta"],
        ),
        (
            "nan.csv",
            rows("0.2,0,0,NaN"),
            ["row 4, column alpha", "NaN"],
        ),
        (
            "backwards.csv",
            rows("0.05,0,0,3.1"),
            [
                "row 4, column t",
                "time goes backwards, from 0.1 s to 0.05 s",
            ],
        ),
        (
            "empty.csv",
            String::new(),
            ["the file is empty", "t,u,theta,alpha"],
        ),
        ("empty.mcap", String::new(), ["the file is empty", ""]),
        (
            "letter.mcap",
            "Dear Sir or Madam".to_owned(),
            ["not an MCAP file", "furuta run"],
        ),
    ] {
        let message = failure(&convert(&folder.file(name, content), &out, &[]));
        for piece in [name].iter().chain(&says) {
            assert!(message.contains(piece), "{name}: {message}");
        }
        assert!(!out.exists(), "{name}: nothing is written");
    }
    assert!(failure(&convert(&folder.0.join("absent.csv"), &out, &[])).contains("absent.csv"));
    let sound = folder.file("run.csv", swing());
    assert!(
        failure(&convert(&sound, &folder.0.join("run.xls"), &[])).contains("ends in .csv or .mcap")
    );
    assert!(failure(&convert(&sound, &sound, &[])).contains("is the recording itself"));
    assert!(
        failure(&convert(
            &sound,
            &folder.0.join("no-such-folder/run.csv"),
            &[]
        ))
        .contains("no-such-folder")
    );
}

/// What a killed run had logged is kept, and the failure says so.
#[test]
fn of_a_truncated_log_the_rest_is_kept() {
    let folder = Folder::new("truncated");
    let whole = folder.0.join("whole.mcap");
    assert!(
        convert(&folder.file("run.csv", swing()), &whole, &[])
            .status
            .success()
    );
    let bytes = std::fs::read(&whole).expect("written");
    let cut = folder.file("cut.mcap", &bytes[..bytes.len() / 2]);
    let saved = folder.0.join("saved.csv");
    let message = failure(&convert(&cut, &saved, &[]));
    assert!(
        message.contains("cut.mcap: log was cut off") && message.contains("saved.csv"),
        "{message}"
    );
    let rows = std::fs::read_to_string(&saved)
        .expect("what was read")
        .lines()
        .count();
    assert!(rows > 500, "{rows} rows");
    // Cut before its first sample.
    let stub = folder.file("stub.mcap", &bytes[..100]);
    assert!(failure(&convert(&stub, &folder.0.join("none.csv"), &[])).contains("record it again"));
}
