//! Estimators: what the sensors do not measure. Each a file, one trait, and [`AnyEstimator`] for a choice at run time.
//!
//! To add one, write its file (a struct of numbers, its memory, `SPEC`, [`Design`] and [`Estimator`]) and add its line
//! to the call of `estimators!` below.

use crate::error::ConfigError;
pub use crate::from_settings::Design;
use crate::numbers::Number;
use crate::real::Real;
use crate::section::{Settings, Spec};
use crate::site::Site;
use furuta_model::State;

/// What is known at a sample.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Measurement<T> {
    /// Arm angle, rad.
    pub theta: T,
    /// Pendulum angle from upright, rad.
    pub alpha: T,
    /// Command that the motor holds from this sample to the next, V.
    pub held: T,
    /// Sample periods since the sample before: 1, or more where samples were lost.
    pub periods: u32,
}

impl<T> Measurement<T> {
    /// Of a loop that loses no samples.
    pub fn new(theta: T, alpha: T, held: T) -> Self {
        Self {
            theta,
            alpha,
            held,
            periods: 1,
        }
    }
}

/// What an estimator makes of it.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Estimate<T> {
    /// The state at the sample.
    pub now: State<T>,
    /// The state when a command given now begins to act, one period later, or more where the rig file names a delay. An
    /// estimator that does not predict says `now`.
    pub ahead: State<T>,
    /// Voltage (V) that acts beside the command: what the estimator cannot explain otherwise. 0 of an estimator that
    /// does not look for one.
    pub disturbance: T,
}

/// From measurements to states.
pub trait Estimator<T: Real> {
    /// What the estimator remembers from sample to sample.
    type State: Clone + core::fmt::Debug;

    /// The memory before the first sample.
    fn start(&self) -> Self::State;

    /// The states after one sample. Angles that are not finite give states that are not, and are forgotten with the
    /// next sound sample.
    fn update(&self, state: &mut Self::State, measurement: &Measurement<T>) -> Estimate<T>;

    /// What it is near upright, where it has the rig's model and a constant correction.
    ///
    /// ```
    /// use furuta_ctrl::estimators::{AnyEstimator, Estimator};
    /// use furuta_ctrl::{Config, Site};
    /// let rig = furuta_model::Rig::builtin("qube-servo-2").ok_or("no such rig")?;
    /// let standard = AnyEstimator::<f64>::design(&Config::default().estimator, &Site::of(&rig, 0.002))?;
    /// let linear = standard.linear().ok_or("not linear")?;
    /// // 120 rad/s: the angle is corrected by 1 - exp(-0.48) of what it is off.
    /// assert!((linear.correction[0][0] - 0.381).abs() < 1e-3 && linear.ahead == 0.0);
    /// # Ok::<(), Box<dyn core::error::Error>>(())
    /// ```
    fn linear(&self) -> Option<LinearEstimator> {
        None
    }

    /// Every number that its estimate depends on, by name; `false` where numbers and the rig's plant alone do not tell
    /// it, so that no other program can be written from them.
    fn numbers(&self, _put: &mut impl FnMut(&'static str, Number<'_, T>)) -> bool {
        false
    }
}

/// Makes the enum over all estimators and their catalogue from one list.
macro_rules! estimators {
    ($($module:ident :: $name:ident),+ $(,)?) => {
        $(mod $module; pub use $module::$name;)+

        /// An estimator chosen at run time, without an allocation or a virtual call.
        #[derive(Clone, Debug)]
        #[allow(clippy::large_enum_variant)] // lives in one place, on the stack of the loop
        #[non_exhaustive]
        pub enum AnyEstimator<T: Real> {
            $(#[doc = concat!("See [`", stringify!($name), "`].")] $name($name<T>)),+
        }

        /// Memory of an [`AnyEstimator`].
        #[derive(Clone, Debug)]
        #[allow(clippy::large_enum_variant)]
        #[non_exhaustive]
        pub enum AnyEstimatorState<T: Real> {
            $(#[doc = concat!("Of [`", stringify!($name), "`].")] $name(<$name<T> as Estimator<T>>::State)),+
        }

        /// Every estimator this version knows, the standard one first.
        pub static CATALOGUE: &[&Spec] = &[$(&$module::SPEC),+];

        impl<T: Real> AnyEstimator<T> {
            /// The estimator of the kind and with the numbers of `settings`, at this site.
            ///
            /// # Errors
            /// Those of [`Design::design`]; settings of something else than an estimator.
            pub fn design(settings: &Settings, site: &Site<'_>) -> Result<Self, ConfigError> {
                $(if settings.spec().id == $module::SPEC.id {
                    return Ok(Self::$name(Design::design(settings, site)?));
                })+
                Err(ConfigError::WrongSection { section: "estimator", found: settings.spec().id })
            }

            /// What the catalogue says of it.
            #[must_use]
            pub fn spec(&self) -> &'static Spec {
                match self { $(Self::$name(_) => &$module::SPEC),+ }
            }
        }

        impl<T: Real> Estimator<T> for AnyEstimator<T> {
            type State = AnyEstimatorState<T>;

            fn start(&self) -> Self::State {
                match self { $(Self::$name(e) => AnyEstimatorState::$name(e.start())),+ }
            }

            fn update(&self, state: &mut Self::State, measurement: &Measurement<T>) -> Estimate<T> {
                match self {
                    $(Self::$name(e) => {
                        if let AnyEstimatorState::$name(s) = &mut *state {
                            return e.update(s, measurement);
                        }
                        // The memory belongs to the estimator chosen before: begin anew.
                        let mut s = e.start();
                        let estimate = e.update(&mut s, measurement);
                        *state = AnyEstimatorState::$name(s);
                        estimate
                    })+
                }
            }

            fn linear(&self) -> Option<LinearEstimator> {
                match self { $(Self::$name(e) => e.linear()),+ }
            }

            fn numbers(&self, put: &mut impl FnMut(&'static str, Number<'_, T>)) -> bool {
                match self { $(Self::$name(e) => e.numbers(put)),+ }
            }
        }
    };
}

estimators! {
    observer::Observer,
    luenberger::Luenberger,
    kalman::Kalman,
    extended_kalman::ExtendedKalman,
    disturbance_observer::DisturbanceObserver,
    filtered_derivative::FilteredDerivative,
}

mod derivative;
mod fixed_gain;
mod noise;
mod predictor;

pub use derivative::{Derivative, DerivativeState};
pub use disturbance_observer::DisturbedBelief;
pub use extended_kalman::UncertainBelief;
pub use fixed_gain::LinearEstimator;
pub use predictor::Belief;

/// Settings of the estimator of this kind, nothing given yet.
#[must_use]
pub fn settings(id: &str) -> Option<Settings> {
    CATALOGUE
        .iter()
        .find(|spec| spec.id == id)
        .map(|spec| Settings::new(spec))
}
