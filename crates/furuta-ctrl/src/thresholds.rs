//! The numbers of a supervisor: what a controller file may say of them, and what they are at a site.

use crate::real::Real;
use crate::section::{ParameterSpec, Settings, Spec};
use crate::site::{Limits, Site};

/// What a controller file's section `[supervisor]` may say.
pub static SPEC: Spec = Spec {
    id: "supervisor",
    sentence: "When swing-up and balance hand over to each other",
    parameters: &[
        ParameterSpec::number(
            "doubt_angle",
            "rad",
            0.01,
            1.5,
            "distance from upright beyond which balancing goes on only while the model says that it will succeed",
        )
        .or(0.4),
        ParameterSpec::number(
            "release_angle",
            "rad",
            0.1,
            3.1,
            "distance from upright at which balancing is given up",
        )
        .or(1.6),
        ParameterSpec::number(
            "reference_speed",
            "rad/s",
            1e-3,
            1e3,
            "how fast the arm is led to its reference",
        )
        .or(1.0),
        ParameterSpec::number(
            "catch_angle",
            "rad",
            0.01,
            1.5,
            "distance from upright beyond which no catch is tried",
        )
        .or(1.2),
        ParameterSpec::number(
            "catch_error",
            "",
            0.0,
            0.5,
            "a catch must succeed by the model with its weight greater, and less, by this share; 0: by the \
             model as it is",
        )
        .or(0.0),
        ParameterSpec::number(
            "blend",
            "",
            0.0,
            1.0,
            "time constant with which the difference of the two commands at a catch dies out, of the \
             pendulum's time constant; 0: at once",
        )
        .or(0.1),
        ParameterSpec::whole(
            "catch_every",
            1.0,
            1000.0,
            1.0,
            "samples from one test of the catch to the next: its cost is spread over them",
        ),
    ],
};

/// What a controller file's section `[limits]` may say.
pub static LIMITS: Spec = Spec {
    id: "limits",
    sentence: "Where the motor is switched off; a rig file's tighter limits count all the same",
    parameters: &[
        ParameterSpec::number(
            "arm_angle",
            "rad",
            1e-3,
            1e3,
            "largest arm angle either way; a turn if neither file says",
        ),
        ParameterSpec::number(
            "arm_speed",
            "rad/s",
            1e-3,
            1e4,
            "largest arm speed; half as much again as the motor reaches if neither file says",
        ),
        ParameterSpec::number(
            "pendulum_speed",
            "rad/s",
            1e-3,
            1e4,
            "largest pendulum speed; ten times its small-angle frequency if neither file says",
        ),
        ParameterSpec::number(
            "command",
            "V",
            1e-3,
            1e3,
            "largest command; the rig's if left out",
        ),
    ],
};

/// Numbers of a [`Supervisor`](crate::supervisor::Supervisor).
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Thresholds<T> {
    /// Largest arm angle either way, rad.
    pub arm_angle_limit: T,
    /// Largest arm speed, rad/s.
    pub arm_speed_limit: T,
    /// Largest pendulum speed, rad/s.
    pub pendulum_speed_limit: T,
    /// Largest command, V.
    pub command_limit: T,
    /// Distance from upright beyond which balancing goes on only while the model says that it will succeed, rad.
    pub doubt_angle: T,
    /// Distance from upright at which balancing is given up, rad.
    pub release_angle: T,
    /// How fast the arm is led to its reference, rad/s.
    pub reference_speed: T,
    /// Speed below which an axis counts as resting, rad/s.
    pub rest_speed: T,
    /// What is left after a sample of the commands' difference at the catch.
    pub blend: T,
    /// Samples from one test of the catch to the next.
    pub catch_every: u32,
}

impl<T: Real> Thresholds<T> {
    /// Those of a controller file's section `[supervisor]` at a site whose limits are known already: see [`within`].
    pub(crate) fn of(settings: &Settings, site: &Site<'_>) -> Self {
        let frequency = site.frequency();
        let free_speed = site.free_speed();
        let limits = &site.limits;
        let number = |key| T::from_f64(settings.value(key));
        Self {
            arm_angle_limit: T::from_f64(limits.arm_angle.unwrap_or(core::f64::consts::TAU)),
            arm_speed_limit: T::from_f64(limits.arm_speed.unwrap_or(1.5 * free_speed)),
            pendulum_speed_limit: T::from_f64(limits.pendulum_speed.unwrap_or(10.0 * frequency)),
            command_limit: T::from_f64(site.command_limit),
            doubt_angle: number(const { SPEC.parameter("doubt_angle").settled() }),
            release_angle: number(const { SPEC.parameter("release_angle").settled() }),
            reference_speed: number(const { SPEC.parameter("reference_speed").settled() }),
            rest_speed: T::from_f64(0.05 * frequency),
            blend: T::from_f64(libm::exp(
                -site.period * frequency / settings.value(const { SPEC.parameter("blend").settled() }),
            )),
            #[allow(clippy::cast_possible_truncation)] // at most 1000
            catch_every: settings.whole(const { SPEC.parameter("catch_every").settled() }) as u32,
        }
    }
}

/// The site with the tighter of its own limits and the file's.
pub(crate) fn within<'a>(settings: &Settings, site: &Site<'a>) -> Site<'a> {
    let tighter = |of_rig: Option<f64>, key| match (of_rig, settings.number(key)) {
        (Some(a), Some(b)) => Some(a.min(b)),
        (a, b) => a.or(b),
    };
    Site {
        command_limit: tighter(
            Some(site.command_limit),
            const { LIMITS.parameter("command").optional() },
        )
        .unwrap_or(site.command_limit),
        limits: Limits {
            arm_angle: tighter(
                site.limits.arm_angle,
                const { LIMITS.parameter("arm_angle").optional() },
            ),
            arm_speed: tighter(
                site.limits.arm_speed,
                const { LIMITS.parameter("arm_speed").optional() },
            ),
            pendulum_speed: tighter(
                site.limits.pendulum_speed,
                const { LIMITS.parameter("pendulum_speed").optional() },
            ),
        },
        ..*site
    }
}
