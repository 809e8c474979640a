//! A rig with its effects under a linear law: the whole closed loop, its poles, its response and its margins.
//!
//! A design sees four states; the loop has more. [`RigLoop`] closes it over [`LinearPlant`]: springs, cables and tilt
//! where they let the rig rest under this very law, a flexible drive and a lag as states, delays as the commands of the
//! last samples (exact for any share of a sample) or, in continuous time, as a Padé approximation. A delay of the
//! encoders is one of the command in a linear loop. The law is given the true states at the sample;
//! [`RigLoop::observed`] gives it an estimator's. Counts and limits are in a rehearsal ([`crate::rehearsal`]).

mod margins;
mod observed;
mod sampled;

pub use margins::Margins;
pub use observed::ObservedLoop;

use furuta_ctrl::Site;
use furuta_ctrl::compensation::holding_voltage;
use furuta_ctrl::config::ConfigError;
use furuta_ctrl::controllers::{AnyController, Controller, LinearLaw};
use furuta_ctrl::settings::Settings;
use furuta_model::linear_plant::{
    Amplitudes, Hold, LinearPlant, MAX_STATES, NoEquilibrium, linear_plant, smooth,
};
use furuta_model::{Plant, PlantError, Rig};
use nalgebra::{Complex, DMatrix, SMatrix, SVector};
use sampled::Sampled;

/// `u = -gain x - integral s`, `s` the integral of the arm's angle.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Law {
    /// On `[theta, alpha, theta_dot, alpha_dot]`, V/rad and V s/rad.
    pub gain: [f64; 4],
    /// V/(rad s); 0: none. Of a sampled loop the integral is exact: a state of the plant, sampled with it.
    pub integral: f64,
}

impl Law {
    /// Without an integral.
    #[must_use]
    pub fn of_states(gain: [f64; 4]) -> Self {
        let integral = 0.0;
        Self { gain, integral }
    }
}

impl Law {
    /// The law that a controller with these settings is near upright, made for this site: an `mpc` its regulator's, a
    /// `pid` without its low pass, a `scheduled_lqr` that of a resting arm.
    ///
    /// # Errors
    /// [`LawError`]; settings that are not possible there.
    ///
    /// ```
    /// use furuta_ctrl::{Site, controllers};
    /// use furuta_design::rig_loop::Law;
    /// use furuta_model::Rig;
    /// let rig = Rig::builtin("shahzad2022-srv02").ok_or("no such rig")?;
    /// let site = Site::of(&rig, 0.002);
    /// let of = |kind| Law::of_controller(&controllers::settings(kind).expect("listed"), &site);
    /// assert_eq!(of("mpc")?, of("lqr")?);
    /// let why = of("lqr_sliding").unwrap_err().to_string();
    /// assert!(why.starts_with("kind = \"lqr_sliding\" has no linear law"));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn of_controller(settings: &Settings, site: &Site<'_>) -> Result<Self, LawError> {
        let controller = AnyController::<f64>::design(settings, site)?;
        Self::of(&controller)
    }

    /// The law that this controller is near upright.
    ///
    /// # Errors
    /// [`LawError::NotLinear`].
    pub fn of(controller: &AnyController<f64>) -> Result<Self, LawError> {
        let LinearLaw { gain, integral } =
            controller.linear_law().ok_or_else(|| LawError::NotLinear {
                kind: controller.spec().id,
            })?;
        Ok(Self { gain, integral })
    }
}

/// Why a controller has no linear law.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LawError {
    /// It switches, or remembers something.
    #[error(
        "kind = \"{kind}\" has no linear law with these settings: it switches, or remembers more than an integral of \
         the arm's angle; see how it does with furuta simulate --controller"
    )]
    NotLinear {
        /// Its kind.
        kind: &'static str,
    },
    /// There is no such controller.
    #[error("{0}")]
    Config(#[from] ConfigError),
}

/// Why there is no loop.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LoopError {
    /// The rig cannot be, or not be sampled like this.
    #[error("{0}")]
    Plant(#[from] PlantError),
    /// Nothing rests upright.
    #[error("{0}")]
    Equilibrium(#[from] NoEquilibrium),
}

/// A rig under a law, in continuous time or sampled with the command held between samples.
#[derive(Clone, Debug)]
pub struct RigLoop {
    /// The linear model of the rig where it rests under the law.
    pub plant: LinearPlant,
    /// The law.
    pub law: Law,
    /// Sample period, s; `None`: continuous time.
    pub period: Option<f64>,
}

/// Order of the Padé approximation of a delay in continuous time.
pub const PADE: usize = 4;

impl RigLoop {
    /// `rig` with its effects under `law`; friction and voltage maps without a slope are described for `amplitudes`.
    ///
    /// Without an integral the rig rests where springs, tilt and the law let it, given the voltage that `furuta run`
    /// adds to hold the arm at its middle; with an integral the arm rests at its middle.
    ///
    /// # Errors
    /// [`LoopError`].
    ///
    /// ```
    /// use furuta_design::rig_loop::{Law, RigLoop};
    /// use furuta_model::linear_plant::Amplitudes;
    /// use furuta_model::{Effect, Rig};
    /// let mut rig = Rig::builtin("shahzad2022-srv02").ok_or("no such rig")?;
    /// let gain = furuta_ctrl::design::balance(&rig.params, 0.002)?.gain;
    /// let law = Law::of_states(std::array::from_fn(|i| gain[i]));
    /// let growth = |rig: &Rig| {
    ///     RigLoop::new(rig, law, Some(0.002), &Amplitudes::NONE).map(|l| l.growth())
    /// };
    /// assert!(growth(&rig)? < -0.5);
    /// rig.effects.push(Effect::new("motor.delay", &[0.15])?);
    /// assert!(growth(&rig)? > 0.5); // 1/s: it falls
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn new(
        rig: &Rig,
        law: Law,
        period: Option<f64>,
        amplitudes: &Amplitudes,
    ) -> Result<Self, LoopError> {
        let plant: Plant<f64> = rig.try_plant()?;
        if let Some(period) = period {
            plant.check_period(period)?;
        }
        let middle = Hold::Arm(0.0);
        let hold = if law.integral == 0.0 {
            Hold::Feedback {
                volts: holding_voltage(&smooth(&plant), 0.0),
                gain: [law.gain[0], law.gain[1]],
            }
        } else {
            middle
        };
        // A law that finds no rest is judged where the arm is held at its middle.
        let plant = linear_plant(&plant, hold, amplitudes)
            .or_else(|_| linear_plant(&plant, middle, amplitudes))?;
        Ok(Self { plant, law, period })
    }

    /// How late the loop is, command and encoders together, s.
    #[must_use]
    pub fn delay(&self) -> f64 {
        self.plant.delay + self.plant.sensor_delay
    }

    /// The same loop, later by `more` seconds.
    #[must_use]
    pub fn delayed(&self, more: f64) -> Self {
        let mut later = self.clone();
        later.plant.delay += more;
        later
    }

    /// The names of its states: the rig's, then `command 1` (the last one), ... or `delay 1`, ... for what is late,
    /// then `integral`.
    #[must_use]
    pub fn states(&self) -> Vec<String> {
        let mut names: Vec<String> = self.plant.states.iter().map(|s| (*s).to_owned()).collect();
        match self.sampled() {
            Some(sampled) => {
                names.extend((1..=sampled.remembered()).map(|k| format!("command {k}")));
            }
            None if self.delay() > 0.0 => {
                names.extend((1..=PADE).map(|k| format!("delay {k}")));
            }
            None => {}
        }
        if self.law.integral != 0.0 {
            names.push("integral".to_owned());
        }
        names
    }

    /// The closed loop's matrix in the order of [`RigLoop::states`]: from sample to sample, or to the rates.
    #[must_use]
    pub fn matrix(&self) -> DMatrix<f64> {
        match self.sampled() {
            Some(sampled) => self.sampled_matrix(&sampled),
            None => self.continuous_matrix(),
        }
    }

    /// The closed loop's poles, in 1/s, or of the sampled system.
    #[must_use]
    pub fn poles(&self) -> Vec<Complex<f64>> {
        self.matrix()
            .complex_eigenvalues()
            .iter()
            .copied()
            .collect()
    }

    /// The fastest growth, 1/s: the largest real part of the poles, as those of continuous time; below 0 where the loop
    /// is stable.
    #[must_use]
    pub fn growth(&self) -> f64 {
        let poles = self.poles();
        let rates = poles.iter().map(|p| match self.period {
            Some(h) => p.norm().ln() / h,
            None => p.re,
        });
        let largest = rates.fold(f64::NEG_INFINITY, f64::max);
        if poles.iter().all(|p| p.re.is_finite() && p.im.is_finite()) {
            largest
        } else {
            f64::NAN
        }
    }

    /// `L` at the frequency `omega` (rad/s): what comes back to the law's output, with its sign changed, of what the
    /// command is given. The delay is exact in continuous time too.
    #[must_use]
    pub fn response(&self, omega: f64) -> Complex<f64> {
        self.response_of(self.sampled().as_ref(), omega)
    }

    /// The same, sampled already.
    fn response_of(&self, sampled: Option<&Sampled>, omega: f64) -> Complex<f64> {
        match sampled {
            Some(sampled) => self.sampled_response(sampled, omega),
            None => {
                let s = Complex::new(0.0, omega);
                let late = (-s * self.delay()).exp();
                let x = self.resolvent(&self.plant.a, s, &self.plant.b.map(|b| late * b));
                self.row(&x, x[0] * s.inv())
            }
        }
    }

    /// The gain, phase, delay and disk margins at the command.
    #[must_use]
    pub fn margins(&self) -> Margins {
        margins::margins(&Prompt {
            of: self,
            sampled: self.sampled(),
        })
    }

    /// The poles of the rig and the delays alone, 1/s or of the sampled system; for frequencies of interest.
    fn open_poles(&self) -> Vec<Complex<f64>> {
        let n = self.plant.states.len();
        let a = DMatrix::from_fn(n, n, |i, j| self.plant.a[(i, j)]);
        a.complex_eigenvalues().iter().copied().collect()
    }

    fn sampled(&self) -> Option<Sampled> {
        let period = self.period?;
        Some(Sampled::new(&self.plant, self.delay(), period))
    }

    /// `K x + k_i s`, `integral` the response of `s`.
    fn row(&self, x: &SVector<Complex<f64>, MAX_STATES>, integral: Complex<f64>) -> Complex<f64> {
        let fed: Complex<f64> = (0..4).map(|i| x[i] * self.law.gain[i]).sum();
        if self.law.integral == 0.0 {
            fed
        } else {
            fed + integral * self.law.integral
        }
    }

    fn sampled_response(&self, sampled: &Sampled, omega: f64) -> Complex<f64> {
        let z = Complex::new(0.0, omega * sampled.period).exp();
        let whole = (0..sampled.whole).fold(Complex::new(1.0, 0.0), |p, _| p / z);
        let input = SVector::<Complex<f64>, MAX_STATES>::from_fn(|i, _| {
            whole * (sampled.newer[i] + sampled.older[i] / z)
        });
        let x = self.resolvent(&sampled.a, z, &input);
        let growth = &sampled.integral;
        let grown: Complex<f64> = (0..MAX_STATES).map(|i| x[i] * growth.row[i]).sum();
        let driven = whole * (growth.older / z + growth.newer);
        self.row(&x, (grown + driven) / (z - 1.0))
    }

    /// The law's row over all states of the closed loop.
    fn feedback(&self, size: usize) -> DMatrix<f64> {
        let mut row = DMatrix::zeros(1, size);
        for (i, k) in self.law.gain.iter().enumerate() {
            row[(0, i)] = *k;
        }
        if self.law.integral != 0.0 {
            row[(0, size - 1)] = self.law.integral;
        }
        row
    }

    fn sampled_matrix(&self, sampled: &Sampled) -> DMatrix<f64> {
        let n = self.plant.states.len();
        let remembered = sampled.remembered();
        let size = n + remembered + usize::from(self.law.integral != 0.0);
        let mut m = DMatrix::zeros(size, size);
        let mut input = DMatrix::zeros(size, 1);
        for i in 0..n {
            for j in 0..n {
                m[(i, j)] = sampled.a[(i, j)];
            }
            // Of the commands, the one of `age` samples ago: 0 is the present one.
            for (age, column) in [
                (sampled.whole, &sampled.newer),
                (sampled.whole + 1, &sampled.older),
            ] {
                if age == 0 {
                    input[(i, 0)] = column[i];
                } else if age <= remembered {
                    m[(i, n + age - 1)] += column[i];
                }
            }
        }
        if self.law.integral != 0.0 {
            let growth = &sampled.integral;
            for i in 0..n {
                m[(size - 1, i)] = growth.row[i];
            }
            m[(size - 1, size - 1)] = 1.0;
            for (age, by) in [
                (sampled.whole, growth.newer),
                (sampled.whole + 1, growth.older),
            ] {
                if age == 0 {
                    input[(size - 1, 0)] = by;
                } else if age <= remembered {
                    m[(size - 1, n + age - 1)] += by;
                }
            }
        }
        if remembered > 0 {
            input[(n, 0)] = 1.0;
        }
        for k in 1..remembered {
            m[(n + k, n + k - 1)] = 1.0;
        }
        m - input * self.feedback(size)
    }

    fn continuous_matrix(&self) -> DMatrix<f64> {
        let n = self.plant.states.len();
        let late = if self.delay() > 0.0 { PADE } else { 0 };
        let size = n + late + usize::from(self.law.integral != 0.0);
        let mut m = DMatrix::zeros(size, size);
        let mut input = DMatrix::zeros(size, 1);
        for i in 0..n {
            for j in 0..n {
                m[(i, j)] = self.plant.a[(i, j)];
            }
            // Of even order, the approximation passes jumps on.
            input[(i, 0)] = self.plant.b[i];
        }
        if late > 0 {
            // (sum c_k (-s t)^k) / (sum c_k (s t)^k), in controllable form; time in units of the delay.
            let [c0, c1, c2, c3] = [1680.0, 840.0, 180.0, 20.0];
            let per_second = 1.0 / self.delay();
            for k in 0..3 {
                m[(n + k, n + k + 1)] = per_second;
            }
            for (k, c) in [c0, c1, c2, c3].into_iter().enumerate() {
                m[(n + 3, n + k)] = -c * per_second;
                // Numerator less denominator: the odd powers change their sign.
                let passed = if k % 2 == 1 { -2.0 * c } else { 0.0 };
                for i in 0..n {
                    m[(i, n + k)] = self.plant.b[i] * passed;
                }
            }
            input[(n + 3, 0)] = per_second;
        }
        if self.law.integral != 0.0 {
            m[(size - 1, 0)] = 1.0;
        }
        m - input * self.feedback(size)
    }

    /// `(w I - A)^-1 b`; infinite where `w` is a pole.
    fn resolvent(
        &self,
        a: &SMatrix<f64, MAX_STATES, MAX_STATES>,
        w: Complex<f64>,
        b: &SVector<Complex<f64>, MAX_STATES>,
    ) -> SVector<Complex<f64>, MAX_STATES> {
        let mut m = a.map(|x| Complex::new(-x, 0.0));
        for i in 0..MAX_STATES {
            let used = i < self.plant.states.len();
            m[(i, i)] += if used { w } else { Complex::new(1.0, 0.0) };
        }
        let nothing = Complex::new(f64::INFINITY, 0.0);
        m.lu().solve(b).unwrap_or_else(|| SVector::repeat(nothing))
    }
}

/// A loop on true states, broken at the command.
struct Prompt<'a> {
    of: &'a RigLoop,
    sampled: Option<Sampled>,
}

impl margins::Broken for Prompt<'_> {
    fn growth(&self) -> f64 {
        self.of.growth()
    }

    fn delayed_growth(&self, more: f64) -> f64 {
        self.of.delayed(more).growth()
    }

    fn period(&self) -> Option<f64> {
        self.of.period
    }

    fn rates(&self) -> Vec<Complex<f64>> {
        let to_continuous = |p: Complex<f64>| match self.of.period {
            Some(h) => p.ln() / h,
            None => p,
        };
        let mut rates: Vec<_> = self.of.poles().into_iter().map(to_continuous).collect();
        rates.extend(self.of.open_poles());
        rates
    }

    fn response(&self, omega: f64) -> Complex<f64> {
        self.of.response_of(self.sampled.as_ref(), omega)
    }
}
