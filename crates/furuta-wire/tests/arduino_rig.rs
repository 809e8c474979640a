//! The sketch for an Arduino decides as [`RigEnd`] does: `firmware/arduino/furuta_rig/rig_end.h`, compiled here, under
//! the same commands and the same motion.

use crate::common;

use std::fmt::Write as _;

use common::{Xorshift, frame};
use furuta_wire::{
    ArmCounts, Command, Hello, Message, PROTOCOL_VERSION, PendulumCounts, Query, RigEnd, RigLimits,
    RigName, Status,
};

/// As `config.h` is committed.
fn rig() -> RigEnd {
    RigEnd::new(Hello {
        version: PROTOCOL_VERSION,
        rig: RigName::from("shahzad2022-srv02").unwrap_or_default(),
        period_us: 2000,
        arm_counts_per_rev: 4096.0,
        pendulum_counts_per_rev: 4096.0,
        command_limit: 10.0,
        limits: RigLimits {
            arm_angle: Some(3.0),
            arm_speed: None,
            pendulum_speed: Some(40.0),
        },
        watchdog_periods: 10,
        actuation: 0,
    })
}

/// What the sketch answers; `None` where there is no C++ compiler.
fn ask(input: &str) -> Option<String> {
    let here = env!("CARGO_MANIFEST_DIR");
    let sketch = format!("-I{here}/../../firmware/arduino/furuta_rig");
    let options = ["-std=c++11", "-Wno-unused-function", &sketch];
    let source = format!("{here}/tests/arduino_rig/main.cpp");
    common::compiled::answer("c++", &options, &source, input)
}

#[test]
fn the_sketch_decides_as_the_rigs_end_does() {
    let mut random = Xorshift::new(7);
    let mut below = |n: u64| random.next() % n;
    let mut rig = rig();
    let (mut input, mut expected) = (String::new(), String::new());
    let (mut theta, mut alpha) = (0i32, 0i32);
    let (mut speed, mut spin) = (0i32, 0i32);
    let mut seen = [0usize; 5];
    let mut braked = 0;
    for tick in 0..100_000 {
        // A host that is there for a while, and away for a while; its commands are news, old, or of no sample at all.
        let is_there = tick / 300 % 4 != 3;
        for _ in 0..if is_there {
            1 + below(20) / 18
        } else {
            below(20) / 19
        } {
            let back = match below(20) {
                0 => below(30) as u32,
                1 => 0u32.wrapping_sub(1),
                _ => 1,
            };
            let seq = rig.seq().wrapping_sub(back);
            let volts = match below(40) {
                0 => f32::NAN,
                1 => f32::INFINITY,
                2 => 0.0,
                3 => -0.0,
                // Mostly against the speed, so that braking occurs.
                4..20 => -(speed.signum() as f32) * below(15) as f32,
                _ => below(3000) as f32 * 0.01 - 15.0,
            };
            let _ = writeln!(input, "c {seq} {}", volts.to_bits());
            for byte in frame(&Message::Command(Command { seq, volts })) {
                rig.receive(byte);
            }
        }
        if below(500) == 0 {
            let version = if below(3) == 0 { 2 } else { PROTOCOL_VERSION };
            let _ = writeln!(input, "q {version}");
            for byte in frame(&Message::Query(Query { version })) {
                rig.receive(byte);
            }
        }
        // An arm that wanders over its limit and back, a pendulum that is too fast now and then.
        if below(100) == 0 {
            speed = below(61) as i32 - 30 - theta / 150;
            spin = below(141) as i32 - 70;
        }
        theta += speed;
        alpha += spin;
        let _ = writeln!(input, "t {theta} {alpha}");
        let sample = rig.tick(0, ArmCounts(theta), PendulumCounts(alpha));
        let (seq, bits, status) = (sample.seq, sample.volts.to_bits(), sample.status.bits());
        let _ = writeln!(expected, "{seq} {bits} {status}");
        let flags = [
            Status::HELD,
            Status::WATCHDOG,
            Status::CLIPPED,
            Status::LIMIT,
            Status::REFUSED,
        ];
        for (count, flag) in seen.iter_mut().zip(flags) {
            *count += usize::from(sample.status.contains(flag));
        }
        braked += usize::from(sample.status.contains(Status::LIMIT) && sample.volts != 0.0);
    }
    // Everything that it can decide occurs.
    assert!(seen.iter().all(|&n| (500..90_000).contains(&n)), "{seen:?}");
    assert!(braked > 500, "{braked}");
    let Some(answer) = ask(&input) else { return };
    for (tick, (sketch, rust)) in answer.lines().zip(expected.lines()).enumerate() {
        assert_eq!(sketch, rust, "tick {tick}");
    }
    assert_eq!(answer.lines().count(), expected.lines().count());
}
