//! Speed from an encoder's angle.

use crate::real::{Real, c, is_finite, wrap};

/// Difference quotient behind two equal first-order low passes: `s / (1 + s/cutoff)^2`, sampled.
///
/// On a ramp it settles at the exact slope. It lags by about `2/cutoff + h/2`; one count of an encoder moves it by
/// at most `count * cutoff / e`, against `count / h` for the bare quotient.
///
/// ```
/// use furuta_ctrl::estimators::Derivative;
/// let speed = Derivative::new(200.0, 0.001);
/// let mut state = speed.start();
/// let mut v = 0.0;
/// for k in 0..100 {
///     v = speed.update(&mut state, 3.0 * f64::from(k) * 0.001);
/// }
/// assert!((v - 3.0).abs() < 1e-6);
/// ```
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Derivative<T> {
    /// `1 - exp(-cutoff h)`.
    blend: T,
    /// Sample rate, 1/s.
    rate: T,
}

/// Memory of a [`Derivative`].
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct DerivativeState<T> {
    angle: Option<T>,
    first: T,
    second: T,
}

impl<T: Real> Derivative<T> {
    /// With corner frequency `cutoff` (rad/s) at the sample period `h` (s).
    pub fn new(cutoff: T, h: T) -> Self {
        Self {
            blend: T::ONE - (-(cutoff * h)).exp(),
            rate: T::ONE / h,
        }
    }

    /// `[1 - exp(-cutoff h), 1/h]`: all that it runs on.
    pub fn numbers(&self) -> [T; 2] {
        [self.blend, self.rate]
    }

    /// Before the first sample.
    pub fn start(&self) -> DerivativeState<T> {
        DerivativeState {
            angle: None,
            first: T::ZERO,
            second: T::ZERO,
        }
    }

    /// The speed (rad/s) after the sample `angle` (rad). Steps are taken the short way round, so a wrapped angle does
    /// no harm; a sample that is not a finite number is passed over.
    pub fn update(&self, state: &mut DerivativeState<T>, angle: T) -> T {
        if !is_finite(angle) {
            return state.second;
        }
        if let Some(last) = state.angle {
            let quotient = wrap(angle - last) * self.rate;
            state.first += self.blend * (quotient - state.first);
            state.second += self.blend * (state.first - state.second);
        }
        state.angle = Some(angle);
        state.second
    }

    /// How late the speed is, s.
    pub fn lag(&self) -> T {
        (c::<T>(2.0) * (T::ONE - self.blend) / self.blend + c(0.5)) / self.rate
    }
}

#[cfg(test)]
mod tests {
    use super::Derivative;

    #[test]
    fn lag_is_what_a_slow_sine_shows() {
        let (h, w) = (0.001, 2.0);
        let speed = Derivative::new(150.0, h);
        let mut state = speed.start();
        let mut worst = 0.0_f64;
        for k in 0..5000 {
            let t = f64::from(k) * h;
            let v = speed.update(&mut state, libm::sin(w * t));
            if t > 1.0 {
                worst = worst.max((v - w * libm::cos(w * (t - speed.lag()))).abs());
            }
        }
        // Second order in w * lag = 0.027: amplitude falls by (w/cutoff)^2.
        assert!(worst < 2e-3, "{worst}");
    }

    #[test]
    fn wraps_and_gaps() {
        let speed = Derivative::new(300.0, 0.001);
        let mut state = speed.start();
        let mut v = 0.0;
        for k in 0..2000 {
            let angle = crate::wrap(10.0 * f64::from(k) * 0.001);
            v = speed.update(&mut state, if k == 1990 { f64::NAN } else { angle });
        }
        // The gap of one sample makes one step of twice the size, forgotten at rate 300/s after 9 samples to (1 + 2.7)
        // exp(-2.7) of it.
        assert!((v - 10.0).abs() < 1.0, "{v}");
    }
}
