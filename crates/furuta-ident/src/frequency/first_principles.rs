//! What a rig file says of the response: its linear model, hanging.

pub use furuta_model::transfer::Output;
use furuta_model::transfer::transfer_function;
use furuta_model::{Plant, Rig, State, linearize};
use nalgebra::RowVector4;

use super::transfer::{Transfer, TransferError};

/// Angle over voltage of a rig whose pendulum hangs, its effects left out. What cancels exactly, the free turning of
/// the arm in the pendulum's response, is cancelled.
///
/// ```
/// use furuta_ident::frequency::first_principles::{Output, of_rig};
/// use furuta_model::Rig;
/// let rig = Rig::builtin("fong2014-emecs").expect("built in");
/// let g = of_rig(&rig, Output::Alpha)?; // equation (28) of its paper
/// assert_eq!(g.orders(), [1, 3]);
/// assert!((g.numerator[0] + 24.72).abs() < 0.01 && (g.denominator[1] - 9.2).abs() < 0.01);
/// assert_eq!(of_rig(&rig, Output::Theta)?.orders(), [2, 4]);
/// # Ok::<(), furuta_ident::frequency::transfer::TransferError>(())
/// ```
///
/// # Errors
/// A rig that the motor does not move.
pub fn of_rig(rig: &Rig, output: Output) -> Result<Transfer, TransferError> {
    of_plant(&rig.nominal_plant(), output)
}

/// The same for a plant with effects; those with a memory of their own (delay, lag, backlash) are not seen.
///
/// # Errors
/// As [`of_rig`].
pub fn of_plant(plant: &Plant<f64>, output: Output) -> Result<Transfer, TransferError> {
    let linear = linearize(plant, State::hanging(), 0.0);
    let c = match output {
        Output::Theta => RowVector4::new(1.0, 0.0, 0.0, 0.0),
        Output::Alpha => RowVector4::new(0.0, 1.0, 0.0, 0.0),
    };
    let g = transfer_function(&linear.a, &linear.b, &c);
    let mut numerator: Vec<f64> = g.numerator.iter().rev().copied().collect();
    let mut denominator = vec![1.0];
    denominator.extend(g.denominator.iter().rev());
    clean(&mut numerator);
    clean(&mut denominator);
    while numerator.len() > 1 && numerator.last() == Some(&0.0) && denominator.last() == Some(&0.0)
    {
        numerator.pop();
        denominator.pop();
    }
    Transfer::new(&numerator, &denominator)
}

/// Rounding makes no coefficient.
fn clean(coefficients: &mut [f64]) {
    let largest = coefficients.iter().fold(0.0_f64, |m, c| m.max(c.abs()));
    for c in coefficients {
        if c.abs() < 1e-11 * largest {
            *c = 0.0;
        }
    }
}
