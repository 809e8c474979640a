//! Ramos-Velasco, Ruiz-Leon, Celikovsky: the pendulum follows a sine, while arm length, pendulum length and mass are
//! not what the controller believes.
//!
//! The paper's experiment starts at `beta = 0.5` rad (its `beta` is our `-alpha`), asks for `beta = 0.1 sin(t)`, and
//! from 2 to 10 s the three parameters are off by 20 %. Its Fig. 5 shows the output regulator of sec. 4.1, Fig. 6 the
//! sliding mode of sec. 4.2; two sliding modes on the surface of an LQR are put beside them.

mod draws;

pub use draws::{Draw, Draws, Summary, draws, factors};

use crate::closed_loop::{ClosedLoop, FALLEN, Sample, Sensing, variation};
use furuta_ctrl::controllers::{
    LqrSliding, NormalFormSliding, OutputRegulator, Reaching, Switching,
};
use furuta_ctrl::design::{DesignError, RegulatorError, SteadyMotion, Weights, lqr};
use furuta_model::params::Coefficients;
use furuta_model::published::Paper;
use furuta_model::{Effect, EffectError, Params, Plant, PlantError, Rig, State, linearize};

/// The controllers that are compared.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Contender {
    /// Sec. 4.1 with the gain that the paper prints in sec. 5.
    Regulator,
    /// Sec. 4.1 with the gain of the LQR on which the sliding surfaces rest.
    RegulatorLqr,
    /// Sec. 4.2, eq. (53) and (54).
    NormalForm,
    /// Sliding mode on the LQR's surface with a boundary layer.
    Layer,
    /// The same, reached by super-twisting.
    Twisting,
}

impl Contender {
    /// All of them, the paper's first.
    pub const ALL: [Self; 5] = [
        Self::Regulator,
        Self::RegulatorLqr,
        Self::NormalForm,
        Self::Layer,
        Self::Twisting,
    ];

    /// In words.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Regulator => "regulator (4.1)",
            Self::RegulatorLqr => "regulator, LQR gain",
            Self::NormalForm => "sliding (4.2)",
            Self::Layer => "LQR surface, layer",
            Self::Twisting => "LQR surface, twisting",
        }
    }
}

/// Factors on the arm's length, the pendulum's length and its mass: `l1`, `l2`, `m2`.
pub type Factors = [f64; 3];

/// Nothing is off.
pub const NOMINAL: Factors = [1.0; 3];

/// The experiment.
#[derive(Clone, Debug, PartialEq)]
pub struct Experiment {
    /// What the controllers believe.
    pub rig: Rig,
    /// The paper's planar model, without the `sin²(alpha)` inertia; the full one otherwise. Plant and controllers
    /// alike.
    pub planar: bool,
    /// Frequency of the reference, rad/s.
    pub lambda: f64,
    /// Its amplitude, rad.
    pub amplitude: f64,
    /// The pendulum's angle at the start, `beta = -alpha`, rad.
    pub start: f64,
    /// Order of the series for the regulator equation.
    pub order: usize,
    /// Samples per second.
    pub rate: f64,
    /// Encoders of the rig in place of perfect states, with speeds filtered at this corner frequency (rad/s).
    pub encoders: Option<f64>,
    /// Coulomb friction on the arm of which no controller knows, N m.
    pub friction: f64,
    /// When the parameters are off, s.
    pub off: [f64; 2],
    /// How long it lasts, s.
    pub duration: f64,
    /// The controllers' parameters.
    pub tuning: Tuning,
}

/// The controllers' parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Tuning {
    /// Of (53) and (54).
    pub switching: Switching<f64>,
    /// Diagonal of Q (theta, alpha, theta', alpha') and R of the LQR on the normal form, whose input is the pendulum's
    /// acceleration (rad/s²).
    pub normal_form: ([f64; 4], f64),
    /// The same of the LQR behind the surfaces, whose input is the command (V).
    pub surface: ([f64; 4], f64),
    /// Gain (V) and width (V s) of the boundary layer.
    pub layer: [f64; 2],
    /// Rate of disturbances for the super-twisting, V/s, and the most that it learns, V.
    pub twisting: [f64; 2],
}

/// Why the experiment cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ExperimentError {
    /// No gain.
    #[error("{0}")]
    Design(#[from] DesignError),
    /// No steady motion.
    #[error("{0}")]
    Regulator(#[from] RegulatorError),
    /// No plant.
    #[error("{0}")]
    Plant(#[from] PlantError),
    /// A setting outside its range.
    #[error("{0}")]
    Effect(#[from] EffectError),
    /// The paper's gain for a rig that is not the paper's.
    #[error("the printed gain of sec. 5 is for the rig ramos-velasco, not for {rig}")]
    NotThePapersRig {
        /// The rig's name.
        rig: String,
    },
}

/// A controller of any of the kinds.
#[derive(Clone, Debug, PartialEq)]
pub enum Tracker {
    /// Sec. 4.1.
    Regulator(Box<OutputRegulator<f64>>),
    /// Sec. 4.2.
    NormalForm(Box<NormalFormSliding<f64>>),
    /// On the LQR's surface.
    Surface(Box<LqrSliding<f64>>),
}

impl Experiment {
    /// The paper's: planar, 0.1 sin(t) from 0.5 rad, perfect states; 1 kHz and third order in the place of the paper's
    /// continuous time.
    #[must_use]
    pub fn paper(rig: &Rig) -> Self {
        Self {
            rig: rig.clone(),
            planar: true,
            lambda: 1.0,
            amplitude: 0.1,
            start: 0.5,
            order: 3,
            rate: 1000.0,
            encoders: None,
            friction: 0.0,
            off: [2.0, 10.0],
            duration: 15.0,
            tuning: Tuning::default(),
        }
    }

    /// The same pendulum as it turns: the full model, seventh order, an amplitude that it can follow.
    #[must_use]
    pub fn full(rig: &Rig) -> Self {
        Self {
            planar: false,
            amplitude: 0.03,
            start: 0.05,
            order: 7,
            ..Self::paper(rig)
        }
    }

    /// The full model as a rig: 500 Hz, encoders, friction on the arm.
    #[must_use]
    pub fn rig_like(rig: &Rig) -> Self {
        Self {
            rate: 500.0,
            encoders: Some(100.0),
            friction: 0.05,
            ..Self::full(rig)
        }
    }

    /// The model's coefficients with these factors on its parameters.
    #[must_use]
    pub fn coefficients(&self, factors: Factors) -> Coefficients<f64> {
        let p = &self.rig.params;
        let mut params: Params<f64> = *p;
        params.arm.length *= factors[0];
        params.pendulum.com *= factors[1];
        params.pendulum.mass *= factors[2];
        let c = params.coefficients();
        Coefficients {
            swing: if self.planar { 0.0 } else { c.swing },
            ..c
        }
    }

    /// The steady motion of the nominal model.
    ///
    /// # Errors
    /// Those of [`SteadyMotion::solve`].
    pub fn steady(&self) -> Result<SteadyMotion<f64>, RegulatorError> {
        SteadyMotion::solve(&self.coefficients(NOMINAL), self.lambda, self.order)
    }

    /// The reference at a time (s), in our sign: `alpha = -amplitude sin(lambda t)`.
    #[must_use]
    pub fn reference(&self, t: f64) -> State<f64> {
        let (sin, cos) = (self.lambda * t).sin_cos();
        let a = self.amplitude;
        State::new(0.0, -a * sin, 0.0, -a * self.lambda * cos)
    }

    fn plant(&self, factors: Factors) -> Result<Plant<f64>, ExperimentError> {
        let friction = Effect::new("arm.coulomb", &[self.friction])?;
        Ok(Plant::from_coefficients(
            self.coefficients(factors),
            &[friction],
        )?)
    }

    /// A contender for the nominal model.
    ///
    /// # Errors
    /// A tuning for which there is no gain; the paper's gain for another rig.
    pub fn controller(&self, contender: Contender) -> Result<Tracker, ExperimentError> {
        let model = self.coefficients(NOMINAL);
        let linear = linearize(
            &Plant::from_coefficients(model, &[])?,
            State::upright(),
            0.0,
        );
        let command_limit = self.rig.params.motor.command_limit;
        let (steady, tuning) = (self.steady()?, &self.tuning);
        let weights = |(q, r): ([f64; 4], f64)| Weights::diagonal(q, [r]);
        let regulator = |gain| {
            Tracker::Regulator(Box::new(OutputRegulator {
                model,
                steady,
                gain,
                command_limit,
            }))
        };
        let surface = |reaching| {
            let weights = weights(tuning.surface);
            LqrSliding::on_surface(&model, &linear, &steady, &weights, reaching, command_limit)
                .map(|c| Tracker::Surface(Box::new(c)))
        };
        Ok(match contender {
            Contender::Regulator => regulator(printed_gain(&self.rig)?),
            Contender::RegulatorLqr => {
                let gain = lqr(&linear.a, &linear.b, &weights(tuning.surface))?.gain;
                regulator(gain.into())
            }
            Contender::NormalForm => Tracker::NormalForm(Box::new(NormalFormSliding {
                model,
                steady,
                gain: NormalFormSliding::gain(
                    &model,
                    &tuning.switching,
                    &weights(tuning.normal_form),
                )?,
                switching: tuning.switching,
                command_limit,
            })),
            Contender::Layer => surface(Reaching::BoundaryLayer {
                gain: tuning.layer[0],
                width: tuning.layer[1],
            })?,
            Contender::Twisting => surface(Reaching::super_twisting(
                tuning.twisting[0],
                tuning.twisting[1],
            ))?,
        })
    }

    /// A run with these factors on the parameters while they are off.
    ///
    /// # Errors
    /// A setting that is not possible.
    pub fn run(&self, tracker: &Tracker, factors: Factors) -> Result<Vec<Sample>, ExperimentError> {
        let nominal = self.plant(NOMINAL)?;
        let period = 1.0 / self.rate;
        nominal.check_period(period)?;
        let experiment = ClosedLoop {
            plants: vec![
                (0.0, nominal.clone().into()),
                (self.off[0], self.plant(factors)?.into()),
                (self.off[1], nominal.into()),
            ],
            start: State::new(0.0, -self.start, 0.0, 0.0),
            period,
            substeps: (1000.0 * period).ceil() as usize,
            duration: self.duration,
            sensing: match self.encoders {
                None => Sensing::Perfect,
                Some(cutoff) => Sensing::Encoders {
                    sensors: self.rig.sensors,
                    cutoff,
                },
            },
        };
        let reference = |t| self.reference(t);
        Ok(match tracker {
            Tracker::Regulator(c) => experiment.run(c.as_ref(), reference),
            Tracker::NormalForm(c) => experiment.run(c.as_ref(), reference),
            Tracker::Surface(c) => experiment.run(c.as_ref(), reference),
        })
    }

    /// What a run came to. The tracking error is looked at from 2 s after the parameters went off until they are right
    /// again.
    #[must_use]
    pub fn outcome(&self, samples: &[Sample]) -> Outcome {
        let up = samples.iter().all(|s| s.x.alpha.abs() <= FALLEN);
        let from = self.off[0] + 2.0;
        let inside = |s: &&Sample| s.t >= from && s.t <= self.off[1];
        let (mut bound, mut squares, mut count, mut theta) = (0.0_f64, 0.0, 0.0, 0.0_f64);
        for s in samples.iter().filter(inside) {
            let error = (s.x.alpha - s.reference.alpha).abs();
            bound = bound.max(error);
            theta = theta.max(s.x.theta.abs());
            squares += error * error;
            count += 1.0;
        }
        Outcome {
            up,
            bound: if up { bound } else { f64::INFINITY },
            rms: if up {
                f64::sqrt(squares / f64::max(count, 1.0))
            } else {
                f64::INFINITY
            },
            theta,
            command: samples.iter().fold(0.0, |m, s| f64::max(m, s.u.abs())),
            chatter: variation(samples, from),
        }
    }
}

/// What a run came to.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Outcome {
    /// Whether the pendulum stayed up all the time.
    pub up: bool,
    /// Largest tracking error while the parameters are off, rad; infinite where the pendulum fell.
    pub bound: f64,
    /// Its root mean square, rad.
    pub rms: f64,
    /// Largest angle of the arm meanwhile, rad.
    pub theta: f64,
    /// Largest command of the whole run, V.
    pub command: f64,
    /// Total variation of the command a second, V/s.
    pub chatter: f64,
}

/// The gain of sec. 5 in our coordinates.
fn printed_gain(rig: &Rig) -> Result<[f64; 4], ExperimentError> {
    let not = || ExperimentError::NotThePapersRig {
        rig: rig.name.clone(),
    };
    let paper = Paper::of("ramos-velasco")
        .filter(|p| p.rig == rig.name)
        .ok_or_else(not)?;
    let printed: Vec<f64> = paper
        .figures
        .iter()
        .filter(|f| f.what.starts_with("K["))
        .map(|f| f.printed)
        .collect();
    match printed[..] {
        [alpha, beta, alpha_dot, beta_dot] => Ok([alpha, -beta, alpha_dot, -beta_dot]),
        _ => Err(not()),
    }
}

impl Default for Tuning {
    /// The paper's `eps`; what it does not print was chosen on the three experiments of [`Experiment`] together.
    fn default() -> Self {
        Self {
            switching: Switching {
                gamma: 2.0,
                eps: 0.1,
                filter: 0.0,
            },
            normal_form: ([1.0; 4], 0.01),
            surface: ([1.0; 4], 1.0),
            layer: [2.0, 0.05],
            twisting: [2.0, 2.0],
        }
    }
}
