//! Polynomials with real coefficients, by falling power as control people write them.

use nalgebra::{Complex, DMatrix, Schur};

/// The value at a point (Horner).
#[must_use]
pub fn value(coefficients: &[f64], s: Complex<f64>) -> Complex<f64> {
    coefficients
        .iter()
        .fold(Complex::new(0.0, 0.0), |sum, c| sum * s + c)
}

/// The derivative's coefficients.
#[must_use]
pub fn derivative(coefficients: &[f64]) -> Vec<f64> {
    let degree = coefficients.len().saturating_sub(1);
    coefficients
        .iter()
        .take(degree)
        .enumerate()
        .map(|(i, c)| (degree - i) as f64 * c)
        .collect()
}

/// All roots, conjugate pairs side by side, from slow to fast: eigenvalues of the companion matrix, refined by Newton's
/// method. Leading zeros are no roots; roots at exactly 0 are.
///
/// ```
/// use furuta_ident::frequency::polynomial::roots;
/// // (s + 3) (s^2 + 2 s + 5)
/// let r = roots(&[1.0, 5.0, 11.0, 15.0]).expect("it converges");
/// assert!((r[0].im.abs() - 2.0).abs() < 1e-12 && (r[0].re + 1.0).abs() < 1e-12);
/// assert!((r[2].re + 3.0).abs() < 1e-12 && r[2].im == 0.0);
/// ```
///
/// `None` where a coefficient is not finite or the eigenvalues do not converge.
#[must_use]
pub fn roots(coefficients: &[f64]) -> Option<Vec<Complex<f64>>> {
    if !coefficients.iter().all(|c| c.is_finite()) {
        return None;
    }
    let first = coefficients.iter().position(|c| *c != 0.0)?;
    let last = coefficients.iter().rposition(|c| *c != 0.0)?;
    let c = &coefficients[first..=last];
    let n = c.len() - 1;
    let mut found = vec![Complex::new(0.0, 0.0); coefficients.len() - 1 - last];
    if n > 0 {
        // In units of the roots' geometric mean, in which the coefficients are of like size.
        let unit = (c[n] / c[0]).abs().powf(1.0 / n as f64);
        let scaled: Vec<f64> = c
            .iter()
            .enumerate()
            .map(|(i, c)| c * unit.powi((n - i) as i32))
            .collect();
        let companion = DMatrix::from_fn(n, n, |i, j| {
            if i == 0 {
                -scaled[j + 1] / scaled[0]
            } else {
                f64::from(i == j + 1)
            }
        });
        let eigenvalues = Schur::try_new(companion, f64::EPSILON, 10_000)?.complex_eigenvalues();
        let slope = derivative(&scaled);
        let polish = |mut z: Complex<f64>| {
            for _ in 0..2 {
                let step = value(&scaled, z) / value(&slope, z);
                // A double root has no slope: it stays as it is.
                if step.norm() < 1e-3 * (1.0 + z.norm()) {
                    z -= step;
                }
            }
            z * unit
        };
        found.extend(eigenvalues.iter().map(|z| polish(*z)));
    }
    // Rounding makes no pair of a real root.
    for z in &mut found {
        if z.im.abs() < 1e-12 * z.norm() {
            z.im = 0.0;
        }
    }
    found.sort_by(|a, b| {
        let slow = |z: &Complex<f64>| z.norm();
        // Both of a pair have the same size but for rounding.
        if (slow(a) - slow(b)).abs() <= 1e-9 * slow(a) {
            a.re.total_cmp(&b.re).then(b.im.total_cmp(&a.im))
        } else {
            slow(a).total_cmp(&slow(b))
        }
    });
    Some(found)
}

/// Coefficients of `product (s - root)`, for roots that come in conjugate pairs.
#[must_use]
pub fn from_roots(roots: &[Complex<f64>]) -> Vec<f64> {
    let mut c = vec![Complex::new(1.0, 0.0)];
    for root in roots {
        c.push(Complex::new(0.0, 0.0));
        for i in (1..c.len()).rev() {
            c[i] = c[i] - root * c[i - 1];
        }
    }
    c.iter().map(|c| c.re).collect()
}
