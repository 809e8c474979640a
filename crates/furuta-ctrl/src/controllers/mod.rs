//! Controllers: each a file, one trait, and [`AnyController`] for a choice at run time.
//!
//! To add one, write its file (a struct of numbers, its memory, `SPEC`, [`Design`] and [`Controller`]) and add its line
//! to the call of `controllers!` below. Controller files, `furuta run`, `simulate` and `design`, Python, the wire to a
//! microcontroller and the tests that every controller must pass know it from then on.

mod swing_up;
mod weights;

pub use lqi::LqiState;
pub use lqr_sliding::{LqrSlidingState, Reaching};
pub(crate) use mpc::counts_delay_once;
pub use mpc::{Bounds, LIMITED, MOVES, MpcState, Outcome, PAST, Report, Rows};
pub use normal_form_sliding::{NormalFormSlidingState, Switching};
pub use pid::PidState;
pub use scheduled_lqr::SPEEDS;
pub use swing_up::{SPEC as SWING_UP, SwingUp, SwingUpState};

pub use crate::from_settings::Design;

use crate::error::ConfigError;
use crate::numbers::Number;
use crate::real::Real;
use crate::reference::Ahead;
use crate::section::{Settings, Spec};
use crate::site::Site;
use furuta_model::State;

/// From an estimated state to a motor command.
///
/// Whatever goes in, what comes out is a finite number within the controller's command limit: a state with a NaN gives
/// 0.
pub trait Controller<T: Real> {
    /// What the controller remembers from sample to sample.
    type State: Clone + core::fmt::Debug;

    /// The memory at the start of a run.
    fn start(&self) -> Self::State;

    /// The memory at the moment this controller takes over in the state `x`, the command so far having been `u` (V):
    /// what it integrates is set such that its first command is near `u`, where it can be.
    fn take_over(&self, _x: &State<T>, _reference: &State<T>, _u: T) -> Self::State {
        self.start()
    }

    /// The command (V) for the estimated state `x`, to be held for the sample period `h` (s). `reference` is where to
    /// go: of the pendulum, 0 is upright.
    fn update(&self, state: &mut Self::State, x: &State<T>, reference: &State<T>, h: T) -> T;

    /// The same with a reference that is known for samples to come. A controller that does not look ahead goes by the
    /// present one.
    fn update_ahead(
        &self,
        state: &mut Self::State,
        x: &State<T>,
        reference: &impl Ahead<T>,
        h: T,
    ) -> T {
        self.update(state, x, &reference.at(0), h)
    }

    /// A state feedback that succeeds about where this controller does, for the supervisor's prediction of a catch,
    /// which must be quick: the surrogate. If `None`, the rig's standard one.
    fn surrogate(&self) -> Option<StateFeedback<T>> {
        None
    }

    /// The linear law that it is near upright while its reference rests there and no limit is met: for poles and
    /// margins of its loop. `None`: it switches, or remembers more than an integral of the arm's angle.
    fn linear_law(&self) -> Option<LinearLaw<T>> {
        None
    }

    /// Every number that its command depends on while the pendulum's reference is upright, by name; `false` where
    /// numbers alone do not tell it, so that no other program can be written from them.
    fn numbers(&self, _put: &mut impl FnMut(&'static str, Number<'_, T>)) -> bool {
        false
    }
}

/// `u = -gain x - integral s`, `s` the integral of the arm's angle.
///
/// ```
/// use furuta_ctrl::Site;
/// use furuta_ctrl::controllers::{self, AnyController, Controller};
/// use furuta_model::Rig;
/// let rig = Rig::builtin("shahzad2022-srv02").ok_or("no such rig")?;
/// let law = |kind| {
///     let settings = controllers::settings(kind)?;
///     AnyController::<f64>::design(&settings, &Site::of(&rig, 0.002)).ok()?.linear_law()
/// };
/// let (lqr, mpc, lqi) = (law("lqr").ok_or("linear")?, law("mpc").ok_or("has one")?, law("lqi").ok_or("linear")?);
/// assert!(mpc == lqr && lqr.integral == 0.0 && lqi.integral < 0.0);
/// assert!(law("normal_form_sliding").is_none());
/// # Ok::<(), &str>(())
/// ```
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct LinearLaw<T> {
    /// On `[theta, alpha, theta_dot, alpha_dot]`: V/rad, V/rad, V s/rad, V s/rad.
    pub gain: [T; 4],
    /// V/(rad s).
    pub integral: T,
}

impl<T: Real> LinearLaw<T> {
    /// Without an integral.
    pub(crate) fn of_states(gain: [T; 4]) -> Self {
        Self {
            gain,
            integral: T::ZERO,
        }
    }
}

/// Makes the enum over all controllers and their catalogue from one list.
macro_rules! controllers {
    ($($module:ident :: $name:ident),+ $(,)?) => {
        $(mod $module; pub use $module::$name;)+

        $(impl<T: Real> $name<T> {
            /// Settings of this kind, nothing given yet: those of [`settings`], for a kind that is known when the
            /// program is compiled.
            ///
            /// ```
            /// use furuta_ctrl::controllers;
            #[doc = concat!("let settings = controllers::", stringify!($name), "::<f64>::settings();")]
            /// assert_eq!(controllers::settings(settings.spec().id), Some(settings));
            /// ```
            #[must_use]
            pub fn settings() -> Settings {
                Settings::new(&$module::SPEC)
            }
        })+

        /// A controller chosen at run time, without an allocation or a virtual call.
        #[derive(Clone, Debug)]
        #[allow(clippy::large_enum_variant)] // lives in one place, on the stack of the loop
        #[non_exhaustive]
        pub enum AnyController<T: Real> {
            $(#[doc = concat!("See [`", stringify!($name), "`].")] $name($name<T>)),+
        }

        /// Memory of an [`AnyController`].
        #[derive(Clone, Debug)]
        #[allow(clippy::large_enum_variant)]
        #[non_exhaustive]
        pub enum AnyControllerState<T: Real> {
            $(#[doc = concat!("Of [`", stringify!($name), "`].")] $name(<$name<T> as Controller<T>>::State)),+
        }

        /// Every controller this version knows, the standard one first.
        pub static CATALOGUE: &[&Spec] = &[$(&$module::SPEC),+];

        impl<T: Real> AnyController<T> {
            /// The controller of the kind and with the numbers of `settings`, at this site.
            ///
            /// # Errors
            /// Those of [`Design::design`]; settings of something else than a controller.
            pub fn design(settings: &Settings, site: &Site<'_>) -> Result<Self, ConfigError> {
                $(if settings.spec().id == $module::SPEC.id {
                    return Ok(Self::$name(Design::design(settings, site)?));
                })+
                Err(ConfigError::WrongSection { section: "controller", found: settings.spec().id })
            }

            /// What the catalogue says of it.
            #[must_use]
            pub fn spec(&self) -> &'static Spec {
                match self { $(Self::$name(_) => &$module::SPEC),+ }
            }
        }

        impl<T: Real> Controller<T> for AnyController<T> {
            type State = AnyControllerState<T>;

            fn start(&self) -> Self::State {
                match self { $(Self::$name(c) => AnyControllerState::$name(c.start())),+ }
            }

            fn take_over(&self, x: &State<T>, reference: &State<T>, u: T) -> Self::State {
                match self { $(Self::$name(c) => AnyControllerState::$name(c.take_over(x, reference, u))),+ }
            }

            fn surrogate(&self) -> Option<StateFeedback<T>> {
                match self { $(Self::$name(c) => c.surrogate()),+ }
            }

            fn linear_law(&self) -> Option<LinearLaw<T>> {
                match self { $(Self::$name(c) => c.linear_law()),+ }
            }

            fn numbers(&self, put: &mut impl FnMut(&'static str, Number<'_, T>)) -> bool {
                match self { $(Self::$name(c) => c.numbers(put)),+ }
            }

            fn update(&self, state: &mut Self::State, x: &State<T>, reference: &State<T>, h: T) -> T {
                self.update_ahead(state, x, reference, h)
            }

            fn update_ahead(
                &self,
                state: &mut Self::State,
                x: &State<T>,
                reference: &impl Ahead<T>,
                h: T,
            ) -> T {
                match self {
                    $(Self::$name(c) => {
                        if let AnyControllerState::$name(s) = &mut *state {
                            return c.update_ahead(s, x, reference, h);
                        }
                        // The memory belongs to the controller chosen before: begin anew.
                        let mut s = c.start();
                        let u = c.update_ahead(&mut s, x, reference, h);
                        *state = AnyControllerState::$name(s);
                        u
                    })+
                }
            }
        }
    };
}

controllers! {
    state_feedback::StateFeedback,
    output_regulator::OutputRegulator,
    normal_form_sliding::NormalFormSliding,
    lqr_sliding::LqrSliding,
    mpc::Mpc,
    lqi::Lqi,
    scheduled_lqr::ScheduledLqr,
    pid::Pid,
}

/// Settings of the controller of this kind, nothing given yet.
///
/// ```
/// use furuta_ctrl::Site;
/// use furuta_ctrl::controllers::{self, AnyController};
/// use furuta_model::Rig;
/// let rig = Rig::builtin("shahzad2022-srv02").ok_or("no such rig")?;
/// let settings = controllers::settings("lqr").ok_or("no such controller")?;
/// let controller = AnyController::<f64>::design(&settings, &Site::of(&rig, 0.002))?;
/// assert_eq!(controller.spec().id, "lqr");
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[must_use]
pub fn settings(id: &str) -> Option<Settings> {
    CATALOGUE
        .iter()
        .find(|spec| spec.id == id)
        .map(|spec| Settings::new(spec))
}
