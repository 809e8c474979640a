//! Why a run ended before its time.

use std::time::Duration;

use furuta_ctrl::supervisor::Fault;

use crate::rig_time::{Against, OldSample, looks};
use crate::transport::TransportError;

/// Why a run ended before its time.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The way to the rig.
    #[error(transparent)]
    Transport(#[from] TransportError),
    /// The rig sends no samples (any more).
    #[error(
        "no sample from the rig for {waited:.1?} (after {samples} samples): see that it is switched on; reset it"
    )]
    Silent {
        /// How long was waited.
        waited: Duration,
        /// Samples before.
        samples: u64,
    },
    /// The rig began counting anew.
    #[error(
        "the rig restarted at t = {t:.3} s (sample number fell from {last} to {seq}): see its power supply"
    )]
    RigReset {
        /// Time (s).
        t: f64,
        /// Number of the last sample before.
        last: u32,
        /// Number of the first sample after.
        seq: u32,
    },
    /// Samples come, and none is news.
    #[error(
        "no new sample from the rig for {waited:.1?} (after {samples} samples): {why}; reset the rig, and \
         see its firmware's `seq` and `t_us`"
    )]
    OldSamples {
        /// How long was waited.
        waited: Duration,
        /// Samples before.
        samples: u64,
        /// Why the last one was no news.
        why: OldSample,
    },
    /// The rig's clock stepped.
    #[error(
        "the rig's clock stepped by {step:.3} s at t = {t:.3} s: its time stamps are no measure any more; reset the rig"
    )]
    RigClock {
        /// Time before (s).
        t: f64,
        /// By how much it stepped (s).
        step: f64,
    },
    /// The rig's clock runs at another rate than it must.
    #[error(
        "the rig's time stamps {} at t = {t:.3} s: motor off; have its firmware count microseconds in \
         `t_us`, and see what its timer's clock is divided by{}",
        looks(*.rate, *.against), emulated(*.against)
    )]
    RigTimeStamps {
        /// Time by the stamps (s).
        t: f64,
        /// Their rate: 1 for microseconds.
        rate: f64,
        /// Compared with what.
        against: Against,
    },
    /// The rig's samples come at another rate than it announced.
    #[error(
        "the rig's samples come every {actual_us:.0} us by its own clock and the host's, its hello says \
         period_us = {period_us:.0} (t = {t:.3} s): motor off; correct the period in its firmware"
    )]
    RigPeriod {
        /// Time (s).
        t: f64,
        /// What it announced (us).
        period_us: f64,
        /// What it keeps (us).
        actual_us: f64,
    },
    /// The run lasts longer than it can.
    #[error(
        "a run of {:.1} s has lasted {:.1} s of the host's clock, and the rig's clock shows {seconds:.3} \
         s: motor off; see the rig's clock",
        .duration.as_secs_f64(), .lasted.as_secs_f64()
    )]
    Overtime {
        /// What was asked for.
        duration: Duration,
        /// What it lasted.
        lasted: Duration,
        /// The rig's clock from first to last sample (s).
        seconds: f64,
    },
    /// A limit of the rig file is exceeded.
    #[error(
        "{quantity} is {value:.3} {unit} at t = {t:.3} s, its limit is {limit} {unit}: motor off; bring \
         the arm back to its middle"
    )]
    Limit {
        /// What.
        quantity: &'static str,
        /// Its value.
        value: f64,
        /// Its limit.
        limit: f64,
        /// Unit of both.
        unit: &'static str,
        /// Time (s).
        t: f64,
    },
    /// The rig itself found a limit exceeded.
    #[error(
        "the rig switched its motor off at t = {t:.3} s because a limit of its own is exceeded: bring the \
         arm back to its middle"
    )]
    RigLimit {
        /// Time (s).
        t: f64,
    },
    /// The supervisor found a limit of its own exceeded, or a measurement that is not a number.
    #[error("{fault} at t = {t:.3} s: motor off; bring the arm back to its middle")]
    Fault {
        /// What it found.
        fault: Fault,
        /// Time (s).
        t: f64,
    },
    /// Estimator or controller produced what is not a number.
    #[error(
        "{quantity} is not a finite number at t = {t:.3} s: motor off; see the controller's gains"
    )]
    NotFinite {
        /// What.
        quantity: &'static str,
        /// Time (s).
        t: f64,
    },
}

fn emulated(against: Against) -> &'static str {
    match against {
        Against::Host => "; where the rig is an emulated one on a busy machine, give --any-clock",
        Against::Period => "",
    }
}
