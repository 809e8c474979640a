//! The table `[trajectory]` of a controller file.

use super::error::FileError;
use super::places::Places;
use super::value::number;
use crate::trajectory::{Knot, Trajectory, TrajectoryError, VERSION, WhenLost};
use std::fmt::Write as _;
use toml::Value;

const KEYS: &str = "version, interval, when_lost, points";
const LOST: [(&str, WhenLost); 2] = [("energy", WhenLost::Energy), ("stop", WhenLost::Stop)];
/// Numbers of a point.
const COLUMNS: usize = 9;

/// The table as a trajectory.
pub(super) fn read(table: &toml::Table, at: &Places<'_>) -> Result<Trajectory, FileError> {
    let section = "trajectory";
    let wrong = |key: &str, wanted: &str| FileError::WrongType {
        line: at.key(section, key),
        key: key.to_owned(),
        wanted: wanted.to_owned(),
    };
    if let Some(key) = table
        .keys()
        .find(|key| !KEYS.split(", ").any(|k| k == *key))
    {
        return Err(FileError::UnknownKey {
            line: at.key(section, key),
            section,
            key: key.clone(),
            known: format!("it has {KEYS}"),
        });
    }
    let version = table.get("version").and_then(Value::as_integer);
    if version != Some(VERSION) {
        let wanted = format!(
            "{VERSION}, the version that this program reads; make the file again with furuta design swing-up"
        );
        return Err(wrong("version", &wanted));
    }
    let interval = table.get("interval").and_then(number);
    let interval = interval.ok_or_else(|| wrong("interval", "a number of seconds"))?;
    let when_lost = match table.get("when_lost") {
        None => WhenLost::default(),
        Some(word) => LOST
            .iter()
            .find(|(name, _)| word.as_str() == Some(*name))
            .map(|(_, what)| *what)
            .ok_or_else(|| wrong("when_lost", "\"energy\" or \"stop\""))?,
    };
    let rows = || {
        wrong(
            "points",
            "a list of points, each [theta, alpha, theta_dot, alpha_dot, u, and four gains]",
        )
    };
    let list = table
        .get("points")
        .and_then(Value::as_array)
        .ok_or_else(rows)?;
    let knots = list
        .iter()
        .map(|row| point(row).ok_or_else(rows))
        .collect::<Result<Vec<_>, _>>()?;
    Trajectory::new(interval, &knots, when_lost).map_err(|error| {
        let key = match error {
            TrajectoryError::Interval { .. } => "interval",
            _ => "points",
        };
        FileError::Trajectory {
            line: at.key(section, key),
            error,
        }
    })
}

#[allow(clippy::cast_possible_truncation)] // beyond single precision is infinite, and refused
fn point(row: &Value) -> Option<Knot> {
    let values: Option<Vec<f32>> = row
        .as_array()?
        .iter()
        .map(|v| number(v).map(|v| v as f32))
        .collect();
    let [a, b, c, d, u, e, f, g, h]: [f32; COLUMNS] = values?.try_into().ok()?;
    Some(Knot {
        x: [a, b, c, d],
        u,
        gain: [e, f, g, h],
    })
}

/// The table's text.
pub(super) fn written(trajectory: &Trajectory) -> String {
    let when_lost = LOST
        .iter()
        .find(|(_, what)| *what == trajectory.when_lost());
    let mut out = format!(
        "[trajectory]   # a swing-up to follow, made by furuta design swing-up\n\
         version = {VERSION}\n\
         interval = {:?}   # s\n\
         when_lost = \"{}\"   # or \"stop\"\n\
         # theta, alpha [rad], theta_dot, alpha_dot [rad/s], u [V], gains of the same [V/rad, V s/rad]\n\
         points = [\n",
        trajectory.interval(),
        when_lost.map_or("energy", |(name, _)| name),
    );
    for knot in trajectory.knots() {
        let [a, b, c, d] = knot.x;
        let [e, f, g, h] = knot.gain;
        // Writing to a String cannot fail; the shortest text that reads back as the same number.
        let _ = writeln!(
            out,
            "    [{a:?}, {b:?}, {c:?}, {d:?}, {:?}, {e:?}, {f:?}, {g:?}, {h:?}],",
            knot.u
        );
    }
    out.push_str("]\n");
    out
}
