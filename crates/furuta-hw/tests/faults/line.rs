//! Bytes and frames that the line loses, damages or delays.

use furuta_hw::{EmulatedTransport, End, FaultRates, FaultyTransport, Summary};
use furuta_log::{Log, Mode};

use super::common::{emulated, logged, pilot, settings, srv02};
use super::link;

/// Share of the samples after the first three seconds in which the pendulum was balanced, and the largest angle then
/// (rad).
fn balanced(log: &Log) -> (f64, f64) {
    let late = log.records.iter().filter(|r| r.t > 3.0);
    let (all, up) = late.fold((0, 0), |(all, up), r| {
        (all + 1, up + i32::from(r.mode == Mode::Balance))
    });
    let lean = log
        .records
        .iter()
        .filter(|r| r.t > 3.0 && r.mode == Mode::Balance);
    let lean = lean.fold(0.0_f64, |max, r| max.max(furuta_ctrl::wrap(r.alpha).abs()));
    (f64::from(up) / f64::from(all), lean)
}

/// Ten seconds over a faulty line, logged.
fn over_a_line(name: &str, rates: FaultRates, seed: u64) -> (Summary, Log, u64) {
    let mut line = FaultyTransport::new(EmulatedTransport::new(emulated()), rates, seed);
    let (summary, recorded, log) = {
        let (mut link, hello) = link(&mut line);
        logged(&mut link, &hello, &pilot(), &settings(10.0), name)
    };
    assert!(recorded.error.is_none());
    assert!(matches!(summary.end, End::Finished), "{summary:?}");
    assert_eq!(log.notice, None);
    assert_eq!(log.records.len() as u64, summary.samples);
    // Each gap in the numbers is one that was counted: nothing is lost without being told.
    let told: u64 = log.records.iter().map(|r| u64::from(r.lost)).sum();
    assert_eq!(told, summary.lost);
    for pair in log.records.windows(2) {
        assert_eq!(pair[1].seq - pair[0].seq, pair[1].lost + 1);
        // What the motor gets is the newest command that came through, the one before while none does, or nothing.
        // Never anything else.
        assert!(pair[1].u.abs() <= srv02().params.motor.command_limit);
    }
    let commands: std::collections::HashSet<u32> = log
        .records
        .iter()
        .map(|r| (r.command as f32).to_bits())
        .collect();
    for record in log.records.iter().skip(2) {
        let held = (record.u as f32).to_bits();
        assert!(
            record.u == 0.0 || commands.contains(&held),
            "t = {}",
            record.t
        );
    }
    (summary, log, line.frames_lost())
}

#[test]
fn bytes_lost_flipped_doubled_and_delayed_are_survived() {
    let rates = FaultRates {
        lost: 0.001,
        flipped: 0.001,
        doubled: 0.001,
        delayed: 0.01,
        ..FaultRates::default()
    };
    let (summary, log, _) = over_a_line("bytes", rates, 11);
    assert!(
        summary.bad_frames > 100 && summary.lost > 100 && summary.held > 50,
        "{summary:?}"
    );
    let (share, lean) = balanced(&log);
    assert!(share == 1.0 && lean < 0.2, "{share} {lean}");
}

#[test]
fn one_frame_in_a_hundred_lost_while_balancing() {
    let rates = FaultRates {
        frame_lost: 0.01,
        ..FaultRates::default()
    };
    let (summary, log, lost) = over_a_line("one-percent", rates, 12);
    // 5,000 samples and as many commands: 50 +- 7 of each; five deviations.
    assert!(
        (15..90).contains(&summary.lost) && (50..150).contains(&lost),
        "{summary:?}"
    );
    assert_eq!((summary.bad_frames, summary.watchdog), (0, 0));
    let (share, lean) = balanced(&log);
    assert!(share == 1.0 && lean < 0.05, "{share} {lean}");
}

#[test]
fn one_frame_in_ten_lost_while_balancing() {
    let rates = FaultRates {
        frame_lost: 0.1,
        ..FaultRates::default()
    };
    let (summary, log, lost) = over_a_line("ten-percent", rates, 13);
    assert!(
        (400..600).contains(&summary.lost) && lost > 800,
        "{summary:?}"
    );
    assert_eq!(summary.bad_frames, 0);
    let (share, lean) = balanced(&log);
    assert!(share == 1.0 && lean < 0.1, "{share} {lean}");
}
