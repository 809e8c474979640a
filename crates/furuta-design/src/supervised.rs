//! A whole control system on a simulated rig, timed as a real loop is.

use furuta_ctrl::estimators::Measurement;
use furuta_ctrl::supervisor::{Fault, Output, Request, Supervisor, SupervisorState};
use furuta_model::{Plant, PlantError, PlantState, Rig, Sensors, State};

/// Longest step of the integrator, s: RK4 then errs by less than an encoder count on all built-in rigs.
const LONGEST_STEP: f64 = 1e-3;

/// A supervisor on a rig: encoders are read at a sample, the command that follows acts from the next sample on.
#[derive(Clone, Debug)]
pub struct Supervised<'a> {
    supervisor: &'a Supervisor<f64>,
    plant: Plant<f64>,
    sensors: Sensors,
    command_limit: f64,
    period: f64,
    substeps: u32,
}

/// A run under way.
#[derive(Clone, Debug)]
pub struct Run {
    /// The rig.
    pub plant: PlantState<f64>,
    /// The supervisor's memory.
    pub memory: SupervisorState<f64>,
    /// The command that acts until the next sample, V.
    held: f64,
}

/// One sample of a run.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Sample {
    /// The true state.
    pub x: State<f64>,
    /// What the encoders read, rad.
    pub reading: [f64; 2],
    /// The command that acts from this sample to the next, V.
    pub held: f64,
    /// What the supervisor decided at it, for the sample after.
    pub output: Output<f64>,
    /// Why it has switched the motor off, if it has.
    pub fault: Option<Fault>,
}

impl<'a> Supervised<'a> {
    /// `supervisor` on `rig` with its effects and encoders, sampled every `period` seconds.
    ///
    /// # Errors
    /// A rig that cannot be, or not be stepped with this period.
    pub fn new(
        supervisor: &'a Supervisor<f64>,
        rig: &Rig,
        period: f64,
    ) -> Result<Self, PlantError> {
        let plant = rig.try_plant()?;
        plant.check_period(period)?;
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // at most 1000
        let substeps = (period / LONGEST_STEP).ceil() as u32;
        plant.check_period(period / f64::from(substeps))?;
        Ok(Self {
            supervisor,
            plant,
            sensors: rig.sensors,
            command_limit: rig.params.motor.command_limit,
            period,
            substeps,
        })
    }

    /// The same with at least this many steps of the integrator per sample.
    ///
    /// # Errors
    /// Steps so short that one is shorter than the model can take.
    pub fn with_substeps(mut self, substeps: u32) -> Result<Self, PlantError> {
        self.substeps = self.substeps.max(substeps);
        self.plant
            .check_period(self.period / f64::from(self.substeps))?;
        Ok(self)
    }

    /// Before the first sample, asked to swing up and balance.
    #[must_use]
    pub fn start(&self, x: State<f64>) -> Run {
        let mut memory = self.supervisor.start();
        memory.request(Request::Start);
        Run {
            plant: self.plant.rest(x),
            memory,
            held: 0.0,
        }
    }

    /// What the encoders would read if they had no steps, `[theta, alpha]` in rad.
    #[must_use]
    pub fn angles(&self, run: &Run) -> [f64; 2] {
        self.plant.measure(&run.plant)
    }

    /// One sample, the arm asked to be at `target` (rad) once the pendulum is up; then the rig moves on to the next.
    ///
    /// ```
    /// use furuta_ctrl::supervisor::{Mode, Supervisor};
    /// use furuta_ctrl::{Config, Site};
    /// use furuta_design::supervised::Supervised;
    /// use furuta_model::{Rig, State};
    /// let rig = Rig::builtin("shahzad2022-srv02").ok_or("no such rig")?;
    /// let supervisor = Supervisor::design(&Config::default(), &Site::of(&rig, 0.002))?;
    /// let bench = Supervised::new(&supervisor, &rig, 0.002)?;
    /// let mut run = bench.start(State::hanging());
    /// let modes: Vec<_> = (0..2500).map(|_| bench.sample(&mut run, 0.0).output.mode).collect();
    /// assert_eq!((modes[0], modes[2499]), (Mode::SwingUp, Mode::Balance));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn sample(&self, run: &mut Run, target: f64) -> Sample {
        self.disturbed(run, target, 0.0)
    }

    /// The same with `added` (V) on top of the command decided, within the rig's limit: a test signal in closed loop.
    pub fn disturbed(&self, run: &mut Run, target: f64, added: f64) -> Sample {
        let reading = self.sensors.quantised(self.plant.measure(&run.plant));
        let measurement = Measurement::new(reading[0], reading[1], run.held);
        let output = self
            .supervisor
            .update(&mut run.memory, &measurement, target);
        let sample = Sample {
            x: run.plant.x,
            reading,
            held: run.held,
            output,
            fault: run.memory.fault(),
        };
        self.advance(run, run.held);
        // The rig clips what its own file does not allow.
        run.held = (output.u + added).clamp(-self.command_limit, self.command_limit);
        sample
    }

    /// Moves the rig on by a sample under the command `u` (V), no supervisor asked; what of it the rig's limit lets
    /// through.
    pub fn advance(&self, run: &mut Run, u: f64) -> f64 {
        let u = u.clamp(-self.command_limit, self.command_limit);
        let h = self.period / f64::from(self.substeps);
        for _ in 0..self.substeps {
            self.plant.step(&mut run.plant, u, h);
        }
        u
    }
}
