//! Where a rig rests upright: Newton's method on the equations of motion at rest.

use crate::jet::Jet;
use crate::plant::Plant;
use crate::scalar::Scalar;
use crate::state::State;
use nalgebra::{SMatrix, SVector};

/// How the rig is held at rest.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Hold {
    /// The arm at this angle (rad), by whatever voltage that takes.
    Arm(f64),
    /// By a state feedback without an integral: the motor's voltage is `volts - gain[0] theta - gain[1] alpha`.
    Feedback {
        /// What it adds, V.
        volts: f64,
        /// Its gain on the angles of arm and pendulum, V/rad.
        gain: [f64; 2],
    },
}

/// Where a rig rests upright.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Equilibrium {
    /// The state; its speeds are zero.
    pub x: State<f64>,
    /// The voltage at the motor, V.
    pub volts: f64,
    /// The command that gives it, V.
    pub command: f64,
    /// The rotor's angle where a coupling twists, else the arm's, rad.
    pub rotor: f64,
}

/// Nothing rests upright.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct NoEquilibrium {
    /// The pendulum's angle at which the search ended, rad.
    pub alpha: f64,
    /// The pendulum's acceleration there, rad/s².
    pub acceleration: f64,
}

impl core::fmt::Display for NoEquilibrium {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(
            f,
            "the rig has no rest with the pendulum within 90 degrees of upright (the search ended at alpha = {:.3} \
             rad, alpha'' = {:.3} rad/s2): its effects pull too hard; check the sizes of springs, tilt and \
             constant torques in the rig file",
            self.alpha, self.acceleration
        )
    }
}

impl core::error::Error for NoEquilibrium {}

/// Newton steps at most.
const STEPS: usize = 60;
/// A step this small (rad, V) is rounding.
const SMALL: f64 = 1e-11;

/// Where `plant` rests, the pendulum upright. The plant has no dry friction: that would hold it anywhere nearby.
///
/// # Errors
/// [`NoEquilibrium`].
///
/// ```
/// use furuta_model::linear_plant::{Hold, equilibrium};
/// use furuta_model::{Effect, Plant, Rig};
/// let rig = Rig::builtin("qube-servo-2").ok_or("no such rig")?;
/// let tilt = Effect::new("arm.tilt", &[0.05, std::f64::consts::FRAC_PI_2, 0.0])?;
/// let plant: Plant<f64> = Plant::new(&rig.params, &[tilt])?;
/// let at = equilibrium(&plant, Hold::Arm(0.0))?;
/// // The pendulum hangs in the vertical of the world, the base leans.
/// assert!((at.x.alpha.abs() - 0.05).abs() < 1e-9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn equilibrium(plant: &Plant<f64>, hold: Hold) -> Result<Equilibrium, NoEquilibrium> {
    type Number = Jet<f64, 3>;
    let dual = plant.cast::<Number>();
    // Alpha; the motor's voltage or the arm's angle; how far the rotor is turned against the arm.
    let mut unknown = match hold {
        Hold::Arm(_) => SVector::<f64, 3>::zeros(),
        Hold::Feedback { volts, gain } => {
            let theta = if gain[0] == 0.0 { 0.0 } else { volts / gain[0] };
            // From where the arm's own feedback balances the voltage, if that is near.
            SVector::from([0.0, if theta.abs() < 0.1 { theta } else { 0.0 }, 0.0])
        }
    };
    let mut value = residual(&dual, hold, &unknown);
    for _ in 0..STEPS {
        let off = value.map(|r| r.v);
        if off.iter().all(|r| *r == 0.0) {
            break;
        }
        let slope = SMatrix::<f64, 3, 3>::from_fn(|i, j| value[i].d[j]);
        let Some(step) = slope.lu().solve(&off) else {
            return Err(failed(&unknown, &off));
        };
        let is_better = |there: &SVector<Number, 3>| size(there) < size(&value);
        // Half steps until it gets better.
        let mut share = 1.0;
        let mut next = unknown - step;
        let mut there = residual(&dual, hold, &next);
        while !is_better(&there) && share > 1e-6 {
            share *= 0.5;
            next = unknown - step * share;
            there = residual(&dual, hold, &next);
        }
        let done = step.amax() < SMALL;
        if done && !is_better(&there) {
            break;
        }
        (unknown, value) = (next, there);
        if done {
            break;
        }
    }
    let off = value.map(|r| r.v);
    let slope = SMatrix::<f64, 3, 3>::from_fn(|i, j| value[i].d[j]);
    // Without gravity it rests everywhere, and no step is needed.
    let left = if off.iter().all(|r| *r == 0.0) {
        0.0
    } else {
        slope.lu().solve(&off).map_or(f64::NAN, |step| step.amax())
    };
    let upright = unknown[0].abs() < core::f64::consts::FRAC_PI_2;
    if !(upright && left < 1e3 * SMALL) {
        return Err(failed(&unknown, &off));
    }
    let (theta, volts) = match hold {
        Hold::Arm(theta) => (theta, unknown[1]),
        Hold::Feedback { volts, gain } => (
            unknown[1],
            volts - gain[0] * unknown[1] - gain[1] * unknown[0],
        ),
    };
    Ok(Equilibrium {
        x: State::new(theta, unknown[0], 0.0, 0.0),
        volts,
        command: command_for(plant, volts),
        rotor: theta + unknown[2],
    })
}

fn failed(unknown: &SVector<f64, 3>, off: &SVector<f64, 3>) -> NoEquilibrium {
    NoEquilibrium {
        alpha: unknown[0],
        acceleration: off[1],
    }
}

fn size(value: &SVector<Jet<f64, 3>, 3>) -> f64 {
    value
        .iter()
        .map(|r| r.v.abs())
        .fold(0.0, |a, b| if a > b { a } else { b })
}

/// Accelerations of arm, pendulum and rotor at rest, rad/s²; of a rotor that is one with the arm, its angle against it.
fn residual(
    plant: &Plant<Jet<f64, 3>>,
    hold: Hold,
    unknown: &SVector<f64, 3>,
) -> SVector<Jet<f64, 3>, 3> {
    type Number = Jet<f64, 3>;
    let [alpha, other, turn] = [0, 1, 2].map(|i| Number::variable(unknown[i], i));
    let (theta, volts) = match hold {
        Hold::Arm(theta) => (Number::constant(theta), other),
        Hold::Feedback { volts, gain } => (
            other,
            Number::constant(volts) - other.scale(gain[0]) - alpha.scale(gain[1]),
        ),
    };
    let x = State::new(theta, alpha, Number::ZERO, Number::ZERO);
    if plant.twists() {
        return plant
            .twisted(&x, [theta + turn, Number::ZERO], volts)
            .into();
    }
    let rate = plant.rate(Number::ZERO, &x, volts, 1e3);
    SVector::from([rate.theta_dot, rate.alpha_dot, turn])
}

/// The command for which the voltage at the motor is `volts`, where the map between is smooth.
fn command_for(plant: &Plant<f64>, volts: f64) -> f64 {
    let mut command = volts;
    for _ in 0..20 {
        let off = plant.volts(command) - volts;
        if off == 0.0 {
            break;
        }
        command -= off;
    }
    command
}

#[cfg(test)]
mod tests {
    use super::{Hold, equilibrium};
    use crate::{Plant, Rig};

    #[test]
    fn without_gravity_a_rig_rests_where_it_stands() -> Result<(), Box<dyn std::error::Error>> {
        let mut rig = Rig::builtin("qube-servo-2").ok_or("no such rig")?;
        rig.params.gravity = 0.0;
        let at = equilibrium(&Plant::new(&rig.params, &[])?, Hold::Arm(0.3))?;
        assert_eq!((at.x.theta, at.x.alpha, at.volts), (0.3, 0.0, 0.0));
        Ok(())
    }
}
