//! Where something crosses zero between two moments.

use crate::scalar::Scalar;

/// The share of the way at which a line from `-a` to `b` (both not negative) crosses zero.
pub(super) fn share<R: Scalar<Real = R> + PartialOrd>(a: R, b: R) -> R {
    let a = if a > R::ZERO { a } else { R::ZERO };
    let sum = a + b;
    if sum > R::ZERO { a / sum } else { R::ONE }
}

/// The cubic over [0, 1] with these ends and slopes.
pub(super) struct Cubic<R> {
    pub(super) from: R,
    pub(super) to: R,
    pub(super) slope_from: R,
    pub(super) slope_to: R,
}

impl<R: Scalar<Real = R> + PartialOrd> Cubic<R> {
    fn at(&self, t: R) -> R {
        let rise = self.to - self.from;
        let square =
            rise.scale(R::from_f64(3.0)) - self.slope_from - self.slope_from - self.slope_to;
        let cube = self.slope_from + self.slope_to - rise - rise;
        self.from + t * (self.slope_from + t * (square + t * cube))
    }

    /// Where it comes down to zero, by bisection; it starts above (or rising from) zero and ends below.
    pub(super) fn falls_to_zero(&self) -> R {
        let (mut above, mut below) = (R::ZERO, R::ONE);
        // To a part in 10^12 of the step; Newton's step does the rest.
        for _ in 0..40 {
            let middle = (above + below).scale(R::from_f64(0.5));
            if self.at(middle) > R::ZERO {
                above = middle;
            } else {
                below = middle;
            }
        }
        below
    }
}
