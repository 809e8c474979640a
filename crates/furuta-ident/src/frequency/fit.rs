//! Transfer functions fitted to measured responses.

use nalgebra::{Complex, DMatrix, DVector};
use std::f64::consts::TAU;

use super::hold::Hold;
use super::least_squares::{Evaluation, Optimum, covariance, minimise};
use super::polynomial;
use super::response::Frf;
use super::start::{Rational, sanathanan_koerner};
use super::transfer::Transfer;

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
/// Standard deviations are those of the response's, carried through the fit to first order, and where the fit leaves more than the noise,
/// enlarged by as much.
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
    /// Sum of the squared residuals in units of their variance over what is expected: 1 where nothing but noise is left.
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

/// Why there is no fit.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// Orders that cannot be.
    #[error(
        "a numerator of order {zeros} over a denominator of order {poles}: the denominator's order is 1 to 12, the numerator's at most {most}"
    )]
    Orders {
        /// Order of the numerator.
        zeros: usize,
        /// Order of the denominator.
        poles: usize,
        /// The highest possible of the numerator.
        most: usize,
    },
    /// Not enough lines.
    #[error(
        "{parameters} coefficients need at least {needed} lines, the response has {lines}: widen the band, ask for a finer resolution, or fit lower orders"
    )]
    TooFewLines {
        /// Parameters.
        parameters: usize,
        /// Lines needed.
        needed: usize,
        /// Lines there are.
        lines: usize,
    },
    /// A response that is no number or 0 somewhere.
    #[error(
        "the response at {frequency} Hz is {value}, its deviation {std}: both must be finite, the response not 0; cut the band"
    )]
    Unusable {
        /// Where, Hz.
        frequency: f64,
        /// The response.
        value: Complex<f64>,
        /// Its deviation.
        std: f64,
    },
    /// A delay that cannot be.
    #[error("delay = {value} s is outside the allowed range [0, {max}] s")]
    DelayOutOfRange {
        /// What was given, s.
        value: f64,
        /// The largest, s.
        max: f64,
    },
    /// The search found nothing.
    #[error(
        "no transfer function of orders {zeros}/{poles} could be fitted: give lower orders or a narrower band"
    )]
    NoConvergence {
        /// Order of the numerator.
        zeros: usize,
        /// Order of the denominator.
        poles: usize,
    },
}

/// Something about a fit that a person should know.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum FitNotice {
    /// A pole in the right half plane.
    Unstable {
        /// The fastest growing one, rad/s.
        pole: Uncertain<Complex<f64>>,
    },
    /// A pole and a zero that cancel within their deviations: the orders are too high.
    Cancels {
        /// The pole, rad/s.
        pole: Complex<f64>,
        /// The zero, rad/s.
        zero: Complex<f64>,
    },
    /// The fit leaves more than the noise.
    MoreThanNoise {
        /// Residuals in units of the noise's variance.
        chi2: f64,
    },
    /// Coefficients that the response does not determine.
    Undetermined {
        /// Parameters.
        parameters: usize,
        /// Those that are determined.
        rank: usize,
    },
}

impl std::fmt::Display for FitNotice {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Unstable { pole } => write!(
                f,
                "the fit is unstable: a pole at {:.4} {:+.4}i rad/s (± {:.2}) in the right half plane; a hanging pendulum is stable: fit lower orders or a narrower band, or, if the rig stood upright, take the response by the joint method",
                pole.value.re, pole.value.im, pole.std.re
            ),
            Self::Cancels { pole, zero } => write!(
                f,
                "the pole {:.4} {:+.4}i and the zero {:.4} {:+.4}i cancel within their deviations: lower orders say the same",
                pole.re, pole.im, zero.re, zero.im
            ),
            Self::MoreThanNoise { chi2 } => write!(
                f,
                "the fit leaves {chi2:.1} times the variance of the noise: higher orders, or something that no linear model has (friction, large swings); standard deviations are enlarged by {:.1}",
                chi2.sqrt()
            ),
            Self::Undetermined { parameters, rank } => write!(
                f,
                "only {rank} of {parameters} coefficients are determined by the response: fit lower orders"
            ),
        }
    }
}

/// A line is believed to no more than this part of itself: responses without any noise would have infinite weight.
const FINEST: f64 = 1e-4;
/// Beyond this many variances the fit is said to leave more than noise.
const MUCH: f64 = 2.0;
/// Times that the images beyond half the sampling rate are computed anew: each is a thousand times smaller than the one before.
const FOLDINGS: usize = 4;

/// Lines to fit, in scaled frequency, the hold and images taken out.
struct Lines {
    /// `j w / unit`.
    s: Vec<Complex<f64>>,
    h: Vec<Complex<f64>>,
    weights: Vec<f64>,
    /// rad/s.
    unit: f64,
}

/// Fits a transfer function to a response: least squares over the complex plane, each line weighted by its deviation, from Levi's start by
/// Sanathanan's and Koerner's iterations to Levenberg's and Marquardt's end.
///
/// Lines without a deviation (0 throughout) are weighted by their size. Behind a hold the function is that of the continuous plant: the hold's
/// factor is divided out, the images beyond half the sampling rate subtracted.
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

impl Lines {
    fn of(frf: &Frf, hold: Hold) -> Self {
        // The geometric middle of the band.
        let logarithms: f64 = frf.frequency.iter().map(|f| f.ln()).sum();
        let unit = TAU * (logarithms / frf.frequency.len() as f64).exp();
        // Real and imaginary part each have half of the squared deviation; neighbours know of one another.
        let share = (0.5 * frf.lines_for_one).sqrt();
        let mut lines = Self {
            s: frf
                .frequency
                .iter()
                .map(|f| Complex::new(0.0, TAU * f / unit))
                .collect(),
            h: frf.response.clone(),
            weights: Vec::new(),
            unit,
        };
        let noiseless = frf.std.iter().all(|s| *s == 0.0);
        for (k, f) in frf.frequency.iter().enumerate() {
            let factor = hold.factor(*f);
            lines.h[k] /= factor;
            let finest = if noiseless { 1.0 } else { FINEST };
            let deviation = (frf.std[k] * share).max(finest * frf.response[k].norm());
            lines.weights.push(factor.norm() / deviation);
        }
        lines
    }

    /// Takes out what this plant beyond half the sampling rate folds into the response.
    fn unfold(&mut self, frf: &Frf, hold: Hold, transfer: &Transfer) {
        for (k, f) in frf.frequency.iter().enumerate() {
            let images = hold.images(*f, |s| transfer.at(s));
            self.h[k] = (frf.response[k] - images) / hold.factor(*f);
        }
    }

    /// Coefficients of numerator, denominator (without its leading 1), and the delay in scaled time where it is fitted.
    fn rational(x: &DVector<f64>, request: &Request) -> (Rational, f64) {
        let split = request.zeros + 1;
        let mut denominator = vec![1.0];
        denominator.extend(x.rows(split, request.poles).iter());
        let rational = Rational {
            numerator: x.rows(0, split).iter().copied().collect(),
            denominator,
        };
        let delay = match request.delay {
            Delay::Known(_) => 0.0,
            Delay::Fitted => x[split + request.poles],
        };
        (rational, delay)
    }

    fn known_delay(&self, request: &Request) -> f64 {
        match request.delay {
            Delay::Known(delay) => delay * self.unit,
            Delay::Fitted => 0.0,
        }
    }

    fn evaluate(&self, x: &DVector<f64>, request: &Request) -> Evaluation {
        let (rational, delay) = Self::rational(x, request);
        // Sought a little below 0 too, or a delay of 0 would be a wall.
        if delay < -1.0 {
            return None;
        }
        let delay = delay + self.known_delay(request);
        let (zeros, poles) = (request.zeros, request.poles);
        let rows = 2 * self.s.len();
        let mut residuals = DVector::zeros(rows);
        let mut jacobian = DMatrix::zeros(rows, x.len());
        for (k, s) in self.s.iter().enumerate() {
            let late = (-s * delay).exp() * self.weights[k];
            let a = polynomial::value(&rational.denominator, *s);
            let plain = polynomial::value(&rational.numerator, *s) / a;
            let g = plain * late;
            let residual = g - self.h[k] * self.weights[k];
            (residuals[2 * k], residuals[2 * k + 1]) = (residual.re, residual.im);
            let mut put = |column: usize, d: Complex<f64>| {
                (jacobian[(2 * k, column)], jacobian[(2 * k + 1, column)]) = (d.re, d.im);
            };
            let mut power = late / a;
            for order in 0..=zeros.max(poles - 1) {
                if order <= zeros {
                    put(zeros - order, power);
                }
                if order < poles {
                    put(zeros + poles - order, -power * plain);
                }
                power *= s;
            }
            if request.delay == Delay::Fitted {
                put(zeros + 1 + poles, -s * g);
            }
        }
        let finite = residuals
            .iter()
            .chain(jacobian.iter())
            .all(|v| v.is_finite());
        finite.then_some((residuals, jacobian))
    }

    fn transfer(&self, x: &DVector<f64>, request: &Request) -> Transfer {
        let (rational, delay) = Self::rational(x, request);
        // B(s/unit)/A(s/unit): coefficient of s^k gets unit^-k, then both get unit^n so that A is monic.
        let n = request.poles as i32;
        let unscale = |c: &[f64]| -> Vec<f64> {
            let degree = c.len() as i32 - 1;
            c.iter()
                .enumerate()
                .map(|(i, c)| c * self.unit.powi(n - degree + i as i32))
                .collect()
        };
        Transfer {
            numerator: unscale(&rational.numerator),
            denominator: unscale(&rational.denominator),
            delay: (delay + self.known_delay(request)) / self.unit,
        }
    }

    fn report(&self, frf: &Frf, request: &Request, found: &Optimum) -> Option<Fit> {
        let transfer = self.transfer(&found.parameters, request);
        let p = parameters(request);
        let (c, rank) = covariance(&found.jacobian);
        // Real and imaginary parts, as many as are independent.
        let count = 2.0 * frf.frequency.len() as f64 / frf.lines_for_one;
        let chi2 = found.sum / (count - p as f64).max(1.0);
        let noiseless = frf.std.iter().all(|s| *s == 0.0);
        let enlarged = if noiseless { chi2 } else { chi2.max(1.0) };
        // To the unscaled coefficients.
        let n = request.poles as i32;
        let scales: Vec<f64> = (0..=request.zeros)
            .map(|i| self.unit.powi(n - (request.zeros - i) as i32))
            .chain((1..=request.poles).map(|i| self.unit.powi(i as i32)))
            .chain((request.delay == Delay::Fitted).then_some(1.0 / self.unit))
            .collect();
        let c = DMatrix::from_fn(p, p, |i, j| enlarged * c[(i, j)] * scales[i] * scales[j]);
        let std = |i: usize| c[(i, i)].max(0.0).sqrt();
        let split = request.zeros + 1;
        let numerator_std: Vec<f64> = (0..split).map(std).collect();
        let mut denominator_std = vec![0.0];
        denominator_std.extend((split..split + request.poles).map(std));
        let delay_std = match request.delay {
            Delay::Known(_) => 0.0,
            Delay::Fitted => std(split + request.poles),
        };
        let poles = uncertain_roots(&transfer.denominator, &c, split, 1)?;
        let zeros = uncertain_roots(&transfer.numerator, &c, 0, 0)?;
        let relative: f64 = (0..self.s.len())
            .map(|k| {
                let model = request.hold.sampled(frf.frequency[k], |s| transfer.at(s));
                (model - frf.response[k]).norm_sqr() / frf.response[k].norm_sqr()
            })
            .sum();
        // Without a known variance, that which is left stands for it.
        let evidence = if noiseless {
            count * (found.sum / count).max(1e-30).ln()
        } else {
            found.sum
        };
        Some(Fit {
            delay: Uncertain {
                value: transfer.delay,
                std: delay_std,
            },
            numerator_std,
            denominator_std,
            poles,
            zeros,
            chi2,
            aic: evidence + 2.0 * p as f64,
            bic: evidence + p as f64 * count.ln(),
            parameters: p,
            rank,
            relative_error: (relative / self.s.len() as f64).sqrt(),
            hold: request.hold,
            transfer,
        })
    }
}

/// Roots of a polynomial with uncertain coefficients; those from `first` on are uncertain, with rows `at` and on of `c`. To first order,
/// `d root / d c_i = -root^(degree - i) / P'(root)`.
fn uncertain_roots(
    coefficients: &[f64],
    c: &DMatrix<f64>,
    at: usize,
    first: usize,
) -> Option<Vec<Uncertain<Complex<f64>>>> {
    let slope = polynomial::derivative(coefficients);
    let degree = coefficients.len() - 1;
    let roots = polynomial::roots(coefficients)?;
    let with_std = |root: Complex<f64>| {
        let p = polynomial::value(&slope, root);
        let gradient: Vec<Complex<f64>> = (first..=degree)
            .map(|i| -root.powi((degree - i) as i32) / p)
            .collect();
        let variance = |part: fn(&Complex<f64>) -> f64| -> f64 {
            let mut sum = 0.0;
            for (i, a) in gradient.iter().enumerate() {
                for (j, b) in gradient.iter().enumerate() {
                    sum += part(a) * part(b) * c[(at + i, at + j)];
                }
            }
            sum.max(0.0).sqrt()
        };
        Uncertain {
            value: root,
            std: Complex::new(variance(|z| z.re), variance(|z| z.im)),
        }
    };
    Some(roots.into_iter().map(with_std).collect())
}

/// The best of several starts: Sanathanan's and Koerner's, the same made stable, and both for several delays where that is sought.
fn search(lines: &Lines, request: &Request) -> Option<Optimum> {
    let fastest = lines.s.last().map_or(1.0, |s| s.im);
    let delays: Vec<f64> = match request.delay {
        Delay::Known(_) => vec![0.0],
        // Up to two turns at the highest frequency.
        Delay::Fitted => [0.0, 0.1, 0.3, 1.0, 3.0, 12.0]
            .map(|turn| turn / fastest)
            .to_vec(),
    };
    let mut best: Option<Optimum> = None;
    for delay in delays {
        let whole = delay + lines.known_delay(request);
        let early: Vec<Complex<f64>> = lines
            .h
            .iter()
            .zip(&lines.s)
            .map(|(h, s)| h * (s * whole).exp())
            .collect();
        let orders = [request.zeros, request.poles];
        let Some(start) = sanathanan_koerner(&lines.s, &early, &lines.weights, orders) else {
            continue;
        };
        let stable = start.reflected();
        for rational in std::iter::once(start).chain(stable) {
            let mut x: Vec<f64> = rational.numerator.clone();
            x.extend(&rational.denominator[1..]);
            if request.delay == Delay::Fitted {
                x.push(delay);
            }
            let found = minimise(DVector::from_vec(x), |x| lines.evaluate(x, request));
            if let Some(found) = found
                && best.as_ref().is_none_or(|b| found.sum < b.sum)
            {
                best = Some(found);
            }
        }
    }
    best
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

    /// What should be known about the fit.
    #[must_use]
    pub fn notices(&self) -> Vec<FitNotice> {
        let mut notices = Vec::new();
        // An integrator's pole lies at 0 give or take its deviation.
        let unstable = |p: &&Uncertain<Complex<f64>>| p.value.re > p.std.re;
        let fastest = self.poles.iter().filter(unstable);
        if let Some(pole) = fastest.max_by(|a, b| a.value.re.total_cmp(&b.value.re)) {
            notices.push(FitNotice::Unstable { pole: *pole });
        }
        for pole in self.poles.iter().filter(|p| p.value.im >= 0.0) {
            let cancels = |zero: &&Uncertain<Complex<f64>>| {
                let spread = pole.std.norm() + zero.std.norm();
                (pole.value - zero.value).norm() < spread
            };
            if let Some(zero) = self.zeros.iter().find(cancels) {
                notices.push(FitNotice::Cancels {
                    pole: pole.value,
                    zero: zero.value,
                });
            }
        }
        if self.chi2 > MUCH {
            notices.push(FitNotice::MoreThanNoise { chi2: self.chi2 });
        }
        if self.rank < self.parameters {
            notices.push(FitNotice::Undetermined {
                parameters: self.parameters,
                rank: self.rank,
            });
        }
        notices
    }
}
