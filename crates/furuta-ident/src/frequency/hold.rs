//! Between a continuous plant and what samples show of it.

use nalgebra::Complex;
use std::f64::consts::TAU;

/// What stands between a continuous transfer function and a measured response.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub enum Hold {
    /// Nothing: the response is that of the continuous plant, as a table or an analogue instrument gives it.
    #[default]
    None,
    /// The command is held from one sample to the next, the output read where the command is about to change, samples
    /// this many seconds apart.
    ZeroOrder(f64),
}

/// Images on either side that are summed one by one; the rest is extrapolated.
const IMAGES: i32 = 60;

impl Hold {
    /// What the hold alone does to a sine: `(1 - e^(-j w h)) / (j w h)`.
    #[must_use]
    pub fn factor(self, frequency: f64) -> Complex<f64> {
        match self {
            Self::None => Complex::new(1.0, 0.0),
            Self::ZeroOrder(h) => {
                // e^(-j w h / 2) sin(w h / 2) / (w h / 2)
                let half = 0.5 * TAU * frequency * h;
                let size = if half == 0.0 { 1.0 } else { half.sin() / half };
                Complex::from_polar(size, -half)
            }
        }
    }

    /// What sampling adds: the plant's response beyond half the sampling rate, folded down. `G_d = factor G + images`.
    pub fn images(
        self,
        frequency: f64,
        plant: impl Fn(Complex<f64>) -> Complex<f64>,
    ) -> Complex<f64> {
        let Self::ZeroOrder(h) = self else {
            return Complex::new(0.0, 0.0);
        };
        let edge = (Complex::new(1.0, 0.0) - Complex::from_polar(1.0, -TAU * frequency * h)) / h;
        let image = |k: i32| {
            let s = Complex::new(0.0, TAU * (frequency + f64::from(k) / h));
            plant(s) / s
        };
        // Pair by pair, so that a gain that falls slowly still sums up.
        let pair = |k: i32| image(k) + image(-k);
        let sum: Complex<f64> = (1..=IMAGES).rev().map(pair).sum();
        // The pairs fall like a power of their number, the second with one pole more than zeros: their tail is an
        // integral.
        let (half, last) = (pair(IMAGES / 2), pair(IMAGES));
        let power = (half.norm() / last.norm()).log2();
        if !(1.5..60.0).contains(&power) {
            return edge * sum;
        }
        let n = f64::from(IMAGES);
        let tail = last * ((n / (n + 0.5)).powf(power) * (n + 0.5) / (power - 1.0));
        edge * (sum + tail)
    }

    /// The sampled plant's response.
    pub fn sampled(
        self,
        frequency: f64,
        plant: impl Fn(Complex<f64>) -> Complex<f64>,
    ) -> Complex<f64> {
        let s = Complex::new(0.0, TAU * frequency);
        plant(s) * self.factor(frequency) + self.images(frequency, plant)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sampling_an_integrator_and_a_lag() {
        // 5 / (s + 5) held: (1 - e^(-5 h)) / (z - e^(-5 h)).
        let h = 0.01_f64;
        for frequency in [0.1, 3.0, 20.0, 45.0] {
            let z = Complex::from_polar(1.0, TAU * frequency * h);
            let a = (-5.0 * h).exp();
            let exact = (1.0 - a) / (z - a);
            let found = Hold::ZeroOrder(h).sampled(frequency, |s| 5.0 / (s + 5.0));
            // One pole more than zeros: without the extrapolated tail the images would leave 1e-3.
            assert!(
                (found - exact).norm() < 1e-5 * exact.norm(),
                "{frequency}: {found} {exact}"
            );
            // A double integrator: h^2/2 (z + 1) / (z - 1)^2.
            let exact = 0.5 * h * h * (z + 1.0) / ((z - 1.0) * (z - 1.0));
            let found = Hold::ZeroOrder(h).sampled(frequency, |s| 1.0 / (s * s));
            assert!(
                (found - exact).norm() < 1e-5 * exact.norm(),
                "{frequency}: {found} {exact}"
            );
        }
    }
}
