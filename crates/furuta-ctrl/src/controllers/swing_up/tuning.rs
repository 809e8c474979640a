//! What a controller file may say of the swing-up.

use crate::real::Real;
use crate::section::{ParameterSpec, Settings, Spec};

/// What a controller file may say of it.
///
/// The defaults were found by a random search over all of them at once, for the built-in rigs with drawn parameters,
/// frictions, their encoders and one sample of delay; the score was the time until the catch. All but the first are
/// ratios.
pub static SPEC: Spec = Spec {
    id: "swing_up",
    sentence: "Energy swing-up, the arm kept within a range",
    parameters: &[
        ParameterSpec::number(
            "arm_range",
            "rad",
            0.1,
            20.0,
            "the arm swings so far to either side; 2.16 or what the arm's limit allows if left out",
        ),
        ParameterSpec::number("brake_at", "", 1.0, 10.0, "the arm is braked before it passes this share of \
            its range").or(1.4),
        ParameterSpec::number("drive", "", 0.05, 5.0, "amplitude of the arm's target, of its range").or(1.4),
        ParameterSpec::number("arm_frequency", "", 0.2, 10.0, "frequency of the arm's oscillator, of the \
            pendulum's").or(1.22),
        ParameterSpec::number("arm_damping", "", 0.0, 5.0, "its damping ratio").or(0.63),
        ParameterSpec::number("full_drive", "", 1e-3, 10.0, "energy missing, in units of 2 m g c, at which \
            the amplitude is full").or(0.49),
        ParameterSpec::number(
            "deadband",
            "",
            0.0,
            2.0,
            "cos(alpha) alpha' over the pendulum's frequency beyond which the drive's direction may change",
        )
        .or(0.356),
        ParameterSpec::number(
            "friction_margin",
            "",
            0.0,
            10.0,
            "friction's share of the target, of what the model says: too fast can be caught, too slow falls back",
        )
        .or(1.32),
        ParameterSpec::number(
            "ascent_angle",
            "rad",
            0.0,
            1.5,
            "distance from upright within which the arm holds the pendulum to the ascent that just reaches the top",
        )
        .or(1.07),
        ParameterSpec::number(
            "ascent_window",
            "",
            0.0,
            2.0,
            "largest distance from that ascent's speed, over the pendulum's frequency",
        )
        .or(0.059),
        ParameterSpec::number("ascent_rate", "", 0.0, 20.0, "how quickly that distance is driven to 0, \
            over the frequency").or(2.05),
        ParameterSpec::number(
            "break_away",
            "",
            0.0,
            0.5,
            "command added in the direction of the wanted one, of the command limit: the arm's dry \
             friction swallows small ones",
        )
        .or(0.1),
        ParameterSpec::number(
            "aim",
            "",
            0.0,
            1.0,
            "speed with which the pendulum is to pass the top, of the largest that can be caught",
        )
        .or(0.9),
        ParameterSpec::number(
            "learn",
            "",
            0.0,
            1.0,
            "how quickly the pendulum's weight over its inertia is learnt from its ascents; 0: as the model says",
        )
        .or(0.3),
    ],
};

/// As in [`SPEC`].
#[derive(Copy, Clone, Debug)]
pub(super) struct SwingUpTuning<T> {
    pub(super) brake_at: T,
    pub(super) drive: T,
    pub(super) arm_frequency: T,
    pub(super) arm_damping: T,
    pub(super) full_drive: T,
    pub(super) deadband: T,
    pub(super) ascent_angle: T,
    pub(super) ascent_window: T,
    pub(super) ascent_rate: T,
    pub(super) break_away: T,
    pub(super) aim: T,
    pub(super) learn: T,
}

impl<T: Real> SwingUpTuning<T> {
    /// The given ones, and the defaults of the others.
    pub(super) fn of(settings: &Settings) -> Self {
        let number = |key| T::from_f64(settings.value(key));
        Self {
            brake_at: number(const { SPEC.parameter("brake_at").settled() }),
            drive: number(const { SPEC.parameter("drive").settled() }),
            arm_frequency: number(const { SPEC.parameter("arm_frequency").settled() }),
            arm_damping: number(const { SPEC.parameter("arm_damping").settled() }),
            full_drive: number(const { SPEC.parameter("full_drive").settled() }),
            deadband: number(const { SPEC.parameter("deadband").settled() }),
            ascent_angle: number(const { SPEC.parameter("ascent_angle").settled() }),
            ascent_window: number(const { SPEC.parameter("ascent_window").settled() }),
            ascent_rate: number(const { SPEC.parameter("ascent_rate").settled() }),
            break_away: number(const { SPEC.parameter("break_away").settled() }),
            aim: number(const { SPEC.parameter("aim").settled() }),
            learn: number(const { SPEC.parameter("learn").settled() }),
        }
    }
}
