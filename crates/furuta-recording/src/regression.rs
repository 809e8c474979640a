//! Least squares with a few coefficients, for the checks of what a recording's columns mean.

use nalgebra::{DMatrix, DVector, SMatrix, SVector};

/// A coefficient and its standard deviation.
#[derive(Clone, Copy, Debug)]
pub(super) struct Estimate {
    pub(super) value: f64,
    pub(super) std: f64,
    /// How far off it is if all that is left follows its regressor, as what a law lacks may.
    pub(super) worst: f64,
}

impl Estimate {
    /// Its sign, where it is larger than `least` and `deviations` standard deviations away from zero.
    pub(super) fn sign(self, least: f64, deviations: f64) -> Option<f64> {
        (self.value.abs() > least && self.value.abs() > deviations * self.std)
            .then_some(self.value.signum())
    }
}

/// What a regression found.
#[derive(Clone, Copy, Debug)]
pub(super) struct Solution<const N: usize> {
    pub(super) coefficients: [Estimate; N],
    /// Share of the squares that the coefficients leave unexplained, 0 to 1.
    pub(super) left: f64,
}

/// Least squares with `N` regressors, by normal equations.
#[derive(Clone)]
pub(super) struct Regression<const N: usize> {
    xx: SMatrix<f64, N, N>,
    xy: SVector<f64, N>,
    yy: f64,
    count: f64,
}

impl<const N: usize> Default for Regression<N> {
    fn default() -> Self {
        Self {
            xx: SMatrix::zeros(),
            xy: SVector::zeros(),
            yy: 0.0,
            count: 0.0,
        }
    }
}

/// The least squared part of a regressor of length one that the others do not make up.
const INDEPENDENT: f64 = 1e-11;
/// Independent samples that a solution needs beyond its coefficients.
const FREEDOM: f64 = 10.0;

impl<const N: usize> Regression<N> {
    pub(super) fn add(&mut self, x: [f64; N], y: f64) {
        let x = SVector::from(x);
        self.xx += x * x.transpose();
        self.xy += x * y;
        self.yy += y * y;
        self.count += 1.0;
    }

    /// The same samples with some of the regressors.
    pub(super) fn only<const M: usize>(&self, places: [usize; M]) -> Regression<M> {
        Regression {
            xx: SMatrix::from_fn(|i, j| self.xx[(places[i], places[j])]),
            xy: SVector::from_fn(|i, _| self.xy[places[i]]),
            yy: self.yy,
            count: self.count,
        }
    }

    /// Samples beyond what the coefficients take, where one sample in `correlated` is independent.
    pub(super) fn freedom(&self, correlated: f64) -> f64 {
        self.count / correlated - N as f64
    }

    /// The squared part of a regressor of length one that the others do not make up.
    pub(super) fn independent(&self, i: usize) -> f64 {
        let lengths = self.xx.diagonal().map(f64::sqrt);
        let unit =
            SMatrix::<f64, N, N>::from_fn(|i, j| self.xx[(i, j)] / (lengths[i] * lengths[j]));
        unit.cholesky().map_or(0.0, |c| 1.0 / c.inverse()[(i, i)])
    }

    /// Coefficients with standard deviations, where one sample in `correlated` is independent; `None` where the
    /// regressors do not differ.
    pub(super) fn solve(&self, correlated: f64) -> Option<Solution<N>> {
        let freedom = self.freedom(correlated);
        let lengths = self.xx.diagonal().map(f64::sqrt);
        let unit =
            SMatrix::<f64, N, N>::from_fn(|i, j| self.xx[(i, j)] / (lengths[i] * lengths[j]));
        let cholesky = unit.cholesky()?;
        let independent = (0..N).all(|i| cholesky.l_dirty()[(i, i)].powi(2) > INDEPENDENT);
        if !(independent && freedom > FREEDOM) {
            return None;
        }
        let inverse = cholesky.inverse();
        let inverse =
            SMatrix::<f64, N, N>::from_fn(|i, j| inverse[(i, j)] / (lengths[i] * lengths[j]));
        let values = inverse * self.xy;
        let explained = values.dot(&self.xy);
        let left = (self.yy - explained).max(0.0);
        Some(Solution {
            coefficients: std::array::from_fn(|i| Estimate {
                value: values[i],
                std: (left / freedom * inverse[(i, i)]).max(0.0).sqrt(),
                worst: (left * inverse[(i, i)]).max(0.0).sqrt(),
            }),
            left: (1.0 - explained / self.yy).clamp(0.0, 1.0),
        })
    }

    /// The share of the squares that is left at least if none of the first `one_sided` coefficients may have the other
    /// sign than `sign`.
    pub(super) fn left_with_signs(&self, one_sided: usize, sign: f64) -> f64 {
        // A few coefficients only: the best of all choices of those that rest at zero.
        (0..1_usize << one_sided)
            .filter_map(|resting| {
                let kept: Vec<usize> = (0..N)
                    .filter(|i| *i >= one_sided || resting & (1 << i) == 0)
                    .filter(|i| self.xx[(*i, *i)] > 0.0)
                    .collect();
                let n = kept.len();
                let length = |i: usize| self.xx[(kept[i], kept[i])].sqrt();
                let unit = DMatrix::from_fn(n, n, |i, j| {
                    let ridge = if i == j { INDEPENDENT } else { 0.0 };
                    self.xx[(kept[i], kept[j])] / (length(i) * length(j)) + ridge
                });
                let right = DVector::from_fn(n, |i, _| self.xy[kept[i]] / length(i));
                let values = unit.cholesky()?.solve(&right);
                let allowed = |i: usize| kept[i] >= one_sided || sign * values[i] >= 0.0;
                let explained = values.dot(&right);
                (0..n)
                    .all(allowed)
                    .then(|| (1.0 - explained / self.yy).clamp(0.0, 1.0))
            })
            .fold(1.0, f64::min)
    }
}

#[cfg(test)]
mod tests {
    use super::Regression;

    /// A regressor read with noise is found too small, by far more than its standard deviation says; it is not further
    /// off than if all that is left followed it.
    #[test]
    fn what_is_left_bounds_what_noise_in_a_regressor_does() {
        let mut regression = Regression::<1>::default();
        for k in 0..4000 {
            let x = (0.1 * f64::from(k)).sin();
            let noise = 0.5 * (f64::from(k) * 12.9898).sin();
            regression.add([x + noise], 2.0 * x);
        }
        let found = regression.solve(1.0).expect("one regressor").coefficients[0];
        let off = 2.0 - found.value;
        assert!(off > 12.0 * found.std, "{found:?}");
        assert!(off < found.worst, "{found:?}");
    }
}
