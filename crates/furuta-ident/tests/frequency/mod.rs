//! Identification in the frequency domain, against systems whose response is known.

mod bad_input;
mod compare;
mod fit;
mod local;
mod response;

use furuta_model::signals::random::normal;
use nalgebra::Complex;
use std::f64::consts::TAU;

/// White noise of variance 1.
fn white(seed: u64, n: usize) -> Vec<f64> {
    (0..n as u64).map(|k| normal(seed, k)).collect()
}

/// A second-order filter `y[k] = -a1 y[k-1] - a2 y[k-2] + b1 u[k-1] + b2 u[k-2]`: a resonance at 0.08 of the sampling
/// rate.
const A: [f64; 2] = [-1.6, 0.8];
const B: [f64; 2] = [0.3, 0.1];

fn filtered(u: &[f64]) -> Vec<f64> {
    let mut y = vec![0.0; u.len()];
    for k in 2..u.len() {
        y[k] = -A[0] * y[k - 1] - A[1] * y[k - 2] + B[0] * u[k - 1] + B[1] * u[k - 2];
    }
    y
}

/// The filter's response at a frequency, samples `h` apart.
fn exact(frequency: f64, h: f64) -> Complex<f64> {
    let q = Complex::from_polar(1.0, -TAU * frequency * h);
    (q * B[0] + q * q * B[1]) / (q * A[0] + q * q * A[1] + 1.0)
}
