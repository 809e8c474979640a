//! Whether a controller holds a pendulum upright by its linear closed loop.

use furuta_ctrl::controllers::{AnyController, Controller};
use furuta_ctrl::design::poles;
use furuta_model::discretize::zero_order_hold;
use furuta_model::{Params, Plant, State, linearize};
use nalgebra::{RowVector4, SMatrix};

/// The fastest growth (1/s) in the closed loop of a rig and a controller near upright: the largest real part of its
/// poles, as those of continuous time; below 0 where it is stable. `None` where the controller has no gain near
/// upright, or the parameters have no linear model.
///
/// The rig's model without its effects, held over the sample period; the integral of the one controller that has one
/// counts.
///
/// ```
/// use furuta_ctrl::controllers::{AnyController, StateFeedback};
/// use furuta_design::upright::growth;
/// let rig = furuta_model::Rig::builtin("shahzad2022-srv02").ok_or("no such rig")?;
/// let standard = StateFeedback::new(&furuta_ctrl::design::balance(&rig.params, 0.002)?, 10.0);
/// let turned = StateFeedback { gain: standard.gain.map(|k: f64| -k), ..standard };
/// assert!(growth(&AnyController::StateFeedback(standard), &rig.params, 0.002).is_some_and(|g| g < -0.5));
/// assert!(growth(&AnyController::StateFeedback(turned), &rig.params, 0.002).is_some_and(|g| g > 5.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use]
pub fn growth(balance: &AnyController<f64>, params: &Params<f64>, period: f64) -> Option<f64> {
    let integral_gain = match balance {
        AnyController::Lqi(lqi) => Some(lqi.integral_gain),
        _ => None,
    };
    growth_of(balance.surrogate()?.gain, integral_gain, params, period)
}

/// [`growth`] with every gain of the opposite sign: stable where the sign is what is wrong.
#[must_use]
pub fn growth_turned(
    balance: &AnyController<f64>,
    params: &Params<f64>,
    period: f64,
) -> Option<f64> {
    let integral_gain = match balance {
        AnyController::Lqi(lqi) => Some(-lqi.integral_gain),
        _ => None,
    };
    let gain = balance.surrogate()?.gain.map(|k| -k);
    growth_of(gain, integral_gain, params, period)
}

fn growth_of(
    gain: [f64; 4],
    integral_gain: Option<f64>,
    params: &Params<f64>,
    period: f64,
) -> Option<f64> {
    let plant = Plant::new(params, &[]).ok()?;
    let linear = linearize(&plant, State::upright(), 0.0);
    let (a, b) = zero_order_hold(&linear.a, &linear.b, period);
    let closed = a - b * RowVector4::from(gain);
    let size = match integral_gain {
        None => largest(poles(&closed)?.map(|z| z.norm())),
        Some(k) => {
            let mut all = SMatrix::<f64, 5, 5>::identity();
            all.fixed_view_mut::<4, 4>(0, 0).copy_from(&closed);
            all.fixed_view_mut::<4, 1>(0, 4).copy_from(&(b * -k));
            all[(4, 0)] = period;
            largest(poles(&all)?.map(|z| z.norm()))
        }
    };
    Some(size.ln() / period)
}

fn largest<const N: usize>(sizes: [f64; N]) -> f64 {
    sizes.into_iter().fold(0.0, f64::max)
}
