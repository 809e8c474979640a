//! The whole loop as it is run: the law is given what an estimator with the rig's model makes of the encoders, looking
//! ahead to when a command begins to act.
//!
//! The estimator steps the same linear model, corrects it by what is read, and is one step and the command's delay
//! ahead (between two samples by a line); a command decided at a sample is held from the next one on.

use super::RigLoop;
use super::margins::{Broken, Margins, margins};
use super::sampled::Sampled;
use furuta_ctrl::design::integral_over_sample;
use furuta_ctrl::estimators::LinearEstimator;
use furuta_model::linear_plant::MAX_STATES;
use nalgebra::{Complex, DMatrix, DVector, SVector};

/// A [`RigLoop`] with an estimator in it.
#[derive(Clone, Debug)]
pub struct ObservedLoop {
    base: RigLoop,
    estimator: LinearEstimator,
    sampled: Sampled,
    /// The delay of the encoders in whole periods and the rest as a share of one, where there is any.
    late: Option<(usize, f64)>,
    /// What the rig does to its commands unknown to the estimator: a factor, and a delay in seconds.
    unknown: (f64, f64),
}

/// The rig, or what the estimator believes of it.
#[derive(Clone, Debug, PartialEq)]
struct Model {
    z: SVector<f64, MAX_STATES>,
    /// The last ones first.
    commands: Vec<f64>,
    /// What the encoders were mounted on, angles and speeds; now first. Empty where nothing is late.
    seen: Vec<[f64; 4]>,
}

/// Everything that the loop remembers.
#[derive(Clone, Debug, PartialEq)]
struct Memory {
    rig: Model,
    belief: Model,
    integral: f64,
    /// Angle and speed of the arm that the law was given at the sample before, where it integrates.
    before: [f64; 2],
    held: f64,
}

impl RigLoop {
    /// The same loop as it is run, with an estimator; `None` in continuous time.
    ///
    /// ```
    /// use furuta_ctrl::estimators::{AnyEstimator, Estimator};
    /// use furuta_ctrl::{Config, Site};
    /// use furuta_design::rig_loop::{Law, RigLoop};
    /// use furuta_model::linear_plant::Amplitudes;
    /// use furuta_model::{Effect, Rig};
    /// let mut rig = Rig::builtin("shahzad2022-srv02").ok_or("no such rig")?;
    /// rig.effects.push(Effect::new("motor.delay", &[0.15])?);
    /// let gain = furuta_ctrl::design::balance(&rig.params, 0.002)?.gain;
    /// let law = Law::of_states(std::array::from_fn(|i| gain[i]));
    /// let states = RigLoop::new(&rig, law, Some(0.002), &Amplitudes::NONE)?;
    /// let estimator = AnyEstimator::<f64>::design(&Config::default().estimator, &Site::of(&rig, 0.002))?;
    /// let observed = states.observed(estimator.linear().ok_or("not linear")?).ok_or("continuous")?;
    /// // Looking ahead over the delay brings back what the delay costs.
    /// assert!(states.growth() > 0.0 && observed.growth() < 0.0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn observed(&self, estimator: LinearEstimator) -> Option<ObservedLoop> {
        let period = self.period?;
        let samples = self.plant.sensor_delay / period;
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // at most 126
        let late = (samples > 0.0).then_some((samples as usize, samples.fract()));
        Some(ObservedLoop {
            sampled: Sampled::new(&self.plant, self.plant.delay, period),
            base: self.clone(),
            estimator,
            late,
            unknown: (1.0, 0.0),
        })
    }
}

impl ObservedLoop {
    /// The poles of the whole loop, of the sampled system: the rig's, the estimator's, and those of what is remembered.
    #[must_use]
    pub fn poles(&self) -> Vec<Complex<f64>> {
        self.matrix()
            .complex_eigenvalues()
            .iter()
            .copied()
            .collect()
    }

    /// The fastest growth, 1/s, as of [`RigLoop::growth`].
    #[must_use]
    pub fn growth(&self) -> f64 {
        let sizes = self.poles().into_iter().map(|p| p.norm());
        sizes.fold(0.0, f64::max).ln() / self.sampled.period
    }

    /// The margins at the rig's command: the estimator does not know of what changes.
    #[must_use]
    pub fn margins(&self) -> Margins {
        let blank = self.blank();
        let open = Open {
            of: self,
            a: self.stepped(|m| self.step(m, 0.0)),
            b: DVector::from_vec(self.step(blank, 1.0).flat()),
        };
        margins(&open)
    }

    /// The same loop on a rig whose commands are multiplied by `gain` and `delay` seconds later than the estimator
    /// knows.
    #[must_use]
    pub fn with_errors(&self, gain: f64, delay: f64) -> Self {
        Self {
            unknown: (gain, delay),
            ..self.clone()
        }
    }

    /// From sample to sample.
    fn matrix(&self) -> DMatrix<f64> {
        self.stepped(|m| {
            let held = m.held;
            self.step(m, self.unknown.0 * held)
        })
    }

    /// The matrix of a linear map of everything that is remembered.
    fn stepped(&self, map: impl Fn(Memory) -> Memory) -> DMatrix<f64> {
        let blank = self.blank();
        let size = blank.flat().len();
        let columns: Vec<DVector<f64>> = (0..size)
            .map(|i| {
                let mut unit = vec![0.0; size];
                unit[i] = 1.0;
                DVector::from_vec(map(blank.filled(&unit)).flat())
            })
            .collect();
        DMatrix::from_columns(&columns)
    }

    fn blank(&self) -> Memory {
        let model = |sampled: &Sampled| Model {
            z: SVector::zeros(),
            commands: vec![0.0; sampled.remembered()],
            seen: self
                .late
                .map_or(Vec::new(), |(whole, _)| vec![[0.0; 4]; whole + 2]),
        };
        Memory {
            rig: model(&self.true_plant()),
            belief: model(&self.sampled),
            integral: 0.0,
            before: [0.0; 2],
            held: 0.0,
        }
    }

    /// The rig itself, which may be later than the estimator knows.
    fn true_plant(&self) -> Sampled {
        if self.unknown.1 == 0.0 {
            return self.sampled.clone();
        }
        let delay = self.base.plant.delay + self.unknown.1;
        Sampled::new(&self.base.plant, delay, self.sampled.period)
    }

    /// One sample of everything, the rig under the command `given`.
    fn step(&self, mut m: Memory, given: f64) -> Memory {
        let (read, expected) = (self.read(&m.rig), self.read(&m.belief));
        let off = [read[0] - expected[0], read[1] - expected[1]];
        self.correct(&mut m.belief, off);
        let x = self.ahead(&m.belief, m.held);
        let law = &self.base.law;
        let fed: f64 = law.gain.iter().zip(&x).map(|(k, x)| k * x).sum();
        if law.integral == 0.0 {
            (m.integral, m.before) = (0.0, [0.0; 2]); // there is none
        } else {
            let arm = [x[0], x[2]];
            m.integral += integral_over_sample(self.sampled.period, m.before, arm);
            m.before = arm;
        }
        let u = -fed - law.integral * m.integral;
        self.advance(&mut m.rig, &self.true_plant(), given);
        self.advance(&mut m.belief, &self.sampled, m.held);
        m.held = u;
        m
    }

    fn advance(&self, model: &mut Model, sampled: &Sampled, u: f64) {
        let acting = |age: usize| match age {
            0 => u,
            _ => model.commands.get(age - 1).copied().unwrap_or(0.0),
        };
        let (newer, older) = (acting(sampled.whole), acting(sampled.whole + 1));
        model.z = sampled.a * model.z + sampled.newer * newer + sampled.older * older;
        if !model.commands.is_empty() {
            model.commands.rotate_right(1);
            model.commands[0] = u;
        }
        if !model.seen.is_empty() {
            model.seen.rotate_right(1);
            model.seen[0] = self.base.plant.seen.map(|i| model.z[i]);
        }
    }

    /// The angles that reach the encoders' output now: a cubic between two samples, as the plant has it.
    fn read(&self, model: &Model) -> [f64; 2] {
        let Some((whole, back)) = self.late else {
            return [0, 1].map(|i| model.z[self.base.plant.seen[i]]);
        };
        let (new, old) = (model.seen[whole], model.seen[whole + 1]);
        let h = self.sampled.period;
        [0, 1].map(|i| {
            let (fall, before, after) = (old[i] - new[i], h * old[i + 2], h * new[i + 2]);
            let square = 3.0 * fall + 2.0 * after + before;
            let cube = -(after + before + 2.0 * fall);
            new[i] + back * (back * (back * cube + square) - after)
        })
    }

    /// Moves the belief's rig as a whole, rotor and arm alike.
    fn correct(&self, belief: &mut Model, off: [f64; 2]) {
        let by = self
            .estimator
            .correction
            .map(|[a, b]| a * off[0] + b * off[1]);
        for (i, by) in by.into_iter().enumerate() {
            belief.z[i] += by;
        }
        if self.base.plant.states.contains(&"rotor") {
            belief.z[4] += by[0];
            belief.z[5] += by[2];
        }
    }

    /// The state when a command given now begins to act, as the estimator sees it.
    fn ahead(&self, belief: &Model, held: f64) -> [f64; 4] {
        let mut next = belief.clone();
        let mut step = || {
            self.advance(&mut next, &self.sampled, held);
            [0, 1, 2, 3].map(|i| next.z[i])
        };
        let mut x = step();
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // a few hundred
        for _ in 0..self.estimator.ahead as usize {
            x = step();
        }
        let part = self.estimator.ahead.fract();
        if part > 0.0 {
            let to = step();
            x = [0, 1, 2, 3].map(|i| x[i] + part * (to[i] - x[i]));
        }
        x
    }
}

impl Memory {
    /// In a row: the rig, the belief, the integral, the held command.
    fn flat(&self) -> Vec<f64> {
        let mut all = Vec::new();
        for model in [&self.rig, &self.belief] {
            all.extend(model.z.iter());
            all.extend(&model.commands);
            all.extend(model.seen.iter().flatten());
        }
        all.extend([self.integral, self.before[0], self.before[1], self.held]);
        all
    }

    /// Of the same sizes, with these values.
    fn filled(&self, values: &[f64]) -> Self {
        let mut filled = self.clone();
        let mut values = values.iter().copied();
        let mut next = || values.next().unwrap_or(0.0);
        for model in [&mut filled.rig, &mut filled.belief] {
            model.z.iter_mut().for_each(|z| *z = next());
            model.commands.iter_mut().for_each(|u| *u = next());
            model.seen.iter_mut().flatten().for_each(|y| *y = next());
        }
        filled.integral = next();
        filled.before = [next(), next()];
        filled.held = next();
        filled
    }
}

/// The loop cut between the held command and the rig.
struct Open<'a> {
    of: &'a ObservedLoop,
    a: DMatrix<f64>,
    b: DVector<f64>,
}

impl Broken for Open<'_> {
    fn growth(&self) -> f64 {
        self.of.growth()
    }

    fn delayed_growth(&self, more: f64) -> f64 {
        self.of.with_errors(1.0, more).growth()
    }

    fn period(&self) -> Option<f64> {
        Some(self.of.sampled.period)
    }

    fn rates(&self) -> Vec<Complex<f64>> {
        let poles = self.of.poles();
        // What is forgotten within a sample has no frequency.
        let lasting = poles.into_iter().filter(|p| p.norm() > 1e-3);
        let mut rates: Vec<_> = lasting.map(|p| p.ln() / self.of.sampled.period).collect();
        rates.extend(self.of.base.open_poles());
        rates
    }

    fn response(&self, omega: f64) -> Complex<f64> {
        let z = Complex::new(0.0, omega * self.of.sampled.period).exp();
        let n = self.a.nrows();
        let m = DMatrix::from_fn(n, n, |i, j| {
            let diagonal = if i == j { z } else { Complex::new(0.0, 0.0) };
            diagonal - self.a[(i, j)]
        });
        match m.lu().solve(&self.b.map(|b| Complex::new(b, 0.0))) {
            // The held command is the last of all.
            Some(x) => -x[n - 1],
            None => Complex::new(f64::INFINITY, 0.0),
        }
    }
}
