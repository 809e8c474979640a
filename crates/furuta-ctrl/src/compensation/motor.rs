//! The command that gives a voltage, behind a dead zone or an amplifier that is not straight.

use crate::real::{Real, c};
use furuta_model::Plant;

/// Halvings of the interval of commands: to 1e-6 of it.
pub(super) const HALVINGS: u32 = 20;
/// Share of the largest command below which a voltage is not reached exactly but in proportion: across a dead zone the
/// command would otherwise jump with every change of sign.
pub(super) const STRAIGHT: f64 = 0.01;

/// The command (V, within `limit`) for which the model's motor has the voltage `volts`.
pub(super) fn command<T: Real>(plant: &Plant<T>, volts: T, limit: T) -> T {
    let small = c::<T>(STRAIGHT) * limit;
    if volts.abs() >= small {
        return inverse(plant, volts, limit);
    }
    let (low, high) = (inverse(plant, -small, limit), inverse(plant, small, limit));
    low + (high - low) * ((volts + small) / (small + small))
}

/// By bisection: the maps of the catalogue never fall, and have kinks.
fn inverse<T: Real>(plant: &Plant<T>, volts: T, limit: T) -> T {
    let half = c::<T>(0.5);
    let (mut low, mut high) = (-limit, limit);
    for _ in 0..HALVINGS {
        let middle = half * (low + high);
        if plant.volts(middle) < volts {
            low = middle;
        } else {
            high = middle;
        }
    }
    half * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use furuta_model::effects::Acts;
    use furuta_model::{CATALOGUE, Effect, Rig};

    /// Whatever the catalogue has between command and motor, alone and with a dead zone before it.
    #[test]
    fn the_motor_gets_the_voltage_that_was_wanted() {
        let rig = Rig::builtin("qube-servo-2").expect("built in");
        let limit = rig.params.motor.command_limit;
        let maps = CATALOGUE
            .iter()
            .filter(|s| s.acts.includes(Acts::VOLTAGE) && s.id != "motor.saturation");
        for spec in maps {
            let values: arrayvec::ArrayVec<f64, 8> = spec
                .parameters
                .iter()
                .map(|p| p.off + p.typical(&rig.params))
                .collect();
            let effect = Effect::new(spec.id, &values).expect("typical");
            let plant = Plant::<f64>::new(&rig.params, &[effect]).expect("possible");
            for k in -80..=80 {
                let volts = 0.1 * f64::from(k);
                let u = command(&plant, volts, limit);
                if volts.abs() >= STRAIGHT * limit {
                    // Bisection ends within 2^-20 of twice the limit.
                    let off = plant.volts(u) - volts;
                    assert!(off.abs() < 1e-4, "{}: {volts} V, off by {off}", spec.id);
                }
                assert!(u.abs() <= limit);
            }
        }
    }

    #[test]
    fn beyond_what_the_motor_can_give_the_limit() {
        let rig = Rig::builtin("qube-servo-2").expect("built in");
        let zone = Effect::new("motor.deadzone", &[1.0]).expect("an effect");
        let plant = Plant::<f64>::new(&rig.params, &[zone]).expect("possible");
        assert!((command(&plant, 30.0, 10.0) - 10.0).abs() < 1e-4);
        assert!((command(&plant, -30.0, 10.0) + 10.0).abs() < 1e-4);
        assert!(command(&plant, 0.0, 10.0).abs() < 1e-4);
    }
}
