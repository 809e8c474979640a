//! What stands between controllers and a motor: modes, the catch, limits, faults.
//!
//! | from | when | to | command |
//! |---|---|---|---|
//! | idle, stopping | [`Request::Start`] | swing-up | 0 while idle |
//! | swing-up | the balance controller would succeed from here (see below) | balance | energy swing-up |
//! | balance | the pendulum is further than [`Thresholds::release_angle`] from upright, or beyond [`Thresholds::doubt_angle`] falling, and the model says that it will not be saved; or the arm could not be stopped within its limit any more | swing-up | the balance controller's |
//! | swing-up, balance | [`Request::Stop`] | stopping | |
//! | stopping | both axes at rest for half a second | idle | 0 |
//! | swing-up, balance | an angle or speed beyond its limit | braking | 0 from the next sample on, then against the arm's speed: [`Brake`] |
//! | braking | the arm has stopped, or a quarter of a second is over | fault | |
//! | idle, stopping | an angle or speed beyond its limit | fault | 0 |
//! | any | a measurement that is not a number | fault | 0 |
//! | fault | [`Request::Reset`], measurements being sound again | idle | 0 while in fault |
//!
//! Started with the pendulum held upright, the catch succeeds at once: there is no separate mode for it.
//!
//! **The catch.** Whether the balance controller can take over depends on angle, both speeds, how far the arm may go,
//! and the voltage at hand; no fixed window around upright fits a light pendulum on a strong motor and a heavy one on a
//! short arm. So the model is asked: the balance loop, command limit included, is rolled out for a few of the
//! pendulum's own time constants, and the switch is made where it ends near upright, at the moment at which the command
//! jumps least. Near upright the switch back is not even considered: that is the hysteresis.
//!
//! The same as a table of modes and events, tried and compared by a test: `docs/controllers.md`.

mod brake;
mod catch;
mod fault;
mod mode;
mod system;
mod transitions;
mod update;

pub use crate::thresholds::{LIMITS, SPEC, Thresholds};
pub use brake::{Brake, Braking};
pub use catch::Catch;
pub use fault::Fault;
pub use mode::{Mode, Request};
pub use system::{Supervisor, SupervisorState};
pub use update::Output;
