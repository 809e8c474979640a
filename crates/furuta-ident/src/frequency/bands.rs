//! How far a model is from a measured response, band by band.

use nalgebra::Complex;

use super::response::{Frf, decibels};

/// The error of a model within a band.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Band {
    /// Lower end, Hz.
    pub low: f64,
    /// Upper end, Hz.
    pub high: f64,
    /// Lines within.
    pub lines: usize,
    /// RMS error of the magnitude, dB.
    pub magnitude_db: f64,
    /// RMS error of the phase, degrees.
    pub phase_deg: f64,
    /// RMS of the relative error in the complex plane.
    pub relative: f64,
}

/// The errors of `model`, a function of frequency in Hz, between each two of `edges` (Hz, ascending); bands without
/// lines are left out. A line at an edge belongs to the band above it, one at the last edge to the last band.
pub fn errors(frf: &Frf, edges: &[f64], model: impl Fn(f64) -> Complex<f64>) -> Vec<Band> {
    let band = |(i, pair): (usize, &[f64])| {
        let (low, high) = (pair[0], pair[1]);
        let last = i + 2 == edges.len();
        let inside = |f: f64| f >= low && (f < high || last && f <= high * (1.0 + 1e-9));
        let mut sums = [0.0; 3];
        let mut lines = 0;
        for (f, h) in frf.frequency.iter().zip(&frf.response) {
            if inside(*f) {
                let ratio = model(*f) / h;
                sums[0] += decibels(ratio.norm()).powi(2);
                sums[1] += ratio.arg().to_degrees().powi(2);
                sums[2] += (ratio - 1.0).norm_sqr();
                lines += 1;
            }
        }
        let [magnitude_db, phase_deg, relative] = sums.map(|s| (s / lines as f64).sqrt());
        (lines > 0).then_some(Band {
            low,
            high,
            lines,
            magnitude_db,
            phase_deg,
            relative,
        })
    };
    edges.windows(2).enumerate().filter_map(band).collect()
}
