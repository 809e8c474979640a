//! What does a measured transfer function know that a rig file does not? Each effect of the catalogue with a linear footprint is fitted, alone and
//! together with others, beside the rig's refitted parameters.

mod footprint;
mod linear;

use furuta_model::params::Coefficients;
use furuta_model::{Rig, effects};
use nalgebra::{Complex, DMatrix, DVector};
use std::f64::consts::TAU;

pub use footprint::{Footprint, OWN, footprint};

use self::linear::{Effects, response};
use super::first_principles::Output;
use super::hold::Hold;
use super::least_squares::{covariance, minimise};
use super::response::Frf;
use super::transfer::Transfer;

/// What was measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// The response, over the band that counts.
    pub frf: Frf,
    /// The angle.
    pub output: Output,
    /// What stands between the rig and the response.
    pub hold: Hold,
    /// How many independent numbers it holds: twice its lines for a measured response, the coefficients of a published function.
    pub numbers: f64,
}

impl Measured {
    /// A transfer function that was fitted elsewhere, over a band (Hz): lines evenly in the logarithm, all equally important relative to their size.
    /// However many lines, they say no more than its coefficients.
    ///
    /// # Errors
    /// A band that is none.
    pub fn function(
        g: &Transfer,
        output: Output,
        [low, high]: [f64; 2],
    ) -> Result<Self, CompareError> {
        if !(low > 0.0 && low < high && high.is_finite()) {
            return Err(CompareError::Band { low, high });
        }
        let last = LINES as f64 - 1.0;
        let frequency: Vec<f64> = (0..LINES)
            .map(|k| low * (high / low).powf(k as f64 / last))
            .collect();
        let [zeros, poles] = g.orders();
        Ok(Self {
            frf: Frf::exact(&frequency, |f| g.response(f)),
            output,
            hold: Hold::None,
            numbers: (zeros + 1 + poles) as f64,
        })
    }

    /// A response measured from recordings.
    #[must_use]
    pub fn response(frf: Frf, output: Output) -> Self {
        Self {
            numbers: 2.0 * frf.frequency.len() as f64 / frf.lines_for_one,
            hold: Hold::ZeroOrder(frf.sample_period),
            frf,
            output,
        }
    }
}

/// Lines that stand for a transfer function.
const LINES: usize = 60;
/// Most effects at once.
const TOGETHER: usize = 3;
/// Two explanations whose responses differ by less than this, RMS relative, are one to whoever sees responses alone.
const SAME: f64 = 0.01;
/// A refitted parameter beyond this factor of the data sheet's is not believed without a word.
pub const FAR: f64 = 2.0;

/// How far the data sheet is trusted where the response leaves a combination of its parameters open: standard deviation of a logarithm.
pub const TRUST: f64 = 0.5;
/// What is uncertain by more than this, a standard deviation of a logarithm, is not determined.
const UNKNOWN: f64 = 3.0;

/// Why nothing can be compared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CompareError {
    /// A band that is none.
    #[error("a band from {low} to {high} Hz: give two frequencies above 0, the lower one first")]
    Band {
        /// Lower end, Hz.
        low: f64,
        /// Upper end, Hz.
        high: f64,
    },
    /// Less is measured than is to be fitted.
    #[error(
        "the response has {lines} lines; at least {needed} are needed: widen the band or ask for a finer resolution"
    )]
    TooFewLines {
        /// Lines.
        lines: usize,
        /// Lines needed.
        needed: usize,
    },
    /// A line that is no number, or 0.
    #[error("the response at {frequency} Hz is {value}: it must be finite and not 0; cut the band")]
    Unusable {
        /// Where, Hz.
        frequency: f64,
        /// The response.
        value: Complex<f64>,
    },
    /// The search found nothing.
    #[error(
        "the rig's parameters cannot be fitted to this response: is it of {output} over voltage, in rad/V?"
    )]
    NoConvergence {
        /// The angle.
        output: &'static str,
    },
}

/// A refitted parameter.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Refitted {
    /// In words: `arm inertia`.
    pub name: &'static str,
    /// Over the data sheet's value.
    pub factor: f64,
    /// Standard deviation of the factor, the data sheet trusted to [`TRUST`] where the response is silent.
    pub std: f64,
}

/// A parameter of an effect.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Value {
    /// The effect.
    pub effect: &'static str,
    /// The parameter.
    pub parameter: &'static str,
    /// The estimate.
    pub value: f64,
    /// Its standard deviation; infinite where the response does not determine it.
    pub std: f64,
    /// Its unit.
    pub unit: &'static str,
}

/// One explanation: effects together with refitted parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Explanation {
    /// The effects; none for parameters alone.
    pub effects: Vec<&'static str>,
    /// Their parameters.
    pub values: Vec<Value>,
    /// The rig's parameters.
    pub refitted: Vec<Refitted>,
    /// RMS of the relative error over the band.
    pub relative_error: f64,
    /// Fitted numbers that the response determines.
    pub parameters: usize,
    /// Schwarz's criterion, lower is better.
    pub bic: f64,
    /// By how much it is below that of the parameters alone.
    pub evidence: f64,
    /// Its response, at the measured lines.
    pub response: Vec<Complex<f64>>,
    /// Other explanations with as many effects whose responses cannot be told from this one's.
    pub same_as: Vec<Vec<&'static str>>,
}

impl Explanation {
    /// Its effects in words, `parameters alone` where there are none.
    #[must_use]
    pub fn name(&self) -> String {
        name(&self.effects)
    }
}

/// Effects in words.
#[must_use]
pub fn name(effects: &[&str]) -> String {
    if effects.is_empty() {
        "parameters alone".to_owned()
    } else {
        effects.join(" + ")
    }
}

/// What was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// The rig as its file has it, at the measured lines.
    pub as_given: Vec<Complex<f64>>,
    /// RMS of its relative error.
    pub as_given_error: f64,
    /// All explanations of up to three effects, best first.
    pub explanations: Vec<Explanation>,
}

impl Comparison {
    /// The refitted parameters alone.
    #[must_use]
    pub fn parameters_alone(&self) -> Option<&Explanation> {
        self.explanations.iter().find(|e| e.effects.is_empty())
    }

    /// Explanations by one effect, best first.
    pub fn singles(&self) -> impl Iterator<Item = &Explanation> {
        self.explanations.iter().filter(|e| e.effects.len() == 1)
    }
}

/// The rig's parameters that are refitted, by the equations' coefficients; the weight's moment and the coupling stay as the data sheet has them,
/// since only ratios show.
const BASE: [&str; 5] = [
    "arm inertia",
    "pendulum inertia",
    "motor gain",
    "arm damping",
    "pendulum damping",
];

/// An effect's parameters in the search: logarithms of their values over a typical one.
#[derive(Copy, Clone)]
struct Knob {
    effect: &'static str,
    parameter: &'static str,
    unit: &'static str,
    typical: f64,
    most: f64,
}

/// Compares a measured response with the hanging rig of this file, whose effects are part of the rig where they are linear springs, and otherwise left
/// out.
///
/// ```
/// use furuta_ident::frequency::compare::{Measured, compare};
/// use furuta_ident::frequency::{first_principles::{Output, of_plant}};
/// use furuta_model::{Effect, Plant, Rig};
/// let rig = Rig::builtin("qube-servo-2").expect("built in");
/// let real = Plant::new(&rig.params, &[Effect::new("arm.spring", &[0.002, 0.0])?])?;
/// let measured = Measured::function(&of_plant(&real, Output::Theta)?, Output::Theta, [0.1, 20.0])?;
/// let found = compare(&measured, &rig)?;
/// let best = &found.explanations[0];
/// assert_eq!(best.effects, ["arm.spring"]);
/// assert!((best.values[0].value - 0.002).abs() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// Too few lines, lines that are no numbers, a response that the rig's parameters do not fit at all.
pub fn compare(measured: &Measured, rig: &Rig) -> Result<Comparison, CompareError> {
    let frf = &measured.frf;
    let needed = 8;
    if frf.frequency.len() < needed {
        return Err(CompareError::TooFewLines {
            lines: frf.frequency.len(),
            needed,
        });
    }
    for (frequency, value) in frf.frequency.iter().zip(&frf.response) {
        if !(value.norm() > 0.0 && value.norm().is_finite()) {
            return Err(CompareError::Unusable {
                frequency: *frequency,
                value: *value,
            });
        }
    }
    let problem = Problem::new(measured, rig);
    let as_given = problem.response(&problem.nominal, &Effects::default());
    let null =
        problem
            .explain(&[], &[vec![0.0; BASE.len()]])
            .ok_or(CompareError::NoConvergence {
                output: measured.output.name(),
            })?;
    // Larger sets begin where smaller ones ended.
    let mut known: Vec<(Vec<usize>, Vec<f64>, Explanation)> = vec![(Vec::new(), null.0, null.1)];
    for size in 1..=TOGETHER {
        for set in subsets(OWN.len(), size) {
            let ids: Vec<&'static str> = set.iter().map(|i| OWN[*i]).collect();
            let mut parents: Vec<_> = known
                .iter()
                .filter(|(less, ..)| less.len() + 1 == size && less.iter().all(|i| set.contains(i)))
                .collect();
            parents.sort_by(|a, b| a.2.relative_error.total_cmp(&b.2.relative_error));
            let starts: Vec<Vec<f64>> = parents
                .into_iter()
                .take(2)
                .flat_map(|(less, z, _)| problem.extended(less, z, &set))
                .collect();
            if let Some((z, explanation)) = problem.explain(&ids, &starts) {
                known.push((set, z, explanation));
            }
        }
    }
    let mut explanations: Vec<Explanation> = known.into_iter().map(|(.., e)| e).collect();
    let null_bic = explanations.first().map_or(0.0, |e| e.bic);
    let same = |a: &Explanation, b: &Explanation| {
        let distance: f64 = (0..frf.frequency.len())
            .map(|k| (a.response[k] - b.response[k]).norm_sqr() / frf.response[k].norm_sqr())
            .sum();
        (distance / frf.frequency.len() as f64).sqrt() < SAME
    };
    // What says the same with fewer effects makes the larger set empty talk.
    let fewer = |e: &Explanation, o: &Explanation| {
        o.effects.len() < e.effects.len()
            && o.effects.iter().all(|id| e.effects.contains(id))
            && same(e, o)
    };
    let all = explanations.clone();
    explanations.retain(|e| e.effects.len() < 2 || !all.iter().any(|o| fewer(e, o)));
    let same_as: Vec<Vec<Vec<&'static str>>> = explanations
        .iter()
        .map(|e| {
            explanations
                .iter()
                .filter(|o| {
                    o.effects != e.effects && o.effects.len() == e.effects.len() && same(e, o)
                })
                .map(|o| o.effects.clone())
                .collect()
        })
        .collect();
    for (e, same_as) in explanations.iter_mut().zip(same_as) {
        e.evidence = null_bic - e.bic;
        e.same_as = same_as;
    }
    explanations.sort_by(|a, b| a.bic.total_cmp(&b.bic));
    Ok(Comparison {
        as_given_error: problem.relative_error(&as_given),
        as_given,
        explanations,
    })
}

/// All sets of `size` of `0..n`.
fn subsets(n: usize, size: usize) -> Vec<Vec<usize>> {
    (0_u32..1 << n)
        .filter(|mask| mask.count_ones() as usize == size)
        .map(|mask| (0..n).filter(|i| mask & (1 << i) != 0).collect())
        .collect()
}

struct Problem<'a> {
    measured: &'a Measured,
    nominal: Coefficients<f64>,
    /// One over the deviation of each line's real and imaginary part.
    weights: Vec<f64>,
    /// Whether these are the noise's, and not all lines equal.
    noise_known: bool,
    knobs: Vec<Knob>,
}

impl<'a> Problem<'a> {
    fn new(measured: &'a Measured, rig: &Rig) -> Self {
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
        let wanted = [
            ("arm.spring", "stiffness"),
            ("arm.tilt", "angle"),
            ("pendulum.spring", "stiffness"),
            ("motor.lag", "time_constant"),
            ("motor.delay", "delay"),
            ("drive.compliance", "stiffness"),
            ("drive.compliance", "damping"),
            ("drive.compliance", "motor_share"),
        ];
        let knob = |(effect, parameter): (&'static str, &'static str)| {
            let spec = effects::spec(effect)?;
            let p = spec.parameters.iter().find(|p| p.name == parameter)?;
            Some(Knob {
                effect,
                parameter,
                unit: p.unit,
                typical: (p.typical)(&rig.params),
                // A base leans by less than a right angle; half of the arm's inertia is the motor's, give or take.
                most: if parameter == "angle" { 1.5 } else { p.max },
            })
        };
        Self {
            measured,
            nominal: rig.params.coefficients(),
            weights,
            noise_known,
            knobs: wanted.into_iter().filter_map(knob).collect(),
        }
    }

    fn knobs(&self, effects: &[&str]) -> Vec<Knob> {
        self.knobs
            .iter()
            .filter(|k| effects.contains(&k.effect))
            .copied()
            .collect()
    }

    /// Starts for a larger set from a smaller one's end: the new effect weak and strong.
    fn extended(&self, less: &[usize], z: &[f64], set: &[usize]) -> Vec<Vec<f64>> {
        let ids = |set: &[usize]| -> Vec<&str> { set.iter().map(|i| OWN[*i]).collect() };
        let (old, new) = (self.knobs(&ids(less)), self.knobs(&ids(set)));
        let start = |log: f64| -> Vec<f64> {
            let mut start = z[..BASE.len()].to_vec();
            start.extend(new.iter().map(|k| {
                let place = old
                    .iter()
                    .position(|o| o.effect == k.effect && o.parameter == k.parameter);
                match place {
                    Some(place) => z[BASE.len() + place],
                    None if k.parameter == "motor_share" => 0.0,
                    None => log,
                }
            }));
            start
        };
        [-2.0, 1.0].map(start).to_vec()
    }

    /// Coefficients and effects at a place of the search; `None` outside what can be.
    fn place(&self, z: &[f64], knobs: &[Knob]) -> Option<(Coefficients<f64>, Effects)> {
        let mut c = self.nominal;
        let more = (z[0].exp() - 1.0) * c.arm;
        (c.arm, c.hub) = (c.arm + more, c.hub + more);
        c.pendulum *= z[1].exp();
        c.drive *= z[2].exp();
        c.arm_damping *= z[3].exp();
        c.pendulum_damping *= z[4].exp();
        let mut effects = Effects::default();
        let mut compliance = [0.0; 3];
        for (knob, z) in knobs.iter().zip(&z[BASE.len()..]) {
            let value = knob.typical * z.exp();
            if value > knob.most {
                return None;
            }
            match (knob.effect, knob.parameter) {
                ("arm.spring", _) => effects.arm_spring = value,
                ("arm.tilt", _) => effects.tilt = value,
                ("pendulum.spring", _) => effects.pendulum_spring = value,
                ("motor.lag", _) => effects.lag = value,
                ("motor.delay", _) => effects.delay = value,
                (_, "stiffness") => compliance[0] = value,
                (_, "damping") => compliance[1] = value,
                _ => compliance[2] = value,
            }
        }
        if knobs.iter().any(|k| k.effect == "drive.compliance") {
            effects.compliance = Some(compliance);
        }
        // A body whose inertias do not allow its coupling is none.
        let body = c.arm * c.pendulum > c.coupling * c.coupling && c.hub > 0.0;
        body.then_some((c, effects))
    }

    fn response(&self, c: &Coefficients<f64>, effects: &Effects) -> Vec<Complex<f64>> {
        let plant = |s| response(c, effects, self.measured.output, s);
        let hold = self.measured.hold;
        let at = |f: &f64| match hold {
            // What folds down is a thousandth of a thousandth; the hold itself is not.
            Hold::ZeroOrder(_) => hold.factor(*f) * plant(Complex::new(0.0, TAU * f)),
            Hold::None => plant(Complex::new(0.0, TAU * f)),
        };
        self.measured.frf.frequency.iter().map(at).collect()
    }

    fn relative_error(&self, response: &[Complex<f64>]) -> f64 {
        let h = &self.measured.frf.response;
        let sum: f64 = response
            .iter()
            .zip(h)
            .map(|(g, h)| (g - h).norm_sqr() / h.norm_sqr())
            .sum();
        (sum / h.len() as f64).sqrt()
    }

    /// Residuals, with a faint pull towards the data sheet where the response says nothing.
    fn residuals(&self, z: &DVector<f64>, knobs: &[Knob]) -> Option<DVector<f64>> {
        const FAINT: f64 = 1e-4;
        let (c, effects) = self.place(z.as_slice(), knobs)?;
        let g = self.response(&c, &effects);
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

    fn evaluate(&self, z: &DVector<f64>, knobs: &[Knob]) -> Option<(DVector<f64>, DMatrix<f64>)> {
        const STEP: f64 = 1e-5;
        let r = self.residuals(z, knobs)?;
        let mut j = DMatrix::zeros(r.len(), z.len());
        for i in 0..z.len() {
            let moved = |by: f64| {
                let mut z = z.clone();
                z[i] += by;
                self.residuals(&z, knobs)
            };
            let (up, down) = (moved(STEP)?, moved(-STEP)?);
            j.set_column(i, &((up - down) / (2.0 * STEP)));
        }
        Some((r, j))
    }

    /// The best fit from these starts.
    fn explain(
        &self,
        ids: &[&'static str],
        starts: &[Vec<f64>],
    ) -> Option<(Vec<f64>, Explanation)> {
        let knobs = self.knobs(ids);
        let best = starts
            .iter()
            .filter_map(|start| {
                minimise(DVector::from_column_slice(start), |z| {
                    self.evaluate(z, &knobs)
                })
            })
            .min_by(|a, b| a.sum.total_cmp(&b.sum))?;
        let z: Vec<f64> = best.parameters.iter().copied().collect();
        let (c, effects) = self.place(&z, &knobs)?;
        let response = self.response(&c, &effects);
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
            .map(|(i, name)| {
                let factor = z[i].exp();
                Refitted {
                    name,
                    factor,
                    std: factor * std(i),
                }
            })
            .collect();
        let values = knobs
            .iter()
            .enumerate()
            .map(|(i, k)| {
                let value = k.typical * z[BASE.len() + i].exp();
                Value {
                    effect: k.effect,
                    parameter: k.parameter,
                    value,
                    std: value * std(BASE.len() + i),
                    unit: k.unit,
                }
            })
            .collect();
        Some((
            z,
            Explanation {
                effects: ids.to_vec(),
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

/// The Jacobian in units of the noise, with the data sheet below it: where the response leaves a combination open, the sheet's word decides how open.
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

/// Directions of the parameters (logarithms, all of one size) that move the response by more than a thousandth of what the strongest moves it.
fn determined(jacobian: &DMatrix<f64>) -> usize {
    let values = jacobian.singular_values();
    let largest = values.max();
    values.iter().filter(|v| **v > 1e-4 * largest).count()
}
