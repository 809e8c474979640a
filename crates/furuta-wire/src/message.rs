//! What rig and host say to each other.

use core::ops::BitOr;

use arrayvec::ArrayString;
use serde::{Deserialize, Serialize};

use crate::{ArmCounts, PendulumCounts};

/// Version of the protocol that this crate speaks. Raised whenever a message changes; [`Query`] and [`Hello`] begin
/// with it in every version, so that two ends that do not understand each other can at least say so.
pub const PROTOCOL_VERSION: u16 = 1;

/// Longest name of a rig, in bytes of UTF-8.
pub const RIG_NAME_CAPACITY: usize = 32;

/// Name of a rig, of fixed capacity.
pub type RigName = ArrayString<RIG_NAME_CAPACITY>;

/// Every message of the protocol. The order of the variants is part of the protocol: postcard sends their index.
#[derive(Copy, Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Message {
    /// Host to rig: who are you?
    Query(Query),
    /// Rig to host: the answer.
    Hello(Hello),
    /// Rig to host: one per period.
    Sample(Sample),
    /// Host to rig: one per sample.
    Command(Command),
}

/// Host to rig: asks for a [`Hello`].
#[derive(Copy, Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Query {
    /// The host's [`PROTOCOL_VERSION`].
    pub version: u16,
}

/// Rig to host: identity and limits.
#[derive(Copy, Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hello {
    /// The rig's [`PROTOCOL_VERSION`].
    pub version: u16,
    /// Name of the rig, as in its rig file.
    pub rig: RigName,
    /// Sampling period (us).
    pub period_us: u32,
    /// Counts of the arm encoder per turn of the arm.
    pub arm_counts_per_rev: f64,
    /// Counts of the pendulum encoder per turn of the pendulum.
    pub pendulum_counts_per_rev: f64,
    /// Largest voltage the rig applies (V), or largest command in the unit of its kind; commands beyond it are clipped.
    pub command_limit: f32,
    /// Where the rig switches its motor off by itself.
    pub limits: RigLimits,
    /// Periods without a valid command after which the motor is switched off.
    pub watchdog_periods: u16,
    /// What a command is: 0 a voltage (V), 1 a current (A), 2 a torque (N m), 3 the arm's acceleration (rad/s²). A
    /// voltage is not said on the wire: the hello of such a rig ends with `watchdog_periods`, as it always did, and a
    /// host that knows voltages alone refuses every other.
    #[serde(default)]
    pub actuation: u8,
}

/// Beyond these the rig switches its motor off until the next valid command within them. `None`: no limit.
#[derive(Copy, Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RigLimits {
    /// Largest `abs(theta)` (rad).
    pub arm_angle: Option<f32>,
    /// Largest `abs(theta_dot)` (rad/s).
    pub arm_speed: Option<f32>,
    /// Largest `abs(alpha_dot)` (rad/s).
    pub pendulum_speed: Option<f32>,
}

/// Rig to host, once per period: what the encoders read at this tick, and what the motor gets until the next.
#[derive(Copy, Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sample {
    /// Number of the tick; a jump tells the host how many samples were lost. Wraps.
    pub seq: u32,
    /// The rig's clock at this tick (us).
    pub t_us: u64,
    /// Arm encoder.
    pub theta: ArmCounts,
    /// Pendulum encoder.
    pub alpha: PendulumCounts,
    /// Voltage applied from this tick to the next (V): what was really held, whatever the host had asked for. Of a rig
    /// of another kind the command in its unit.
    pub volts: f32,
    /// What happened since the previous tick.
    pub status: Status,
}

/// Host to rig: the answer to one sample.
#[derive(Copy, Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Command {
    /// [`Sample::seq`] of the sample answered: one of the last, and newer than that of the command before.
    pub seq: u32,
    /// Motor voltage (V); of a rig of another kind the command in its unit ([`Hello::actuation`]).
    pub volts: f32,
}

/// Flags of a [`Sample`].
#[derive(Copy, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Status(u8);

impl Status {
    /// Nothing to report.
    pub const OK: Self = Self(0);
    /// No valid command arrived since the previous tick; the last one is held.
    pub const HELD: Self = Self(1 << 0);
    /// No valid command for the watchdog's number of periods (or none ever): the motor is off.
    pub const WATCHDOG: Self = Self(1 << 1);
    /// The command was beyond the command limit and was clipped.
    pub const CLIPPED: Self = Self(1 << 2);
    /// A limit is exceeded: the motor is off.
    pub const LIMIT: Self = Self(1 << 3);
    /// A command was refused: not a finite number, or an answer to no sample of late (repeated, old, of before a
    /// reset).
    pub const REFUSED: Self = Self(1 << 4);

    /// The flags as a number.
    #[must_use]
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// The flags from their number.
    #[must_use]
    pub const fn from_bits(bits: u8) -> Self {
        Self(bits)
    }

    /// True if every flag of `flags` is set.
    ///
    /// ```
    /// use furuta_wire::Status;
    /// let status = Status::HELD | Status::WATCHDOG;
    /// assert!(status.contains(Status::WATCHDOG) && !status.contains(Status::LIMIT));
    /// ```
    #[must_use]
    pub const fn contains(self, flags: Self) -> bool {
        self.0 & flags.0 == flags.0
    }
}

impl BitOr for Status {
    type Output = Self;

    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl core::fmt::Debug for Status {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        const NAMES: [(Status, &str); 5] = [
            (Status::HELD, "HELD"),
            (Status::WATCHDOG, "WATCHDOG"),
            (Status::CLIPPED, "CLIPPED"),
            (Status::LIMIT, "LIMIT"),
            (Status::REFUSED, "REFUSED"),
        ];
        f.write_str("Status(")?;
        let mut first = true;
        for (flag, name) in NAMES {
            if self.contains(flag) {
                if !first {
                    f.write_str(" | ")?;
                }
                f.write_str(name)?;
                first = false;
            }
        }
        f.write_str(")")
    }
}
