//! What a command writes: nothing that a person mistypes destroys data, and a file is written whole or not at all.

use crate::common;

use std::path::{Path, PathBuf};
use std::process::{Output, Stdio};

use common::{Folder, failure, furuta, last_line};

/// A folder with a rig file and two recordings, small enough for a quick answer.
struct Bench {
    folder: Folder,
    rig: String,
    run: String,
}

impl Bench {
    fn new(test: &str) -> Self {
        let folder = Folder::new(test);
        let rig = furuta_model::Rig::builtin_text("qube-servo-2").expect("built in");
        folder.file("rig.toml", rig);
        let text = |name: &str| folder.path(name).to_str().expect("UTF-8").to_owned();
        let (rig, run) = (text("rig.toml"), text("run-0.csv"));
        for (file, input) in [(run.as_str(), "multisine"), (&text("run-1.csv"), "steps")] {
            let done = furuta(&["simulate", "--rig", &rig, "--duration", "4", "-o", file])
                .args(["--input", input, "--amplitude", "1"])
                .stderr(Stdio::null())
                .status();
            assert!(done.expect("runs").success());
        }
        Self { folder, rig, run }
    }

    fn path(&self, name: &str) -> String {
        self.folder.path(name).to_str().expect("UTF-8").to_owned()
    }

    fn bytes(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.folder.path(name)).expect("a file")
    }

    /// `identify validate` is the quickest of the commands that read recordings.
    fn validate(&self, more: &[&str]) -> Output {
        let args = ["identify", "validate", "--rig", &self.rig];
        furuta(&[&args[..], more].concat()).output().expect("runs")
    }

    /// Every file, by name, with its content.
    fn files(&self) -> Vec<(PathBuf, Vec<u8>)> {
        let folder = std::fs::read_dir(self.folder.path("")).expect("a folder");
        let mut files: Vec<_> = folder
            .map(|entry| entry.expect("an entry").path())
            .filter(|path| path.is_file())
            .map(|path| (path.clone(), std::fs::read(path).expect("a file")))
            .collect();
        files.sort();
        files
    }
}

/// The line that destroyed a measurement: `--json` takes no value, and the recordings behind it are recordings.
#[test]
fn json_is_a_flag_and_the_recordings_behind_it_stay() {
    let bench = Bench::new("outputs-json");
    let before = bench.files();
    let second = bench.path("run-1.csv");
    for data in [&[bench.run.as_str()][..], &[&bench.run, &second]] {
        let output = bench.validate(&[&["--json"], data].concat());
        assert!(output.status.success(), "{output:?}");
        let answer: serde_json::Value =
            serde_json::from_slice(&output.stdout).expect("only JSON on standard output");
        assert!(answer["channels"].is_array(), "{answer}");
    }
    assert_eq!(bench.files(), before);

    // Those who still give it a file are told.
    for old in ["-", "out.json"] {
        let output = bench.validate(&[&bench.run, "--json", old]);
        let line = failure(&output);
        assert!(
            line.contains("--json takes no value any more") && line.contains("--json-file FILE"),
            "{line}"
        );
        assert!(output.stdout.is_empty());
    }

    // Text for the person, JSON for the program.
    let file = bench.path("answer.json");
    let output = bench.validate(&[&bench.run, "--json-file", &file]);
    assert!(output.status.success(), "{output:?}");
    let written: serde_json::Value =
        serde_json::from_slice(&bench.bytes("answer.json")).expect("JSON");
    assert!(written["channels"].is_array());
    assert!(serde_json::from_slice::<serde_json::Value>(&output.stdout).is_err());
    // Both at once, again over the same file.
    let output = bench.validate(&[&bench.run, "--json", "--json-file", &file]);
    assert_eq!(output.stdout, bench.bytes("answer.json"));
}

#[test]
fn every_command_has_json_as_a_flag() {
    let commands = [
        "demo rigs effects simulate controllers diagnose emulate run latency convert replay",
        "design:lqr,lqi,place,robust,steady-motion",
        "identify:frf,tf,compare,calibrate,validate,plan",
        "study:fong2014,shahzad2022,ramos-velasco,swing-up,reach,mpc,estimators,limit-cycle,region,calibration",
    ];
    let all = commands.iter().flat_map(|line| match line.split_once(':') {
        Some((group, names)) => names.split(',').map(|name| vec![group, name]).collect(),
        None => line.split(' ').map(|name| vec![name]).collect::<Vec<_>>(),
    });
    for command in all {
        let output = furuta(&command).arg("--help").output().expect("runs");
        let help = String::from_utf8(output.stdout).expect("UTF-8");
        let line = help
            .lines()
            .find(|l| l.split_whitespace().next() == Some("--json"));
        let value = line.is_none_or(|line| line.contains('<'));
        assert!(!value, "{command:?}: {help}");
    }
}

/// Under every option that writes, and under every name that it goes by, an input stays as it is.
#[cfg(unix)]
#[test]
fn an_output_is_no_input_of_the_same_command() {
    let bench = Bench::new("outputs-inputs");
    let [soft, hard] = ["soft.html", "hard.html"].map(|name| bench.path(name));
    std::os::unix::fs::symlink("run-0.csv", &soft).expect("a link");
    std::fs::hard_link(&bench.run, &hard).expect("a link");
    std::fs::create_dir(bench.folder.path("down")).expect("a folder");
    let round = bench.path("down/../run-0.csv");
    let before = bench.files();
    let (run, rig) = (bench.run.as_str(), bench.rig.as_str());
    let on = ["--rig", rig];
    let commands: [(&[&str], &[&str]); 12] = [
        (&["diagnose", run], &["--report", run]),
        (&["diagnose", run], &["--report", &soft]),
        (&["diagnose", run], &["--report", &hard]),
        (&["diagnose", run], &["--json-file", &round]),
        (&["diagnose", run], &["--write-rig", rig]),
        (&["identify", "calibrate", run], &["--write-rig", rig]),
        (&["identify", "validate", run], &["--json-file", run]),
        (&["identify", "frf", run], &["--csv", run]),
        (&["identify", "tf", run], &["--report", run]),
        (&["identify", "compare", run], &["--plot", run]),
        (&["simulate"], &["--output", rig]),
        (&["design", "lqr"], &["--write-controller", rig]),
    ];
    for (command, option) in commands {
        let with_rig: &[&str] = if command.ends_with(&["frf", run]) {
            &[]
        } else {
            &on
        };
        let args = [command, with_rig, option].concat();
        let output = furuta(&args).output().expect("runs");
        let line = failure(&output);
        for part in [
            option[0],
            option[1],
            "is an input of this command",
            "--force",
        ] {
            assert!(line.contains(part), "{args:?}: {line}");
        }
        assert!(output.stdout.is_empty());
        assert_eq!(bench.files(), before, "{args:?}");
    }
    let line = failure(&furuta(&["convert", run, run]).output().expect("runs"));
    assert!(
        line.contains("OUT") && line.contains("is an input"),
        "{line}"
    );
    assert_eq!(bench.files(), before);
    // Whoever insists has it so.
    let output = bench.validate(&[run, "--json-file", run, "--force"]);
    assert!(output.status.success(), "{output:?}");
    assert!(bench.bytes("run-0.csv").starts_with(b"{"));
}

#[test]
fn two_outputs_are_two_files() {
    let bench = Bench::new("outputs-two");
    let before = bench.files();
    let (one, same) = (bench.path("out"), bench.path("./out"));
    let args = [
        "diagnose", &bench.run, "--rig", &bench.rig, "--report", &one,
    ];
    let output = furuta(&[&args[..], &["--write-rig", &same]].concat()).output();
    let line = failure(&output.expect("runs"));
    assert!(
        line.contains("--report")
            && line.contains("--write-rig")
            && line.contains("a name of its own"),
        "{line}"
    );
    assert_eq!(bench.files(), before);
}

/// What can be made again is replaced, by its own kind; what may be all there is of it is not.
#[test]
fn only_what_can_be_made_again_is_replaced() {
    let bench = Bench::new("outputs-exists");
    let validate = |option: &str, name: &str, force: bool| {
        let more = if force { &["--force"][..] } else { &[] };
        bench.validate(&[&[bench.run.as_str(), option, &bench.path(name)], more].concat())
    };
    bench
        .folder
        .file("page.html", "<!doctype html>\n<p>of yesterday");
    bench.folder.file("answer.json", "{\"schema\": 0}\n");
    bench.folder.file("empty", "");
    bench
        .folder
        .file("controller.toml", "[controller]\nkind = \"lqr\"\n");
    // A recording under the name of something else is still a recording.
    bench
        .folder
        .file("recording.json", bench.bytes("run-1.csv"));
    let log = bench.path("run.mcap");
    let made = furuta(&["convert", &bench.run, &log]).output();
    assert!(made.expect("runs").status.success());
    for name in [
        "run-1.csv",
        "run.mcap",
        "controller.toml",
        "recording.json",
        "page.html",
    ] {
        let before = bench.files();
        let output = validate("--json-file", name, false);
        let line = failure(&output);
        for part in ["--json-file", name, "exists already", "--force"] {
            assert!(line.contains(part), "{name}: {line}");
        }
        assert!(output.stdout.is_empty(), "refused before anything runs");
        assert_eq!(bench.files(), before, "{name}");
    }
    for name in ["answer.json", "empty", "new"] {
        let output = validate("--json-file", name, false);
        assert!(output.status.success(), "{name}: {output:?}");
        assert!(bench.bytes(name).starts_with(b"{"), "{name}");
    }
    assert!(validate("--json-file", "run-1.csv", true).status.success());
    assert!(bench.bytes("run-1.csv").starts_with(b"{"));

    let simulated = bench.path("simulated.csv");
    let simulate = |more: &[&str]| {
        let args = [
            "simulate",
            "--rig",
            &bench.rig,
            "--duration",
            "0.1",
            "-o",
            &simulated,
        ];
        furuta(&[&args[..], more].concat()).output().expect("runs")
    };
    assert!(simulate(&[]).status.success());
    assert!(failure(&simulate(&[])).contains("simulated.csv: exists already"));
    assert!(simulate(&["--force"]).status.success());
}

/// What cannot be written is said before the work, not after it.
#[test]
fn where_nothing_can_be_written_nothing_runs() {
    let bench = Bench::new("outputs-nowhere");
    let folder = bench.path("");
    for (path, says) in [
        (bench.path("no/such/answer.json"), "cannot be created"),
        (folder.clone(), "is a folder"),
        ("-".to_owned(), "names no file"),
        (bench.path("run-0.csv/answer.json"), "cannot be created"),
    ] {
        // With a recording that does not exist: the output is refused before it is opened.
        let line = failure(&bench.validate(&["absent.csv", "--json-file", &path]));
        assert!(
            line.contains(says) && line.contains("--json-file"),
            "{line}"
        );
    }
    let plot = bench.path("plot.png");
    let output = furuta(&["study", "fong2014", "--plot", &plot]).output();
    assert!(failure(&output.expect("runs")).contains("let the name end in .svg"));
}

/// The demo fills a folder of its own: what others left there stays.
#[test]
fn the_demo_replaces_no_file_of_others() {
    let bench = Bench::new("outputs-demo");
    let before = bench.files();
    let output = furuta(&["demo", "--out", &bench.path("")]).output();
    let line = failure(&output.expect("runs"));
    assert!(
        line.contains("rig.toml is there already") && line.contains("--force"),
        "{line}"
    );
    assert_eq!(bench.files(), before);
}

/// Devices and pipes are written as they are.
#[cfg(target_os = "linux")]
#[test]
fn streams_are_written_directly() {
    let bench = Bench::new("outputs-streams");
    let before = bench.files();
    let null = ["--json-file", "/dev/null"];
    assert!(
        bench
            .validate(&[&[bench.run.as_str()], &null[..]].concat())
            .status
            .success()
    );
    let both = ["--json", "--json-file", "/dev/stdout"];
    let output = bench.validate(&[&[bench.run.as_str()], &both[..]].concat());
    let twice = String::from_utf8(output.stdout).expect("UTF-8");
    let (first, second) = twice.split_at(twice.len() / 2);
    assert!(first.starts_with('{') && first == second);
    // Standard output that is a file takes both, none over the other.
    let file = std::fs::File::create(bench.folder.path("both")).expect("a file");
    let args = ["identify", "validate", "--rig", &bench.rig, &bench.run];
    let done = furuta(&[&args[..], &both[..]].concat())
        .stdout(file)
        .status();
    assert!(done.expect("runs").success());
    assert_eq!(bench.bytes("both"), twice.as_bytes());
    std::fs::remove_file(bench.folder.path("both")).expect("written");
    assert_eq!(bench.files(), before);
}

/// Of a log that ends early, its name and the reason are the last that is said.
#[cfg(target_os = "linux")]
#[test]
fn a_log_that_ends_early_is_named() {
    let args = ["run", "--emulated", "shahzad2022-srv02", "--task", "zero"];
    let output = furuta(&[&args[..], &["--duration", "0.2", "--log", "/dev/full"]].concat());
    let line = common::last_line(&{ output }.output().expect("the binary runs"));
    assert!(
        line.contains("/dev/full: log cannot be written further: No space left"),
        "{line}"
    );
}

/// A full disk: the answer is given, the failure is one line, no file is left half written.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_leaves_nothing_half_written() {
    let bench = Bench::new("outputs-full");
    let output = bench.validate(&[&bench.run, "--json", "--json-file", "/dev/full"]);
    let line = failure(&output);
    assert!(
        line.contains("/dev/full: cannot be written: No space left"),
        "{line}"
    );
    assert!(serde_json::from_slice::<serde_json::Value>(&output.stdout).is_ok());
    for name in ["full.csv", "full.mcap"] {
        let full = bench.path(name);
        std::os::unix::fs::symlink("/dev/full", &full).expect("a link");
        let line = failure(
            &furuta(&["convert", &bench.run, &full])
                .output()
                .expect("runs"),
        );
        assert!(
            line.contains(name) && line.contains("No space left"),
            "{line}"
        );
        std::fs::remove_file(&full).expect("a link");
    }
    // A file system of its own, where one may be mounted: older files stay as they were, whatever is written over
    // them.
    let disk = bench.path("disk");
    std::fs::create_dir(&disk).expect("a folder");
    let Some(_disk) = Disk::mount(&disk) else {
        println!("no file system can be mounted here");
        return;
    };
    let names = || {
        let names = std::fs::read_dir(&disk).expect("a folder");
        names
            .map(|entry| entry.expect("an entry").file_name())
            .collect::<Vec<_>>()
    };
    let old = Path::new(&disk).join("old.csv");
    std::fs::write(&old, "t,u,theta,alpha\n").expect("room for a line");
    for name in ["old.csv", "new.csv", "new.mcap"] {
        let out = format!("{disk}/{name}");
        let args = ["convert", &bench.run, &out, "--force"];
        let line = failure(&furuta(&args).output().expect("runs"));
        assert!(
            line.contains(name) && line.contains("No space left"),
            "{line}"
        );
        assert_eq!(names(), ["old.csv"]);
    }
    assert_eq!(std::fs::read(&old).expect("there"), b"t,u,theta,alpha\n");
}

/// The folder goes away during the work: the answer is given all the same.
#[cfg(target_os = "linux")]
#[test]
fn a_folder_that_goes_away_does_not_take_the_answer_along() {
    let bench = Bench::new("outputs-gone");
    let gone = bench.path("gone");
    std::fs::create_dir(&gone).expect("a folder");
    let file = format!("{gone}/answer.json");
    // A search takes seconds.
    let child = furuta(&["diagnose", "--rig", "qube-servo-2", &bench.run])
        .args(["--json", "--json-file", &file, "--accept-suspicious"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("runs");
    // The search has threads of its own; outputs have been checked before.
    let threads = format!("/proc/{}/task", child.id());
    let searches = || std::fs::read_dir(&threads).is_ok_and(|all| all.count() > 2);
    for _ in 0..60_000 {
        if searches() {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    std::fs::remove_dir(&gone).expect("empty: nothing stays of the check");
    let output = child.wait_with_output().expect("ends");
    let line = failure(&output);
    assert!(line.contains("answer.json: cannot be"), "{line}");
    assert!(serde_json::from_slice::<serde_json::Value>(&output.stdout).is_ok());
}

/// 16 KiB in memory.
struct Disk<'a>(&'a str);

impl<'a> Disk<'a> {
    fn mount(at: &'a str) -> Option<Self> {
        let args = ["-t", "tmpfs", "-o", "size=16k", "tmpfs", at];
        let done = std::process::Command::new("mount")
            .args(args)
            .stderr(Stdio::null())
            .status();
        done.is_ok_and(|status| status.success())
            .then_some(Self(at))
    }
}

impl Drop for Disk<'_> {
    fn drop(&mut self) {
        let _ = std::process::Command::new("umount").arg(self.0).status();
    }
}

/// A log is replaced by the log of a run, not by a run that never was.
#[test]
fn a_failed_run_does_not_replace_an_older_log() {
    let bench = Bench::new("outputs-log");
    let log = bench.path("run.mcap");
    let made = furuta(&["convert", &bench.run, &log]).output();
    assert!(made.expect("runs").status.success());
    let before = bench.files();
    let run = |on: &[&str], more: &[&str]| {
        let args = ["run", "--duration", "0.2", "--task", "zero", "--log", &log];
        furuta(&[&args[..], on, more].concat())
            .output()
            .expect("runs")
    };
    let emulated = ["--emulated", "shahzad2022-srv02"];
    let line = failure(&run(&emulated, &[]));
    assert!(line.contains("--log") && line.contains("--force"), "{line}");
    let no_rig = ["--port", "/dev/no-such-port", "--rig", "qube-servo-2"];
    last_line(&run(&no_rig, &["--force"]));
    // The rig says that it is another.
    let rig = furuta_model::Rig::builtin("shahzad2022-srv02").expect("built in");
    let emulation = furuta_hw::Emulation::default();
    let on = furuta_hw::EmulatedRig::new(&rig, &emulation).expect("valid");
    let on = furuta_hw::PtyRig::start(on, furuta_hw::Pace::Patient).expect("a port");
    last_line(&run(
        &["--port", on.path(), "--rig", "qube-servo-2"],
        &["--force"],
    ));
    assert_eq!(bench.files(), before);
    // One that flies does replace it, and leaves nothing beside it.
    let output = run(&emulated, &["--force"]);
    assert!(output.status.success(), "{output:?}");
    let read = furuta_log::read(Path::new(&log)).expect("a log");
    assert!(read.records.len() >= 100 && read.notice.is_none());
    assert_eq!(bench.files().len(), before.len());
}

/// A host that is killed while it writes over an older log: that one stays, and what was logged is readable beside it.
#[cfg(unix)]
#[test]
fn a_killed_run_leaves_the_older_log_and_its_own() {
    let bench = Bench::new("outputs-killed");
    let log = bench.path("run.mcap");
    let made = furuta(&["convert", &bench.run, &log]).output();
    assert!(made.expect("runs").status.success());
    let older = bench.bytes("run.mcap");
    let mut host = furuta(&["run", "--emulated", "shahzad2022-srv02", "--force"])
        .args(["--duration", "600", "--log", &log])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("runs");
    let partial = || {
        let files = bench.files().into_iter();
        let named = |path: &Path| path.to_string_lossy().ends_with(".partial");
        files.map(|(path, _)| path).find(|path| named(path))
    };
    for _ in 0..1200 {
        if partial().is_some_and(|p| p.metadata().is_ok_and(|m| m.len() > 50_000)) {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(50));
    }
    host.kill().expect("running"); // SIGKILL
    host.wait().expect("killed");
    assert_eq!(bench.bytes("run.mcap"), older);
    let partial = partial().expect("beside it");
    let text = partial.to_str().expect("UTF-8");
    assert!(text.contains("run.mcap."), "{text}");
    // Readers take it by its name.
    let saved = bench.path("saved.csv");
    let line = last_line(&furuta(&["convert", text, &saved]).output().expect("runs"));
    assert!(
        line.contains("cut off") && line.contains("saved.csv"),
        "{line}"
    );
    let rows = String::from_utf8(bench.bytes("saved.csv")).expect("UTF-8");
    assert!(rows.lines().count() > 100);
}
