//! Physical parameters, their units, and the ranges outside which a value is a mistake.

use crate::actuation::Actuation;
use crate::scalar::Scalar;

/// The arm: from the motor's axis to the pendulum's hinge.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Arm<S> {
    /// `L_r`, motor axis to pendulum pivot, m.
    pub length: S,
    /// `J_a` about the motor's axis, rotor and gears included, pendulum not, kg m².
    pub inertia: S,
    /// `b_a`, viscous friction, N m s/rad.
    pub viscous: S,
}

/// The pendulum: a rigid body hinged at the arm's end, hinge along the arm.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Pendulum<S> {
    /// `m`, kg.
    pub mass: S,
    /// `c`, pivot to centre of mass, m.
    pub com: S,
    /// `I`, about the centre of mass and the hinge's direction, kg m².
    pub inertia: S,
    /// `I_t`, about the centre of mass, transverse to rod and hinge, kg m² (a slender rod: equal to `inertia`; 0 in the
    /// papers).
    pub inertia_transverse: S,
    /// `I_a`, about the rod's own axis, kg m².
    pub inertia_axial: S,
    /// `b_p`, viscous friction of the hinge, N m s/rad.
    pub viscous: S,
}

/// What drives the arm: amplifier, motor and gear. What does not enter the equations of its kind
/// ([`Actuation::uses`]) is neutral: 1, and 0 for the back-EMF.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Motor<S> {
    /// What the command is.
    pub actuation: Actuation,
    /// Armature resistance, ohm.
    pub resistance: S,
    /// N m/A at the motor's shaft.
    pub torque_constant: S,
    /// V s/rad at the motor's shaft.
    pub back_emf_constant: S,
    /// Turns of the motor for one of the arm.
    pub gear_ratio: S,
    /// Of motor and gear together, 0 to 1.
    pub efficiency: S,
    /// Volts at the motor for one volt of command; amperes, newton metres or rad/s² for one of them in other kinds.
    pub amplifier_gain: S,
    /// Largest command, in the command's unit ([`Actuation::unit`]).
    pub command_limit: S,
}

/// All parameters of the rigid two-body model.
///
/// ```
/// use furuta_model::Rig;
/// let p = Rig::builtin("qube-servo-2").expect("built in").params;
/// assert!(p.validate().is_ok());
/// let mut wrong = p;
/// wrong.pendulum.mass = -0.024;
/// assert_eq!(wrong.validate().expect_err("negative mass").key, "pendulum.mass");
/// ```
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Params<S> {
    /// The arm.
    pub arm: Arm<S>,
    /// The pendulum.
    pub pendulum: Pendulum<S>,
    /// Amplifier, motor, gear.
    pub motor: Motor<S>,
    /// Acceleration of gravity, m/s².
    pub gravity: S,
}

/// A parameter outside the range in which it makes physical sense.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct ParamError {
    /// Which, as in the rig file: `pendulum.mass`.
    pub key: &'static str,
    /// What it was.
    pub value: f64,
    /// Lower end of the allowed range.
    pub min: f64,
    /// Upper end of the allowed range.
    pub max: f64,
    /// Whether the lower end itself is allowed.
    pub min_allowed: bool,
    /// Unit of value and range.
    pub unit: &'static str,
}

impl core::fmt::Display for ParamError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let open = if self.min_allowed { "[" } else { "(" };
        write!(
            f,
            "{} = {} is outside the allowed range {open}{}, {}] {}",
            self.key,
            furuta_input::number(self.value),
            self.min,
            self.max,
            self.unit
        )
    }
}

impl core::error::Error for ParamError {}

/// Key, unit and range of every parameter: the one list that validation, rig files and reports share.
#[derive(Copy, Clone, Debug)]
pub struct ParamRange {
    /// As in the rig file.
    pub key: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// Lower end.
    pub min: f64,
    /// Upper end.
    pub max: f64,
    /// Whether the lower end itself is allowed (it is for friction, not for a mass).
    pub min_allowed: bool,
}

const fn positive(key: &'static str, unit: &'static str, max: f64) -> ParamRange {
    ParamRange {
        key,
        unit,
        min: 0.0,
        max,
        min_allowed: false,
    }
}

const fn from_zero(key: &'static str, unit: &'static str, max: f64) -> ParamRange {
    ParamRange {
        key,
        unit,
        min: 0.0,
        max,
        min_allowed: true,
    }
}

/// The ranges, in the order of [`Params::to_array`]. The upper ends are those of a laboratory rig: a value above is a
/// wrong unit (mm, g).
pub const RANGES: [ParamRange; 17] = [
    positive("arm.length", "m", 10.0),
    positive("arm.inertia", "kg m2", 100.0),
    from_zero("arm.viscous", "N m s/rad", 100.0),
    positive("pendulum.mass", "kg", 100.0),
    positive("pendulum.com", "m", 10.0),
    from_zero("pendulum.inertia", "kg m2", 100.0),
    from_zero("pendulum.inertia_transverse", "kg m2", 100.0),
    from_zero("pendulum.inertia_axial", "kg m2", 100.0),
    from_zero("pendulum.viscous", "N m s/rad", 100.0),
    positive("motor.resistance", "ohm", 1e4),
    positive("motor.torque_constant", "N m/A", 100.0),
    from_zero("motor.back_emf_constant", "V s/rad", 100.0),
    positive("motor.gear_ratio", "-", 1e4),
    positive("motor.efficiency", "-", 1.0),
    positive("motor.amplifier_gain", "V/V", 1e3),
    positive("motor.command_limit", "V", 1e3),
    from_zero("environment.gravity", "m/s2", 30.0),
];

impl ParamRange {
    /// The unit on a rig whose command is of this kind.
    ///
    /// ```
    /// use furuta_model::{Actuation, params::RANGES};
    /// let limit = RANGES.iter().find(|r| r.key == "motor.command_limit").expect("in the list");
    /// assert_eq!((limit.unit, limit.unit_for(Actuation::Current)), ("V", "A"));
    /// ```
    #[must_use]
    pub fn unit_for(&self, actuation: Actuation) -> &'static str {
        actuation.unit_of(self.unit)
    }
}

/// Inertia, and torque for a rad/s² of command, of an arm whose acceleration is commanded, kg m²: 2^40, against which a
/// pendulum's reaction of 1 N m accelerates the arm by 1e-12 rad/s².
const UNMOVED: f64 = 1_099_511_627_776.0;

impl<S: Copy> Params<S> {
    /// All values in the order of [`RANGES`].
    #[must_use]
    pub const fn to_array(&self) -> [S; 17] {
        let (a, p, m) = (&self.arm, &self.pendulum, &self.motor);
        [
            a.length,
            a.inertia,
            a.viscous,
            p.mass,
            p.com,
            p.inertia,
            p.inertia_transverse,
            p.inertia_axial,
            p.viscous,
            m.resistance,
            m.torque_constant,
            m.back_emf_constant,
            m.gear_ratio,
            m.efficiency,
            m.amplifier_gain,
            m.command_limit,
            self.gravity,
        ]
    }

    /// From all values in the order of [`RANGES`], of a rig whose command is of this kind.
    #[must_use]
    pub const fn from_array(actuation: Actuation, v: [S; 17]) -> Self {
        Self {
            arm: Arm {
                length: v[0],
                inertia: v[1],
                viscous: v[2],
            },
            pendulum: Pendulum {
                mass: v[3],
                com: v[4],
                inertia: v[5],
                inertia_transverse: v[6],
                inertia_axial: v[7],
                viscous: v[8],
            },
            motor: Motor {
                actuation,
                resistance: v[9],
                torque_constant: v[10],
                back_emf_constant: v[11],
                gear_ratio: v[12],
                efficiency: v[13],
                amplifier_gain: v[14],
                command_limit: v[15],
            },
            gravity: v[16],
        }
    }

    /// Every value through `f`, for example into another scalar.
    #[must_use]
    pub fn map<T: Copy>(&self, f: impl Fn(S) -> T) -> Params<T> {
        Params::from_array(self.motor.actuation, self.to_array().map(f))
    }
}

impl<S: Scalar> Params<S> {
    /// The same values in another scalar, as constants.
    #[must_use]
    pub fn cast<T: Scalar>(&self) -> Params<T> {
        self.map(|x| T::from_f64(x.value()))
    }

    /// Checks every value against its range.
    ///
    /// # Errors
    /// The first value that is not finite or outside its range.
    pub fn validate(&self) -> Result<(), ParamError> {
        for (range, value) in RANGES.iter().zip(self.to_array()) {
            let value = value.value();
            let above = if range.min_allowed {
                value >= range.min
            } else {
                value > range.min
            };
            if !(above && value <= range.max) {
                return Err(ParamError {
                    key: range.key,
                    value,
                    min: range.min,
                    max: range.max,
                    min_allowed: range.min_allowed,
                    unit: range.unit_for(self.motor.actuation),
                });
            }
        }
        Ok(())
    }

    /// The combinations of parameters in which the equations of motion are linear.
    #[must_use]
    pub fn coefficients(&self) -> Coefficients<S> {
        let (a, p, m) = (&self.arm, &self.pendulum, &self.motor);
        let com2 = p.mass * p.com * p.com;
        if m.actuation == Actuation::Acceleration {
            let unmoved = S::from_f64(UNMOVED);
            return Coefficients {
                arm: unmoved,
                hub: unmoved,
                swing: com2 + p.inertia_transverse - p.inertia_axial,
                coupling: p.mass * a.length * p.com,
                pendulum: p.inertia + com2,
                weight: p.mass * self.gravity * p.com,
                lever: p.mass * self.gravity * a.length,
                drive: m.amplifier_gain * unmoved,
                arm_damping: S::ZERO,
                pendulum_damping: p.viscous,
            };
        }
        let electric = m.torque_constant * m.gear_ratio * m.efficiency / m.resistance;
        Coefficients {
            arm: a.inertia + p.mass * a.length * a.length + p.inertia_axial,
            hub: a.inertia,
            swing: com2 + p.inertia_transverse - p.inertia_axial,
            coupling: p.mass * a.length * p.com,
            pendulum: p.inertia + com2,
            weight: p.mass * self.gravity * p.com,
            lever: p.mass * self.gravity * a.length,
            drive: m.amplifier_gain * electric,
            arm_damping: a.viscous + electric * m.back_emf_constant * m.gear_ratio,
            pendulum_damping: p.viscous,
        }
    }
}

/// What the equations of motion see of the parameters.
///
/// From (u, theta, alpha) alone only the ratios of these to, say, `weight` can be identified: multiply all ten by one
/// number and every motion stays the same.
///
/// All kinds of command share them ([`Actuation`]). A drive that is told a current or a torque has no back-EMF. An arm
/// whose acceleration is commanded is one of infinite inertia under a torque in proportion: `arm` is 2^40 kg m² and
/// `drive` that times the command's gain, so that the first equation of motion reads `theta'' = gain u` (to 1e-12
/// rad/s² for each N m of the pendulum's reaction), and the second is the pendulum's on a base that moves as commanded.
/// The control step has no branch for it.
///
/// ```
/// use furuta_model::{Rig, State, dynamics::acceleration};
/// let p = Rig::builtin("stepper-kit").ok_or("no such rig")?.params;
/// let (c, x) = (p.coefficients(), State::new(0.3, 0.4, -2.0, 1.5));
/// let [theta, alpha] = acceleration(&c, &x, 20.0);
/// let (sin, cos) = x.alpha.sin_cos();
/// let moments = c.coupling * cos * 20.0 + c.swing * sin * cos * 4.0 + c.weight * sin - c.pendulum_damping * 1.5;
/// assert!((theta - 20.0).abs() < 1e-11);
/// assert!((alpha - moments / c.pendulum).abs() < 1e-9);
/// # Ok::<(), &str>(())
/// ```
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Coefficients<S> {
    /// `J_a + m L_r² + I_a`: inertia of the arm's axis with the pendulum upright, kg m².
    pub arm: S,
    /// `J_a`: the part of it that turns about the motor's axis alone, kg m²; only a drive with backlash or spring sees
    /// it apart.
    pub hub: S,
    /// `m c² + I_t - I_a`: what `sin²(alpha)` adds to it, kg m².
    pub swing: S,
    /// `m L_r c`: coupling, kg m².
    pub coupling: S,
    /// `I + m c²`: inertia about the hinge, kg m².
    pub pendulum: S,
    /// `m g c`: weight's moment, N m.
    pub weight: S,
    /// `m g L_r`: the weight's moment about the motor's axis, N m; only a tilted base sees it.
    pub lever: S,
    /// Torque on the arm for one volt (ampere, newton metre, rad/s²) of command, N m/V.
    pub drive: S,
    /// Viscous friction and back-EMF of the arm's axis together, N m s/rad.
    pub arm_damping: S,
    /// Viscous friction of the hinge, N m s/rad.
    pub pendulum_damping: S,
}

impl<S: Scalar> Coefficients<S> {
    /// The same values in another scalar, as constants.
    #[must_use]
    pub fn cast<T: Scalar>(&self) -> Coefficients<T> {
        let f = |x: S| T::from_f64(x.value());
        Coefficients {
            arm: f(self.arm),
            hub: f(self.hub),
            swing: f(self.swing),
            coupling: f(self.coupling),
            pendulum: f(self.pendulum),
            weight: f(self.weight),
            lever: f(self.lever),
            drive: f(self.drive),
            arm_damping: f(self.arm_damping),
            pendulum_damping: f(self.pendulum_damping),
        }
    }
}

impl<S: Scalar> From<&Params<S>> for Coefficients<S> {
    fn from(p: &Params<S>) -> Self {
        p.coefficients()
    }
}
