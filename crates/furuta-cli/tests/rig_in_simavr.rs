//! `furuta run` against the sketch for an Arduino: its binary in simavr, behind a pseudo-terminal, a simulated rig on
//! its pins (`firmware/arduino/simavr`).
//!
//! Runs where FURUTA_ARDUINO names the folder of what was built (`make arduino` sets it), skipped otherwise. The chip's
//! time stands still while the host thinks, so that no test depends on how fast this machine is.
#![cfg(unix)]

use crate::common;

use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use common::{Folder, furuta};
use furuta_hw::{Link, SerialTransport, Transport};
use furuta_log::Mode;
use furuta_wire::{Message, Sample, Status};

const RIG: &str = "shahzad2022-srv02";
const BAUD: u32 = 500_000;
const PATIENCE: Duration = Duration::from_secs(30);

/// Something that happened to the board, at this time of its own, s.
type Event = (f64, String);

/// The board with the sketch; switched off when dropped.
struct Board {
    bench: Child,
    commands: ChildStdin,
    events: Receiver<Event>,
    port: String,
}

impl Board {
    fn start() -> Option<Self> {
        Self::of("uno", "atmega328p", &[])
    }

    /// `None` where there is nothing to run; then the test is skipped, saying so.
    fn of(sketch: &str, chip: &str, options: &[&str]) -> Option<Self> {
        let Some(folder) = std::env::var_os("FURUTA_ARDUINO") else {
            eprintln!(
                "skipped: FURUTA_ARDUINO does not name the folder of the sketch; `make arduino` builds and runs it"
            );
            return None;
        };
        let folder = std::path::PathBuf::from(folder);
        let mut bench = Command::new(folder.join("bench"))
            .arg(chip)
            .arg(folder.join(sketch).with_extension("elf"))
            .args(options)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("`make arduino` has built it");
        let commands = bench.stdin.take().expect("piped");
        let mut lines = BufReader::new(bench.stdout.take().expect("piped")).lines();
        let first = lines.next().expect("it says something").expect("text");
        let port = first.strip_prefix("board on ").expect("where it is");
        let port = port.to_owned();
        let (sender, events) = channel();
        std::thread::spawn(move || {
            for line in lines.map_while(Result::ok) {
                let event = line.split_once(' ');
                let event = event.and_then(|(t, what)| Some((t.parse().ok()?, what.to_owned())));
                if sender.send(event.expect("time and event")).is_err() {
                    return;
                }
            }
        });
        Some(Self {
            bench,
            commands,
            events,
            port,
        })
    }

    fn tell(&mut self, command: &str) {
        writeln!(self.commands, "{command}").expect("it listens");
    }

    /// Waits for an event and returns its time.
    fn wait_for(&self, what: &str) -> f64 {
        let deadline = Instant::now() + PATIENCE;
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            let (t, event) = self.events.recv_timeout(left).expect(what);
            if event == what {
                return t;
            }
        }
    }

    /// What happened up to now and was not waited for.
    fn happened(&self) -> Vec<String> {
        self.events.try_iter().map(|(_, event)| event).collect()
    }

    /// Whether the motor went off and stayed off, for half a second of this machine's time.
    fn is_off(&self) -> bool {
        let mut last = None;
        while let Ok((_, event)) = self.events.recv_timeout(Duration::from_millis(500)) {
            if event.starts_with("motor") {
                last = Some(event);
            }
        }
        last.as_deref() == Some("motor off")
    }

    fn port(&self) -> SerialTransport {
        SerialTransport::open(&self.port, BAUD).expect("there")
    }

    fn connect(&self) -> Host {
        Host::on(self.port())
    }

    fn run(&self, args: &[&str]) -> Command {
        let mut command = furuta(&["run", "--any-clock", "--baud", "500000", "--rig", RIG]);
        command.args(["--port", &self.port]).args(args);
        command
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        let _ = self.bench.kill();
        let _ = self.bench.wait();
    }
}

/// A host that says what it likes.
struct Host(Link<SerialTransport>);

impl Host {
    fn on(port: SerialTransport) -> Self {
        let (link, hello) = Link::connect(port, PATIENCE).expect("the board answers");
        assert_eq!((hello.rig.as_str(), hello.watchdog_periods), (RIG, 10));
        Self(link)
    }

    fn sample(&mut self) -> Sample {
        let deadline = Instant::now() + PATIENCE;
        loop {
            match self.0.receive(deadline).expect("there") {
                Some(Message::Sample(sample)) => return sample,
                Some(_) => {}
                None => panic!("no sample"),
            }
        }
    }

    /// Answers the next sample.
    fn drive(&mut self, volts: f32) -> Sample {
        let sample = self.sample();
        self.0.command(sample.seq, volts).expect("there");
        sample
    }

    /// Goes on with it until the board holds this voltage.
    fn drive_until(&mut self, volts: f32, held: f32) -> Sample {
        let deadline = Instant::now() + PATIENCE;
        while Instant::now() < deadline {
            let sample = self.drive(volts);
            if sample.volts == held {
                return sample;
            }
        }
        panic!("{held} V were never held");
    }
}

/// Swings up and balances, as `furuta run` says and as its log shows.
fn swings_up(board: &Board, folder: &str) -> Vec<furuta_log::Record> {
    let folder = Folder::new(folder);
    let path = folder.path("run.mcap");
    let log = path.to_str().expect("plain");
    let output = board
        .run(&["--duration", "6", "--json", "--log", log])
        .output()
        .expect("the binary runs");
    assert!(output.status.success(), "{output:?}");
    let summary: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(summary["end"], "finished");
    let log = furuta_log::read(&path).expect("a log");
    assert_eq!(log.notice, None);
    let first = log.records[0];
    assert_eq!(
        (first.mode, first.alpha),
        (Mode::SwingUp, std::f64::consts::PI)
    );
    let last = &log.records[log.records.len() - 500..];
    assert!(
        last.iter()
            .all(|r| r.mode == Mode::Balance && furuta_ctrl::wrap(r.alpha).abs() < 0.1),
        "{:?}",
        summary["modes"]
    );
    log.records
}

#[test]
fn the_host_swings_the_sketchs_pendulum_up_and_balances_it() {
    let Some(board) = Board::start() else { return };
    let records = swings_up(&board, "simavr-uno");
    // The board held what it was told, one sample later; where this machine was too busy to answer in time, what it was
    // told before.
    let told = |r: &furuta_log::Record| f64::from(r.command as f32);
    let answered = records.windows(2).filter(|r| r[1].u == told(&r[0])).count();
    assert!(answered > 2700, "{answered} of {}", records.len());
    // What the pins do with the bench's rig, which has its own equations in C, is what the host's model predicts:
    // within three counts over 0.2 s (PWM has steps of 30 mV).
    let rig = furuta_model::Rig::builtin(RIG).expect("built in");
    let plant = rig.plant::<f64>();
    let count = rig.sensors.resolution()[1];
    let mut x = plant.rest(furuta_model::State::hanging());
    for pair in records.windows(2).take(100) {
        for _ in 0..pair[1].lost + 1 {
            plant.step(&mut x, pair[0].u, 0.002);
        }
        let apart = (x.x.alpha - pair[1].alpha) / count;
        assert!(apart.abs() < 3.0, "t = {}: {apart} counts", pair[1].t);
    }
}

#[test]
fn the_driver_with_a_direction_pin_swings_it_up_as_well() {
    let Some(board) = Board::of("uno-direction", "atmega328p", &["--direction"]) else {
        return;
    };
    swings_up(&board, "simavr-direction");
}

#[test]
fn the_mega_swings_it_up_as_well() {
    let Some(board) = Board::of("mega", "atmega2560", &[]) else {
        return;
    };
    swings_up(&board, "simavr-mega");
}

/// An adapter that holds bytes for a millisecond each way: each answer comes a period late.
#[test]
fn an_ordinary_usb_adapter_is_fast_enough() {
    let Some(board) = Board::of("uno", "atmega328p", &["--usb", "1000"]) else {
        return;
    };
    swings_up(&board, "simavr-usb");
}

#[test]
fn the_motor_is_off_when_the_host_falls_silent() {
    let Some(board) = Board::start() else { return };
    let mut host = board.connect();
    assert!(host.sample().status.contains(Status::WATCHDOG));
    let mut driven = 0;
    loop {
        let sample = host.sample();
        if sample.volts == 1.0 {
            // From the last command that was obeyed on.
            let is_obeyed = !sample.status.contains(Status::HELD);
            driven = if is_obeyed { 1 } else { driven + 1 };
        } else if driven == 0 {
            // Until one comes in time.
            host.0.command(sample.seq, 1.0).expect("there");
        } else {
            assert!(sample.volts == 0.0 && sample.status.contains(Status::WATCHDOG));
            break;
        }
    }
    assert_eq!(driven, 10);
    // What the pins show: ten periods of 2 ms, in steps of the bench's 50 us. The line may have held a command twice.
    let on = board.wait_for("motor on");
    let off = board.wait_for("motor off");
    assert!((0.019..0.1).contains(&(off - on)), "{}", off - on);
}

/// A host that is killed says no goodbye.
#[test]
fn the_motor_is_off_when_the_host_is_killed() {
    let Some(board) = Board::start() else { return };
    let folder = Folder::new("simavr-killed");
    let path = folder.path("run.mcap");
    let mut host = board
        .run(&["--duration", "600"])
        .arg("--log")
        .arg(&path)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("runs");
    let patience = Instant::now() + 2 * PATIENCE;
    while std::fs::metadata(&path).map_or(0, |m| m.len()) < 50_000 {
        assert!(Instant::now() < patience, "the run does not begin");
        std::thread::sleep(Duration::from_millis(20));
    }
    host.kill().expect("running"); // SIGKILL
    host.wait().expect("killed");
    let mut next = board.connect();
    let deadline = Instant::now() + PATIENCE;
    while !next.sample().status.contains(Status::WATCHDOG) {
        assert!(Instant::now() < deadline, "no watchdog");
    }
    assert!(board.is_off());
}

#[test]
fn a_command_beyond_the_limit_is_clipped() {
    let Some(board) = Board::start() else { return };
    let mut host = board.connect();
    for (volts, held) in [(100.0, 10.0), (-100.0, -10.0), (10.0, 10.0)] {
        let sample = host.drive_until(volts, held);
        let is_clipped = sample.status.contains(Status::CLIPPED);
        assert_eq!(is_clipped, volts.abs() > 10.0, "{volts} V");
    }
}

#[test]
fn a_command_that_is_no_number_is_refused() {
    let Some(board) = Board::start() else { return };
    let mut host = board.connect();
    for volts in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        host.drive_until(1.0, 1.0);
        // It feeds no watchdog: what was held is held for ten periods, and nothing else.
        let samples: Vec<Sample> = (0..40).map(|_| host.drive(volts)).collect();
        assert!(samples.iter().all(|s| s.volts == 1.0 || s.volts == 0.0));
        let off = &samples[20..];
        assert!(off.iter().all(|s| s.volts == 0.0), "{volts}");
        assert!(off.iter().all(|s| s.status.contains(Status::WATCHDOG)));
        assert!(off.iter().any(|s| s.status.contains(Status::REFUSED)));
    }
}

#[test]
fn an_arm_beyond_its_limit_switches_the_motor_off() {
    let Some(board) = Board::start() else { return };
    let mut host = board.connect();
    let deadline = Instant::now() + PATIENCE;
    let first = loop {
        let sample = host.drive(4.0);
        if sample.status.contains(Status::LIMIT) {
            break sample;
        }
        assert!(Instant::now() < deadline, "it moves: {sample:?}");
    };
    // 3 rad of 4096 counts per turn.
    assert!((1956..2000).contains(&first.theta.0), "{first:?}");
    for _ in 0..200 {
        // Whatever way: it moves outwards no more, after the first quarter of a second at the latest.
        assert_eq!(host.drive(4.0).volts, 0.0);
    }
    for k in 0..200 {
        let sample = host.drive(-4.0);
        assert!(sample.status.contains(Status::LIMIT), "{sample:?}");
        assert!(k < 3 || sample.volts == 0.0, "{sample:?}");
    }
}

#[test]
fn bytes_that_mean_nothing_move_nothing() {
    let Some(board) = Board::start() else { return };
    let mut port = board.port();
    let mut state = 1u32;
    for _ in 0..100 {
        let noise: Vec<u8> = (0..200)
            .map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (state >> 24) as u8
            })
            .collect();
        // A line that is full takes no more.
        let _ = port.write(&noise);
        std::thread::sleep(Duration::from_millis(2));
    }
    let mut host = Host::on(port);
    assert_eq!(host.sample().volts, 0.0);
    assert_eq!(board.happened(), [""; 0]);
    host.drive_until(1.0, 1.0);
}

#[test]
fn a_reset_leaves_the_motor_off_and_the_board_says_hello_again() {
    let Some(mut board) = Board::start() else {
        return;
    };
    let mut host = board.connect();
    host.drive_until(1.0, 1.0);
    let before = (0..60).map(|_| host.drive(1.0)).last().expect("60").seq;
    board.tell("reset");
    board.wait_for("reset by the button");
    board.wait_for("motor off");
    // A host that has not noticed goes on with the numbers of before.
    let mut after = Vec::new();
    let mut seq = before;
    for _ in 0..400 {
        let sample = host.sample();
        seq += 1;
        host.0.command(seq, 1.0).expect("there");
        if sample.seq < before {
            after.push(sample);
        }
        if after.len() == 40 {
            break;
        }
    }
    assert_eq!((after.len(), after[0].seq), (40, 0));
    assert!(after.iter().all(|s| s.volts == 0.0));
    assert!(after.iter().all(|s| s.status.contains(Status::WATCHDOG)));
    assert!(after.iter().any(|s| s.status.contains(Status::REFUSED)));
    let happened = board.happened();
    assert!(!happened.contains(&"motor on".to_owned()), "{happened:?}");
    let hello = host.0.ask(PATIENCE).expect("the board answers");
    assert_eq!(hello.rig.as_str(), RIG);
    host.drive_until(1.0, 1.0);
}

#[test]
fn a_reset_ends_the_run() {
    let Some(mut board) = Board::start() else {
        return;
    };
    let host = board
        .run(&["--duration", "600"])
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("runs");
    board.wait_for("motor on");
    std::thread::sleep(Duration::from_secs(1));
    board.tell("reset");
    let output = host.wait_with_output().expect("it ends");
    let said = common::last_line(&output);
    assert!(said.contains("the rig restarted at t = "), "{said}");
    assert!(board.is_off());
}

/// The program runs in a circle, with its interrupts and without.
#[test]
fn a_hang_is_reset_by_the_chips_watchdog() {
    let Some(mut board) = Board::start() else {
        return;
    };
    for fault in ["hang", "hang deaf"] {
        let mut host = board.connect();
        host.drive_until(1.0, 1.0);
        board.tell(fault);
        let hung = board.wait_for("hangs");
        let reset = board.wait_for("reset by its watchdog");
        let off = board.wait_for("motor off");
        // 15 ms, counted from the last sample; the pins are seen every 50 us.
        assert!(reset - hung < 0.017 && off - reset < 0.001, "{fault}");
        assert_eq!(host.0.ask(PATIENCE).expect("it answers").rig.as_str(), RIG);
        let sample = host.sample();
        assert!(sample.volts == 0.0 && sample.status.contains(Status::WATCHDOG));
    }
}

/// The IDE compiles what is in the sketch's folder and nothing else.
#[test]
fn the_sketch_has_the_protocols_header() {
    let read = |path: &str| {
        let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../../");
        std::fs::read(format!("{root}{path}")).expect(path)
    };
    assert!(read("docs/furuta_wire.h") == read("firmware/arduino/furuta_rig/furuta_wire.h"));
}
