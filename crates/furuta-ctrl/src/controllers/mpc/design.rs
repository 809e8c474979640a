//! The numbers of a predictive controller, from a rig's model.

use super::late::Late;
use super::preview::Preview;
use super::rows::Rows;
use super::{Mpc, PAST, SPEC};
use crate::controllers::{Design, weights};
use crate::design::{DesignError, Prediction, Weights, balance_weights, dlqr};
use crate::error::ConfigError;
use crate::real::{Real, c};
use crate::section::Settings;
use crate::site::Site;
use furuta_model::discretize::zero_order_hold;
use furuta_model::{Linear, Plant};
use nalgebra::RowSVector;

/// What a limit may be missed by, in roundings of the numbers at hand.
const ROUNDINGS: f64 = 64.0;
/// Price of an angle beyond its limit by as much again, at each time looked at, in units of the cost of the full
/// command.
const PRICE: f64 = 30.0;
/// The horizon in units of the pendulum's time constant.
const HORIZON: f64 = 10.0;

/// What angles may be, and how the solver works.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Bounds {
    /// Largest command either way, V.
    pub command: f64,
    /// Largest angle of the pendulum from upright, rad; `None`: any.
    pub pendulum: Option<f64>,
    /// Largest angle of the arm from zero, rad; `None`: any.
    pub arm: Option<f64>,
    /// Largest rate of the command either way, V/s; `None`: any.
    pub rate: Option<f64>,
}

impl<const M: usize> Mpc<f64, M> {
    /// For the upright linearisation sampled at `h` (s), looking `horizon` (s) ahead.
    ///
    /// # Errors
    /// Those of [`crate::design::riccati::discrete`].
    pub fn new(
        upright: &Linear,
        h: f64,
        weights: &Weights<f64, 4, 1>,
        horizon: f64,
        bounds: &Bounds,
        iterations: usize,
    ) -> Result<Self, DesignError> {
        let (a, b) = zero_order_hold(&upright.a, &upright.b, h);
        let regulator = dlqr(&a, &b, weights)?;
        // At most a minute's samples: the range of `horizon` over the shortest period of a loop.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let samples = libm::round(horizon / h).clamp(0.0, 1e6) as usize;
        let prediction = Prediction::<4, M>::new(&b, &regulator, samples);
        let any = f64::INFINITY;
        let (pendulum, arm) = (bounds.pendulum.unwrap_or(any), bounds.arm.unwrap_or(any));
        let step = bounds.rate.unwrap_or(any) * h;
        let price = |limit: f64| PRICE * bounds.command * bounds.command / limit;
        let rows = [
            Rows::new(&prediction.command(), bounds.command, any),
            Rows::new(
                &prediction.output(&RowSVector::<f64, 4>::new(0.0, 1.0, 0.0, 0.0)),
                pendulum,
                price(pendulum),
            ),
            Rows::new(
                &prediction.output(&RowSVector::<f64, 4>::new(1.0, 0.0, 0.0, 0.0)),
                arm,
                price(arm),
            ),
            Rows::changes(&prediction.command(), step, |i| prediction.length(i)),
        ];
        Ok(Self {
            gain: regulator.gain.into(),
            rows,
            #[allow(clippy::cast_precision_loss)]
            first: 1.0 / libm::sqrt(prediction.length(0) as f64),
            iterations,
            command_limit: bounds.command,
            step,
            looks_ahead: false,
            preview: Preview::new(&a, &b, weights.r[0], &regulator, &prediction.ends),
            late: None,
            precision: ROUNDINGS * rounding::<f64>(),
        })
    }

    /// The same for a command that acts `delay` (s) after the time of the state, of the linearisation `upright` sampled
    /// at `h` (s). What is under way is remembered, and the cost is counted from when a command acts.
    ///
    /// # Errors
    /// [`ConfigError::Delay`]: a delay below 0, or longer than [`PAST`] samples.
    ///
    /// ```
    /// use furuta_ctrl::controllers::{self, Controller, Design, Mpc};
    /// use furuta_ctrl::Site;
    /// use furuta_model::{Rig, State};
    /// let rig = Rig::builtin("qube-servo-2").ok_or("no such rig")?;
    /// let site = Site::of(&rig, 0.002);
    /// let settings = controllers::settings("mpc").ok_or("no such controller")?;
    /// let prompt = Mpc::<f64>::design(&settings, &site)?;
    /// let late = prompt.with_delay(&site.linear()?, 0.002, 0.005)?;
    /// // The pendulum falls for 5 ms before the command acts: more of it is needed.
    /// let (x, upright) = (State::new(0.0, 0.01, 0.0, 0.0), State::upright());
    /// let [u, early] = [late, prompt].map(|mpc| mpc.update(&mut mpc.start(), &x, &upright, 0.002));
    /// assert!(u < 1.01 * early && early < 0.0);
    /// assert!(prompt.with_delay(&site.linear()?, 0.002, 0.1).is_err());
    /// # Ok::<(), Box<dyn core::error::Error>>(())
    /// ```
    pub fn with_delay(self, upright: &Linear, h: f64, delay: f64) -> Result<Self, ConfigError> {
        #[allow(clippy::cast_precision_loss)]
        let most = PAST as f64 * h;
        let late = Late::new(upright, h, delay).ok_or(ConfigError::Delay { delay, most })?;
        Ok(Self {
            late: (delay > 0.0).then_some(late),
            ..self
        })
    }

    /// The same in the target's own precision.
    pub fn cast<T: Real>(&self) -> Mpc<T, M> {
        Mpc {
            gain: self.gain.map(c),
            rows: self.rows.map(|r| r.cast()),
            first: c(self.first),
            iterations: self.iterations,
            command_limit: c(self.command_limit),
            step: c(self.step),
            looks_ahead: self.looks_ahead,
            preview: self.preview.cast(),
            late: self.late.as_ref().map(Late::cast),
            precision: c(ROUNDINGS * rounding::<T>()),
        }
    }
}

/// The distance from 1 to the next number.
fn rounding<T: Real>() -> f64 {
    let mut last = 1.0;
    while (T::ONE + c::<T>(0.5 * last)).value() > 1.0 {
        last *= 0.5;
    }
    last
}

impl<T: Real> Design for Mpc<T> {
    fn design(settings: &Settings, site: &Site<'_>) -> Result<Self, ConfigError> {
        let weights = weights::given(settings, || balance_weights(site.params))?;
        let horizon = settings
            .number(const { SPEC.parameter("horizon").optional() })
            .unwrap_or(HORIZON / site.frequency());
        let bounds = Bounds {
            command: site.command_limit,
            pendulum: settings.number(const { SPEC.parameter("pendulum_angle").optional() }),
            arm: settings
                .number(const { SPEC.parameter("arm_angle").optional() })
                .or(site.limits.arm_angle.map(|limit| 0.9 * limit)),
            rate: settings.number(const { SPEC.parameter("command_rate").optional() }),
        };
        let samples = match settings.word(const { SPEC.parameter("delay").chosen() }) {
            "motor" => Some(0.0),
            "sample_and_motor" => Some(1.0),
            _ => None,
        };
        let upright = site.linear()?;
        let mut designed = Mpc::<f64>::new(
            &upright,
            site.period,
            &weights,
            horizon,
            &bounds,
            settings.whole(const { SPEC.parameter("iterations").settled() }),
        )?;
        designed.looks_ahead = settings.is_on(const { SPEC.parameter("preview").settled() });
        if let Some(samples) = samples {
            let plant = Plant::<f64>::new(site.params, site.effects)?;
            let delay = samples * site.period + plant.delay();
            designed = designed.with_delay(&upright, site.period, delay)?;
        }
        Ok(designed.cast())
    }
}

