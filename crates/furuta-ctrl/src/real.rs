//! The numbers controllers run on.

use furuta_model::Scalar;

/// A plain real number: `f32` on a microcontroller, `f64` on a host.
pub trait Real: Scalar<Real = Self> + PartialOrd {}
impl<T: Scalar<Real = T> + PartialOrd> Real for T {}

/// Constant.
pub(crate) fn c<T: Real>(x: f64) -> T {
    T::from_f64(x)
}

pub(crate) fn is_finite<T: Real>(x: T) -> bool {
    x.value().is_finite()
}

/// The command within `-limit..=limit`; 0 where it is not a number, for a motor must never be given one.
pub(crate) fn command<T: Real>(u: T, limit: T) -> T {
    if u.value().is_nan() {
        T::ZERO
    } else {
        u.clamp(-limit, limit)
    }
}

/// The angle in (-pi, pi] that differs from `angle` by whole turns.
pub fn wrap<T: Real>(angle: T) -> T {
    let turns = angle.value() / core::f64::consts::TAU;
    // Half a turn stays +pi: ceil(turns - 1/2) is the nearest integer with ties downwards.
    let whole = libm::ceil(turns - 0.5);
    if whole == 0.0 {
        angle
    } else {
        T::from_f64(angle.value() - whole * core::f64::consts::TAU)
    }
}

#[cfg(test)]
mod tests {
    use super::{command, wrap};
    use core::f64::consts::PI;

    #[test]
    fn wrapped_angles() {
        assert_eq!(wrap(PI), PI);
        assert_eq!(wrap(-PI), PI);
        assert!((wrap(7.0) - (7.0 - 2.0 * PI)).abs() < 1e-15);
        assert!((wrap(-50.0_f32) - (-50.0 + 16.0 * core::f32::consts::PI)).abs() < 1e-5);
    }

    #[test]
    fn a_motor_never_sees_nan() {
        assert_eq!(command(f64::NAN, 10.0), 0.0);
        assert_eq!(command(f64::INFINITY, 10.0), 10.0);
        assert_eq!(command(-3.0, 10.0), -3.0);
    }
}
