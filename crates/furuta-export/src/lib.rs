//! Rigs and control systems in the formats of other programs.
//!
//! | Module | What it writes |
//! |---|---|
//! | [`mod@mjcf`] | a rig as a model of MuJoCo |
//! | [`mod@urdf`] | a rig as a robot description |
//! | [`c`] | a controller file's control system as one C99 file |
//!
//! A model's file carries those effects of the rig that its format can say, and lists the others in a comment: see
//! [`Exported::left_out`].
#![forbid(unsafe_code)]
// `!(x > 0)` is how a NaN is made to fail a test.
#![allow(clippy::neg_cmp_op_on_partial_ord)]

mod body;
pub mod c;
pub mod mjcf;
mod remark;
pub mod urdf;

pub use body::BodyError;
pub use mjcf::mjcf;
pub use remark::{Exported, Remark};
pub use urdf::urdf;
