//! How well the numbers of a data sheet are known.

use super::file::RigError;
use crate::jet::Jet;
use crate::params::{Params, RANGES};

/// How many numbers a sheet has.
const COUNT: usize = RANGES.len();

/// What is usual where a rig file says nothing: one standard deviation as a share of the value, in the order of
/// [`RANGES`]; `None`: the sheet is a guess.
///
/// A ruler is good to a millimetre or two (2 % of a desk-top arm), a balance to 1 %. The arm's inertia is known to its
/// order of magnitude: a rod that turns about its end in place of its middle has four times as much, and hub, clamp and
/// cable are left out. The pendulum is a rod with a knob, 30 %. A motor's constants vary by 10 % from one to the next.
/// Gears are counted. No sheet knows a friction.
const USUAL: [Option<f64>; COUNT] = [
    Some(0.02), // arm.length
    Some(1.0),  // arm.inertia
    None,       // arm.viscous
    Some(0.01), // pendulum.mass
    Some(0.02), // pendulum.com
    Some(0.3),  // pendulum.inertia
    Some(0.3),  // pendulum.inertia_transverse
    Some(0.3),  // pendulum.inertia_axial
    None,       // pendulum.viscous
    Some(0.1),  // motor.resistance
    Some(0.1),  // motor.torque_constant
    Some(0.1),  // motor.back_emf_constant
    Some(0.0),  // motor.gear_ratio
    Some(0.1),  // motor.efficiency
    Some(0.05), // motor.amplifier_gain
    Some(0.0),  // motor.command_limit
    Some(0.0),  // environment.gravity
];

/// Smallest and largest share that a rig file may state.
const SHARES: (f64, f64) = (1e-6, 10.0);

/// The table `[tolerance]` of a rig file: one standard deviation of each number of the sheet, a share of its value.
///
/// A diagnosis holds what recordings do not show near the sheet by it; what they show moves as far as they say.
///
/// ```
/// use furuta_model::Rig;
/// let mut rig = Rig::builtin("qube-servo-2").expect("built in");
/// assert_eq!(rig.tolerance.share("arm.length"), Some(0.02));   // a ruler, where the file says nothing
/// assert_eq!(rig.tolerance.share("arm.viscous"), None);        // no sheet knows a friction
/// rig.tolerance.set("arm.length", 0.002).expect("a calliper");
/// let again = Rig::from_toml(&rig.to_toml()).expect("what is written can be read");
/// assert_eq!(again.tolerance.share("arm.length"), Some(0.002));
/// ```
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Tolerance {
    stated: [Option<f64>; COUNT],
}

impl Tolerance {
    /// One standard deviation of a number of the sheet, a share of its value: as stated, or what is usual. `None` where
    /// nothing is known of it, and for a key that no sheet has.
    #[must_use]
    pub fn share(&self, key: &str) -> Option<f64> {
        let i = RANGES.iter().position(|r| r.key == key)?;
        self.stated[i].or(USUAL[i])
    }

    /// What was stated, in the order of [`RANGES`]: key and share.
    pub fn stated(&self) -> impl Iterator<Item = (&'static str, f64)> {
        let stated = self.stated;
        RANGES
            .iter()
            .zip(stated)
            .filter_map(|(r, s)| Some((r.key, s?)))
    }

    /// States how well a number of the sheet is known.
    ///
    /// # Errors
    /// A key that no sheet has, or a share outside 1e-6 to 10.
    pub fn set(&mut self, key: &str, share: f64) -> Result<(), RigError> {
        let known = || RANGES.iter().map(|r| r.key).collect::<Vec<_>>().join(", ");
        let i =
            RANGES
                .iter()
                .position(|r| r.key == key)
                .ok_or_else(|| RigError::UnknownTolerance {
                    key: key.to_owned(),
                    known: known(),
                })?;
        if !(share >= SHARES.0 && share <= SHARES.1) {
            return Err(RigError::Tolerance {
                key: RANGES[i].key,
                share,
                min: SHARES.0,
                max: SHARES.1,
            });
        }
        self.stated[i] = Some(share);
        Ok(())
    }

    /// One standard deviation of a quantity that is computed from the sheet, a share of its value: to first order, the
    /// numbers of the sheet independent of each other. `None` where it depends on a number of which nothing is known,
    /// or is 0.
    ///
    /// ```
    /// use furuta_model::Rig;
    /// let rig = Rig::builtin("qube-servo-2").expect("built in");
    /// let area = rig.tolerance.of(&rig.params, |p| p.arm.length * p.arm.length).expect("lengths are known");
    /// assert!((area - 2.0 * 0.02).abs() < 1e-12);
    /// ```
    #[must_use]
    pub fn of(
        &self,
        params: &Params<f64>,
        quantity: impl Fn(&Params<Jet<f64, COUNT>>) -> Jet<f64, COUNT>,
    ) -> Option<f64> {
        let sheet = params.to_array();
        let variables = std::array::from_fn(|i| Jet::variable(sheet[i], i));
        let result = quantity(&Params::from_array(params.motor.actuation, variables));
        let mut variance = 0.0;
        for (i, range) in RANGES.iter().enumerate() {
            if result.d[i] != 0.0 {
                variance += (result.d[i] * sheet[i] * self.share(range.key)?).powi(2);
            }
        }
        (result.v != 0.0).then(|| variance.sqrt() / result.v.abs())
    }
}
