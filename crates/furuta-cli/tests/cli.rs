//! The command line, command by command. One program: each links all of what it tests.

mod broken_pipe;
mod calibrate;
mod common;
mod controllers;
mod designs;
mod diagnose;
mod effects;
mod frequency;
mod outputs;
mod published;
mod recordings;
mod replay;
mod rigs;
mod studies;
mod words;
