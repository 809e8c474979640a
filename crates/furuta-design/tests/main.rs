//! Designs and studies, against independent answers. One program: each links all of what it tests.

mod limit_cycle;
mod lqi;
mod mpc;
mod papers;
mod pid;
mod region;
mod rig_loop;
mod robust;
mod scheduled_lqr;
mod swing_up;
mod trackers;
