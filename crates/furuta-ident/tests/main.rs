//! Recordings in, answers out: diagnosis, calibration, validation, frequency. One program: each links all of what it
//! tests.

mod accelerated;
mod bounds;
mod calibrate;
mod combinations;
mod common;
mod coverage;
mod diagnose;
mod driven;
mod ended_early;
mod expression;
mod frequency;
mod laboratory;
mod own_hypothesis;
mod pendulum_off;
mod plan;
mod rare;
mod real_rigs;
mod report;
mod rough;
mod stretch;
mod thorough;
mod transients;
mod unexplained;
mod validate;
