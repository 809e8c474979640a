//! Control of the rotary inverted pendulum: the part that runs, unchanged, on a microcontroller, on a Linux board and in Python.
#![no_std]

pub mod design;
