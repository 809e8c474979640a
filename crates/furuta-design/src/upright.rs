//! Whether a controller holds a pendulum upright by its linear closed loop.

use furuta_ctrl::controllers::{AnyController, Controller};
use furuta_model::Rig;
use furuta_model::linear_plant::Amplitudes;

use crate::rig_loop::{Law, RigLoop};

/// The fastest growth (1/s) in the closed loop of a rig with its effects and a controller near upright: the largest
/// real part of its poles, as those of continuous time; below 0 where it is stable. `None` where the controller has no
/// gain near upright, or the rig has no linear model.
///
/// See [`crate::rig_loop`] for what the loop holds; integrals of the arm's error count, a PID's filters and its
/// integral of the pendulum's error do not.
///
/// ```
/// use furuta_ctrl::controllers::{AnyController, StateFeedback};
/// use furuta_design::upright::growth;
/// let rig = furuta_model::Rig::builtin("shahzad2022-srv02").ok_or("no such rig")?;
/// let standard = StateFeedback::new(&furuta_ctrl::design::balance(&rig.params, 0.002)?, 10.0);
/// let turned = StateFeedback { gain: standard.gain.map(|k: f64| -k), ..standard };
/// assert!(growth(&AnyController::StateFeedback(standard), &rig, 0.002).is_some_and(|g| g < -0.5));
/// assert!(growth(&AnyController::StateFeedback(turned), &rig, 0.002).is_some_and(|g| g > 5.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use]
pub fn growth(balance: &AnyController<f64>, rig: &Rig, period: f64) -> Option<f64> {
    growth_of(law(balance)?, rig, period)
}

/// [`growth`] with every gain of the opposite sign: stable where the sign is what is wrong.
#[must_use]
pub fn growth_turned(balance: &AnyController<f64>, rig: &Rig, period: f64) -> Option<f64> {
    let Law { gain, integral } = law(balance)?;
    let turned = Law {
        gain: gain.map(|k| -k),
        integral: -integral,
    };
    growth_of(turned, rig, period)
}

/// What a controller does near upright, where that is linear.
#[must_use]
pub fn law(balance: &AnyController<f64>) -> Option<Law> {
    let integral = match balance {
        AnyController::Lqi(lqi) => lqi.integral_gain,
        AnyController::Pid(pid) => pid.pendulum[0] * pid.arm[1],
        _ => 0.0,
    };
    Some(Law {
        gain: balance.surrogate()?.gain,
        integral,
    })
}

fn growth_of(law: Law, rig: &Rig, period: f64) -> Option<f64> {
    let found = RigLoop::new(rig, law, Some(period), &Amplitudes::NONE).ok()?;
    Some(found.growth()).filter(|growth| growth.is_finite())
}
