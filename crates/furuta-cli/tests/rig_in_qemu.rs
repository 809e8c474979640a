//! `furuta run` against the firmware: the board mps2-an386 in QEMU, behind a pseudo-terminal, a model in the place of
//! its mechanics.
//!
//! Runs where FURUTA_FIRMWARE names the program (`make firmware-run` sets it), skipped otherwise. The board's emulated
//! time stands still while this machine is busy, so that no test depends on how fast that is. FURUTA_ON_CHIP names a
//! program that needs no host.

use crate::common;

use std::ffi::OsStr;
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use common::{Folder, furuta};
use furuta_hw::{Link, SerialTransport};
use furuta_log::Mode;
use furuta_wire::{Message, Status};

const RIG: &str = "shahzad2022-srv02";

/// The board with a program, its serial line as said.
fn qemu(program: &OsStr, serial: &str) -> Command {
    let mut command = Command::new("qemu-system-arm");
    command
        .args(["-machine", "mps2-an386", "-cpu", "cortex-m4"])
        .args(["-display", "none", "-monitor", "none", "-serial", serial])
        .args(["-semihosting-config", "enable=on,target=native", "-kernel"])
        .arg(program)
        .stdin(Stdio::null());
    command
}

/// The board; switched off when dropped.
struct Board {
    qemu: Child,
    port: String,
}

impl Board {
    /// `None` where there is no firmware to run; then the test is skipped, saying so.
    fn start() -> Option<Self> {
        let Some(firmware) = std::env::var_os("FURUTA_FIRMWARE") else {
            eprintln!(
                "skipped: FURUTA_FIRMWARE does not name the rig's firmware; `make firmware-run` builds and runs it"
            );
            return None;
        };
        let spawned = qemu(&firmware, "pty").stdout(Stdio::piped()).spawn();
        let mut qemu = match spawned {
            Ok(qemu) => qemu,
            Err(error) => {
                eprintln!(
                    "skipped: qemu-system-arm ({error}); as root: apt-get install qemu-system-arm"
                );
                return None;
            }
        };
        // char device redirected to /dev/pts/3 (label serial0)
        let stdout = qemu.stdout.take().expect("piped");
        let port = BufReader::new(stdout)
            .lines()
            .map_while(Result::ok)
            .find_map(|line| {
                let path = line.split_once("redirected to ")?.1;
                Some(path.split(' ').next()?.to_owned())
            });
        let port = port.expect("QEMU names its pseudo-terminal");
        Some(Self { qemu, port })
    }

    fn connect(&self) -> (Link<SerialTransport>, furuta_wire::Hello) {
        let port = SerialTransport::open(&self.port, SerialTransport::BAUD).expect("there");
        Link::connect(port, Duration::from_secs(20)).expect("the board answers")
    }

    fn run(&self, args: &[&str]) -> std::process::Output {
        furuta(&["run", "--any-clock", "--port", &self.port, "--rig", RIG])
            .args(args)
            .output()
            .expect("the binary runs")
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        let _ = self.qemu.kill();
        let _ = self.qemu.wait();
    }
}

#[test]
fn the_host_swings_the_boards_pendulum_up_and_balances_it() {
    let Some(board) = Board::start() else { return };
    let folder = Folder::new("qemu-run");
    let path = folder.path("run.mcap");
    let log = path.to_str().expect("plain");
    let output = board.run(&["--duration", "8", "--json", "--log", log]);
    assert!(output.status.success(), "{output:?}");
    let summary: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(summary["end"], "finished");
    let log = furuta_log::read(&path).expect("a log");
    assert_eq!(log.notice, None);
    assert_eq!(Some(log.records.len() as u64), summary["samples"].as_u64());
    assert_eq!(log.metadata.map(|m| m.rig).as_deref(), Some(RIG));
    // Hanging at first; up and balanced for most of the time and at the end.
    let first = log.records[0];
    assert_eq!(
        (first.mode, first.alpha),
        (Mode::SwingUp, std::f64::consts::PI)
    );
    let upright = |alpha: f64| furuta_ctrl::wrap(alpha).abs();
    let balanced = log
        .records
        .iter()
        .filter(|r| r.mode == Mode::Balance && upright(r.alpha) < 0.2);
    assert!(
        2 * balanced.count() > log.records.len(),
        "{:?}",
        summary["modes"]
    );
    let last = &log.records[log.records.len() - 500..];
    assert!(
        last.iter()
            .all(|r| r.mode == Mode::Balance && upright(r.alpha) < 0.1)
    );
    // The board held what it was told, one sample later; where this machine was too busy to answer in time, what it was
    // told before.
    let mut answered = 0;
    for (k, after) in log.records.iter().enumerate().skip(1) {
        if after.lost > 0 || after.status != 0 {
            continue;
        }
        let told = |r: &furuta_log::Record| f64::from(r.command as f32);
        if after.u == told(&log.records[k - 1]) {
            answered += 1;
            continue;
        }
        let mut earlier = log.records[..k].iter();
        assert!(
            after.u == 0.0 || earlier.any(|r| after.u == told(r)),
            "t = {}: {} V were never asked for",
            after.t,
            after.u
        );
    }
    assert!(answered > 3500, "{answered} of {}", log.records.len());
    // What the board computes in f32 is what the host's model predicts in f64, over short times (an encoder count is
    // 1.5e-3 rad).
    let rig = furuta_model::Rig::builtin(RIG).expect("built in");
    let plant = rig.plant::<f64>();
    let count = rig.sensors.resolution()[1];
    let mut x = plant.rest(furuta_model::State::hanging());
    for pair in log.records.windows(2).take(100) {
        for _ in 0..pair[1].lost + 1 {
            plant.step(&mut x, pair[0].u, 0.002);
        }
        assert!(
            (x.x.alpha - pair[1].alpha).abs() < 0.7 * count,
            "t = {}",
            pair[1].t
        );
    }
}

#[test]
fn the_board_switches_its_motor_off_when_its_host_falls_silent() {
    let Some(board) = Board::start() else { return };
    let (mut link, hello) = board.connect();
    assert_eq!((hello.rig.as_str(), hello.watchdog_periods), (RIG, 10));
    let deadline = Instant::now() + Duration::from_secs(30);
    let mut sample = || match link.receive(deadline).expect("there") {
        Some(Message::Sample(sample)) => sample,
        other => panic!("{other:?}"),
    };
    assert!(sample().status.contains(Status::WATCHDOG));
    let mut driven = 0;
    while let Some(message) = link.receive(deadline).expect("there") {
        match message {
            Message::Sample(s) if s.volts == 1.0 => {
                // From the last command that was obeyed on.
                let is_obeyed = !s.status.contains(Status::HELD);
                driven = if is_obeyed { 1 } else { driven + 1 };
            }
            // Until one comes in time.
            Message::Sample(s) if driven == 0 => link.command(s.seq, 1.0).expect("there"),
            Message::Sample(s) => {
                assert!(s.volts == 0.0 && s.status.contains(Status::WATCHDOG));
                break;
            }
            _ => {}
        }
    }
    assert_eq!(driven, 10);
}

/// A host that is killed says no goodbye.
#[cfg(unix)]
#[test]
fn the_board_switches_its_motor_off_when_its_host_is_killed() {
    let Some(board) = Board::start() else { return };
    let folder = Folder::new("qemu-killed");
    let path = folder.path("run.mcap");
    let mut host = furuta(&[
        "run",
        "--any-clock",
        "--port",
        &board.port,
        "--rig",
        RIG,
        "--duration",
        "600",
    ])
    .arg("--log")
    .arg(&path)
    .stdout(Stdio::null())
    .stderr(Stdio::null())
    .spawn()
    .expect("runs");
    let patience = Instant::now() + Duration::from_secs(60);
    while std::fs::metadata(&path).map_or(0, |m| m.len()) < 50_000 {
        assert!(Instant::now() < patience, "the run does not begin");
        std::thread::sleep(Duration::from_millis(20));
    }
    host.kill().expect("running"); // SIGKILL
    host.wait().expect("killed");
    let (mut link, _) = board.connect();
    // What it sent before is thrown away on connecting; by now 20 ms of the rig's time have passed, or will have.
    let deadline = Instant::now() + Duration::from_secs(30);
    let off = loop {
        match link.receive(deadline).expect("there") {
            Some(Message::Sample(s)) if s.status.contains(Status::WATCHDOG) => break s,
            Some(_) => {}
            None => panic!("no watchdog"),
        }
    };
    assert_eq!(off.volts, 0.0);
    // Cut off, and readable up to the last chunk.
    let log = furuta_log::read(&path).expect("a log");
    assert!(
        log.notice.is_some() && log.records.len() > 100,
        "{:?}",
        log.notice
    );
}

/// The control system on the chip, built with a rig file that names effects and with a controller file that has a
/// trajectory, catches the pendulum when the host's simulation of both files says. A rig without these effects is
/// caught ten samples later.
#[test]
fn the_chip_follows_the_trajectory_of_a_controller_file() {
    let Some(program) = std::env::var_os("FURUTA_ON_CHIP") else {
        eprintln!(
            "skipped: FURUTA_ON_CHIP does not name a program with its own control system; `make firmware-run` does"
        );
        return;
    };
    // The board's time is the number of its instructions: the same run every time.
    let output = qemu(&program, "null")
        .args(["-icount", "shift=3,sleep=off"])
        .output()
        .expect("qemu-system-arm runs the other tests");
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{output:?}");
    let caught = said
        .lines()
        .find_map(|line| line.strip_suffix(" s: balance"))
        .and_then(|time| time.parse::<f64>().ok());
    let caught = caught.unwrap_or_else(|| panic!("never caught: {said}"));

    let data = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data");
    let folder = Folder::new("on-chip");
    let csv = folder.path("simulated.csv");
    let output = furuta(&["simulate", "--duration", "2", "-o"])
        .arg(&csv)
        .arg("--rig")
        .arg(format!("{data}/sprung.toml"))
        .arg("--controller")
        .arg(format!("{data}/sprung-swing-up.toml"))
        .output()
        .expect("the binary runs");
    assert!(output.status.success(), "{output:?}");
    let text = std::fs::read_to_string(&csv).expect("written");
    let simulated = text
        .lines()
        .find(|line| line.ends_with(",balance"))
        .and_then(|line| line.split(',').next()?.parse::<f64>().ok())
        .expect("the simulated one is caught");
    // Single precision and counts may move it by a sample or two.
    assert!(
        (caught - simulated).abs() <= 0.004 + 1e-9,
        "{caught} s on the chip, {simulated} s simulated"
    );
}
