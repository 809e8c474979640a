//! What a run measures, answers and counts.

use std::f64::consts::PI;
use std::time::{Duration, Instant};

use furuta_hw::{
    Decision, Emulation, End, FaultRates, FaultyTransport, Link, Measurement, Pace, Pilot,
    SerialTransport,
};
use furuta_log::Mode;
use furuta_model::State;
use furuta_wire::{Message, Sample, Status};

use super::common::{Constant, connect, logged, qube, settings, start, unlogged};

#[test]
fn every_sample_is_answered_one_period_later() {
    let rig = start(&Emulation::default(), Pace::HostLed);
    let (mut link, hello) = connect(&rig);
    let (summary, recorded, log) = logged(&mut link, &hello, &Sawtooth, &settings(2.0), "answered");
    assert!(matches!(summary.end, End::Finished), "{:?}", summary.end);
    assert_eq!(
        (
            summary.samples,
            summary.lost,
            summary.held,
            summary.bad_frames
        ),
        (1001, 0, 0, 0)
    );
    assert_eq!(recorded.records, 1001);
    assert_eq!((log.records.len(), log.notice), (1001, None));
    for pair in log.records.windows(2) {
        assert_eq!(pair[1].seq, pair[0].seq + 1);
        // f32 on the wire.
        assert_eq!(pair[1].u, f64::from(pair[0].command as f32));
    }
}

/// Answers with a voltage that tells the samples apart.
struct Sawtooth;

impl Pilot for Sawtooth {
    type State = u32;

    fn start(&self) -> u32 {
        0
    }

    fn process(&self, k: &mut u32, _: &Measurement) -> Decision {
        *k += 1;
        let volts = 1e-3 * f64::from(*k % 100);
        Decision {
            volts,
            theta_dot: 0.0,
            alpha_dot: 0.0,
            reference: 0.0,
            mode: Mode::Excite,
            fault: None,
        }
    }
}

#[test]
fn a_free_run_in_real_time_keeps_the_rigs_period() {
    let rig = start(&Emulation::default(), Pace::RealTime);
    let (mut link, hello) = connect(&rig);
    let begin = Instant::now();
    let summary = unlogged(&mut link, &hello, &Constant(0.0), &settings(1.0));
    assert!(matches!(summary.end, End::Finished), "{:?}", summary.end);
    // Never faster than the clock; how much slower depends on what else the machine does.
    assert!(
        begin.elapsed() > Duration::from_millis(950),
        "{:?}",
        begin.elapsed()
    );
    assert_eq!(summary.samples + summary.lost, 501);
}

#[test]
fn a_silent_host_trips_the_rigs_watchdog() {
    let rig = start(&Emulation::default(), Pace::RealTime);
    let (mut link, _) = connect(&rig);
    let deadline = Instant::now() + Duration::from_secs(10);
    let mut driven = 0;
    loop {
        match link.receive(deadline).expect("still there") {
            Some(Message::Sample(sample)) if sample.volts == 2.0 => {
                // From the last command that was obeyed on.
                let is_obeyed = !sample.status.contains(Status::HELD);
                driven = if is_obeyed { 1 } else { driven + 1 };
            }
            // Until one comes in time.
            Some(Message::Sample(sample)) if driven == 0 => {
                link.command(sample.seq, 2.0).expect("there");
            }
            Some(Message::Sample(sample)) if driven > 0 => {
                assert!(sample.volts == 0.0 && sample.status.contains(Status::WATCHDOG));
                break;
            }
            Some(_) => {}
            None => panic!("the watchdog did nothing"),
        }
    }
    // The command's own period and those before the watchdog trips: never longer, however slow this machine is.
    assert_eq!(driven, 10);
}

/// A host slower than the rig's clock: a patient rig waits for it and misses nothing; once it is silent, the watchdog
/// trips as ever.
#[test]
fn a_patient_rig_waits_for_a_slow_host() {
    let rig = start(&Emulation::default(), Pace::Patient);
    let (mut link, _) = connect(&rig);
    // What came before anybody answered is read first.
    let mut statuses = Vec::new();
    let mut sample = next_sample(&mut link);
    for _ in 0..400 {
        let slow = statuses.len() > 100; // prompt at first, so as to catch up
        std::thread::sleep(Duration::from_millis(if slow { 7 } else { 0 }));
        link.command(sample.seq, 1.0).expect("there");
        sample = next_sample(&mut link);
        statuses.push((sample.volts, sample.status));
    }
    assert!(
        statuses[110..].iter().all(|s| *s == (1.0, Status::OK)),
        "{statuses:?}"
    );
    let begin = Instant::now();
    while !sample.status.contains(Status::WATCHDOG) {
        assert!(begin.elapsed() < Duration::from_secs(5), "no watchdog");
        sample = next_sample(&mut link);
    }
}

fn next_sample(link: &mut Link<SerialTransport>) -> Sample {
    match link.receive(Instant::now() + Duration::from_secs(5)) {
        Ok(Some(Message::Sample(sample))) => sample,
        other => panic!("{other:?}"),
    }
}

/// What comes through encoders, wire and loop is the model's own trajectory.
#[test]
fn measured_angles_are_the_models() {
    let start_state = State::new(0.0, PI - 0.5, 0.0, 0.0);
    let rig = start(
        &Emulation {
            start: start_state,
            ..Emulation::default()
        },
        Pace::HostLed,
    );
    let (mut link, hello) = connect(&rig);
    let (_, recorded, log) = logged(&mut link, &hello, &Constant(0.7), &settings(1.0), "model");
    assert!(recorded.error.is_none());

    let plant = qube().plant::<f64>();
    let mut x = plant.rest(start_state);
    let mut period = |u: f64| {
        for _ in 0..20 {
            plant.step(&mut x, u, 1e-4); // ten times finer than the emulation's own steps
        }
        x.x
    };
    // The rig has ticked a few times before the run's first sample: it swung freely from its start.
    let mut model = (0..log.records[0].seq).fold(start_state, |_, _| period(0.0));
    let count = std::f64::consts::TAU / 2048.0;
    for record in &log.records {
        let (e, f) = (record.theta - model.theta, record.alpha - model.alpha);
        // Half a count of rounding, and a tenth for the integrators' difference.
        assert!(
            e.abs() < 0.6 * count && f.abs() < 0.6 * count,
            "t = {}: {e} {f}",
            record.t
        );
        model = period(record.u);
    }
    assert_eq!((log.records.len(), log.notice), (501, None));
}

/// A wire that damages about one frame in ten: what is lost is counted, nothing wrong is believed, the run goes on.
#[test]
fn a_faulty_wire_is_survived_and_counted() {
    // Frames have some 20 bytes each way.
    let rates = FaultRates {
        lost: 0.002,
        flipped: 0.002,
        doubled: 0.001,
        ..FaultRates::default()
    };
    let rig = start(&Emulation::default(), Pace::RealTime);
    let port = SerialTransport::open(rig.path(), SerialTransport::BAUD).expect("the port is there");
    let mut wire = FaultyTransport::new(port, rates, 1);
    let (mut link, hello) =
        Link::connect(&mut wire, Duration::from_secs(10)).expect("asked until it answers");
    let summary = unlogged(&mut link, &hello, &Constant(0.5), &settings(3.0));
    assert!(matches!(summary.end, End::Finished), "{:?}", summary.end);
    // Lost samples, and at the end perhaps some beyond the duration.
    assert!(summary.samples + summary.lost >= 1501, "{summary:?}");
    assert!((50..500).contains(&summary.lost), "{summary:?}");
    assert!(
        summary.bad_frames >= summary.lost / 2 && summary.held > 50,
        "{summary:?}"
    );
    assert!(wire.damaged() > 100);
}
