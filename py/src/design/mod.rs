//! Control design. The designs are written for sizes known at compile time; here a size is looked up.

mod closed_loop;
mod controllability;
mod estimate;
mod place;
mod regulate;
mod relay;
mod riccati;
mod robust;
mod swing_up;
mod system;

use pyo3::prelude::*;

/// Calls `$sized::<N, M>` for the sizes of `$dim`, N = 1..=8 states and M = 1..=3 inputs.
macro_rules! by_size {
    ($dim:expr, $sized:ident $arguments:tt; $($n:literal)*) => {
        match $dim {
            $(
                ($n, 1) => $sized::<$n, 1> $arguments,
                ($n, 2) => $sized::<$n, 2> $arguments,
                ($n, 3) => $sized::<$n, 3> $arguments,
            )*
            (n, m) => Err($crate::error::design(format!(
                "{n} states and {m} inputs (for an estimator: measurements); 1 to 8 states and 1 to 3 \
                 inputs are possible"
            ))),
        }
    };
}
use by_size;

/// Adds the functions to the module.
pub(crate) fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(riccati::care, m)?)?;
    m.add_function(wrap_pyfunction!(riccati::dare, m)?)?;
    m.add_function(wrap_pyfunction!(regulate::lqr, m)?)?;
    m.add_function(wrap_pyfunction!(regulate::dlqr, m)?)?;
    m.add_function(wrap_pyfunction!(regulate::lqi, m)?)?;
    m.add_function(wrap_pyfunction!(estimate::lqe, m)?)?;
    m.add_function(wrap_pyfunction!(estimate::dlqe, m)?)?;
    m.add_function(wrap_pyfunction!(place::place, m)?)?;
    m.add_function(wrap_pyfunction!(robust::robust_lqr, m)?)?;
    m.add_function(wrap_pyfunction!(closed_loop::closed_loop, m)?)?;
    m.add_function(wrap_pyfunction!(closed_loop::rehearse, m)?)?;
    m.add_function(wrap_pyfunction!(relay::relay, m)?)?;
    m.add_function(wrap_pyfunction!(swing_up::design_swing_up, m)?)?;
    m.add_function(wrap_pyfunction!(controllability::controllability, m)?)
}
