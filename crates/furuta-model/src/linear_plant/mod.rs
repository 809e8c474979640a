//! The linear model of a rig with its effects, about the place upright where they let it rest.
//!
//! | Effects | In the linear model |
//! |---|---|
//! | springs, cables, cogging, tilt, empirical terms, constant torques | their slopes at the [equilibrium](hold), by dual numbers |
//! | `drive.compliance` | the rotor's angle and speed as states |
//! | `motor.lag` | the voltage at the motor as a state |
//! | `motor.resonance` | how far the arm is behind the command, and how fast it falls behind, as states |
//! | `motor.delay`, `sensor.delay` | as times; whoever samples or approximates makes states of them |
//! | dry, presliding and quadratic friction | by [describing function](describing) for a given speed, else left out |
//! | dead zone, saturation, asymmetry | by describing function for a given command, else left out |
//! | backlash, end stops, a cable that relaxes, the current's delay and limit, disturbances | left out |
//!
//! What is left out, and why, is listed in [`LinearPlant::remarks`].

pub mod describing;
pub mod hold;
mod load;
mod treatment;

pub use describing::Amplitudes;
pub use hold::{Equilibrium, Hold, NoEquilibrium, equilibrium};
pub use load::Load;
pub use treatment::{Remark, Treatment, rigid_remarks};

use crate::jet::Jet;
use crate::linearize::{Linear, linearize};
use crate::plant::{MAX_EFFECTS, Plant};
use crate::scalar::Scalar;
use crate::state::State;
use arrayvec::ArrayVec;
use nalgebra::{SMatrix, SVector};

/// The most states a [`LinearPlant`] has: four of arm and pendulum, two of the rotor or of what rings about the command
/// (no rig has both), one of the voltage.
pub const MAX_STATES: usize = 7;

/// `z' = A z + B (u(t - delay) - command)`, `z` the distance from the equilibrium.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearPlant {
    /// Where it rests.
    pub at: Equilibrium,
    /// Arm and pendulum alone, rotor and arm one body, without lag and delay: what a state feedback is designed for.
    pub rigid: Linear,
    /// Names of all states: `theta`, `alpha`, `theta_dot`, `alpha_dot`, then `rotor`, `rotor_dot` (rad, rad/s) where
    /// the coupling twists, or `behind`, `behind_dot` where the arm rings about the command, then `volts` (V) where the
    /// voltage lags.
    pub states: ArrayVec<&'static str, MAX_STATES>,
    /// `A` in its first `states.len()` rows and columns, zero beyond.
    pub a: SMatrix<f64, MAX_STATES, MAX_STATES>,
    /// `B` per volt of command, in the same rows.
    pub b: SVector<f64, MAX_STATES>,
    /// Where the states are that the encoders are mounted on, in the order of [`State`]: the rotor's in place of the
    /// arm's where the arm's encoder sits there.
    pub seen: [usize; 4],
    /// How late the command acts, s.
    pub delay: f64,
    /// How late the encoders are, s.
    pub sensor_delay: f64,
    /// What the matrices do not hold exactly: one for each effect that is left out or described.
    pub remarks: ArrayVec<Remark, MAX_EFFECTS>,
}

/// The linear model of `plant` upright, held at rest as `hold` says; friction and voltage maps that have no slope are
/// described for `amplitudes`.
///
/// # Errors
/// [`NoEquilibrium`] where nothing rests upright.
///
/// ```
/// use furuta_model::linear_plant::{Amplitudes, Hold, Treatment, linear_plant};
/// use furuta_model::{Effect, Plant, Rig};
/// let rig = Rig::builtin("shahzad2022-srv02").ok_or("no such rig")?;
/// let effects = [
///     Effect::new("arm.spring", &[0.005, 0.3])?,
///     Effect::new("motor.lag", &[0.01])?,
///     Effect::new("arm.coulomb", &[1e-3])?,
/// ];
/// let plant: Plant<f64> = Plant::new(&rig.params, &effects)?;
/// let linear = linear_plant(&plant, Hold::Arm(0.0), &Amplitudes::NONE)?;
/// assert_eq!(linear.states[..], ["theta", "alpha", "theta_dot", "alpha_dot", "volts"]);
/// assert!(linear.rigid.a[(2, 0)] < 0.0); // the spring pulls the arm back
/// let dry = &linear.remarks[0];
/// assert!(dry.effect == "arm.coulomb" && matches!(dry.treatment, Treatment::LeftOut(_)));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn linear_plant(
    plant: &Plant<f64>,
    hold: Hold,
    amplitudes: &Amplitudes,
) -> Result<LinearPlant, NoEquilibrium> {
    let mut smooth = smooth(plant);
    let at = equilibrium(&smooth, hold)?;
    let described = describing::described(plant, &at, amplitudes);
    smooth.coefficients.arm_damping += described.arm_damping;
    smooth.coefficients.pendulum_damping += described.pendulum_damping;
    let mut rigid = linearize(&smooth, at.x, at.command);
    rigid.b *= described.gain;
    let mut linear = LinearPlant {
        at,
        rigid,
        states: ["theta", "alpha", "theta_dot", "alpha_dot"]
            .into_iter()
            .collect(),
        a: SMatrix::zeros(),
        b: SVector::zeros(),
        seen: if smooth.twists() && plant.sees_rotor() {
            [4, 1, 5, 3]
        } else {
            [0, 1, 2, 3]
        },
        delay: plant.delay(),
        sensor_delay: plant.sensor_delay(),
        remarks: treatment::remarks(plant, &at, amplitudes, &described),
    };
    // Per volt at the motor.
    let mut drive = SVector::<f64, MAX_STATES>::zeros();
    if smooth.twists() {
        linear.states.extend(["rotor", "rotor_dot"]);
        (linear.a, drive) = two_bodies(&smooth, &at);
    } else {
        linear.a.fixed_view_mut::<4, 4>(0, 0).copy_from(&rigid.a);
        let by_motor = linearize_by_motor(&smooth, &at);
        drive.fixed_rows_mut::<4>(0).copy_from(&by_motor);
    }
    let gain = described.gain * map_slope(&smooth, at.command);
    let rings = plant.resonance().is_some();
    if let Some(r) = plant.resonance() {
        let k = linear.states.len();
        linear.states.extend(["behind", "behind_dot"]);
        let (square, decay) = (r.rate() * r.rate(), r.decay());
        linear.a.set_column(k, &(drive * square));
        linear.a.set_column(k + 1, &(drive * decay));
        linear.a[(k, k + 1)] = 1.0;
        linear.a[(k + 1, k)] = -square;
        linear.a[(k + 1, k + 1)] = -decay;
        drive.fill(0.0);
        drive[k + 1] = 1.0;
    }
    if plant.lag() > 0.0 {
        let k = linear.states.len();
        linear.states.push("volts");
        linear.a.set_column(k, &drive);
        linear.a[(k, k)] = -1.0 / plant.lag();
        linear.b[k] = gain / plant.lag();
    } else if smooth.twists() || rings {
        linear.b = drive * gain;
    } else {
        linear.b.fixed_rows_mut::<4>(0).copy_from(&rigid.b);
    }
    Ok(linear)
}

/// The plant with those of its effects alone that have a slope at rest: no friction, no backlash, no voltage map with a
/// kink, nothing that comes from elsewhere.
#[must_use]
pub fn smooth(plant: &Plant<f64>) -> Plant<f64> {
    plant.retaining(treatment::has_slope)
}

/// [`LinearPlant::rigid`] alone, friction and voltage maps with a kink left out.
///
/// # Errors
/// [`NoEquilibrium`].
///
/// ```
/// use furuta_model::linear_plant::{Hold, rigid};
/// use furuta_model::{Rig, State, linearize};
/// let plant = Rig::builtin("qube-servo-2").ok_or("no such rig")?.nominal_plant();
/// assert_eq!(rigid(&plant, Hold::Arm(0.0))?, linearize(&plant, State::upright(), 0.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn rigid(plant: &Plant<f64>, hold: Hold) -> Result<Linear, NoEquilibrium> {
    let smooth = smooth(plant);
    let at = equilibrium(&smooth, hold)?;
    Ok(linearize(&smooth, at.x, at.command))
}

/// Volts at the motor per volt of command.
fn map_slope(smooth: &Plant<f64>, command: f64) -> f64 {
    type Number = Jet<f64, 1>;
    smooth
        .cast::<Number>()
        .volts(Number::variable(command, 0))
        .d[0]
}

/// `B` per volt at the motor.
fn linearize_by_motor(smooth: &Plant<f64>, at: &Equilibrium) -> SVector<f64, 4> {
    type Number = Jet<f64, 1>;
    let x = State::from(at.x.to_array().map(Number::constant));
    let volts = Number::variable(at.volts, 0);
    let rate = smooth
        .cast::<Number>()
        .rate(Number::ZERO, &x, volts, 1e3)
        .to_array();
    SVector::from_fn(|r, _| rate[r].d[0])
}

/// `A` and `B` (per volt at the motor) with the rotor as a body of its own.
fn two_bodies(
    smooth: &Plant<f64>,
    at: &Equilibrium,
) -> (
    SMatrix<f64, MAX_STATES, MAX_STATES>,
    SVector<f64, MAX_STATES>,
) {
    type Number = Jet<f64, MAX_STATES>;
    let [theta, alpha, ..] = at.x.to_array();
    let values = [theta, alpha, 0.0, 0.0, at.rotor, 0.0, at.volts];
    let mut i = 0;
    let z = values.map(|v| {
        i += 1;
        Number::variable(v, i - 1)
    });
    let x = State::new(z[0], z[1], z[2], z[3]);
    let accelerations = smooth.cast::<Number>().twisted(&x, [z[4], z[5]], z[6]);
    let (mut a, mut b) = (SMatrix::zeros(), SVector::zeros());
    for (angle, speed) in [(0, 2), (1, 3), (4, 5)] {
        a[(angle, speed)] = 1.0;
    }
    for (row, acceleration) in [2, 3, 5].into_iter().zip(accelerations) {
        for column in 0..MAX_STATES - 1 {
            a[(row, column)] = acceleration.d[column];
        }
        b[row] = acceleration.d[MAX_STATES - 1];
    }
    (a, b)
}
