//! Responses and fits in words and tables.

use nalgebra::Complex;

use super::fit::Uncertain;
use super::response::decibels;
use super::transfer::polynomial_text;
use super::{Fit, FrequencyError, Frf};
use crate::answer::significant;

/// Lines shown; all of them are in [`csv`].
const SHOWN: usize = 24;

/// A response as a table: how it was measured, and some two dozen of its lines, evenly in the logarithm. `what` it is
/// of: `alpha / u`.
///
/// # Errors
/// As [`Frf::confidence`].
pub fn response_text(what: &str, frf: &Frf) -> Result<String, FrequencyError> {
    let mut text = format!(
        "{what}: {}, {} independent averages, {} lines {} Hz apart\n",
        frf.method,
        significant(frf.averages, 3),
        frf.frequency.len(),
        significant(frf.resolution(), 4)
    );
    text += "        Hz   magnitude        dB     phase  coherence  95 % within\n";
    // The unit of the usual columns; others have whatever was recorded.
    let unit = match what {
        "theta / u" | "alpha / u" => "rad/V",
        "theta_dot / u" | "alpha_dot / u" => "rad/s/V",
        _ => "",
    };
    text += &format!("{unit:>19}                   deg                        %\n");
    let (db, phase) = (frf.magnitude_db(), frf.phase_degrees());
    let radius = frf.confidence(0.95)?;
    let mut last = 0.0;
    let (low, high) = match (frf.frequency.first(), frf.frequency.last()) {
        (Some(low), Some(high)) => (*low, *high),
        _ => (1.0, 1.0),
    };
    // Evenly in the logarithm, as a Bode plot is read.
    let step = (high / low).powf(1.0 / SHOWN as f64);
    for k in 0..frf.frequency.len() {
        if frf.frequency[k] < last * step * (1.0 - 1e-9) {
            continue;
        }
        last = frf.frequency[k];
        let magnitude = frf.response[k].norm();
        text += &format!(
            "  {:>8} {:>11} {:>9.2} {:>9.1} {:>10.4} {:>12.2}\n",
            significant(frf.frequency[k], 4),
            significant(magnitude, 4),
            db[k],
            phase[k],
            frf.coherence[k],
            100.0 * radius[k] / magnitude
        );
    }
    Ok(text)
}

/// A fitted function in words: coefficients, poles and zeros with their deviations, how well it fits.
#[must_use]
pub fn fit_text(fit: &Fit) -> String {
    let g = &fit.transfer;
    let mut text = format!(
        "  G(s) = ({}) / ({})",
        polynomial_text(&g.numerator, 4),
        polynomial_text(&g.denominator, 4)
    );
    if g.delay != 0.0 {
        text += &format!(" e^(-{} s)", significant(g.delay, 3));
    }
    text += "\n";
    let coefficient = |name: &str, c: &[f64], std: &[f64]| -> String {
        let degree = c.len() - 1;
        c.iter()
            .zip(std)
            .enumerate()
            .filter(|(i, _)| name == "b" || *i > 0)
            .map(|(i, (c, std))| {
                format!(
                    "  {name}{}   {:>12} ± {}\n",
                    degree - i,
                    significant(*c, 5),
                    significant(*std, 2)
                )
            })
            .collect()
    };
    text += "  (± one standard deviation)\n";
    text += &coefficient("b", &g.numerator, &fit.numerator_std);
    text += &coefficient("a", &g.denominator, &fit.denominator_std);
    if fit.delay.std > 0.0 {
        text += &format!(
            "  delay {:>11} ± {} ms\n",
            significant(1e3 * fit.delay.value, 4),
            significant(1e3 * fit.delay.std, 2)
        );
    }
    text += &format!("  poles  {} rad/s\n", roots(&fit.poles));
    text += &format!("  zeros  {} rad/s\n", roots(&fit.zeros));
    text += &format!(
        "  chi2 {:.2} (1: nothing but noise is left), RMS of the relative error {:.2} %, AIC {:.1}, BIC {:.1}\n",
        fit.chi2,
        100.0 * fit.relative_error,
        fit.aic,
        fit.bic
    );
    text
}

/// `-0.69 (± 0.02) ± 7.36 (± 0.02) i`, pairs once.
#[must_use]
pub fn roots(roots: &[Uncertain<Complex<f64>>]) -> String {
    let number = |x: f64, std: f64| format!("{} (± {})", significant(x, 4), significant(std, 2));
    let texts: Vec<String> = roots
        .iter()
        .filter(|r| r.value.im >= 0.0)
        .map(|r| {
            let re = number(r.value.re, r.std.re);
            if r.value.im > 0.0 {
                format!("{re} ± {} i", number(r.value.im, r.std.im))
            } else {
                re
            }
        })
        .collect();
    if texts.is_empty() {
        "none".to_owned()
    } else {
        texts.join(",  ")
    }
}

/// A measured response as CSV, a line each, models over it beside it.
///
/// ```
/// use furuta_ident::frequency::{Frf, Transfer, words::csv};
/// let g = Transfer::new(&[1.0], &[1.0, 1.0])?;
/// let frf = Frf::exact(&[0.5, 1.0], |f| g.response(f));
/// let text = csv(&frf, &[("fit", &frf.response)]);
/// let header = "frequency,real,imaginary,magnitude_db,phase_deg,coherence,std,fit_real,fit_imaginary";
/// assert_eq!(text.lines().next(), Some(header));
/// assert_eq!(text.lines().count(), 3);
/// # Ok::<(), furuta_ident::frequency::transfer::TransferError>(())
/// ```
#[must_use]
pub fn csv(frf: &Frf, models: &[(&str, &[Complex<f64>])]) -> String {
    let mut text = String::from("frequency,real,imaginary,magnitude_db,phase_deg,coherence,std");
    for (name, _) in models {
        text += &format!(",{name}_real,{name}_imaginary");
    }
    text += "\n";
    let phase = frf.phase_degrees();
    for (k, h) in frf.response.iter().enumerate() {
        text += &format!(
            "{},{},{},{},{},{},{}",
            frf.frequency[k],
            h.re,
            h.im,
            decibels(h.norm()),
            phase[k],
            frf.coherence[k],
            frf.std[k]
        );
        for g in models.iter().filter_map(|(_, curve)| curve.get(k)) {
            text += &format!(",{},{}", g.re, g.im);
        }
        text += "\n";
    }
    text
}
