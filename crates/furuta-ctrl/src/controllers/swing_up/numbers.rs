//! The swing-up's numbers by name.

use super::{FALLING, LEARN_HEIGHT, LEARN_LIMIT, SwingUp};
use crate::numbers::{Number, listed};
use crate::real::{Real, c};

impl<T: Real> SwingUp<T> {
    /// Every number that its command depends on, by name; see [`Number`].
    pub fn numbers(&self, put: &mut impl FnMut(&'static str, Number<'_, T>)) {
        let t = &self.tuning;
        put("SWING_UP_MODEL", Number::Real(&listed(&self.coefficients)));
        put("SWING_UP_FRICTION", Number::Real(self.friction.table()));
        let single = [
            ("SWING_UP_FREQUENCY", self.frequency),
            ("SWING_UP_ARM_RANGE", self.arm_range),
            ("SWING_UP_CATCH_RANGE", self.catch_range()),
            ("SWING_UP_BRAKE", self.brake),
            ("SWING_UP_TOP_SPEED", self.top_speed),
            ("SWING_UP_FALLING", c(FALLING)),
            ("SWING_UP_LEARN_HEIGHT", c(LEARN_HEIGHT)),
            ("SWING_UP_LEARN_LIMIT", c(LEARN_LIMIT)),
            ("SWING_UP_BRAKE_AT", t.brake_at),
            ("SWING_UP_DRIVE", t.drive),
            ("SWING_UP_ARM_FREQUENCY", t.arm_frequency),
            ("SWING_UP_ARM_DAMPING", t.arm_damping),
            ("SWING_UP_FULL_DRIVE", t.full_drive),
            ("SWING_UP_DEADBAND", t.deadband),
            ("SWING_UP_ASCENT_ANGLE", t.ascent_angle),
            ("SWING_UP_ASCENT_WINDOW", t.ascent_window),
            ("SWING_UP_ASCENT_RATE", t.ascent_rate),
            ("SWING_UP_BREAK_AWAY", t.break_away),
            ("SWING_UP_LEARN", t.learn),
            ("SWING_UP_COMMAND_LIMIT", self.command_limit),
        ];
        for (name, value) in single {
            put(name, Number::Real(&[value]));
        }
    }
}
