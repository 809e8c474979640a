//! What a rig's command is: a voltage, a current, a torque, or the arm's acceleration.

/// What drives the arm: what the rig file calls `motor.kind`, and its unit.
///
/// | `motor.kind` | Command | Arm |
/// |---|---|---|
/// | `"voltage"` | V at the amplifier | DC motor with back-EMF: `tau = drive u - (b_a + back-EMF) theta'` |
/// | `"torque"`, `unit = "A"` | current, A | the drive closes a current loop: `tau = drive u - b_a theta'` |
/// | `"torque"`, `unit = "N m"` | torque at the motor's shaft, N m | the same |
/// | `"acceleration"` | rad/s² of the arm | a stepper motor's: `theta'' = gain u`, whatever the pendulum does |
///
/// One set of equations serves all: see [`crate::params::Coefficients`].
///
/// ```
/// use furuta_model::{Actuation, Rig};
/// let rig = Rig::builtin("stepper-kit").ok_or("no such rig")?;
/// assert_eq!(rig.params.motor.actuation, Actuation::Acceleration);
/// assert_eq!(rig.params.motor.actuation.unit(), "rad/s2");
/// # Ok::<(), &str>(())
/// ```
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub enum Actuation {
    /// A voltage amplifier and a DC motor.
    #[default]
    Voltage,
    /// A drive that controls its current.
    Current,
    /// A drive that is told a torque.
    Torque,
    /// A stepper motor, or a drive that follows an acceleration.
    Acceleration,
}

impl Actuation {
    /// All of them.
    pub const ALL: [Self; 4] = [
        Self::Voltage,
        Self::Current,
        Self::Torque,
        Self::Acceleration,
    ];

    /// Its number where bytes are sent or compiled in: its place in [`Actuation::ALL`].
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::Voltage => 0,
            Self::Current => 1,
            Self::Torque => 2,
            Self::Acceleration => 3,
        }
    }

    /// The one with this number; `None` for a number that none has.
    ///
    /// ```
    /// use furuta_model::Actuation;
    /// assert!(Actuation::ALL.iter().all(|a| Actuation::from_code(a.code()) == Some(*a)));
    /// assert_eq!(Actuation::from_code(4), None);
    /// ```
    #[must_use]
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.get(usize::from(code)).copied()
    }

    /// `motor.kind` of a rig file.
    #[must_use]
    pub const fn kind(self) -> &'static str {
        match self {
            Self::Voltage => "voltage",
            Self::Current | Self::Torque => "torque",
            Self::Acceleration => "acceleration",
        }
    }

    /// Unit of the command.
    #[must_use]
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Voltage => "V",
            Self::Current => "A",
            Self::Torque => "N m",
            Self::Acceleration => "rad/s2",
        }
    }

    /// What the command is, in words.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Voltage => "voltage",
            Self::Current => "current",
            Self::Torque => "torque",
            Self::Acceleration => "acceleration of the arm",
        }
    }

    /// The kind that `motor.kind` and `motor.unit` of a rig file name; without a unit the first of its kind.
    ///
    /// ```
    /// use furuta_model::Actuation;
    /// assert_eq!(Actuation::of("torque", None), Some(Actuation::Current));
    /// assert_eq!(Actuation::of("torque", Some("N m")), Some(Actuation::Torque));
    /// assert_eq!(Actuation::of("voltage", Some("A")), None);
    /// ```
    #[must_use]
    pub fn of(kind: &str, unit: Option<&str>) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|a| a.kind() == kind && unit.is_none_or(|unit| unit == a.unit()))
    }

    /// A unit of the catalogue or of [`crate::params::RANGES`], which are written for voltages, on a rig of this kind:
    /// `V` is the command's.
    ///
    /// ```
    /// use furuta_model::Actuation;
    /// assert_eq!(Actuation::Acceleration.unit_of("V"), "rad/s2");
    /// assert_eq!(Actuation::Acceleration.unit_of("kg"), "kg");
    /// ```
    #[must_use]
    pub fn unit_of(self, unit: &'static str) -> &'static str {
        match (self, unit) {
            (Self::Voltage, _) => unit,
            (_, "V") => self.unit(),
            (_, "V/V") => "-",
            (Self::Current, "V/s") => "A/s",
            (Self::Torque, "V/s") => "N m/s",
            (Self::Acceleration, "V/s") => "rad/s3",
            (Self::Current, "N m/V") => "N m/A",
            (Self::Torque, "N m/V") => "-",
            (Self::Current, "1/V") => "1/A",
            (Self::Torque, "1/V") => "1/(N m)",
            (Self::Acceleration, "1/V") => "s2/rad",
            (_, unit) => unit,
        }
    }

    /// Whether a parameter of [`crate::params::RANGES`] enters the equations of motion.
    ///
    /// ```
    /// use furuta_model::Actuation;
    /// assert!(!Actuation::Current.uses("motor.resistance"));
    /// assert!(!Actuation::Acceleration.uses("arm.inertia"));
    /// ```
    #[must_use]
    pub fn uses(self, key: &str) -> bool {
        match self {
            Self::Voltage => true,
            Self::Current => !matches!(key, "motor.resistance" | "motor.back_emf_constant"),
            Self::Torque => !matches!(
                key,
                "motor.resistance" | "motor.back_emf_constant" | "motor.torque_constant"
            ),
            Self::Acceleration => !matches!(
                key,
                "arm.inertia"
                    | "arm.viscous"
                    | "motor.resistance"
                    | "motor.back_emf_constant"
                    | "motor.torque_constant"
                    | "motor.gear_ratio"
                    | "motor.efficiency"
            ),
        }
    }
}

impl core::fmt::Display for Actuation {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.kind())
    }
}
