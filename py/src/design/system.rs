//! A linear system as an argument: its matrices one by one, or one object in place of them, as in python-control.

use crate::arguments::RigLike;
use crate::error;
use crate::linear::at_rest;
use crate::matrix::{Lies, Matrix, Small};
use furuta_model::linear_plant::rigid_remarks;
use numpy::PyUntypedArray;
use pyo3::prelude::*;
use pyo3::types::{PyList, PyString};

/// Whether time flows or steps.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(super) enum Time {
    Continuous,
    Sampled,
}

/// What a design is for.
pub(super) struct Plant<'py> {
    pub(super) time: Time,
    pub(super) a: Small,
    pub(super) b: Small,
    /// Without meaning where a function has no output matrix.
    pub(super) c: Small,
    /// The arguments after the system's.
    pub(super) rest: [Option<Matrix<'py>>; 3],
}

/// Reads the arguments of `function`: `a`, then either the system's other `matrices` (B, or G and C) or, where `a` is a
/// whole system, already what comes after them; then `rest`.
pub(super) fn plant<'py, const M: usize>(
    function: &str,
    time: Time,
    a: &Matrix<'py>,
    matrices: [Option<Matrix<'py>>; M],
    rest: [Option<Matrix<'py>>; 3],
) -> PyResult<Plant<'py>> {
    if let Some([a, b, c]) = whole(function, time, a)? {
        let rest = after_the_system(function, matrices.into_iter().chain(rest).collect(), M)?;
        return Ok(Plant {
            time,
            a,
            b,
            c,
            rest,
        });
    }
    let a = Small::read("A", a, Lies::Square)?;
    let others = if M == 1 { ["B", ""] } else { ["G", "C"] };
    let mut read = matrices.into_iter().zip(others).map(|(given, name)| {
        let lies = if name == "C" { Lies::Row } else { Lies::Column };
        Small::read(name, &required(function, name, given)?, lies)
    });
    let b = read.next().transpose()?.unwrap_or(a);
    let c = read.next().transpose()?.unwrap_or(a);
    Ok(Plant {
        time,
        a,
        b,
        c,
        rest,
    })
}

/// An argument that cannot be left out.
pub(super) fn required<'py>(
    function: &str,
    name: &str,
    given: Option<Matrix<'py>>,
) -> PyResult<Matrix<'py>> {
    given.ok_or_else(|| error::design(format!("{function} needs {name}, which was not given")))
}

/// What follows a whole system: given by position it stands in the places of the `matrices` that were left out, by
/// keyword in its own.
fn after_the_system<'py>(
    function: &str,
    mut given: Vec<Option<Matrix<'py>>>,
    matrices: usize,
) -> PyResult<[Option<Matrix<'py>>; 3]> {
    let by_position = given.iter().take_while(|g| g.is_some()).count();
    let mut rest = [const { None }; 3];
    if by_position > rest.len() {
        return Err(error::design(format!(
            "{function} takes at most {} arguments after a system; {by_position} were given",
            rest.len()
        )));
    }
    for (to, from) in rest
        .iter_mut()
        .zip(given.drain(..by_position.max(matrices)))
    {
        *to = from;
    }
    // What is left in `given` stands in its own place, counted from the end.
    let free = rest.len() - given.len().min(rest.len());
    for (to, from) in rest.iter_mut().skip(free).zip(given) {
        if from.is_some() {
            *to = from;
        }
    }
    Ok(rest)
}

/// A, B and C of a system given as one object, if `given` is one: a rig upright, with those of its effects that have a
/// slope there (a Python warning names the others), or whatever has the attributes A, B, C and dt, as python-control's
/// `StateSpace` does.
fn whole(function: &str, time: Time, given: &Bound<'_, PyAny>) -> PyResult<Option<[Small; 3]>> {
    // The usual cases first: a design takes a few microseconds.
    if given.cast::<PyUntypedArray>().is_ok() || given.is_instance_of::<PyList>() {
        return Ok(None);
    }
    let is_rig = given.is_instance_of::<PyString>() || given.is_instance_of::<crate::rig::PyRig>();
    if is_rig {
        let rig = given.extract::<RigLike>()?.rig;
        if time == Time::Sampled {
            return Err(error::design(format!(
                "{function} is for a sampled system, and a rig's model is continuous: give A and B of \
                 zero_order_hold(*linearize(rig), dt)"
            )));
        }
        let plant = rig.try_plant().map_err(error::rig)?;
        error::warn_each(given.py(), rigid_remarks(&plant))?;
        let linear = at_rest(&plant)?;
        let encoders = Small::from_fn(2, 4, |i, j| f64::from(i == j));
        return Ok(Some([
            Small::from_fixed(&linear.a),
            Small::from_fixed(&linear.b),
            encoders,
        ]));
    }
    let (Ok(a), Ok(b), Ok(c)) = (given.getattr("A"), given.getattr("B"), given.getattr("C")) else {
        if given.hasattr("num")? && given.hasattr("den")? {
            return Err(error::design(format!(
                "{function} needs the states of a system, and a transfer function has none: give control.ss(system)"
            )));
        }
        return Ok(None);
    };
    // None: not said. True: sampled, at a period that is not said.
    let dt = given.getattr("dt").ok().filter(|dt| !dt.is_none());
    let sampled = dt.map(|dt| dt.is_truthy()).transpose()?;
    match (time, sampled) {
        (Time::Continuous, Some(true)) => Err(error::design(format!(
            "{function} is for a continuous system, and the one given is sampled: use d{function}"
        ))),
        (Time::Sampled, Some(false)) => Err(error::design(format!(
            "{function} is for a sampled system, and the one given is continuous: use {}, or sample it first",
            &function[1..]
        ))),
        _ => Ok(Some([
            Small::read("A", &a, Lies::Square)?,
            Small::read("B", &b, Lies::Column)?,
            Small::read("C", &c, Lies::Row)?,
        ])),
    }
}
