//! What the tests of the built binary share: a folder for one test, and commands that fail as they should.
#![allow(dead_code)] // each test file uses a part

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// An empty folder of its own for one test, removed afterwards.
pub(crate) struct Folder(PathBuf);

impl Folder {
    pub(crate) fn new(test: &str) -> Self {
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(test);
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir_all(&path).expect("a folder");
        Self(path)
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    pub(crate) fn file(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path(name);
        std::fs::write(&path, content).expect("a file");
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// The built binary, to be given arguments.
pub(crate) fn furuta(args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_furuta"));
    command.args(args);
    command
}

/// What a command that succeeds answers, given `--json`.
pub(crate) fn json(args: &[&str]) -> serde_json::Value {
    let output = furuta(args).output().expect("the binary runs");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    serde_json::from_slice(&output.stdout).expect("JSON")
}

/// The one line on standard error of a command that fails as it should: exit code 1, no panic.
pub(crate) fn failure(output: &Output) -> String {
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(stderr.trim_end().lines().count(), 1, "{stderr}");
    last_line(output)
}

/// The same of a command that says something before it fails: the last line.
pub(crate) fn last_line(output: &Output) -> String {
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(!stderr.contains("panicked"), "{stderr}");
    let line = stderr.trim_end().lines().last().unwrap_or_default();
    assert!(line.starts_with("furuta: "), "{stderr}");
    line.to_owned()
}

/// A built-in rig's file with `from` replaced by `to`.
pub(crate) fn rig_text(name: &str, from: &str, to: &str) -> String {
    let text = furuta_model::Rig::builtin_text(name).expect("built in");
    assert!(text.contains(from));
    text.replacen(from, to, 1)
}

/// A recording of 2000 samples in 8 s, with a comment and further columns.
pub(crate) fn swing() -> String {
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
