//! The numbers that a control system runs on, by name: for what writes it in another language.

use crate::real::Real;
use furuta_model::params::Coefficients;

/// A number of a control system, or several: `Real` in the control system's precision, `Whole` for counts and switches
/// (0 or 1).
///
/// ```
/// use furuta_ctrl::numbers::Number;
/// use furuta_ctrl::supervisor::Supervisor;
/// use furuta_ctrl::{Config, Site};
/// let rig = furuta_model::Rig::builtin("qube-servo-2").ok_or("no such rig")?;
/// let supervisor = Supervisor::<f64>::design(&Config::default(), &Site::of(&rig, 0.002))?;
/// let mut limit = None;
/// supervisor.numbers(&mut |name, number| match number {
///     Number::Real(values) if name == "COMMAND_LIMIT" => limit = Some(values[0]),
///     _ => {}
/// });
/// assert_eq!(limit, Some(10.0));
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Number<'a, T> {
    /// One, or a list.
    Real(&'a [T]),
    /// A count, or a switch.
    Whole(u32),
}

/// The coefficients as a list: arm, swing, coupling, pendulum, weight, lever, drive, arm damping, pendulum damping.
pub(crate) fn listed<T: Real>(c: &Coefficients<T>) -> [T; 9] {
    [
        c.arm,
        c.swing,
        c.coupling,
        c.pendulum,
        c.weight,
        c.lever,
        c.drive,
        c.arm_damping,
        c.pendulum_damping,
    ]
}
