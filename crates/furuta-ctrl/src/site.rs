//! What a controller is made for.

use crate::error::ConfigError;
use furuta_model::discretize::zero_order_hold;
use furuta_model::linear_plant::{Hold, Load, rigid};
use furuta_model::params::Coefficients;
use furuta_model::{Actuation, Effect, Linear, Params, Plant};
use nalgebra::{SMatrix, SVector};

/// Where a controller is to work: a rig's model and the sample period. Designs start from it.
#[derive(Copy, Clone, Debug)]
pub struct Site<'a> {
    /// The rig's parameters.
    pub params: &'a Params<f64>,
    /// Effects that the rig file names. Designs of linear gains take those that have a slope at rest.
    pub effects: &'a [Effect<f64>],
    /// Sample period, s.
    pub period: f64,
    /// Largest command, V: the rig's, or less.
    pub command_limit: f64,
    /// Angles of one count of the encoders, `[theta, alpha]`, rad; 0: none are known of.
    pub resolution: [f64; 2],
    /// Where the rig's own file stops a run.
    pub limits: Limits,
}

/// Where a run is stopped. `None`: a default from the model, wide enough for a sound run.
#[derive(Copy, Clone, Debug, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Limits {
    /// Largest arm angle either way, rad.
    pub arm_angle: Option<f64>,
    /// Largest arm speed, rad/s.
    pub arm_speed: Option<f64>,
    /// Largest pendulum speed, rad/s.
    pub pendulum_speed: Option<f64>,
}

impl<'a> Site<'a> {
    /// A rig without effects and without limits but its command limit.
    #[must_use]
    pub fn new(params: &'a Params<f64>, period: f64) -> Self {
        Self {
            params,
            effects: &[],
            period,
            command_limit: params.motor.command_limit,
            resolution: [0.0; 2],
            limits: Limits::default(),
        }
    }

    /// A rig as its file describes it.
    #[cfg(feature = "std")]
    #[must_use]
    pub fn of(rig: &'a furuta_model::Rig, period: f64) -> Self {
        let furuta_model::Limits {
            arm_angle,
            arm_speed,
            pendulum_speed,
        } = rig.limits;
        Self {
            effects: &rig.effects,
            resolution: rig.sensors.resolution(),
            limits: Limits {
                arm_angle,
                arm_speed,
                pendulum_speed,
            },
            ..Self::new(&rig.params, period)
        }
    }

    /// The linear model upright with the arm at its middle: springs, cables, tilt and what else has a slope at rest as
    /// the rig file has them, about where they let the rig rest; without delay, lag and the drive's compliance, which
    /// are no states of a state feedback. See [`furuta_model::linear_plant()`].
    ///
    /// # Errors
    /// Parameters or effects that are not possible; effects that let nothing rest upright.
    ///
    /// ```
    /// use furuta_ctrl::Site;
    /// use furuta_model::{Effect, Rig};
    /// let mut rig = Rig::builtin("shahzad2022-srv02").ok_or("no such rig")?;
    /// rig.effects.push(Effect::new("arm.spring", &[0.005, 0.0])?);
    /// let linear = Site::of(&rig, 0.002).linear()?;
    /// assert!(linear.a[(2, 0)] < -0.5); // theta'' per radian of the arm
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn linear(&self) -> Result<Linear, ConfigError> {
        let plant = Plant::new(self.params, self.effects)?;
        Ok(rigid(&plant, Hold::Arm(0.0))?)
    }

    /// [`Site::linear`] held over the sample period: `A` (4 x 4), `B` (4 x 1, per volt).
    ///
    /// # Errors
    /// Those of [`Site::linear`].
    pub fn upright(&self) -> Result<(SMatrix<f64, 4, 4>, SVector<f64, 4>), ConfigError> {
        let linear = self.linear()?;
        Ok(zero_order_hold(&linear.a, &linear.b, self.period))
    }

    /// The model's coefficients with what the rig's effects make of them: for a law that inverts the model.
    ///
    /// # Errors
    /// Parameters or effects that are not possible.
    ///
    /// ```
    /// use furuta_ctrl::Site;
    /// use furuta_model::{Effect, Rig};
    /// let mut rig = Rig::builtin("qube-servo-2").ok_or("no such rig")?;
    /// rig.effects.push(Effect::new("pendulum.inertia_transverse", &[1e-5])?);
    /// let site = Site::of(&rig, 0.002);
    /// assert!(site.coefficients()?.swing > rig.params.coefficients().swing);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn coefficients(&self) -> Result<Coefficients<f64>, ConfigError> {
        Ok(Plant::new(self.params, self.effects)?.coefficients)
    }

    /// What springs, cables, tilt and what else has a slope at rest pull with, about the place where [`Site::linear`]
    /// has them: for a law that inverts the model.
    ///
    /// # Errors
    /// Those of [`Site::linear`].
    ///
    /// ```
    /// use furuta_ctrl::Site;
    /// use furuta_model::{Effect, Rig};
    /// let mut rig = Rig::builtin("qube-servo-2").ok_or("no such rig")?;
    /// rig.effects.push(Effect::new("arm.spring", &[0.005, 0.0])?);
    /// assert_eq!(Site::of(&rig, 0.002).load()?.slope[0], [-0.005, 0.0, 0.0, 0.0]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn load(&self) -> Result<Load<f64>, ConfigError> {
        let plant = Plant::new(self.params, self.effects)?;
        Ok(Load::of(&plant, Hold::Arm(0.0))?)
    }

    /// Small-angle frequency of the hanging pendulum, rad/s: the rig's own unit of time is its inverse.
    #[must_use]
    pub fn frequency(&self) -> f64 {
        let k = self.params.coefficients();
        libm::sqrt(k.weight / k.pendulum)
    }

    /// The speed that an arm without pendulum reaches, rad/s: under the rig's full command against back-EMF and
    /// friction, and where the command is no voltage at most what full acceleration gives in half a swing of the
    /// pendulum.
    ///
    /// ```
    /// use furuta_ctrl::Site;
    /// use furuta_model::Rig;
    /// let kit = Rig::builtin("stepper-kit").ok_or("no such rig")?;
    /// let site = Site::of(&kit, 0.002);
    /// let half_swing = core::f64::consts::PI / site.frequency();
    /// assert!((site.free_speed() - 150.0 * half_swing).abs() < 1e-6);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn free_speed(&self) -> f64 {
        let k = self.params.coefficients();
        let torque = k.drive * self.params.motor.command_limit;
        let steady = torque / k.arm_damping.max(1e-9);
        if self.params.motor.actuation == Actuation::Voltage {
            return steady;
        }
        let half_swing = core::f64::consts::PI * libm::sqrt(k.pendulum / k.weight.max(1e-9));
        steady.min(torque / k.arm * half_swing)
    }
}
