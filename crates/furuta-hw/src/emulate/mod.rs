//! An emulated rig: it speaks the same bytes as a real one and integrates a model, in which effects can be hidden.

mod hide;
mod pty;
mod rig;

pub use hide::{HideError, hidden_effect};
pub use pty::{Pace, PtyError, PtyRig};
pub(crate) use rig::to_counts;
pub use rig::{EmulatedRig, Emulation, EmulationError};
