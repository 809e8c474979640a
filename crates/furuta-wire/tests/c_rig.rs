//! A rig written in C from docs/protocol.md (docs/furuta_wire.h) against this crate, in both directions.

use crate::common;

use std::fmt::Write as _;

use common::{Xorshift, any_message, frame};
use furuta_wire::{
    ArmCounts, Command, Decoder, FrameError, Message, PendulumCounts, Query, RigEnd, Status,
};

/// What the C program answers; `None` where there is no C compiler.
fn ask(input: &str) -> Option<String> {
    let here = env!("CARGO_MANIFEST_DIR");
    let header = format!("-I{here}/../../docs");
    let source = format!("{here}/tests/c_rig/main.c");
    common::compiled::answer("cc", &["-std=c99", &header], &source, input)
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}

#[test]
fn a_c_rig_sends_and_understands_the_same_bytes() {
    let mut random = Xorshift::new(5);
    let (mut input, mut expected) = (String::new(), String::new());
    let mut decoder = Decoder::new();
    for k in 0..4000 {
        let message = any_message(&mut random);
        // What the C rig sends.
        match message {
            Message::Sample(s) => {
                let (volts, status) = (s.volts.to_bits(), s.status.bits());
                let _ = writeln!(
                    input,
                    "s {} {} {} {} {volts} {status}",
                    s.seq, s.t_us, s.theta.0, s.alpha.0
                );
                let _ = writeln!(expected, "{}", hex(&frame(&message)));
            }
            Message::Hello(mut h) => {
                // The C rig has whole numbers of counts, and takes a limit of 0 for none.
                (h.arm_counts_per_rev, h.pendulum_counts_per_rev) = (
                    f64::from(random.next() as i32),
                    f64::from(random.next() as i32 >> 16),
                );
                let limits = [
                    &mut h.limits.arm_angle,
                    &mut h.limits.arm_speed,
                    &mut h.limits.pendulum_speed,
                ];
                let bits = limits.map(|limit| {
                    *limit = limit.map(|_| 1.0 + random.uniform() as f32);
                    limit.unwrap_or(0.0).to_bits()
                });
                let _ = writeln!(
                    input,
                    "h {} {} {} {} {} {} {} {} {} {}",
                    h.rig,
                    h.period_us,
                    h.arm_counts_per_rev,
                    h.pendulum_counts_per_rev,
                    h.command_limit.to_bits(),
                    bits[0],
                    bits[1],
                    bits[2],
                    h.watchdog_periods,
                    h.actuation
                );
                let _ = writeln!(expected, "{}", hex(&frame(&Message::Hello(h))));
            }
            Message::Query(_) | Message::Command(_) => {}
        }
        // What it receives: whole frames, and damaged ones.
        let mut bytes = frame(&message);
        if k % 2 == 1 {
            random.mutate(&mut bytes);
        }
        for byte in bytes {
            let _ = writeln!(input, "r {byte:x}");
            let _ = match decoder.push(byte) {
                None => Ok(()),
                Some(Ok(Message::Command(c))) => {
                    writeln!(expected, "command {} {}", c.seq, c.volts.to_bits())
                }
                Some(
                    Ok(Message::Query(Query { version: found }))
                    | Err(FrameError::Version { found }),
                ) => writeln!(expected, "query {found}"),
                // A rig has no use for messages of rigs.
                Some(_) => writeln!(expected, "bad"),
            };
        }
    }
    let Some(answer) = ask(&input) else { return };
    for (line, (c, rust)) in answer.lines().zip(expected.lines()).enumerate() {
        assert_eq!(c, rust, "line {line}");
    }
    assert_eq!(answer.lines().count(), expected.lines().count());
}

/// Which commands are news, and which are repeated, old or of another life of the rig.
#[test]
fn a_c_rig_takes_the_same_commands_for_news() {
    let mut random = Xorshift::new(6);
    let hello = loop {
        if let Message::Hello(hello) = any_message(&mut random) {
            break hello;
        }
    };
    let mut end = RigEnd::new(furuta_wire::Hello {
        watchdog_periods: 7,
        actuation: 0,
        ..hello
    });
    let (mut input, mut expected) = (String::new(), String::new());
    for _ in 0..3000 {
        let back = random.next() as u32 % 12;
        let seq = match random.next() % 20 {
            0 => random.next() as u32,
            1 => end.seq().wrapping_add(back),
            _ => end.seq().wrapping_sub(back),
        };
        let _ = writeln!(input, "a {seq} {} 7", end.seq());
        for byte in frame(&Message::Command(Command { seq, volts: 1.0 })) {
            end.receive(byte);
        }
        let sample = end.tick(0, ArmCounts(0), PendulumCounts(0));
        let is_news = !sample.status.contains(Status::HELD);
        assert_eq!(is_news, !sample.status.contains(Status::REFUSED));
        let _ = writeln!(expected, "{}", i32::from(is_news));
    }
    let news = expected.lines().filter(|line| *line == "1").count();
    assert!((500..2500).contains(&news), "{news}");
    let Some(answer) = ask(&input) else { return };
    assert_eq!(answer, expected);
}
