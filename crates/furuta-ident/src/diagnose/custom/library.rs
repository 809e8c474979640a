//! The terms an expression is put together from, each on either axis.

use furuta_model::State;
use furuta_model::dynamics::Angle;
use furuta_model::effects::{Clock, Instant, TERMS, Term};
use furuta_model::params::Coefficients;

/// A term of the library on one axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Column {
    /// 0 arm, 1 pendulum.
    pub(super) axis: usize,
    /// Its place in [`TERMS`].
    pub(super) term: usize,
    /// Whether the torque can only act with the axis' motion: then its coefficient must not be positive.
    pub(super) drags: bool,
}

/// Every term on every axis that a torque moves.
pub(super) fn library(coefficients: &Coefficients<f64>, moved: [bool; 2]) -> Vec<Column> {
    (0..2)
        .filter(|axis| moved[*axis])
        .flat_map(|axis| {
            (0..TERMS.len()).map(move |term| Column {
                axis,
                term,
                drags: drags(&TERMS[term], axis, coefficients),
            })
        })
        .collect()
}

/// Whether a torque by this term never changes its direction against the axis' motion: then only one sign is friction,
/// the other would drive for ever.
fn drags(term: &Term, axis: usize, coefficients: &Coefficients<f64>) -> bool {
    const ANGLES: [f64; 5] = [-2.1, -0.7, 0.0, 0.9, 2.3];
    const SPEEDS: [f64; 4] = [-3.1, -0.4, 0.6, 2.9];
    let mut power = 0.0;
    for theta in ANGLES {
        for alpha in ANGLES {
            for theta_dot in SPEEDS {
                for alpha_dot in SPEEDS {
                    for volts in [-1.7, 2.2] {
                        let x = State::new(theta, alpha, theta_dot, alpha_dot);
                        let speed = [theta_dot, alpha_dot][axis];
                        let now = speed * term.value(&instant(0.0, &x, coefficients, volts));
                        if now < 0.0 {
                            return false;
                        }
                        power += now;
                    }
                }
            }
        }
    }
    power > 0.0
}

pub(super) fn instant<'a>(
    t: f64,
    x: &'a State<f64>,
    coefficients: &'a Coefficients<f64>,
    volts: f64,
) -> Instant<'a, f64> {
    Instant {
        clock: Clock::at(t),
        x,
        angle: Angle::of(x.alpha),
        coefficients,
        memory: 0.0,
        volts,
    }
}
