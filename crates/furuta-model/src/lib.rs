//! The rotary inverted (Furuta) pendulum: one definition of its dynamics, generic in the scalar.
//!
//! The same equations run in `f32` on a microcontroller, in `f64` on a host, and on dual numbers ([`Jet`]) where
//! derivatives with respect to states or parameters are wanted. Nothing here allocates; without the feature `std`
//! nothing needs an operating system.
//!
//! | Module | What it holds |
//! |---|---|
//! | [`scalar`], [`jet`], [`series`], [`lanes`], [`trig`] | the numbers the model is generic in |
//! | [`actuation`] | what the command is: a voltage, a current, a torque, the arm's acceleration |
//! | [`state`], [`params`] | `x = [theta, alpha, theta_dot, alpha_dot]`, physical parameters and their ranges |
//! | [`derivation`] | a page to read: the equations from the picture, where effects act, how a step meets events, how to add an effect |
//! | [`dynamics`], [`energy`] | manipulator form `M(q) q'' + bias + gravity = torque`, kinetic and potential energy |
//! | [`effects`] | what the equations leave out: friction, springs, dead zones, delays, ... one file each |
//! | [`plant`], [`integrate`] | a rig with its effects, stepped by RK4 under a held command |
//! | [`vectors`] | work on dual numbers, compiled for the processor's vectors |
//! | [`mod@linearize`], [`discretize`], [`transfer`] | exact Jacobians; zero-order-hold discretisation; transfer functions |
//! | [`mod@linear_plant`] | the linear model of a rig with its effects, about where it rests upright |
//! | [`zero_dynamics`] | the arm's motion under a pendulum that follows a prescribed one |
//! | [`signals`] | test signals: steps, chirp, multisine, PRBS, noise, ... |
//! | `simulate` (feature `std`) | whole trajectories, and thousands of them at once |
//! | `rig` (feature `std`) | rig files (TOML) and the built-in rigs |
//!
//! ```
//! use furuta_model::{Plant, Rig, State};
//!
//! let rig = Rig::builtin("qube-servo-2").expect("built in");
//! let plant: Plant<f64> = rig.plant();
//! let mut x = plant.rest(State::new(0.0, 3.0, 0.0, 0.0)); // almost hanging
//! for _ in 0..1000 {
//!     plant.step(&mut x, 0.0, 0.001);
//! }
//! assert!((x.x.alpha - std::f64::consts::PI).abs() < 0.15); // it swings about the hanging position
//! ```
#![cfg_attr(not(feature = "std"), no_std)]
#![forbid(unsafe_code)]

pub mod actuation;
#[doc = include_str!("derivation.md")]
pub mod derivation {}
pub mod discretize;
pub mod dynamics;
pub mod effects;
pub mod energy;
pub mod integrate;
pub mod jet;
pub mod lanes;
pub mod linear_plant;
pub mod linearize;
pub mod params;
pub mod plant;
#[cfg(feature = "std")]
pub mod rig;
pub mod scalar;
pub mod series;
pub mod signals;
#[cfg(feature = "std")]
pub mod simulate;
pub mod state;
pub mod transfer;
pub mod trig;
pub mod vectors;
pub mod zero_dynamics;

pub use actuation::Actuation;
pub use effects::{CATALOGUE, Effect, EffectError, RARE, Spec};
pub use jet::Jet;
pub use lanes::Lanes;
pub use linear_plant::{LinearPlant, linear_plant};
pub use linearize::{Linear, linearize};
pub use params::{Arm, Motor, ParamError, Params, Pendulum};
pub use plant::{MAX_OWN_STATES, Plant, PlantError, PlantState, Twist};
#[cfg(feature = "std")]
pub use rig::{Limits, Rig, RigError, Sensors, Tolerance, published};
pub use scalar::Scalar;
pub use state::State;
