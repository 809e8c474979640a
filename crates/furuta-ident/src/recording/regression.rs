//! Least squares with three coefficients, for the checks of what a recording's columns mean.

/// A coefficient and its standard deviation.
#[derive(Clone, Copy, Debug)]
pub(super) struct Estimate {
    pub(super) value: f64,
    pub(super) std: f64,
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
pub(super) struct Solution {
    pub(super) coefficients: [Estimate; 3],
    /// Share of the squares that the coefficients leave unexplained, 0 to 1.
    pub(super) left: f64,
}

/// Least squares with three regressors, by normal equations.
#[derive(Default)]
pub(super) struct Regression {
    xx: [[f64; 3]; 3],
    xy: [f64; 3],
    yy: f64,
    count: f64,
}

impl Regression {
    pub(super) fn add(&mut self, x: [f64; 3], y: f64) {
        for ((row, xy), xi) in self.xx.iter_mut().zip(&mut self.xy).zip(x) {
            for (entry, xj) in row.iter_mut().zip(x) {
                *entry += xi * xj;
            }
            *xy += xi * y;
        }
        self.yy += y * y;
        self.count += 1.0;
    }

    /// Coefficients with standard deviations, where one sample in `correlated` is independent; `None` where the regressors do not differ.
    pub(super) fn solve(&self, correlated: f64) -> Option<Solution> {
        let [[a, b, c], [_, d, e], [_, _, f]] = self.xx;
        let adjugate = [
            [d * f - e * e, c * e - b * f, b * e - c * d],
            [c * e - b * f, a * f - c * c, b * c - a * e],
            [b * e - c * d, b * c - a * e, a * d - b * b],
        ];
        let determinant = a * (d * f - e * e) + b * (c * e - b * f) + c * (b * e - c * d);
        let independent = self.count / correlated - 3.0;
        if !(determinant > 1e-12 * a * d * f && independent > 10.0) {
            return None;
        }
        let dot = |row: [f64; 3]| {
            row.into_iter()
                .zip(self.xy)
                .map(|(entry, xy)| entry * xy)
                .sum::<f64>()
                / determinant
        };
        let values = adjugate.map(dot);
        let explained: f64 = values
            .into_iter()
            .zip(self.xy)
            .map(|(value, xy)| value * xy)
            .sum();
        let variance = ((self.yy - explained) / correlated / independent).max(0.0);
        let [[p, ..], [_, q, _], [_, _, r]] = adjugate;
        let std = |cofactor: f64| {
            (variance * correlated * cofactor / determinant)
                .max(0.0)
                .sqrt()
        };
        let [x, y, z] = values;
        Some(Solution {
            coefficients: [(x, p), (y, q), (z, r)].map(|(value, cofactor)| Estimate {
                value,
                std: std(cofactor),
            }),
            left: (1.0 - explained / self.yy).clamp(0.0, 1.0),
        })
    }
}
