//! A controller on a plant: samples, sensors, a plant that changes on the way.

use furuta_ctrl::controllers::Controller;
use furuta_ctrl::estimators::{Derivative, DerivativeState};
use furuta_ctrl::wrap;
use furuta_model::discretize::zero_order_hold;
use furuta_model::{Linear, Plant, PlantState, Sensors, State};
use nalgebra::{SMatrix, SVector};

/// What the controller is connected to.
#[derive(Clone, Debug)]
pub enum Model {
    /// The nonlinear model with its effects, stepped by RK4.
    Rig(Box<Plant<f64>>),
    /// A linear model, stepped exactly.
    Linear(Linear),
}

impl From<Plant<f64>> for Model {
    fn from(plant: Plant<f64>) -> Self {
        Self::Rig(Box::new(plant))
    }
}

/// What the controller sees.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Sensing {
    /// The state itself.
    Perfect,
    /// Encoders, and speeds as filtered difference quotients ([`Derivative`]).
    Encoders {
        /// The encoders.
        sensors: Sensors,
        /// Corner frequency of the speeds' filters, rad/s.
        cutoff: f64,
    },
}

/// An experiment: where it starts, how it is sampled, which plant acts from when on.
#[derive(Clone, Debug)]
pub struct ClosedLoop {
    /// The plants, each from its time (s) on; the first one from the start.
    pub plants: Vec<(f64, Model)>,
    /// Where it starts.
    pub start: State<f64>,
    /// Sample period, s; the command is held in between.
    pub period: f64,
    /// Steps of the integrator per sample.
    pub substeps: usize,
    /// How long it lasts, s.
    pub duration: f64,
    /// What the controller sees.
    pub sensing: Sensing,
}

/// One sample: the state, what was wanted, the command given then.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Sample {
    /// s.
    pub t: f64,
    /// The true state.
    pub x: State<f64>,
    /// What the controller was asked for.
    pub reference: State<f64>,
    /// The command from here on, V.
    pub u: f64,
}

/// The pendulum counts as fallen beyond this angle from upright, rad.
pub const FALLEN: f64 = std::f64::consts::FRAC_PI_2;

impl ClosedLoop {
    /// The samples until the end, or until the pendulum has fallen: then the last one has `|alpha|` above [`FALLEN`] or
    /// is not finite.
    ///
    /// Between a plant and the next the state is continuous. A linear model knows no effects: what a plant before it
    /// remembers is lost.
    ///
    /// ```
    /// use furuta_ctrl::{controllers::StateFeedback, design::balance};
    /// use furuta_design::closed_loop::{ClosedLoop, Sensing};
    /// use furuta_model::{Rig, State};
    /// let rig = Rig::builtin("qube-servo-2").ok_or("no such rig")?;
    /// let control = StateFeedback::new(&balance(&rig.params, 0.002)?, 10.0);
    /// let samples = ClosedLoop {
    ///     plants: vec![(0.0, rig.plant().into())],
    ///     start: State::new(0.0, 0.1, 0.0, 0.0),
    ///     period: 0.002, substeps: 1, duration: 3.0, sensing: Sensing::Perfect,
    /// }.run(&control, |_| State::upright());
    /// assert_eq!(samples.len(), 1501);
    /// assert!(samples[1500].x.alpha.abs() < 1e-3);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn run<C: Controller<f64>>(
        &self,
        controller: &C,
        reference: impl Fn(f64) -> State<f64>,
    ) -> Vec<Sample> {
        let samples = (self.duration / self.period).round() as usize;
        let mut out = Vec::with_capacity(samples + 1);
        let mut memory = controller.start();
        let mut sensors = SensorModel::new(self.sensing, self.period);
        let mut plants = self.plants.iter().peekable();
        let Some((_, first)) = plants.next() else {
            return out;
        };
        let mut plant = PlantModel::at(first, self.start, self.step());
        for k in 0..=samples {
            let t = k as f64 * self.period;
            // Half a period early: sums of periods miss round times by rounding.
            while let Some((_, model)) = plants.next_if(|(from, _)| *from <= t + 0.5 * self.period)
            {
                plant = plant.handed_to(model, self.step());
            }
            let wanted = reference(t);
            let x = plant.state();
            let u = controller.update(&mut memory, &sensors.measure(&plant), &wanted, self.period);
            out.push(Sample {
                t,
                x,
                reference: wanted,
                u,
            });
            if !(wrap(x.alpha).abs() <= FALLEN) {
                break;
            }
            plant.advance(u, self.step(), self.substeps);
        }
        out
    }

    fn step(&self) -> f64 {
        self.period / self.substeps.max(1) as f64
    }
}

/// A plant in motion.
enum PlantModel<'a> {
    Rig(&'a Plant<f64>, Box<PlantState<f64>>),
    Linear {
        a: SMatrix<f64, 4, 4>,
        b: SVector<f64, 4>,
        x: SVector<f64, 4>,
    },
}

impl<'a> PlantModel<'a> {
    fn at(model: &'a Model, x: State<f64>, step: f64) -> Self {
        match model {
            Model::Rig(plant) => Self::Rig(plant, Box::new(plant.rest(x))),
            Model::Linear(linear) => {
                let (a, b) = zero_order_hold(&linear.a, &linear.b, step);
                Self::Linear { a, b, x: x.into() }
            }
        }
    }

    fn handed_to(self, model: &'a Model, step: f64) -> Self {
        match (self, model) {
            (Self::Rig(_, state), Model::Rig(plant)) => Self::Rig(plant, state),
            (before, model) => Self::at(model, before.state(), step),
        }
    }

    fn state(&self) -> State<f64> {
        match self {
            Self::Rig(_, s) => s.x,
            Self::Linear { x, .. } => (*x).into(),
        }
    }

    fn angles(&self) -> [f64; 2] {
        match self {
            Self::Rig(plant, s) => plant.measure(s),
            Self::Linear { x, .. } => [x[0], x[1]],
        }
    }

    fn advance(&mut self, u: f64, step: f64, steps: usize) {
        for _ in 0..steps.max(1) {
            match self {
                Self::Rig(plant, s) => plant.step(s, u, step),
                Self::Linear { a, b, x } => *x = *a * *x + *b * u,
            }
        }
    }
}

/// Sensors and what makes speeds of them.
enum SensorModel {
    Perfect,
    Encoders {
        sensors: Sensors,
        speed: Derivative<f64>,
        memory: [DerivativeState<f64>; 2],
    },
}

impl SensorModel {
    fn new(sensing: Sensing, period: f64) -> Self {
        match sensing {
            Sensing::Perfect => Self::Perfect,
            Sensing::Encoders { sensors, cutoff } => {
                let speed = Derivative::new(cutoff, period);
                Self::Encoders {
                    sensors,
                    memory: [speed.start(), speed.start()],
                    speed,
                }
            }
        }
    }

    fn measure(&mut self, plant: &PlantModel<'_>) -> State<f64> {
        match self {
            Self::Perfect => plant.state(),
            Self::Encoders {
                sensors,
                speed,
                memory,
            } => {
                let [theta, alpha] = sensors.quantised(plant.angles());
                State::new(
                    theta,
                    alpha,
                    speed.update(&mut memory[0], theta),
                    speed.update(&mut memory[1], alpha),
                )
            }
        }
    }
}

/// Total variation of the command from `from` (s) on, per second, V/s: how much it chatters.
#[must_use]
pub fn variation(samples: &[Sample], from: f64) -> f64 {
    let late: Vec<_> = samples.iter().filter(|s| s.t >= from).collect();
    let span = late.last().map_or(0.0, |s| s.t - from);
    let total: f64 = late.windows(2).map(|s| (s[1].u - s[0].u).abs()).sum();
    if span > 0.0 { total / span } else { 0.0 }
}
