//! What a log of this rig can say at all. A measurement is a whole number of counts, a time a whole number of
//! microseconds, a voltage one that was commanded: a number changed afterwards seldom is, even where the estimator
//! would not notice it.

use std::collections::HashSet;
use std::f64::consts::PI;
use std::fmt;

use furuta_log::Record;
use furuta_wire::{ArmCounts, Hello, PendulumCounts};

use super::difference::same;
use crate::emulate::to_counts;

/// A record holds what no run of this rig can have given.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Impossible {
    /// Index of the record in the log, from 0.
    pub index: usize,
    /// The rig's number of the sample.
    pub seq: u32,
    /// Column of the log.
    pub name: &'static str,
    /// What it holds.
    pub value: f64,
    /// Why that cannot be.
    pub why: &'static str,
}

impl fmt::Display for Impossible {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            index,
            seq,
            name,
            value,
            why,
        } = self;
        write!(
            f,
            "sample {index} (seq {seq}) was changed after the run: its {name} = {value} {why}"
        )
    }
}

pub(super) struct Evidence<'a> {
    hello: &'a Hello,
    /// Voltages that the rig may hold, by the bits of their f32.
    commanded: HashSet<u32>,
}

impl<'a> Evidence<'a> {
    pub(super) fn new(hello: &'a Hello) -> Self {
        // Whatever was commanded, the rig's own watchdog and limits give nothing.
        let commanded = [0.0_f32, -0.0].map(f32::to_bits).into();
        Self { hello, commanded }
    }

    /// Looks at one record after the other, each once.
    pub(super) fn impossible(&mut self, index: usize, records: &[Record]) -> Option<Impossible> {
        let record = records.get(index)?;
        let before = index.checked_sub(1).and_then(|k| records.get(k));
        let found = self
            .angle(record)
            .or_else(|| self.time(index, records))
            .or_else(|| before.and_then(|before| number(record, before)))
            .or_else(|| self.voltage(record, before.is_none()));
        #[allow(clippy::cast_possible_truncation)] // as it went over the wire
        let sent = record.command as f32;
        let limit = self.hello.command_limit;
        self.commanded.insert(sent.min(limit).max(-limit).to_bits());
        found.map(|(name, value, why)| Impossible {
            index,
            seq: record.seq,
            name,
            value,
            why,
        })
    }

    fn angle(&self, record: &Record) -> Option<Found> {
        let [arm, pendulum] = [
            self.hello.arm_counts_per_rev,
            self.hello.pendulum_counts_per_rev,
        ];
        let why = "is no whole number of the encoder's counts";
        let theta = ArmCounts(to_counts(record.theta, arm)).theta(arm);
        if !same(theta, record.theta) {
            return Some(("theta", record.theta, why));
        }
        let alpha = PendulumCounts(to_counts(record.alpha - PI, pendulum)).alpha(pendulum);
        (!same(alpha, record.alpha)).then_some(("alpha", record.alpha, why))
    }

    /// What the rig held at the first record was commanded before, if it was.
    fn voltage(&mut self, record: &Record, first: bool) -> Option<Found> {
        #[allow(clippy::cast_possible_truncation)] // that it fits is what is asked
        let held = record.u as f32;
        if !same(f64::from(held), record.u) {
            return Some(("u", record.u, "is no voltage that fits on the wire"));
        }
        if first {
            self.commanded.insert(held.to_bits());
        }
        (!self.commanded.contains(&held.to_bits())).then_some((
            "u",
            record.u,
            "was never commanded before",
        ))
    }
}

type Found = (&'static str, f64, &'static str);

impl Evidence<'_> {
    /// The rig counts microseconds from the first sample, and its ticks come by the period: late by a part of it where
    /// the board is busy, but never a whole period beside both neighbours.
    fn time(&self, index: usize, records: &[Record]) -> Option<Found> {
        let here = records.get(index)?;
        let found = |why| Some(("t", here.t, why));
        // As the loop computes it.
        if !here.t.is_finite() || !same((here.t * 1e6).round() * 1e-6, here.t) {
            return found("is no whole number of microseconds");
        }
        let Some(before) = index.checked_sub(1).and_then(|k| records.get(k)) else {
            // Later is a hole, which is told otherwise.
            let sound = here.t > 0.0 || same(here.t, 0.0);
            return if sound {
                None
            } else {
                found("is before the run")
            };
        };
        let period = f64::from(self.hello.period_us) * 1e-6;
        // By how much the second comes later than its number says (s).
        let late = |a: &Record, b: &Record| {
            b.t - a.t - period * f64::from(b.seq.wrapping_sub(a.seq).cast_signed())
        };
        let Some(after) = records.get(index + 1) else {
            return if here.t > before.t {
                None
            } else {
                found("is not after the one before it")
            };
        };
        let (arrives, leaves) = (late(before, here), late(here, after));
        let beside = arrives.abs() >= period && leaves.abs() >= period;
        if beside && arrives.signum() != leaves.signum() {
            return found("does not fit those before and after it");
        }
        None
    }
}

/// Numbers rise by one, and by one more for every sample lost.
fn number(record: &Record, before: &Record) -> Option<Found> {
    let periods = record.seq.wrapping_sub(before.seq);
    // More is a hole, which is told otherwise.
    let sound = (1..=u32::MAX / 2).contains(&periods) && periods > record.lost;
    (!sound).then_some((
        "seq",
        f64::from(record.seq),
        "does not follow the one before it",
    ))
}
