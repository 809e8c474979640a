//! Transfer functions fitted to measured responses.

mod error;
mod lines;
mod notice;
mod uncertainty;

use nalgebra::Complex;

use super::hold::Hold;
use super::least_squares::minimise;
use super::response::Frf;
use super::transfer::Transfer;
pub use error::FitError;
use lines::{Lines, search};
pub use notice::FitNotice;

/// What is to be fitted.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Request {
    /// Order of the numerator, at most that of the denominator (below it, behind a hold).
    pub zeros: usize,
    /// Order of the denominator, 1 to 12.
    pub poles: usize,
    /// What stands between the plant and the response.
    pub hold: Hold,
    /// The delay beyond the hold's own.
    pub delay: Delay,
}

/// What is known of a delay.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Delay {
    /// It is so long, s.
    Known(f64),
    /// It is fitted too.
    Fitted,
}

/// A number with its standard deviation.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Uncertain<T> {
    /// The estimate.
    pub value: T,
    /// Its standard deviation; of a root, of real and imaginary part.
    pub std: T,
}

/// A fitted transfer function, and how sure it is.
///
/// Standard deviations are those of the response's, carried through the fit to first order, and where the fit leaves
/// more than the noise, enlarged by as much. Where the response tells nonlinear distortion from noise
/// ([`Frf::distortion`]), they are widened by what distortion of that size can do at most.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// The function.
    pub transfer: Transfer,
    /// Standard deviations of the numerator's coefficients.
    pub numerator_std: Vec<f64>,
    /// Those of the denominator's; 0 for its first.
    pub denominator_std: Vec<f64>,
    /// The delay, s.
    pub delay: Uncertain<f64>,
    /// Poles, slow ones first, rad/s.
    pub poles: Vec<Uncertain<Complex<f64>>>,
    /// Zeros, rad/s.
    pub zeros: Vec<Uncertain<Complex<f64>>>,
    /// Sum of the squared residuals in units of their variance over what is expected: 1 where nothing but noise is
    /// left.
    pub chi2: f64,
    /// Akaike's criterion, lower is better: chi² + 2 p.
    pub aic: f64,
    /// Schwarz's (BIC): chi² + p ln N.
    pub bic: f64,
    /// Parameters fitted.
    pub parameters: usize,
    /// Directions among them that the response determines.
    pub rank: usize,
    /// RMS of the relative error over the lines, `|G - H| / |H|`.
    pub relative_error: f64,
    /// What stands between the function and the response.
    pub hold: Hold,
}

/// Times that the images beyond half the sampling rate are computed anew: each is a thousand times smaller than the one
/// before.
const FOLDINGS: usize = 4;

/// Fits a transfer function to a response: least squares over the complex plane, each line weighted by its deviation,
/// from Levi's start by Sanathanan's and Koerner's iterations to Levenberg's and Marquardt's end.
///
/// Lines without a deviation (0 throughout) are weighted by their size. Behind a hold the function is that of the
/// continuous plant: the hold's factor is divided out, the images beyond half the sampling rate subtracted.
///
/// ```
/// use furuta_ident::frequency::fit::{Delay, Request, fit};
/// use furuta_ident::frequency::{Frf, hold::Hold, transfer::Transfer};
/// let truth = Transfer::new(&[2.0, 1.0], &[1.0, 0.8, 9.0])?;
/// let frequency: Vec<f64> = (1..60).map(|k| 0.05 * f64::from(k)).collect();
/// let frf = Frf::exact(&frequency, |f| truth.response(f));
/// let found = fit(&frf, &Request { zeros: 1, poles: 2, hold: Hold::None, delay: Delay::Known(0.0) })?;
/// assert!((found.transfer.denominator[2] - 9.0).abs() < 1e-9);
/// assert!(found.notices().is_empty());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// Orders that cannot be, fewer lines than coefficients, lines that are no numbers, no convergence.
pub fn fit(frf: &Frf, request: &Request) -> Result<Fit, FitError> {
    check(frf, request)?;
    let mut lines = Lines::of(frf, request.hold);
    let mut found = search(&lines, request).ok_or(FitError::NoConvergence {
        zeros: request.zeros,
        poles: request.poles,
    })?;
    for _ in 0..FOLDINGS {
        if request.hold == Hold::None {
            break;
        }
        let transfer = lines.transfer(&found.parameters, request);
        lines.unfold(frf, request.hold, &transfer);
        let start = found.parameters.clone();
        let Some(again) = minimise(start, |x| lines.evaluate(x, request)) else {
            break;
        };
        found = again;
    }
    lines
        .report(frf, request, &found)
        .ok_or(FitError::NoConvergence {
            zeros: request.zeros,
            poles: request.poles,
        })
}

fn check(frf: &Frf, request: &Request) -> Result<(), FitError> {
    let Request { zeros, poles, .. } = *request;
    let most = match request.hold {
        Hold::None => poles,
        // What jumps with the command has no value where the command jumps.
        Hold::ZeroOrder(_) => poles.saturating_sub(1),
    };
    if !(1..=12).contains(&poles) || zeros > most {
        return Err(FitError::Orders { zeros, poles, most });
    }
    let parameters = parameters(request);
    let needed = parameters.div_ceil(2) + 1;
    if frf.frequency.len() < needed {
        return Err(FitError::TooFewLines {
            parameters,
            needed,
            lines: frf.frequency.len(),
        });
    }
    let usable = |k: &usize| {
        let (f, h, std) = (frf.frequency[*k], frf.response[*k], frf.std[*k]);
        f > 0.0
            && f.is_finite()
            && h.norm() > 0.0
            && h.norm().is_finite()
            && std >= 0.0
            && std.is_finite()
    };
    if let Some(k) = (0..frf.frequency.len()).find(|k| !usable(k)) {
        return Err(FitError::Unusable {
            frequency: frf.frequency[k],
            value: frf.response[k],
            std: frf.std[k],
        });
    }
    if let Delay::Known(value) = request.delay {
        let max = 10.0;
        if !(0.0..=max).contains(&value) {
            return Err(FitError::DelayOutOfRange { value, max });
        }
    }
    Ok(())
}

fn parameters(request: &Request) -> usize {
    request.zeros + 1 + request.poles + usize::from(request.delay == Delay::Fitted)
}

impl Fit {
    /// Whether all poles lie in the left half plane.
    #[must_use]
    pub fn is_stable(&self) -> bool {
        self.poles.iter().all(|p| p.value.re < 0.0)
    }

    /// The response that the fit predicts at a frequency (Hz), hold included.
    #[must_use]
    pub fn response(&self, frequency: f64) -> Complex<f64> {
        self.hold.sampled(frequency, |s| self.transfer.at(s))
    }
}
