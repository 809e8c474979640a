//! Whether residuals are what a perfect model leaves: white, and strangers to the voltage.

use serde::{Deserialize, Serialize};

use crate::answer::null_if_not_finite;

/// Of the normal distribution: 99 % lie within this many standard deviations.
pub const NORMAL_99: f64 = 2.575_829;

/// The autocorrelation of residuals.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Autocorrelation {
    /// At the lags 1, 2, ..., as a share of lag 0.
    pub values: Vec<f64>,
    /// Of white residuals, 99 % of the lags lie within this bound.
    pub bound: f64,
    /// How many lie outside.
    pub outside: usize,
    /// Ljung and Box's statistic over these lags.
    #[serde(with = "null_if_not_finite")]
    pub ljung_box: f64,
    /// Probability of so large a statistic, were the residuals white.
    #[serde(with = "null_if_not_finite")]
    pub p_value: f64,
}

/// The correlation of residuals with the voltage before (positive lags) and after (negative ones: feedback).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CrossCorrelation {
    /// Samples by which the voltage is earlier.
    pub lags: Vec<i64>,
    /// At these, as a correlation coefficient.
    pub values: Vec<f64>,
    /// Of residuals that do not know the voltage, 99 % of the lags lie within this bound.
    #[serde(with = "null_if_not_finite")]
    pub bound: f64,
    /// How many of the lags from 0 on lie outside: what the voltage still explains.
    pub outside: usize,
}

/// Products of `a` at `k` and `b` at `k - lag`, over the number of samples.
fn covariance(a: &[f64], b: &[f64], lag: usize) -> f64 {
    let sum: f64 = a.iter().skip(lag).zip(b).map(|(a, b)| a * b).sum();
    sum / a.len().max(1) as f64
}

fn centred(x: &[f64]) -> Vec<f64> {
    let mean = x.iter().sum::<f64>() / x.len().max(1) as f64;
    x.iter().map(|x| x - mean).collect()
}

/// The whiteness test over `lags` lags.
///
/// `r_k = sum e_t e_(t-k) / sum e_t²`, the bound `2.58 / sqrt(n)`, and `Q = n (n + 2) sum r_k² / (n - k)`, chi² with as
/// many degrees of freedom as there are lags (Ljung and Box, Biometrika 65, 1978).
///
/// ```
/// use furuta_ident::validate::residuals::autocorrelation;
/// // A sign that changes every time remembers itself.
/// let e: Vec<f64> = (0..100).map(|k| if k % 2 == 0 { 1.0 } else { -1.0 }).collect();
/// let test = autocorrelation(&e, 5);
/// assert!((test.values[0] + 0.99).abs() < 1e-12 && test.outside == 5 && test.p_value < 1e-9);
/// ```
#[must_use]
pub fn autocorrelation(residual: &[f64], lags: usize) -> Autocorrelation {
    let e = centred(residual);
    let n = e.len() as f64;
    let lags = lags.min(e.len().saturating_sub(1));
    let own = covariance(&e, &e, 0);
    let values: Vec<f64> = (1..=lags)
        .map(|k| {
            if own > 0.0 {
                covariance(&e, &e, k) / own
            } else {
                0.0
            }
        })
        .collect();
    let bound = NORMAL_99 / n.sqrt();
    let statistic: f64 = values
        .iter()
        .enumerate()
        .map(|(i, r)| r * r / (n - (i + 1) as f64))
        .sum::<f64>()
        * n
        * (n + 2.0);
    Autocorrelation {
        outside: values.iter().filter(|r| r.abs() > bound).count(),
        bound,
        ljung_box: statistic,
        p_value: chi2_above(statistic, lags as f64),
        values,
    }
}

/// The correlation of residuals with what acted before and after them, for lags up to `lags` either way.
///
/// The bound is `2.58 sqrt(P / n) / sqrt(R_e(0) R_u(0))` with `P = sum over all k of R_e(k) R_u(k)` (Ljung, System
/// Identification, 16.6), so that it holds for voltages and residuals that are not white.
///
/// ```
/// use furuta_ident::validate::residuals::cross_correlation;
/// // What is left is the voltage three samples before.
/// let u: Vec<f64> = (0..400).map(|k| f64::from(k * k % 17) - 8.0).collect();
/// let e: Vec<f64> = (0..400).map(|k| if k < 3 { 0.0 } else { u[k - 3] }).collect();
/// let test = cross_correlation(&e, &u, 10);
/// let largest = test.values.iter().zip(&test.lags).max_by(|a, b| a.0.total_cmp(b.0)).expect("lags");
/// assert_eq!(*largest.1, 3);
/// assert!(*largest.0 > 0.95);
/// ```
#[must_use]
pub fn cross_correlation(residual: &[f64], volts: &[f64], lags: usize) -> CrossCorrelation {
    let (e, u) = (centred(residual), centred(volts));
    let n = e.len();
    let lags = lags.min(n.saturating_sub(1));
    let (re, ru) = (covariance(&e, &e, 0), covariance(&u, &u, 0));
    let size = (re * ru).sqrt();
    let over = |x: f64| if size > 0.0 { x / size } else { 0.0 };
    // Correlations beyond a quarter of the run are noise.
    let far = (n / 4).min(10 * lags.max(1));
    let sum: f64 = (1..=far)
        .map(|k| 2.0 * covariance(&e, &e, k) * covariance(&u, &u, k))
        .sum();
    let spread = (re * ru + sum).max(0.1 * re * ru);
    let bound = NORMAL_99 * over((spread / n as f64).sqrt());
    let reach = lags as i64;
    let places: Vec<i64> = (-reach..=reach).collect();
    let values: Vec<f64> = places
        .iter()
        .map(|&lag| {
            let k = lag.unsigned_abs() as usize;
            over(if lag >= 0 {
                covariance(&e, &u, k)
            } else {
                covariance(&u, &e, k)
            })
        })
        .collect();
    CrossCorrelation {
        outside: places
            .iter()
            .zip(&values)
            .filter(|(lag, r)| **lag >= 0 && r.abs() > bound)
            .count(),
        lags: places,
        values,
        bound,
    }
}

/// Probability that chi² with `freedom` degrees of freedom is above `x`: the upper regularised incomplete gamma
/// function `Q(freedom/2, x/2)`.
#[must_use]
pub fn chi2_above(x: f64, freedom: f64) -> f64 {
    if freedom <= 0.0 || !x.is_finite() {
        return f64::NAN;
    }
    let (a, x) = (0.5 * freedom, 0.5 * x);
    if x <= 0.0 {
        return 1.0;
    }
    let front = (a * x.ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 {
        // Series of the lower function.
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        for _ in 0..1000 {
            n += 1.0;
            term *= x / n;
            sum += term;
            if term < 1e-16 * sum {
                break;
            }
        }
        (1.0 - front * sum).clamp(0.0, 1.0)
    } else {
        // Lentz's continued fraction of the upper one.
        const TINY: f64 = 1e-300;
        let mut b = x + 1.0 - a;
        let mut c = 1.0 / TINY;
        let mut d = 1.0 / b;
        let mut h = d;
        for i in 1..1000 {
            let i = f64::from(i);
            let an = -i * (i - a);
            b += 2.0;
            d = 1.0 / or_tiny(an * d + b, TINY);
            c = or_tiny(b + an / c, TINY);
            let by = d * c;
            h *= by;
            if (by - 1.0).abs() < 1e-15 {
                break;
            }
        }
        (front * h).clamp(0.0, 1.0)
    }
}

fn or_tiny(x: f64, tiny: f64) -> f64 {
    if x.abs() < tiny { tiny } else { x }
}

/// Logarithm of the gamma function for a positive argument (Lanczos, g = 7, nine terms: 15 digits).
fn ln_gamma(x: f64) -> f64 {
    const C: [f64; 9] = [
        0.999_999_999_999_809_9,
        676.520_368_121_885_1,
        -1_259.139_216_722_402_8,
        771.323_428_777_653_1,
        -176.615_029_162_140_6,
        12.507_343_278_686_905,
        -0.138_571_095_265_720_12,
        9.984_369_578_019_572e-6,
        1.505_632_735_149_311_6e-7,
    ];
    let x = x - 1.0;
    let t = x + 7.5;
    let sum = C[1..]
        .iter()
        .enumerate()
        .fold(C[0], |s, (i, c)| s + c / (x + (i + 1) as f64));
    0.5 * std::f64::consts::TAU.ln() + (x + 0.5) * t.ln() - t + sum.ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tail_of_chi_squared() {
        // Tables: 5 % points of 1, 10 and 25 degrees of freedom; and a closed form, Q = exp(-x/2) for two.
        for (x, freedom) in [(3.841_459, 1.0), (18.307_038, 10.0), (37.652_484, 25.0)] {
            assert!((chi2_above(x, freedom) - 0.05).abs() < 1e-7, "{freedom}");
        }
        for x in [0.1, 1.0, 5.0, 40.0] {
            assert!((chi2_above(x, 2.0) / (-0.5 * x).exp() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn white_noise_is_white() {
        let noise: Vec<f64> = (0..5000)
            .map(|k| furuta_model::signals::random::normal(3, k))
            .collect();
        let test = autocorrelation(&noise, 25);
        // One lag in a hundred may be outside: of 25, three or more in two of a thousand seeds.
        assert!(test.outside <= 2, "{}", test.outside);
        assert!(test.p_value > 1e-3, "{}", test.p_value);
        let other: Vec<f64> = (0..5000)
            .map(|k| furuta_model::signals::random::normal(4, k))
            .collect();
        assert!(cross_correlation(&noise, &other, 25).outside <= 2);
    }
}
