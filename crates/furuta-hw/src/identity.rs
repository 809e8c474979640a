//! Whether the rig on the port is the one that the rig file describes. A controller designed for another rig may do
//! harm.

use std::fmt::Write as _;

use furuta_model::{Actuation, Rig};
use furuta_wire::Hello;

/// A name as it can be shown: control characters and what cannot be seen are escaped, or a rig could move the cursor of
/// a terminal.
///
/// ```
/// use furuta_hw::identity::printable;
/// assert_eq!(printable("Drehpendel ä"), "Drehpendel ä");
/// assert_eq!(printable("rig\x1b[2J\n"), "rig\\u{1b}[2J\\n");
/// ```
#[must_use]
pub fn printable(name: &str) -> String {
    let mut shown = String::new();
    for c in name.chars() {
        match c {
            '\'' | '"' | '\\' => shown.push(c),
            c => shown.extend(c.escape_debug()),
        }
    }
    shown
}

/// Something the rig says of itself is no longer what it said.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{quantity} was {was} and is now {is}")]
pub struct Change {
    /// Field of the hello.
    pub quantity: &'static str,
    /// What it was.
    pub was: String,
    /// What it is.
    pub is: String,
}

/// All that a rig says otherwise than before.
#[must_use]
pub fn changes(was: &Hello, is: &Hello) -> Vec<Change> {
    let fields = |hello: &Hello| {
        let limit = |limit: Option<f32>| limit.map_or("none".to_owned(), |limit| limit.to_string());
        [
            ("name", printable(&hello.rig)),
            ("period_us", hello.period_us.to_string()),
            ("arm_counts_per_rev", hello.arm_counts_per_rev.to_string()),
            (
                "pendulum_counts_per_rev",
                hello.pendulum_counts_per_rev.to_string(),
            ),
            ("command_limit", hello.command_limit.to_string()),
            ("limit arm_angle", limit(hello.limits.arm_angle)),
            ("limit arm_speed", limit(hello.limits.arm_speed)),
            ("limit pendulum_speed", limit(hello.limits.pendulum_speed)),
            ("watchdog_periods", hello.watchdog_periods.to_string()),
            ("actuation", hello.actuation.to_string()),
        ]
    };
    let both = fields(was).into_iter().zip(fields(is));
    both.filter(|((_, was), (_, is))| was != is)
        .map(|((quantity, was), (_, is))| Change { quantity, was, is })
        .collect()
}

/// Something the rig says of itself is not what its rig file says.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("the rig says {quantity} = {rig}, its rig file {file}")]
pub struct Mismatch {
    /// What differs: `name`, or a key of the rig file.
    pub quantity: &'static str,
    /// What the rig says.
    pub rig: String,
    /// What the file says.
    pub file: String,
}

/// The rig on the port is not the one of the rig file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "the rig on this port is not the one of the rig file: {}; give the file of this rig, or --any-rig to \
     run it all the same",
    listed(.mismatches)
)]
pub struct WrongRig {
    /// Everything that differs; never empty.
    pub mismatches: Vec<Mismatch>,
}

pub(crate) fn listed(items: &[impl std::fmt::Display]) -> String {
    let mut text = String::new();
    for (i, item) in items.iter().enumerate() {
        // Writing to a String cannot fail.
        let _ = write!(text, "{}{item}", if i == 0 { "" } else { "; " });
    }
    text
}

/// Where the rig and the rig file disagree.
///
/// What tells one rig from another is compared: the name (a rig file's may go on, as that of a repaired one does, since
/// a rig has 32 bytes for it), what a command is, the counts of both encoders, and the largest command. The limits of
/// angle and speed are not: each side keeps its own, and whichever is reached first switches the motor off.
///
/// ```
/// use furuta_hw::{EmulatedRig, Emulation, identity::mismatches};
/// let named = |name| furuta_model::Rig::builtin(name).expect("built in");
/// let [one, other] = ["qube-servo-2", "fong2014-emecs"].map(named);
/// let hello = *EmulatedRig::new(&one, &Emulation::default())?.settings();
/// assert_eq!(mismatches(&hello, &one), []);
/// let first = mismatches(&hello, &other)[0].to_string();
/// assert_eq!(first, "the rig says name = qube-servo-2, its rig file fong2014-emecs");
/// # Ok::<(), furuta_hw::EmulationError>(())
/// ```
#[must_use]
pub fn mismatches(hello: &Hello, rig: &Rig) -> Vec<Mismatch> {
    let mut found = Vec::new();
    if !rig.name.starts_with(hello.rig.as_str()) {
        found.push(Mismatch {
            quantity: "name",
            rig: printable(&hello.rig),
            file: rig.name.clone(),
        });
    }
    let file = rig.params.motor.actuation;
    if hello.actuation != file.code() {
        let said = Actuation::from_code(hello.actuation);
        let shown = |a: Actuation| format!("\"{a}\" in {}", a.unit());
        found.push(Mismatch {
            quantity: "motor.kind",
            rig: said.map_or_else(|| hello.actuation.to_string(), shown),
            file: shown(file),
        });
    }
    let numbers = [
        (
            "arm_counts_per_rev",
            hello.arm_counts_per_rev,
            rig.sensors.arm_counts_per_rev,
        ),
        (
            "pendulum_counts_per_rev",
            hello.pendulum_counts_per_rev,
            rig.sensors.pendulum_counts_per_rev,
        ),
        (
            "command_limit",
            f64::from(hello.command_limit),
            rig.params.motor.command_limit,
        ),
    ];
    for (quantity, said, file) in numbers {
        // The command limit comes as an f32. What is no number is no match either.
        let equal = (said - file).abs() <= 1e-6 * file.abs();
        if !equal {
            found.push(Mismatch {
                quantity,
                rig: said.to_string(),
                file: file.to_string(),
            });
        }
    }
    found
}

/// Refuses a rig that is not the one of the rig file.
///
/// # Errors
/// [`WrongRig`], with all that differs.
pub fn check(hello: &Hello, rig: &Rig) -> Result<(), WrongRig> {
    match mismatches(hello, rig) {
        found if found.is_empty() => Ok(()),
        mismatches => Err(WrongRig { mismatches }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{EmulatedRig, Emulation};

    /// A host that would send volts to a driver of accelerations, and the other way round.
    #[test]
    fn a_rig_of_another_kind_is_refused() {
        let stepper = Rig::builtin("stepper-kit").expect("built in");
        let rig = EmulatedRig::new(&stepper, &Emulation::default()).expect("possible");
        assert_eq!(check(rig.settings(), &stepper), Ok(()));
        let mut volts = stepper.clone();
        volts.params.motor.actuation = Actuation::Voltage;
        let error = check(rig.settings(), &volts).expect_err("another kind");
        let said =
            "the rig says motor.kind = \"acceleration\" in rad/s2, its rig file \"voltage\" in V";
        assert!(error.to_string().contains(said), "{error}");
        let rig = EmulatedRig::new(&volts, &Emulation::default()).expect("possible");
        assert!(check(rig.settings(), &stepper).is_err());
    }
}
