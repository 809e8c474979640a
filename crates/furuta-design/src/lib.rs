//! What is done about controllers on a host and needs more than the control core: closed-loop experiments, studies over
//! many draws of the parameters, the experiments of the source papers with their figures.
//!
//! | Module | What it holds |
//! |---|---|
//! | [`closed_loop`] | a controller on a plant that may change on the way, with perfect states or encoders |
//! | [`supervised`] | a whole control system, from swing-up on, timed as a real loop is |
//! | [`reach`] | how near to upright any voltage brings a hanging pendulum |
//! | [`swing_up`] | how surely a rig is swung up that is not quite as its file says |
//! | [`region`] | from where a controller brings the pendulum back to upright |
//! | [`upright`] | whether a controller holds a pendulum upright by its linear closed loop |
//! | [`shahzad2022`] | arm steps and a push under an LQR |
//! | [`ramos_velasco`] | a pendulum that follows a sine, under five controllers, on wrong parameters |
//! | [`arm_step`] | a step of the arm under LQR, sliding mode and model predictive control |
//! | [`mpc`] | model predictive control by an interior-point method |
//! | [`steady_motion`] | the motion of the arm under which the pendulum follows a sine, to any order |
//! | [`largest_sine`] | the largest sine that a pendulum can follow at all |
//! | [`optimal`] | the fastest swing-up within a rig's limits, by optimisation |
//! | [`rig_loop`] | a rig with its effects under a linear law: the whole loop, its poles and margins |
//! | [`rehearsal`] | whether a control system holds the nonlinear rig, encoders and delay included |
//! | [`relay`] | the PID pair tuned by a relay experiment |
//! | [`estimation`] | how well estimators know speeds, all watching the same run |
//! | [`limit_cycle`] | how far a balanced rig wanders, its effects compensated or not |
//! | [`polytope`] | the linear models of a rig whose parameters are known only within a range, enclosed by vertices |
//! | [`robust`] | one gain for all of them, with a guaranteed cost |
//! | [`robust_rig`] | that gain for a rig, and how far off its parameters may be at most |
#![forbid(unsafe_code)]
// `!(x > 0)` is how a NaN is made to fail a test.
#![allow(clippy::neg_cmp_op_on_partial_ord)]

pub mod arm_step;
pub mod closed_loop;
pub mod estimation;
pub mod largest_sine;
pub mod limit_cycle;
mod lmi;
pub mod mpc;
pub mod optimal;
pub mod polytope;
pub mod ramos_velasco;
pub mod reach;
pub mod region;
pub mod rehearsal;
pub mod relay;
pub mod rig_loop;
pub mod robust;
pub mod robust_rig;
pub mod shahzad2022;
pub mod steady_motion;
pub mod supervised;
pub mod swing_up;
pub mod upright;
