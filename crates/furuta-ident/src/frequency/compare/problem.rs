//! The fit of effects and refitted parameters to a response.

use furuta_model::effects::{BaseParameter, Footprint};
use furuta_model::params::Coefficients;
use furuta_model::{Effect, Params, Rig, Spec};
use nalgebra::{Complex, DMatrix, DVector};
use std::f64::consts::TAU;

use super::super::hold::Hold;
use super::super::least_squares::{covariance, minimise};
use super::linear::Linear;
use super::{Explanation, Measured, Refitted, TRUST, Value};

/// The rig's parameters that are refitted, by the equations' coefficients; the weight's moment and the coupling stay as
/// the data sheet has them, since only ratios show.
const BASE: [BaseParameter; 5] = BaseParameter::ALL;

/// What is uncertain by more than this, a standard deviation of a logarithm, is not determined.
const UNKNOWN: f64 = 3.0;

/// A parameter of an effect in the search: the logarithm of its value over a typical one.
#[derive(Copy, Clone)]
struct FreeParameter {
    spec: &'static Spec,
    /// Which of its parameters.
    index: usize,
    typical: f64,
}

impl FreeParameter {
    fn value(&self, z: f64) -> f64 {
        self.typical * z.exp()
    }

    /// Whether it is a strength, or may be left out.
    fn may_vanish(&self) -> bool {
        let parameter = &self.spec.parameters[self.index];
        self.index < self.spec.strengths || parameter.default.is_some()
    }
}

/// A response, and what is fitted to it.
pub(super) struct CompareProblem<'a> {
    measured: &'a Measured,
    sheet: Coefficients<f64>,
    /// One over the deviation of each line's real and imaginary part.
    weights: Vec<f64>,
    /// Whether these are the noise's, and not all lines equal.
    noise_known: bool,
    params: Params<f64>,
}

impl<'a> CompareProblem<'a> {
    /// Lines weighted by their deviations, or all alike.
    pub(super) fn new(measured: &'a Measured, rig: &Rig) -> Self {
        let frf = &measured.frf;
        let noise_known = frf.std.iter().any(|s| *s > 0.0);
        let weights = frf
            .response
            .iter()
            .zip(&frf.std)
            .map(|(h, std)| {
                if noise_known {
                    1.0 / (std * (0.5 * frf.lines_for_one).sqrt()).max(1e-4 * h.norm())
                } else {
                    1.0 / h.norm()
                }
            })
            .collect();
        Self {
            measured,
            sheet: rig.params.coefficients(),
            weights,
            noise_known,
            params: rig.params,
        }
    }

    /// The rig as its file has it.
    pub(super) fn as_given(&self) -> Vec<Complex<f64>> {
        self.response(&Linear::new(self.sheet, &[]))
    }

    /// The rig's parameters refitted, no effect added.
    pub(super) fn alone(&self) -> Option<(Vec<f64>, Explanation)> {
        self.explain(&[], &[vec![0.0; BASE.len()]])
    }

    /// What is searched for of these effects.
    fn free_parameters(&self, effects: &[&'static Spec]) -> Vec<FreeParameter> {
        let of = |spec: &&'static Spec| {
            let spec: &'static Spec = spec;
            let shown = match spec.footprint {
                Footprint::Own(shown) => shown,
                _ => &[],
            };
            let all = spec.parameters.iter().enumerate();
            all.filter(|(_, p)| shown.contains(&p.name))
                .map(|(index, p)| FreeParameter {
                    spec,
                    index,
                    typical: p.typical(&self.params),
                })
                .collect::<Vec<_>>()
        };
        effects.iter().flat_map(of).collect()
    }

    /// Starts for a larger set from a smaller one's end: the new effect weak and strong.
    pub(super) fn extended(
        &self,
        less: &[&'static Spec],
        z: &[f64],
        set: &[&'static Spec],
    ) -> Vec<Vec<f64>> {
        let (old, new) = (self.free_parameters(less), self.free_parameters(set));
        let start = |log: f64| -> Vec<f64> {
            let mut start = z[..BASE.len()].to_vec();
            start.extend(new.iter().map(|k| {
                let place = old
                    .iter()
                    .position(|o| o.spec.id == k.spec.id && o.index == k.index);
                match place {
                    Some(place) => z[BASE.len() + place],
                    None if k.may_vanish() => log,
                    None => 0.0,
                }
            }));
            start
        };
        [-2.0, 1.0].map(start).to_vec()
    }

    /// The rig at a place of the search; `None` outside what can be.
    fn place(
        &self,
        z: &[f64],
        effects: &[&'static Spec],
        free: &[FreeParameter],
    ) -> Option<Linear> {
        let mut c = self.sheet;
        let more = (z[0].exp() - 1.0) * c.arm;
        (c.arm, c.hub) = (c.arm + more, c.hub + more);
        c.pendulum *= z[1].exp();
        c.drive *= z[2].exp();
        c.arm_damping *= z[3].exp();
        c.pendulum_damping *= z[4].exp();
        let built: Option<Vec<Effect<f64>>> = effects
            .iter()
            .map(|spec| {
                let mut values: Vec<f64> = spec.parameters.iter().map(|p| p.off).collect();
                for (parameter, z) in free.iter().zip(&z[BASE.len()..]) {
                    if parameter.spec.id == spec.id {
                        values[parameter.index] = parameter.value(*z);
                    }
                }
                Effect::new(spec.id, &values).ok()
            })
            .collect();
        // No real body has inertias that do not allow its coupling.
        let body = c.arm * c.pendulum > c.coupling * c.coupling && c.hub > 0.0;
        built.filter(|_| body).map(|built| Linear::new(c, &built))
    }

    fn response(&self, rig: &Linear) -> Vec<Complex<f64>> {
        let plant = |s| rig.response(self.measured.output, s);
        let hold = self.measured.hold;
        let at = |f: &f64| match hold {
            // What folds down is a thousandth of a thousandth; the hold itself is not.
            Hold::ZeroOrder(_) => hold.factor(*f) * plant(Complex::new(0.0, TAU * f)),
            Hold::None => plant(Complex::new(0.0, TAU * f)),
        };
        self.measured.frf.frequency.iter().map(at).collect()
    }

    /// RMS of the relative error over the lines.
    pub(super) fn relative_error(&self, response: &[Complex<f64>]) -> f64 {
        let h = &self.measured.frf.response;
        let sum: f64 = response
            .iter()
            .zip(h)
            .map(|(g, h)| (g - h).norm_sqr() / h.norm_sqr())
            .sum();
        (sum / h.len() as f64).sqrt()
    }

    /// Residuals, with a faint pull towards the data sheet where the response says nothing.
    fn residuals(
        &self,
        z: &DVector<f64>,
        effects: &[&'static Spec],
        free: &[FreeParameter],
    ) -> Option<DVector<f64>> {
        const FAINT: f64 = 1e-4;
        let g = self.response(&self.place(z.as_slice(), effects, free)?);
        let lines = g.len();
        let mut r = DVector::zeros(2 * lines + z.len());
        for k in 0..lines {
            let e = (g[k] - self.measured.frf.response[k]) * self.weights[k];
            (r[2 * k], r[2 * k + 1]) = (e.re, e.im);
        }
        // The sheet says nothing of effects; they are merely kept from running away.
        for (i, z) in z.iter().enumerate() {
            let pull = if i < BASE.len() { FAINT } else { 0.01 * FAINT };
            r[2 * lines + i] = pull * z;
        }
        r.iter().all(|r| r.is_finite()).then_some(r)
    }

    fn evaluate(
        &self,
        z: &DVector<f64>,
        effects: &[&'static Spec],
        free: &[FreeParameter],
    ) -> Option<(DVector<f64>, DMatrix<f64>)> {
        const STEP: f64 = 1e-5;
        let r = self.residuals(z, effects, free)?;
        let mut j = DMatrix::zeros(r.len(), z.len());
        for i in 0..z.len() {
            let moved = |by: f64| {
                let mut z = z.clone();
                z[i] += by;
                self.residuals(&z, effects, free)
            };
            let (up, down) = (moved(STEP)?, moved(-STEP)?);
            j.set_column(i, &((up - down) / (2.0 * STEP)));
        }
        Some((r, j))
    }

    /// The best fit from these starts.
    pub(super) fn explain(
        &self,
        effects: &[&'static Spec],
        starts: &[Vec<f64>],
    ) -> Option<(Vec<f64>, Explanation)> {
        let free = self.free_parameters(effects);
        let best = starts
            .iter()
            .filter_map(|start| {
                minimise(DVector::from_column_slice(start), |z| {
                    self.evaluate(z, effects, &free)
                })
            })
            .min_by(|a, b| a.sum.total_cmp(&b.sum))?;
        let z: Vec<f64> = best.parameters.iter().copied().collect();
        let response = self.response(&self.place(&z, effects, &free)?);
        let relative_error = self.relative_error(&response);
        let lines = 2 * self.measured.frf.frequency.len();
        let jacobian = best.jacobian.rows(0, lines).into_owned();
        // Columns by size: a parameter that moves the response by nothing is not determined, whatever its direction.
        let rank = determined(&jacobian);
        let sum: f64 = best.sum;
        let numbers = self.measured.numbers;
        let (fit, scale) = if self.noise_known {
            let spare = (numbers - rank as f64).max(1.0);
            (sum, (sum / spare).max(1.0))
        } else {
            // The mean squared error stands for the variance; an exact fit is as good as six digits.
            let mean = (relative_error * relative_error).max(1e-12);
            (numbers * mean.ln(), mean * lines as f64 / numbers)
        };
        let bic = fit + rank as f64 * numbers.ln();
        let trusted = trusting(&jacobian, scale);
        let (covariance, _) = covariance(&trusted);
        let std = |i: usize| {
            let std = covariance[(i, i)].max(0.0).sqrt();
            if std < UNKNOWN { std } else { f64::INFINITY }
        };
        let refitted = BASE
            .into_iter()
            .enumerate()
            .map(|(i, parameter)| {
                let factor = z[i].exp();
                Refitted {
                    name: parameter.name(),
                    factor,
                    std: factor * std(i),
                }
            })
            .collect();
        let values = free
            .iter()
            .enumerate()
            .map(|(i, k)| {
                let parameter = &k.spec.parameters[k.index];
                let value = k.value(z[BASE.len() + i]);
                Value {
                    effect: k.spec.id,
                    parameter: parameter.name,
                    value,
                    std: value * std(BASE.len() + i),
                    unit: parameter.unit,
                }
            })
            .collect();
        Some((
            z,
            Explanation {
                effects: effects.iter().map(|s| s.id).collect(),
                values,
                refitted,
                relative_error,
                parameters: rank,
                bic,
                evidence: 0.0,
                response,
                same_as: Vec::new(),
            },
        ))
    }
}

/// The Jacobian in units of the noise, with the data sheet below it: where the response leaves a combination open, the
/// sheet's word decides how open.
fn trusting(jacobian: &DMatrix<f64>, variance: f64) -> DMatrix<f64> {
    let (lines, n) = jacobian.shape();
    DMatrix::from_fn(lines + BASE.len(), n, |i, j| {
        if i < lines {
            jacobian[(i, j)] / variance.sqrt()
        } else {
            f64::from(i - lines == j) / TRUST
        }
    })
}

/// Directions of the parameters (logarithms, all of one size) that move the response by more than a thousandth of what
/// the strongest moves it.
fn determined(jacobian: &DMatrix<f64>) -> usize {
    let values = jacobian.singular_values();
    let largest = values.max();
    values.iter().filter(|v| **v > 1e-4 * largest).count()
}
