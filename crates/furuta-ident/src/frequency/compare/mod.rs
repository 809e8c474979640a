//! What does a measured transfer function know that a rig file does not? Each effect of the catalogue with a linear
//! footprint is fitted, alone and together with others, beside the rig's refitted parameters.

mod linear;
mod problem;
mod words;

use furuta_model::effects::Footprint;
use furuta_model::{CATALOGUE, Rig, Spec};
use nalgebra::Complex;

pub use words::{plot, text};

use self::problem::CompareProblem;
use super::first_principles::Output;
use super::hold::Hold;
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
    /// How many independent numbers it holds: twice its lines for a measured response, the coefficients of a published
    /// function.
    pub numbers: f64,
}

impl Measured {
    /// A transfer function that was fitted elsewhere, over a band (Hz): lines evenly in the logarithm, all equally
    /// important relative to their size. However many lines, they say no more than its coefficients.
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
/// A fall of BIC by more than this is strong evidence (Kass, Raftery, J. Am. Stat. Assoc. 90 (1995) 773).
pub const STRONG: f64 = 6.0;
/// A refitted parameter beyond this factor of the data sheet's is not believed without a word.
pub const FAR: f64 = 2.0;

/// How far the data sheet is trusted where the response leaves a combination of its parameters open: standard deviation
/// of a logarithm.
pub const TRUST: f64 = 0.5;

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
    /// Whether it has effects, and strong evidence for them.
    #[must_use]
    pub fn has_evidence(&self) -> bool {
        !self.effects.is_empty() && self.evidence > STRONG
    }

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

    /// The best explanation by effects, where the evidence for it is strong.
    #[must_use]
    pub fn best(&self) -> Option<&Explanation> {
        self.explanations.first().filter(|e| e.has_evidence())
    }

    /// Explanations by one effect, best first.
    pub fn singles(&self) -> impl Iterator<Item = &Explanation> {
        self.explanations.iter().filter(|e| e.effects.len() == 1)
    }
}

/// Compares a measured response with the hanging rig of this file, whose effects are part of the rig where they are
/// linear springs, and otherwise left out.
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
    let problem = CompareProblem::new(measured, rig);
    let as_given = problem.as_given();
    let null = problem.alone().ok_or(CompareError::NoConvergence {
        output: measured.output.name(),
    })?;
    let own: Vec<&'static Spec> = own().collect();
    // Larger sets begin where smaller ones ended.
    let mut known: Vec<(Vec<usize>, Vec<f64>, Explanation)> = vec![(Vec::new(), null.0, null.1)];
    for size in 1..=TOGETHER {
        for set in subsets(own.len(), size) {
            let specs: Vec<&'static Spec> = set.iter().map(|i| own[*i]).collect();
            let mut parents: Vec<_> = known
                .iter()
                .filter(|(less, ..)| less.len() + 1 == size && less.iter().all(|i| set.contains(i)))
                .collect();
            parents.sort_by(|a, b| a.2.relative_error.total_cmp(&b.2.relative_error));
            let starts: Vec<Vec<f64>> = parents
                .into_iter()
                .take(2)
                .flat_map(|(less, z, _)| {
                    let less: Vec<&'static Spec> = less.iter().map(|i| own[*i]).collect();
                    problem.extended(&less, z, &specs)
                })
                .collect();
            if let Some((z, explanation)) = problem.explain(&specs, &starts) {
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
    // What says the same with fewer effects, or more, makes the larger set empty talk.
    let fewer = |e: &Explanation, o: &Explanation| {
        o.effects.len() < e.effects.len()
            && o.effects.iter().all(|id| e.effects.contains(id))
            && (o.relative_error <= e.relative_error || same(e, o))
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

/// The effects of the catalogue that give a transfer function a form of its own.
///
/// ```
/// assert!(furuta_ident::frequency::compare::own().any(|s| s.id == "arm.spring"));
/// ```
pub fn own() -> impl Iterator<Item = &'static Spec> {
    let all = CATALOGUE.iter().copied();
    all.filter(|s| matches!(s.footprint, Footprint::Own(_)))
}
