//! Controllers: each a file, one trait, and [`AnyController`] for a choice at run time.

mod lqr_sliding;
mod normal_form_sliding;
mod output_regulator;
mod state_feedback;
mod swing_up;

pub use lqr_sliding::{LqrSliding, LqrSlidingState, Reaching};
pub use normal_form_sliding::{NormalFormSliding, NormalFormSlidingState, Switching};
pub use output_regulator::OutputRegulator;
pub use state_feedback::StateFeedback;
pub use swing_up::{SwingUp, SwingUpState};

use crate::real::Real;
use furuta_model::State;

/// From an estimated state to a motor command.
///
/// Whatever goes in, what comes out is a finite number within the controller's command limit: a state with a NaN gives 0.
pub trait Controller<T: Real> {
    /// What the controller remembers from sample to sample.
    type State: Clone + core::fmt::Debug;

    /// The memory at the start of a run.
    fn start(&self) -> Self::State;

    /// The command (V) for the estimated state `x`, to be held for the sample period `h` (s). `reference` is where to go: of the
    /// pendulum, 0 is upright.
    fn update(&self, state: &mut Self::State, x: &State<T>, reference: &State<T>, h: T) -> T;
}

/// A controller chosen at run time, without an allocation or a virtual call.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant)] // lives in one place, on the stack of the loop
pub enum AnyController<T> {
    /// [`StateFeedback`].
    StateFeedback(StateFeedback<T>),
    /// [`SwingUp`].
    SwingUp(SwingUp<T>),
}

/// Memory of an [`AnyController`].
#[derive(Clone, Debug)]
pub enum AnyControllerState<T> {
    /// Of a controller that remembers nothing.
    None,
    /// Of [`SwingUp`].
    SwingUp(SwingUpState<T>),
}

impl<T: Real> Controller<T> for AnyController<T> {
    type State = AnyControllerState<T>;

    fn start(&self) -> Self::State {
        match self {
            Self::StateFeedback(_) => AnyControllerState::None,
            Self::SwingUp(c) => AnyControllerState::SwingUp(c.start()),
        }
    }

    fn update(&self, state: &mut Self::State, x: &State<T>, reference: &State<T>, h: T) -> T {
        match (self, &mut *state) {
            (Self::StateFeedback(c), _) => c.update(&mut (), x, reference, h),
            (Self::SwingUp(c), AnyControllerState::SwingUp(s)) => c.update(s, x, reference, h),
            // The memory belongs to the controller chosen before: begin anew.
            (Self::SwingUp(c), AnyControllerState::None) => {
                let mut s = c.start();
                let u = c.update(&mut s, x, reference, h);
                *state = AnyControllerState::SwingUp(s);
                u
            }
        }
    }
}
