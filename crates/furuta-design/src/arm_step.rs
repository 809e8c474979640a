//! A step of the arm under four controllers with the same weights: what knowing the limits is worth.

use std::time::{Duration, Instant};

use crate::closed_loop::{ClosedLoop, FALLEN, Sample, Sensing};
use crate::mpc::InteriorPoint;
use furuta_ctrl::controllers::{Controller, Design, LqrSliding, Mpc, StateFeedback};
use furuta_ctrl::settings::{Settings, SettingsError};
use furuta_ctrl::{ConfigError, Site};
use furuta_model::{Rig, State};

/// The experiment: from rest upright the arm is asked to be elsewhere. Nonlinear model without effects, perfect states.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Experiment {
    /// Where the arm is to go, rad.
    pub step: f64,
    /// Samples per second.
    pub rate: f64,
    /// s.
    pub duration: f64,
    /// Diagonal of `Q` and `R` of all four; `None`: those of [`furuta_ctrl::design::balance_weights`] with the arm at
    /// half of the step in the place of its own, which asks for more than there is.
    pub weights: Option<([f64; 4], f64)>,
    /// How far the pendulum may lean, rad; `None`: half of what it leans under the LQR.
    pub pendulum: Option<f64>,
    /// Largest number of changes of the active limits in each sample.
    pub iterations: usize,
}

impl Default for Experiment {
    /// 0.5 rad, 500 Hz, 5 s, at most 100 changes.
    fn default() -> Self {
        Self {
            step: 0.5,
            rate: 500.0,
            duration: 5.0,
            weights: None,
            pendulum: None,
            iterations: 200,
        }
    }
}

/// Who holds the pendulum.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Contender {
    /// State feedback, cut off at the command limit.
    Lqr,
    /// A sliding mode on the LQR's surface, with a boundary layer.
    Sliding,
    /// Model predictive control solved to the end.
    InteriorPoint,
    /// Model predictive control by the active-set method, as on a microcontroller.
    ActiveSet,
}

impl Contender {
    /// All of them.
    pub const ALL: [Self; 4] = [
        Self::Lqr,
        Self::Sliding,
        Self::InteriorPoint,
        Self::ActiveSet,
    ];

    /// In words.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Lqr => "LQR",
            Self::Sliding => "sliding mode",
            Self::InteriorPoint => "MPC, Clarabel",
            Self::ActiveSet => "MPC, active set",
        }
    }
}

/// A run and its figures.
#[derive(Clone, Debug)]
pub struct Run {
    /// Who.
    pub contender: Contender,
    /// What happened; ends where the pendulum has fallen.
    pub samples: Vec<Sample>,
    /// In numbers.
    pub figures: Figures,
}

/// All runs.
#[derive(Clone, Debug)]
pub struct Study {
    /// Diagonal of `Q`, and `R`.
    pub weights: ([f64; 4], f64),
    /// How far the pendulum may lean, rad.
    pub pendulum: f64,
    /// Largest command, V.
    pub command: f64,
    /// One for each of [`Contender::ALL`].
    pub runs: Vec<Run>,
}

/// What became of a run, in numbers.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Figures {
    /// Time after which the arm stays within 2 % of the step of its target, s; `None`: it does not.
    pub settle: Option<f64>,
    /// How far the arm goes beyond its target, as a part of the step.
    pub overshoot: f64,
    /// Largest angle of the pendulum from upright, rad.
    pub alpha: f64,
    /// Largest command given, V.
    pub command: f64,
    /// Samples in which the pendulum leans by more than a hundredth above its limit: the nonlinear plant is not quite
    /// the model.
    pub violations: usize,
    /// Samples in which the command is at its limit.
    pub saturated: usize,
    /// Integral of the command's square, V² s.
    pub effort: f64,
    /// Sum of `e'Qe + R u²` over time, what all of them minimise.
    pub cost: f64,
    /// Whether the pendulum stayed up.
    pub up: bool,
    /// Mean time of one update on this machine.
    pub time: Duration,
}

/// Why there is no study.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StudyError {
    /// A setting of a controller.
    #[error("{0}")]
    Settings(#[from] SettingsError),
    /// No controller.
    #[error("{0}")]
    Config(#[from] ConfigError),
    /// A sample period at which the model cannot be stepped.
    #[error("{0}")]
    Plant(#[from] furuta_model::PlantError),
    /// A number outside its range.
    #[error("{name} = {value} {unit} must be above 0 and at most {max}")]
    Range {
        /// What.
        name: &'static str,
        /// As given.
        value: f64,
        /// The largest.
        max: f64,
        /// Its unit.
        unit: &'static str,
    },
}

impl Experiment {
    /// All contenders on a rig.
    ///
    /// # Errors
    /// Numbers outside their ranges; weights with which there is no gain.
    pub fn run(&self, rig: &Rig) -> Result<Study, StudyError> {
        for (name, value, max, unit) in [
            ("step", self.step.abs(), 100.0, "rad"),
            ("rate", self.rate, 1e5, "Hz"),
            ("duration", self.duration, 600.0, "s"),
        ] {
            if !(value > 0.0 && value <= max) {
                return Err(StudyError::Range {
                    name,
                    value,
                    max,
                    unit,
                });
            }
        }
        let period = 1.0 / self.rate;
        rig.nominal_plant::<f64>().check_period(period)?;
        let site = Site::of(rig, period);
        let weights = self.weights.unwrap_or_else(|| self.eager(rig));
        let weighted = |standard: Settings| -> Result<Settings, StudyError> {
            Ok(standard.with("q", &weights.0)?.with("r", &[weights.1])?)
        };
        let lqr = StateFeedback::design(&weighted(StateFeedback::<f64>::settings())?, &site)?;
        let sliding = LqrSliding::design(&weighted(LqrSliding::<f64>::settings())?, &site)?;
        let first = self.of(Contender::Lqr, rig, &lqr);
        let lean = largest(&first.samples, |s| s.x.alpha);
        let pendulum = self.pendulum.unwrap_or(0.5 * lean.min(1.0));
        #[allow(clippy::cast_precision_loss)]
        let predictive = weighted(Mpc::<f64>::settings())?
            .with("pendulum_angle", &[pendulum])?
            .with("iterations", &[self.iterations as f64])?;
        let mpc = Mpc::design(&predictive, &site)?;
        let mut runs = vec![
            first,
            self.of(Contender::Sliding, rig, &sliding),
            self.of(Contender::InteriorPoint, rig, &InteriorPoint(mpc)),
            self.of(Contender::ActiveSet, rig, &mpc),
        ];
        for run in &mut runs {
            run.figures
                .count(&run.samples, weights, pendulum, site.command_limit);
        }
        Ok(Study {
            weights,
            pendulum,
            command: site.command_limit,
            runs,
        })
    }

    /// Weights that ask for more than the motor has.
    fn eager(&self, rig: &Rig) -> ([f64; 4], f64) {
        let standard = furuta_ctrl::design::balance_weights(&rig.params);
        let mut q: [f64; 4] = standard.q.diagonal().into();
        q[0] = (2.0 / self.step).powi(2);
        (q, standard.r[0])
    }

    fn of<C: Controller<f64>>(&self, contender: Contender, rig: &Rig, controller: &C) -> Run {
        let target = State::new(self.step, 0.0, 0.0, 0.0);
        let timed = Timed {
            controller,
            spent: std::cell::Cell::default(),
        };
        let samples = ClosedLoop {
            plants: vec![(0.0, rig.nominal_plant().into())],
            start: State::upright(),
            period: 1.0 / self.rate,
            substeps: 1,
            duration: self.duration,
            sensing: Sensing::Perfect,
        }
        .run(&timed, |_| target);
        let updates = u32::try_from(samples.len()).unwrap_or(u32::MAX).max(1);
        let figures = Figures::of(&samples, self.step, timed.spent.get() / updates);
        Run {
            contender,
            samples,
            figures,
        }
    }
}

/// A controller and how long it has worked.
struct Timed<'a, C> {
    controller: &'a C,
    spent: std::cell::Cell<Duration>,
}

impl<C: Controller<f64>> Controller<f64> for Timed<'_, C> {
    type State = C::State;

    fn start(&self) -> C::State {
        self.controller.start()
    }

    fn update(&self, state: &mut C::State, x: &State<f64>, r: &State<f64>, h: f64) -> f64 {
        let from = Instant::now();
        let u = self.controller.update(state, x, r, h);
        self.spent.set(self.spent.get() + from.elapsed());
        u
    }
}

fn largest(samples: &[Sample], value: impl Fn(&Sample) -> f64) -> f64 {
    samples.iter().map(|s| value(s).abs()).fold(0.0, f64::max)
}

impl Figures {
    fn of(samples: &[Sample], step: f64, time: Duration) -> Self {
        let alpha = largest(samples, |s| s.x.alpha);
        let beyond = |s: &Sample| (s.x.theta - step) / step;
        let outside = samples.iter().rfind(|s| beyond(s).abs() > 0.02);
        let end = samples.last().map_or(0.0, |s| s.t);
        let up = alpha <= FALLEN;
        Self {
            settle: outside
                .map_or(Some(0.0), |s| Some(s.t))
                .filter(|t| up && t + 0.05 < end),
            overshoot: samples.iter().map(beyond).fold(0.0, f64::max),
            alpha,
            command: largest(samples, |s| s.u),
            violations: 0,
            saturated: 0,
            effort: 0.0,
            cost: 0.0,
            up,
            time,
        }
    }

    fn count(&mut self, samples: &[Sample], (q, r): ([f64; 4], f64), pendulum: f64, command: f64) {
        for s in samples {
            self.violations += usize::from(s.x.alpha.abs() > 1.01 * pendulum);
            self.saturated += usize::from(s.u.abs() >= command * (1.0 - 1e-9));
        }
        for pair in samples.windows(2) {
            let (s, h) = (pair[0], pair[1].t - pair[0].t);
            let e = (s.x - s.reference).to_array();
            let state: f64 = e.iter().zip(q).map(|(e, q)| q * e * e).sum();
            self.effort += s.u * s.u * h;
            self.cost += (state + r * s.u * s.u) * h;
        }
    }
}
