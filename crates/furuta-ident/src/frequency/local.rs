//! Response and transient together: the local rational method.
//!
//! A record that does not begin and end at rest, and whose input does not repeat, leaks: `Y = G U + T + noise`, where
//! `T`, the transient of both ends, is as smooth in frequency as `G`. About each line of the answer,
//!
//! ```text
//! (1 + d r) Y = (g0 + g1 r + g2 r² + g3 r³) U + (t0 + t1 r + t2 r² + t3 r³) + noise,   r = (f - f0) / resolution
//! ```
//!
//! is solved by least squares over the spectrum's lines within one resolution of `f0`; `g0` is the response. What is
//! left tells the noise's variance, with as many degrees of freedom as there are lines beyond the nine unknowns; the
//! variance is averaged over neighbours. The denominator's `d` follows a resonance that is narrower than the lines are
//! apart.
//!
//! Source: R. Pintelon, J. Schoukens, *System Identification: A Frequency Domain Approach*, 2nd ed., Wiley 2012,
//! chapter 7; T. McKelvey, G. Guérin, *Non-parametric frequency response estimation using a local rational model*, IFAC
//! Proceedings 45 (2012) 49.

use nalgebra::Complex;
use realfft::RealFftPlanner;

use super::error::{FrequencyError, FrequencyNotice};
use super::response::{self, Frf};
use super::spectra::{self, Settings, Stretch};

type Spectrum = Vec<Complex<f64>>;

/// Coefficients of each local polynomial. Three are enough for a resonance three times as wide as the lines are apart,
/// four for one as wide as they (`furuta study frequency-coverage`).
const TERMS: usize = 4;
/// Fewer degrees of freedom than this in a window and the noise's variance is hardly known: the weights of a fit then
/// scatter by more than their size.
const LEAST_FREEDOM: usize = 4;
/// Degrees of freedom of the noise's variance, averaged over a line and its two neighbours, over those of one. A fit
/// whose weights are that average has the variance that it states within 3 %, with 4 to 50 degrees of freedom; with
/// single weights its true variance is 1.6 to 1.0 times as large (300 records of white noise each).
const POOLED: f64 = 2.0;
/// Of a column, what must be left once the columns before it are taken out: less is rounding.
const DISTINCT: f64 = 1e-9;

/// The response of stretches of a recording at lines `resolution` (Hz) apart, those within `band` (Hz) alone if one is
/// given, and what should be known about it.
///
/// Stretches share the response, each has a transient of its own. With an external signal, the responses from it to the
/// input and to the output are estimated with one denominator, and their quotient is given: right in closed loop too.
///
/// ```
/// use furuta_ident::frequency::{Stretch, local};
/// use nalgebra::Complex;
/// use std::f64::consts::TAU;
/// // y[k+1] = 0.9 y[k] + u[k], which does not begin at rest, without noise.
/// let u: Vec<f64> = (0..2000).map(|k| (f64::from(k * k) * 0.7).sin()).collect();
/// let mut y = vec![5.0; 2000];
/// for k in 0..1999 {
///     y[k + 1] = 0.9 * y[k] + u[k];
/// }
/// let (frf, _) = local::response(&[Stretch { u: &u, y: &y, r: None }], 0.01, 0.5, Some([2.0, 10.0]))?;
/// for (f, h) in frf.frequency.iter().zip(&frf.response) {
///     let exact = (Complex::from_polar(1.0, TAU * f * 0.01) - 0.9).inv();
///     assert!((h - exact).norm() < 1e-4 * exact.norm());
/// }
/// # Ok::<(), furuta_ident::frequency::FrequencyError>(())
/// ```
///
/// # Errors
/// As [`Spectra::of`](super::Spectra::of); recordings that are too short for the resolution, a band in which nothing is
/// excited.
pub fn response(
    stretches: &[Stretch<'_>],
    sample_period: f64,
    resolution: f64,
    band: Option<[f64; 2]>,
) -> Result<(Frf, Vec<FrequencyNotice>), FrequencyError> {
    spectra::check(stretches, sample_period, &Settings::new(8))?;
    let nyquist = 0.5 / sample_period;
    if !(resolution > 0.0 && resolution < nyquist) {
        return Err(FrequencyError::Resolution {
            value: resolution,
            highest: nyquist,
        });
    }
    let (parts, unused) = parts(stretches, sample_period, resolution)?;
    let [low, high] = band.unwrap_or([0.0, nyquist]);
    // A line at the very end counts, whatever its last bit.
    let inside = |f: &f64| *f >= low * (1.0 - 1e-9) && *f <= high * (1.0 + 1e-9);
    let frequencies = (1..)
        .map(|j| f64::from(j) * resolution)
        .take_while(|f| f + resolution <= nyquist)
        .filter(inside)
        .collect::<Vec<f64>>();
    let mut frf = Frf {
        frequency: Vec::new(),
        response: Vec::new(),
        coherence: Vec::new(),
        std: Vec::new(),
        distortion: Vec::new(),
        averages: f64::INFINITY,
        lines_for_one: 1.0,
        sample_period,
        method: "local rational method".to_owned(),
    };
    let loudest = parts
        .iter()
        .flat_map(|p| p.r.as_ref().unwrap_or(&p.u))
        .map(Complex::norm_sqr)
        .fold(0.0, f64::max);
    let lines: Vec<(f64, Line)> = frequencies
        .iter()
        .filter_map(|f| Some((*f, line(&parts, *f, resolution, loudest)?)))
        .collect();
    for (k, (f, line)) in lines.iter().enumerate() {
        let beside = &lines[k.saturating_sub(1)..(k + 2).min(lines.len())];
        let noise = beside.iter().map(|(_, l)| l.noise).sum::<f64>() / beside.len() as f64;
        let variance = noise * line.per_noise;
        // Windows overlap by half: three of them hold twice the lines of one.
        let freedom = POOLED * line.freedom;
        frf.frequency.push(*f);
        frf.response.push(line.response);
        frf.std.push(variance.sqrt());
        // What stands to the deviation as in H1.
        let explained = line.response.norm_sqr();
        frf.coherence
            .push(explained / (explained + freedom * variance));
        frf.averages = frf.averages.min(freedom + 1.0);
    }
    frf.lines_for_one = lines_for_one(&lines);
    if frequencies.is_empty() {
        return Err(FrequencyError::EmptyBand {
            low,
            high,
            resolution,
            highest: nyquist - resolution,
        });
    }
    if frf.frequency.is_empty() {
        return Err(FrequencyError::NotExcited {
            low,
            high,
            resolution,
        });
    }
    let mut notices = Vec::new();
    if stretches.len() > 1 && unused > 0 {
        notices.push(FrequencyNotice::Gaps {
            stretches: stretches.len(),
            unused,
        });
    }
    notices.extend(response::few(&frf));
    let power = |from: f64| -> f64 {
        let lines = |p: &Part| {
            let first = (from / p.spacing).ceil().max(1.0) as usize;
            p.y.iter().skip(first).map(|y| y.norm_sqr()).sum::<f64>()
        };
        parts.iter().map(lines).sum()
    };
    notices.extend(response::aliasing(power, sample_period));
    Ok((frf, notices))
}

/// The spectra of one stretch, scaled so that noise is equally large in all.
struct Part {
    /// Distance of its lines, Hz.
    spacing: f64,
    u: Spectrum,
    y: Spectrum,
    r: Option<Spectrum>,
}

/// The spectra of stretches that are long enough, and how many are not.
fn parts(
    stretches: &[Stretch<'_>],
    sample_period: f64,
    resolution: f64,
) -> Result<(Vec<Part>, usize), FrequencyError> {
    let length = |s: &Stretch<'_>| s.u.len() as f64 * sample_period;
    // Lines within one resolution on either side, less the transient's unknowns.
    let spare = |s: &Stretch<'_>| (2.0 * resolution * length(s) + 1e-6).floor() - TERMS as f64;
    let needed = (TERMS + 1 + LEAST_FREEDOM) as f64;
    let (kept, dropped): (Vec<_>, Vec<_>) = stretches.iter().copied().partition(|s| spare(s) > 0.0);
    if kept.iter().map(spare).sum::<f64>() < needed {
        let longest = stretches.iter().map(length).fold(0.0, f64::max);
        let lines = needed + TERMS as f64;
        return Err(FrequencyError::TooShort {
            resolution,
            needed: lines / (2.0 * resolution),
            longest,
            possible: lines / (2.0 * longest),
        });
    }
    let mut planner = RealFftPlanner::<f64>::new();
    let mut transform = |signal: &[f64]| {
        let n = signal.len();
        let fft = planner.plan_fft_forward(n);
        let (mut out, mean) = (fft.make_output_vec(), signal.iter().sum::<f64>() / n as f64);
        let mut time: Vec<f64> = signal
            .iter()
            .map(|x| (x - mean) / (n as f64).sqrt())
            .collect();
        // It fails on wrong lengths alone, and these are its own.
        let _ = fft.process(&mut time, &mut out);
        out
    };
    let parts = kept.into_iter().map(|s| Part {
        spacing: 1.0 / length(&s),
        u: transform(s.u),
        y: transform(s.y),
        r: s.r.map(&mut transform),
    });
    Ok((parts.collect(), dropped.len()))
}

struct Line {
    response: Complex<f64>,
    /// Variance of the noise in a line of the spectrum.
    noise: f64,
    /// Variance of the response over that.
    per_noise: f64,
    freedom: f64,
    /// Which lines of which part it is from, and with what weight noise there gets into the response.
    places: Vec<(usize, usize)>,
    weights: Spectrum,
}

/// Neighbours share half of their lines: what the mean response knows more, or less, than if they were independent,
/// `1 + 2 rho`. Of local polynomials of order 3 or 4 alone, `rho` is -0.02 and -0.09.
fn lines_for_one(lines: &[(f64, Line)]) -> f64 {
    let correlation = |pair: &[(f64, Line)]| {
        let (a, b) = (&pair[0].1, &pair[1].1);
        let mut beside = b.places.iter().zip(&b.weights).peekable();
        let mut shared = Complex::new(0.0, 0.0);
        // Places ascend in both.
        for (place, weight) in a.places.iter().zip(&a.weights) {
            while beside.next_if(|(other, _)| *other < place).is_some() {}
            if let Some((_, other)) = beside.next_if(|(other, _)| *other == place) {
                shared += weight.conj() * other;
            }
        }
        shared.re / (square(&a.weights) * square(&b.weights)).sqrt()
    };
    let count = lines.len().saturating_sub(1).max(1) as f64;
    1.0 + 2.0 * lines.windows(2).map(correlation).sum::<f64>() / count
}

fn dot(a: &[Complex<f64>], b: &[Complex<f64>]) -> Complex<f64> {
    a.iter().zip(b).map(|(a, b)| a.conj() * b).sum()
}

fn square(a: &[Complex<f64>]) -> f64 {
    a.iter().map(Complex::norm_sqr).sum()
}

/// Orthonormal columns.
struct Basis(Vec<Spectrum>);

impl Basis {
    /// What the columns leave of a vector; taken out twice, for the sake of rounding.
    fn rest(&self, mut v: Spectrum) -> Spectrum {
        for _ in 0..2 {
            for column in &self.0 {
                let part = dot(column, &v);
                v.iter_mut().zip(column).for_each(|(v, c)| *v -= part * c);
            }
        }
        v
    }

    /// The same, of a vector that must be new; `None` where it is not.
    fn new_part(&self, v: Spectrum) -> Option<Spectrum> {
        let before = square(&v);
        let rest = self.rest(v);
        (square(&rest) > DISTINCT * DISTINCT * before).then_some(rest)
    }

    fn push(&mut self, v: Spectrum) -> Option<()> {
        let mut rest = self.new_part(v)?;
        let size = square(&rest).sqrt();
        rest.iter_mut().for_each(|x| *x /= size);
        self.0.push(rest);
        Some(())
    }
}

/// A signal in the local model, once all but `g0` is taken out of it.
struct Signal {
    /// Response to the exciting signal without the denominator, and what the denominator's `d` adds to it.
    response: [Complex<f64>; 2],
    /// What is left without the denominator, and what `d` adds to that.
    rest: [Spectrum; 2],
}

impl Signal {
    fn of(z: Spectrum, r: &[f64], basis: &Basis, input: &[Complex<f64>]) -> Self {
        let turned = z.iter().zip(r).map(|(z, r)| z * r).collect();
        let power = square(input);
        let mut response = [Complex::new(0.0, 0.0); 2];
        let part = |v: Spectrum, g: &mut Complex<f64>| {
            let mut v = basis.rest(v);
            *g = dot(input, &v) / power;
            v.iter_mut().zip(input).for_each(|(v, u)| *v -= *g * u);
            v
        };
        let [first, second] = &mut response;
        let rest = [part(z, first), part(turned, second)];
        Self { response, rest }
    }

    fn at(&self, d: Complex<f64>) -> (Complex<f64>, Spectrum) {
        let [plain, more] = &self.rest;
        let rest = plain.iter().zip(more).map(|(a, b)| a + d * b).collect();
        (self.response[0] + d * self.response[1], rest)
    }
}

/// The response at one frequency; `None` where the input does not excite it. `loudest` is the largest power of a line
/// of the exciting signal.
fn line(parts: &[Part], f0: f64, resolution: f64, loudest: f64) -> Option<Line> {
    // Which lines of which part.
    let mut places = Vec::new();
    for (p, part) in parts.iter().enumerate() {
        let first = ((f0 - resolution) / part.spacing - 1e-6).ceil().max(1.0) as usize;
        let last = ((f0 + resolution) / part.spacing + 1e-6).floor() as usize;
        places.extend((first..=last.min(part.y.len() - 1)).map(|k| (p, k)));
    }
    let r: Vec<f64> = places
        .iter()
        .map(|(p, k)| (*k as f64 * parts[*p].spacing - f0) / resolution)
        .collect();
    let freedom = places.len().checked_sub(TERMS * (parts.len() + 1) + 1)?;
    if freedom == 0 {
        return None;
    }
    let take = |signal: &dyn Fn(&Part) -> &Spectrum| -> Spectrum {
        places.iter().map(|(p, k)| signal(&parts[*p])[*k]).collect()
    };
    let joint = parts.iter().all(|p| p.r.is_some());
    let exciting = take(&|p| p.r.as_ref().unwrap_or(&p.u));
    let mut basis = Basis(Vec::with_capacity(TERMS * (parts.len() + 1)));
    for p in 0..parts.len() {
        for power in 0..TERMS {
            let own = places.iter().zip(&r).map(|((q, _), r)| {
                let value = if *q == p { r.powi(power as i32) } else { 0.0 };
                Complex::new(value, 0.0)
            });
            basis.push(own.collect())?;
        }
    }
    for power in (1..TERMS).rev() {
        let column = exciting
            .iter()
            .zip(&r)
            .map(|(x, r)| x * r.powi(power as i32));
        basis.push(column.collect())?;
    }
    let input = basis.new_part(exciting)?;
    // What is less than that is the transform's rounding.
    if square(&input) <= DISTINCT * DISTINCT * loudest {
        return None;
    }
    let signal = |z| Signal::of(z, &r, &basis, &input);
    let mut signals = vec![signal(take(&|p| &p.y))];
    if joint {
        signals.push(signal(take(&|p| &p.u)));
    }
    // The denominator: each signal with the weight of its own size.
    let weight = |s: &Signal| 1.0 / square(&s.rest[0]).max(f64::MIN_POSITIVE);
    let curvature: f64 = signals.iter().map(|s| weight(s) * square(&s.rest[1])).sum();
    let slope: Complex<f64> = signals
        .iter()
        .map(|s| weight(s) * dot(&s.rest[1], &s.rest[0]))
        .sum();
    let d = if curvature > 0.0 {
        -slope / curvature
    } else {
        slope
    };
    let freedom = freedom as f64;
    let (mut response, mut rest) = signals[0].at(d);
    let mut by_denominator = signals[0].response[1];
    let mut gain = 1.0;
    if let Some(input) = signals.get(1) {
        let (to_input, left) = input.at(d);
        response /= to_input;
        rest.iter_mut()
            .zip(&left)
            .for_each(|(y, u)| *y -= response * u);
        by_denominator -= response * input.response[1];
        gain = to_input.norm_sqr();
    }
    // The variance of `d`: of each signal's part in it.
    let spread: f64 = signals
        .iter()
        .map(|s| weight(s).powi(2) * square(&s.rest[1]) * square(&s.at(d).1))
        .sum();
    let left = square(&rest);
    let spread = if curvature > 0.0 && left > 0.0 {
        spread / (left * curvature.powi(2))
    } else {
        0.0
    };
    let power = square(&signals[0].rest[1]);
    let by_d = if power > 0.0 {
        by_denominator.conj() / power
    } else {
        0.0.into()
    };
    let size = square(&input);
    let turned = &signals[0].rest[1];
    let weights = input
        .iter()
        .zip(turned)
        .map(|(u, t)| u / size - by_d * t)
        .collect();
    let per_noise = (1.0 / square(&input) + by_denominator.norm_sqr() * spread) / gain;
    (response.norm().is_finite() && per_noise.is_finite()).then_some(Line {
        response,
        noise: left / freedom,
        per_noise,
        freedom,
        places,
        weights,
    })
}
