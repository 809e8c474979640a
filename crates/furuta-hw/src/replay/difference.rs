//! Where a replay and its log differ.

use std::fmt;

use furuta_log::{Mode, Record};

use super::Replayed;

/// A sample at which the pilot answers otherwise than is logged.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// Index of the record in the log, from 0.
    pub index: usize,
    /// The rig's number of the sample.
    pub seq: u32,
    /// Time (s).
    pub t: f64,
    /// Mode as logged, and as replayed.
    pub modes: [Mode; 2],
    /// What differs, the command first; empty where only the mode does.
    pub quantities: Vec<Quantity>,
}

/// A number that differs.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Quantity {
    /// Its column in the log.
    pub name: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// As logged.
    pub logged: f64,
    /// As replayed.
    pub replayed: f64,
    /// How many numbers lie between them, the second included; 0 where they differ in the sign of a zero.
    pub ulps: u64,
}

impl Difference {
    pub(super) fn between(index: usize, record: &Record, replayed: &Replayed) -> Option<Self> {
        let pairs = [
            ("command", "V", record.command, replayed.command),
            ("theta_dot", "rad/s", record.theta_dot, replayed.theta_dot),
            ("alpha_dot", "rad/s", record.alpha_dot, replayed.alpha_dot),
            ("reference", "rad", record.reference, replayed.reference),
        ];
        if record.mode == replayed.mode && pairs.iter().all(|&(_, _, a, b)| same(a, b)) {
            return None; // nothing is allocated for those that are equal
        }
        let quantities = pairs
            .into_iter()
            .filter(|&(_, _, logged, replayed)| !same(logged, replayed))
            .map(|(name, unit, logged, replayed)| Quantity {
                name,
                unit,
                logged,
                replayed,
                ulps: ulps(logged, replayed),
            });
        Some(Self {
            index,
            seq: record.seq,
            t: record.t,
            modes: [record.mode, replayed.mode],
            quantities: quantities.collect(),
        })
    }
}

/// Equal bits; of numbers that are none there is only one, since a log does not tell them apart.
pub(super) fn same(a: f64, b: f64) -> bool {
    a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan()
}

/// Units in the last place between two numbers: how many steps from one to the next lie between them.
///
/// ```
/// use furuta_hw::replay::ulps;
/// assert_eq!(ulps(1.0, 1.0 + 2.0 * f64::EPSILON), 2);
/// assert_eq!(ulps(-f64::from_bits(1), f64::from_bits(1)), 2); // across zero
/// assert_eq!(ulps(0.0, -0.0), 0);
/// assert_eq!(ulps(f64::NAN, 1.0), u64::MAX); // nothing is near what is no number
/// ```
#[must_use]
pub fn ulps(a: f64, b: f64) -> u64 {
    if a.is_nan() || b.is_nan() {
        return if a.is_nan() && b.is_nan() {
            0
        } else {
            u64::MAX
        };
    }
    // The bits of a float, taken as a whole number, rise with it; below zero they fall.
    let ordered = |x: f64| {
        let bits = x.to_bits().cast_signed();
        if bits < 0 { i64::MIN - bits } else { bits }
    };
    ordered(a).abs_diff(ordered(b))
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { index, seq, t, .. } = self;
        let [logged, replayed] = self.modes;
        write!(f, "sample {index} (seq {seq}, t = {t:.6} s, {logged})")?;
        if logged != replayed {
            write!(f, ", mode {logged} logged, {replayed} replayed")?;
        }
        for q in &self.quantities {
            let plural = if q.ulps == 1 { "" } else { "s" };
            write!(
                f,
                ", {} {} {} logged, {} replayed, {} ULP{plural} apart",
                q.name, q.logged, q.unit, q.replayed, q.ulps
            )?;
        }
        Ok(())
    }
}
