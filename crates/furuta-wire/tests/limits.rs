//! Beyond a limit the rig's end of the wire lets nothing through but what brakes the arm on its way out, and not for
//! long.

use furuta_wire::{
    ArmCounts, Hello, PROTOCOL_VERSION, PendulumCounts, RigEnd, RigLimits, RigName, Status,
};
use proptest::prelude::*;

const COUNTS: f64 = 1000.0;
/// 0.5 rad in counts, rounded down.
const LIMIT: i32 = 79;
/// A quarter of a second.
const LONGEST: usize = 125;

fn rig() -> RigEnd {
    RigEnd::new(Hello {
        version: PROTOCOL_VERSION,
        rig: RigName::from("limits").unwrap_or_default(),
        period_us: 2000,
        arm_counts_per_rev: COUNTS,
        pendulum_counts_per_rev: COUNTS,
        command_limit: 10.0,
        limits: RigLimits {
            arm_angle: Some(0.5),
            ..RigLimits::default()
        },
        watchdog_periods: 10,
        actuation: 0,
    })
}

/// The voltages held while the arm goes through these counts under these commands.
fn held(path: impl IntoIterator<Item = (i32, f32)>) -> Vec<(f32, Status)> {
    let mut rig = rig();
    let ticks = path.into_iter().enumerate().map(|(k, (counts, volts))| {
        rig.command(volts);
        let sample = rig.tick(2000 * k as u64, ArmCounts(counts), PendulumCounts(0));
        (sample.volts, sample.status)
    });
    ticks.collect()
}

#[test]
fn outwards_and_braking_is_obeyed_for_a_quarter_of_a_second() {
    for side in [1, -1] {
        let sign = side as f32;
        // A count a tick, out and out; 3 V against it from the limit on.
        let out =
            held((0..400).map(|k| (side * k, if k > LIMIT { -3.0 * sign } else { 3.0 * sign })));
        for (k, (volts, status)) in out.into_iter().enumerate() {
            let beyond = k as i32 > LIMIT;
            assert_eq!(status.contains(Status::LIMIT), beyond, "tick {k}");
            let braking = beyond && k - LIMIT as usize <= LONGEST;
            let expected = match (beyond, braking) {
                (false, _) => 3.0 * sign,
                (true, true) => -3.0 * sign,
                (true, false) => 0.0,
            };
            assert_eq!(volts, expected, "tick {k}");
        }
    }
}

#[test]
fn inwards_or_driving_or_at_rest_the_motor_is_off() {
    // On its way back from 300 counts: neither pushed nor held.
    for volts in [3.0, -3.0] {
        let back = held((0..200).map(|k| (300 - k, volts)));
        assert!(
            back[1..]
                .iter()
                .all(|(v, s)| *v == 0.0 && s.contains(Status::LIMIT))
        );
        let still = held((0..200).map(|_| (300, volts)));
        assert!(still.iter().all(|(v, _)| *v == 0.0));
    }
    let driving = held((100..400).map(|k| (k, 3.0)));
    assert!(driving.iter().all(|(v, _)| *v == 0.0));
}

proptest! {
    /// Whatever is commanded and whatever the arm does: 0 V from the 126th tick in a row beyond the limit on.
    #[test]
    fn no_path_and_no_command_keeps_the_motor_on(
        path in prop::collection::vec((80i32..100_000, prop::num::f32::ANY), 126..200),
    ) {
        for (volts, status) in &held(path)[LONGEST..] {
            prop_assert!(*volts == 0.0 && status.contains(Status::LIMIT));
        }
    }
}

fn say(rig: &mut RigEnd, seq: u32, volts: f32) {
    let mut buffer = [0; furuta_wire::MAX_FRAME];
    let command = furuta_wire::Command { seq, volts };
    let frame = furuta_wire::encode(&furuta_wire::Message::Command(command), &mut buffer);
    frame
        .expect("fits")
        .iter()
        .for_each(|&byte| rig.receive(byte));
}

fn tick(rig: &mut RigEnd) -> furuta_wire::Sample {
    rig.tick(0, ArmCounts(0), PendulumCounts(0))
}

/// A line that repeats a frame, or brings an old one, is no host.
#[test]
fn a_repeated_or_old_command_does_not_feed_the_watchdog() {
    for old in [0, 1, 30] {
        let mut rig = rig();
        for _ in 0..50 {
            let seq = tick(&mut rig).seq;
            say(&mut rig, seq, 2.0);
        }
        let last = rig.seq() - 1;
        let held = tick(&mut rig);
        assert_eq!((held.volts, held.status), (2.0, Status::OK));
        let driven = (0..30).take_while(|_| {
            say(&mut rig, last - old, 2.0);
            let sample = tick(&mut rig);
            assert!(sample.status.contains(Status::REFUSED | Status::HELD));
            sample.volts != 0.0
        });
        assert_eq!(driven.count(), 9, "{old} samples old");
        // And one of news drives again.
        let newest = rig.seq() - 1;
        say(&mut rig, newest, 1.0);
        assert_eq!(tick(&mut rig).volts, 1.0);
    }
}

/// After a reset the host may go on for a while with answers to samples of before.
#[test]
fn a_command_of_before_a_reset_drives_nothing() {
    let mut rig = rig();
    say(&mut rig, 0, 2.0);
    assert_eq!(tick(&mut rig).volts, 0.0, "no sample was sent yet");
    for k in 0..40 {
        say(&mut rig, 1500 + k, 2.0);
        let sample = tick(&mut rig);
        assert!(sample.volts == 0.0 && sample.status.contains(Status::WATCHDOG | Status::REFUSED));
    }
}

/// 0 V is taken whatever sample it answers: a host says it after it has answered the last one.
#[test]
fn off_is_always_obeyed_and_feeds_nothing() {
    let mut rig = rig();
    let seq = tick(&mut rig).seq;
    say(&mut rig, seq, 2.0);
    say(&mut rig, seq, 0.0);
    assert_eq!((tick(&mut rig).volts, tick(&mut rig).volts), (0.0, 0.0));
    for _ in 0..20 {
        say(&mut rig, seq, 0.0);
        tick(&mut rig);
    }
    assert!(tick(&mut rig).status.contains(Status::WATCHDOG));
}
