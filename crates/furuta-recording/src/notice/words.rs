//! What was noticed, in words: what, where, how large, and what to do.

use std::fmt;

use furuta_input::number;

use super::NoticeKind;

/// At most this many rows are listed; the rest are counted.
const ROWS_LISTED: usize = 8;

struct Rows<'a>(&'a [usize]);

impl fmt::Display for Rows<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.0.len() == 1 { "row " } else { "rows " })?;
        for (i, row) in self.0.iter().take(ROWS_LISTED).enumerate() {
            write!(f, "{}{row}", if i == 0 { "" } else { ", " })?;
        }
        match self.0.len().saturating_sub(ROWS_LISTED) {
            0 => Ok(()),
            more => write!(f, " and {more} more"),
        }
    }
}

/// By how many rows a column is to be moved, at least one, and the plural's s.
fn whole_rows(rows: f64) -> [String; 2] {
    let whole = rows.abs().round().max(1.0);
    let s = if whole > 1.0 { "s" } else { "" };
    [format!("{whole:.0}"), s.to_owned()]
}

/// A command that changes on a line between rows and is taken as held looks half a row late, one in the next row a
/// whole row.
const BETWEEN_ROWS: f64 = 0.75;

/// The axis of a column of angles, as rig files call it.
fn axis(column: &str) -> &'static str {
    if column == "theta" { "arm" } else { "pendulum" }
}

impl fmt::Display for NoticeKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::CutOff { what } => f.write_str(what),
            Self::DuplicatedRows { rows } => {
                write!(f, "{} repeat the row before: dropped", Rows(rows))
            }
            Self::Spikes { column, rows, by } => write!(
                f,
                "{}: {column} stands out from both neighbours by {by:.3} rad, which is no motion: not used; \
                 predictions stop there and start anew",
                Rows(rows)
            ),
            Self::ManySpikesSuspected { column, rows, by } => write!(
                f,
                "{column} stands out from both neighbours in {rows} rows, in the first by {by:.3} rad, which is no \
                 motion: check the encoder's cable and supply"
            ),
            Self::Gap { row, from, to } => {
                write!(
                    f,
                    "gap before row {row}: no samples from {} s to {} s; predictions stop there and start anew",
                    number(*from),
                    number(*to)
                )
            }
            Self::Gaps { rows } => write!(
                f,
                "{} gaps, before {}: predictions stop there and start anew",
                rows.len(),
                Rows(rows)
            ),
            Self::IrregularIntervals { rows, period } => write!(
                f,
                "the interval before {} does not fit the sample period of {} s; predictions stop there and start anew",
                Rows(rows),
                number(*period)
            ),
            Self::UnevenTime {
                irregular,
                intervals,
                period,
            } => write!(
                f,
                "{irregular} of {intervals} intervals between time stamps differ much from their mean of {} s: the time \
                 stamps are used as they are (frequency responses alone need a fixed rate)",
                number(*period)
            ),
            Self::Jitter { largest, period } => write!(
                f,
                "time stamps scatter by up to {:.0} % of the sample period; taken as evenly spaced by {} s",
                100.0 * largest,
                number(*period)
            ),
            Self::ShortSegments { rows, samples } => match rows.len() {
                1 => write!(
                    f,
                    "the {samples} samples from {} on, between two gaps, are too few to be of use and left out",
                    Rows(rows)
                ),
                count => write!(
                    f,
                    "{count} stretches between gaps, {samples} samples from {} on, are too short to be of use and left \
                     out",
                    Rows(rows)
                ),
            },
            Self::Unwrapped { column, row, jumps } => write!(
                f,
                "{column} was recorded modulo a turn ({jumps} {}, first at row {row}): made continuous",
                if *jumps == 1 { "jump" } else { "jumps" }
            ),
            Self::Jump { column, row, by } => write!(
                f,
                "{column} jumps by {by:.3} rad at row {row}, which is neither motion nor a turn: check the encoder or \
                 cut the recording there"
            ),
            Self::TooShort { duration, required } => {
                write!(
                    f,
                    "only {duration:.3} s long; record at least {required} s, better 10 s"
                )
            }
            Self::ConstantCommand { value } => {
                write!(
                    f,
                    "the command is {} V throughout: the motor cannot be told from this recording alone; add one with \
                     a changing command",
                    number(*value)
                )
            }
            Self::NoMotion => write!(
                f,
                "neither arm nor pendulum moves: record with a command that moves them"
            ),
            Self::DegreesSuspected {
                column,
                resolution,
                largest,
            } => write!(
                f,
                "{column} looks as if it were in degrees (steps of {resolution:.4}, up to {largest:.1}); radians are \
                 required: multiply by pi/180"
            ),
            Self::TimeUnitSuspected { period, unit } => write!(
                f,
                "time stamps {} apart look as if they were in {unit}; seconds are required",
                number(*period)
            ),
            Self::HangingSuspected => write!(
                f,
                "the pendulum swings about alpha = 0, so alpha looks as if measured from hanging; it must be 0 \
                 upright: add pi to it"
            ),
            Self::SwappedSuspected { columns: [a, b] } => write!(
                f,
                "the pendulum moves as it should if the columns {a} and {b} are swapped, so they look as if exchanged: \
                 give each its name"
            ),
            Self::ClippedSuspected { column, at, times } => write!(
                f,
                "{column} stops dead at {at:.4} rad {times} times while it moves, so its encoder (or the file's \
                 format) looks as if it ended there, or the axis met a stop: \
                 record with less motion, or leave those stretches out"
            ),
            Self::FrequencySuspected { found, expected } => write!(
                f,
                "the pendulum swings at {found:.2} Hz, the rig's at {expected:.2} Hz: either time stamps are off by a \
                 factor of {:.2}, or the recording is of another rig; \
                 check the sample rate and --rig",
                expected / found
            ),
            Self::ScaleSuspected { ratio } => write!(
                f,
                "the arm moves the pendulum {ratio:.3} times as much as on this rig, so theta looks as if in another \
                 unit than alpha (degrees?), or the recording is of another rig: \
                 check the units and --rig"
            ),
            Self::CountsSuspected {
                column,
                encoder,
                taken,
                in_rig_file,
                zero,
            } => {
                let axis = axis(column);
                let source = if taken == in_rig_file {
                    "the rig file says"
                } else {
                    "the angle was made with"
                };
                write!(
                    f,
                    "counts per turn of the {axis}'s encoder look like {encoder}, {source} {taken}: a turn reads as \
                     {:.4} of one; correct the recording, \
                     {column} = {zero:.6} + {:.6} * ({column} - {zero:.6}), and sensors.{axis}_counts_per_rev if the \
                     rig file is wrong",
                    encoder / taken,
                    taken / encoder
                )
            }
            Self::EitherCountsSuspected {
                ratio,
                arm: (arm, arm_taken),
                pendulum: (pendulum, pendulum_taken),
            } => write!(
                f,
                "the arm moves the pendulum {ratio:.3} times as much as on this rig: counts per turn of the \
                 pendulum's encoder look like {pendulum} where {pendulum_taken} \
                 were taken, or those of the arm's like {arm} where {arm_taken} were taken; turn each axis once \
                 round by hand, and correct the one that does not read 2 pi"
            ),
            Self::RawCountsSuspected {
                column,
                largest,
                per_turn,
            } => {
                let axis = axis(column);
                write!(
                    f,
                    "{column} looks as if it were in counts of the {axis}'s encoder (whole numbers, up to \
                     {largest}); radians are required: multiply by 2 pi/{axis}_counts_per_rev"
                )?;
                match per_turn {
                    Some(counts) => write!(f, " = {:.9}", core::f64::consts::TAU / counts)?,
                    None => write!(f, " (0.003067962 for 2048)")?,
                }
                if *column == "alpha" {
                    f.write_str(", and add pi where it was zeroed hanging")?;
                }
                Ok(())
            }
            Self::CommandUnitSuspected {
                largest,
                limit,
                unit,
                factor,
            } => write!(
                f,
                "u goes up to {largest}, the rig's command_limit is {limit} V, so it looks as if it were in {unit}; \
                 volts are required: multiply by {factor:.6}, \
                 or correct motor.command_limit in the rig file"
            ),
            Self::MotorGainSuspected {
                factor,
                unit,
                geared,
                command,
            } => {
                // Two significant digits.
                let places = (1.0 - factor.log10().floor()).max(0.0) as usize;
                write!(
                    f,
                    "each {command} of u moves the arm {factor:.places$} times as hard as the rig file's motor would"
                )?;
                match unit {
                    _ if *geared && *factor > 1.0 => f.write_str(
                        ", and brakes it harder too: a gear looks left out of motor.torque_constant and \
                         motor.back_emf_constant, which are the motor's times the gear's ratio (and of arm.inertia, \
                         which has the rotor's times its square)",
                    ),
                    _ if *geared => f.write_str(
                        ", and brakes it less too: a gear that the rig has not looks counted in motor.torque_constant \
                         and motor.back_emf_constant",
                    ),
                    Some((unit, size)) => write!(
                        f,
                        ", so it looks as if it were in {unit}; {command} are required: multiply by {size:.6}, or \
                         correct the motor in the rig file (gear, resistance)"
                    ),
                    None => write!(
                        f,
                        ": is u in {command}, and are motor.resistance, motor.torque_constant (gear included) and \
                         arm.inertia those of this rig?"
                    ),
                }
            }
            Self::FrozenSuspected {
                column,
                since,
                until,
                at,
            } => {
                write!(
                    f,
                    "{column} stands at {at:.4} rad from {since:.3} s to {until:.3} s while its axis must move, so its \
                     encoder looks dead: check cable and plug, or cut the recording at {since:.3} s"
                )?;
                f.write_str(match *column {
                    "alpha" => {
                        "; where the pendulum was taken off or locked on purpose, diagnose the arm alone (--pendulum \
                         removed or locked)"
                    }
                    "theta" => {
                        "; where the arm was held on purpose, diagnose the pendulum alone (--pendulum alone)"
                    }
                    _ => "",
                })
            }
            Self::CommandSignSuspected => write!(
                f,
                "the arm answers the command with the wrong sign, so u or theta looks as if counted the other way: \
                 change the sign of u, or of theta (and of alpha, if both angles are mirrored)"
            ),
            Self::SkewSuspected { rows } => {
                let (late, early) = if *rows > 0.0 {
                    ("alpha", "theta")
                } else {
                    ("theta", "alpha")
                };
                let (rows, [whole, s]) = (rows.abs(), whole_rows(*rows));
                write!(
                    f,
                    "{late} is {rows:.1} rows later than {early}, but a row holds what both encoders read at its time: \
                     move the column {late} up by {whole} row{s}, or read both encoders at once"
                )
            }
            Self::LateCommandSuspected { rows } if *rows < BETWEEN_ROWS => write!(
                f,
                "the arm answers {rows:.1} rows before u is written: if the file keeps every N-th row of a faster \
                 controller, its command changes between the rows: record every row, or read it as smooth between \
                 them (--command smooth, in Python command=\"smooth\"); if u is written a row late and the motor \
                 lags, move the column u up by 1 row"
            ),
            Self::LateCommandSuspected { rows } => {
                let [whole, s] = whole_rows(*rows);
                write!(
                    f,
                    "the arm answers {rows:.1} rows before u is written, so u looks {whole} row{s} late: a row holds \
                     the command that acts from it to the next; move the column u up by {whole} row{s}"
                )
            }
            Self::AsInAnother { what, other } => {
                write!(
                    f,
                    "{what} (so {other} shows, and this recording does not show otherwise)"
                )
            }
            Self::LeftOut { why } => write!(f, "left out: {why}"),
            Self::OtherRigSuspected { than, why } => write!(
                f,
                "looks as if recorded on another rig than {than}: {why}; diagnose recordings of one rig at a time"
            ),
            Self::SignSuspected => write!(
                f,
                "the pendulum answers the arm with the wrong sign, so theta or alpha looks as if counted the other \
                 way: change the sign of one"
            ),
        }
    }
}
