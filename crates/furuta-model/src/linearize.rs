//! Exact Jacobians by dual numbers.

use crate::jet::Jet;
use crate::plant::Plant;
use crate::scalar::Scalar;
use crate::state::State;
use nalgebra::{SMatrix, SVector};

/// `x' = A (x - x0) + B (u - u0)`.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Linear {
    /// 4 x 4, order `[theta, alpha, theta_dot, alpha_dot]`.
    pub a: SMatrix<f64, 4, 4>,
    /// 4 x 1, per volt.
    pub b: SVector<f64, 4>,
}

/// The plant's Jacobians at `x` (rad, rad/s) and `u` (V), exact to rounding.
///
/// Effects without memory are included; at a kink (dry friction at rest, a dead zone's edge) the slope is that of the
/// branch taken. Delay and lag are left out: they have no state in `x`. For a design model without dry friction,
/// linearise a plant without effects.
///
/// ```
/// use furuta_model::{Plant, Rig, State, linearize};
/// let rig = Rig::builtin("shahzad2022-srv02").expect("built in");
/// let up = linearize(&rig.nominal_plant(), State::upright(), 0.0);
/// assert!((up.a[(2, 1)] - 54.06).abs() < 0.01 && (up.b[2] - 35.84).abs() < 0.01); // paper's (A), (B)
/// ```
#[must_use]
pub fn linearize(plant: &Plant<f64>, x: State<f64>, u: f64) -> Linear {
    type Number = Jet<f64, 5>;
    let plant = plant.cast::<Number>();
    let mut i = 0;
    let x = State::from(x.to_array().map(|v| {
        i += 1;
        Number::variable(v, i - 1)
    }));
    let rate = plant
        .rate(Number::ZERO, &x, plant.volts(Number::variable(u, 4)), 1e3)
        .to_array();
    Linear {
        a: SMatrix::from_fn(|r, c| rate[r].d[c]),
        b: SVector::from_fn(|r, _| rate[r].d[4]),
    }
}
