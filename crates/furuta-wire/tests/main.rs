//! The protocol: frames, golden bytes, rigs in other languages. One program: each links all of what it tests.

mod arduino_rig;
mod c_rig;
mod common;
mod corpus;
mod frames;
mod golden;
mod limits;
mod ten_million;
