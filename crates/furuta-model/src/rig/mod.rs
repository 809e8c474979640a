//! Rigs: parameters, sensors, limits and effects under a name, as written in a rig file.

mod builtin;
mod file;
pub mod published;
mod tolerance;

pub use file::RigError;
pub use tolerance::Tolerance;

use crate::effects::Effect;
use crate::params::Params;
use crate::plant::Plant;
use crate::scalar::Scalar;
use furuta_input::{InputError, read_text};
use std::path::Path;

/// Encoders.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Sensors {
    /// Counts for one turn of the arm (after quadrature).
    pub arm_counts_per_rev: f64,
    /// Counts for one turn of the pendulum (after quadrature).
    pub pendulum_counts_per_rev: f64,
}

impl Sensors {
    /// The angles of one count, `[theta, alpha]`, rad.
    #[must_use]
    pub fn resolution(&self) -> [f64; 2] {
        [self.arm_counts_per_rev, self.pendulum_counts_per_rev].map(|n| std::f64::consts::TAU / n)
    }

    /// What the encoders read at these angles `[theta, alpha]`: each rounded to the nearest count, rad.
    ///
    /// ```
    /// let sensors = furuta_model::Sensors { arm_counts_per_rev: 2048.0, pendulum_counts_per_rev: 4096.0 };
    /// let [arm, pendulum] = sensors.resolution();
    /// assert_eq!(sensors.quantised([2.4 * arm, -0.6 * pendulum]), [2.0 * arm, -pendulum]);
    /// ```
    #[must_use]
    pub fn quantised(&self, angles: [f64; 2]) -> [f64; 2] {
        let count = self.resolution();
        std::array::from_fn(|i| (angles[i] / count[i]).round() * count[i])
    }
}

/// Where a run is stopped, each optional.
#[derive(Copy, Clone, Debug, PartialEq, Default)]
pub struct Limits {
    /// Largest arm angle either way, rad.
    pub arm_angle: Option<f64>,
    /// Largest arm speed, rad/s.
    pub arm_speed: Option<f64>,
    /// Largest pendulum speed, rad/s.
    pub pendulum_speed: Option<f64>,
}

/// A rig as its file describes it.
///
/// ```
/// use furuta_model::Rig;
/// let mut rig = Rig::builtin("qube-servo-2").expect("built in");
/// rig.effects.push(furuta_model::Effect::new("arm.spring", &[8.6e-4, -0.5]).expect("valid"));
/// let again = Rig::from_toml(&rig.to_toml()).expect("what is written can be read");
/// assert_eq!(again, rig);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Rig {
    /// Short name.
    pub name: String,
    /// Where the numbers come from.
    pub source: String,
    /// Physical parameters.
    pub params: Params<f64>,
    /// Encoders.
    pub sensors: Sensors,
    /// Where a run is stopped.
    pub limits: Limits,
    /// How well the parameters are known.
    pub tolerance: Tolerance,
    /// Effects beyond the rigid-body model, as `diagnose` adds them.
    pub effects: Vec<Effect<f64>>,
}

impl Rig {
    /// Names of the built-in rigs.
    pub const BUILTIN: &'static [&'static str] = &builtin::NAMES;

    /// Those of them whose command is a voltage.
    pub const VOLTAGE: &'static [&'static str] = &builtin::VOLTAGE;

    /// A built-in rig.
    #[must_use]
    pub fn builtin(name: &str) -> Option<Self> {
        // The built-in files are checked by a test; a broken one could not ship.
        builtin::text(name).and_then(|text| Self::from_toml(text).ok())
    }

    /// The text of a built-in rig's file, with its remarks.
    #[must_use]
    pub fn builtin_text(name: &str) -> Option<&'static str> {
        builtin::text(name)
    }

    /// A rig from the text of a rig file.
    ///
    /// # Errors
    /// Not TOML, unknown or missing keys, values outside their ranges, unknown effects.
    pub fn from_toml(text: &str) -> Result<Self, RigError> {
        file::parse(text)
    }

    /// The rig as a file's text.
    #[must_use]
    pub fn to_toml(&self) -> String {
        file::write(self)
    }

    /// A built-in rig by name, or else the rig file at this path.
    ///
    /// # Errors
    /// Neither a built-in name nor a readable file, or an invalid one.
    pub fn load(name_or_path: &str) -> Result<Self, RigError> {
        if let Some(rig) = Self::builtin(name_or_path) {
            return Ok(rig);
        }
        let path = Path::new(name_or_path);
        let text = read_text(path, "a rig file").map_err(|error| match error {
            InputError::Io { source, .. } => RigError::Unreadable {
                path: name_or_path.to_owned(),
                builtin: Self::BUILTIN.join(", "),
                source,
            },
            other => other.into(),
        })?;
        Self::from_toml(&text).map_err(|e| e.in_file(name_or_path))
    }

    /// The plant with all effects of the rig.
    ///
    /// # Errors
    /// More effects than a plant can hold.
    pub fn try_plant<S: Scalar>(&self) -> Result<Plant<S>, crate::PlantError> {
        let effects: Vec<_> = self.effects.iter().map(Effect::cast).collect();
        Plant::new(&self.params.cast(), &effects)
    }

    /// The plant with the rig's effects. A rig read from a file always gives one; of a rig built by hand with a value
    /// outside its range, or with more effects than a plant can hold, all states are not a number
    /// ([`Plant::unknown`]), and [`Rig::try_plant`] says why.
    #[must_use]
    pub fn plant<S: Scalar>(&self) -> Plant<S> {
        self.try_plant().unwrap_or_else(|_| Plant::unknown())
    }

    /// The plant without effects: the rigid-body model alone. Of a rig built by hand with a parameter outside its range
    /// all states are not a number, as of [`Rig::plant`]; [`Params::validate`](crate::Params::validate) says which.
    ///
    /// ```
    /// use furuta_model::{Plant, Rig, State};
    /// let mut rig = Rig::builtin("qube-servo-2").expect("built in");
    /// rig.params.pendulum.mass = -1.0;
    /// let plant: Plant<f64> = rig.nominal_plant();
    /// let mut x = plant.rest(State::hanging());
    /// plant.step(&mut x, 0.0, 0.002);
    /// assert!(plant.measure(&x).iter().all(|angle| angle.is_nan()));
    /// assert_eq!(rig.params.validate().expect_err("a negative mass").key, "pendulum.mass");
    /// ```
    #[must_use]
    pub fn nominal_plant<S: Scalar>(&self) -> Plant<S> {
        Plant::new(&self.params.cast(), &[]).unwrap_or_else(|_| Plant::unknown())
    }
}
