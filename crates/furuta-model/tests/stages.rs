//! The four stages of the integrator: a loop for numbers with many derivatives, one after the other for the rest.

use crate::{FEW, MANY};
use furuta_model::{Effect, Jet, Plant, Rig, Scalar, State};

type Effects = &'static [(&'static str, &'static [f64])];

/// The states of a run with the initial state as the first four variables.
fn run<const N: usize>(effects: Effects) -> Vec<State<Jet<f64, N>>> {
    let rig = Rig::builtin("qube-servo-2").expect("built in");
    let effects: Vec<Effect<f64>> = effects
        .iter()
        .map(|(id, values)| Effect::new(id, values).expect("valid"))
        .collect();
    let plant: Plant<f64> = Plant::new(&rig.params, &effects).expect("valid");
    let plant = plant.cast::<Jet<f64, N>>();
    let start = State::from(std::array::from_fn(|i| {
        Jet::variable([0.1, 2.0, 0.3, -0.2][i], i)
    }));
    let mut s = plant.rest(start);
    (0..1500)
        .map(|k| {
            let u = if k < 1000 {
                1.5 * (0.02 * f64::from(k)).sin()
            } else {
                0.0
            };
            plant.step(&mut s, Scalar::from_f64(u), 2e-3);
            s.x
        })
        .collect()
}

/// Both have the same digits, derivatives included, where it is smooth and where something rests, turns, touches,
/// remembers or has a state of its own.
#[test]
fn both_forms_come_to_the_same_digits() {
    let all: [Effects; 7] = [
        &[],
        &[("arm.coulomb", &[2e-3]), ("pendulum.coulomb", &[2e-4])],
        &[("arm.presliding", &[2e-3, 0.05])],
        &[("drive.backlash", &[0.02, 0.3, 0.0])],
        &[
            ("drive.compliance", &[0.4, 1e-3, 0.4, 0.0]),
            ("arm.coulomb", &[2e-3]),
        ],
        &[("arm.relaxation", &[5e-3, 0.6])],
        &[
            ("motor.delay", &[0.0033]),
            ("arm.stribeck", &[2e-3, 2.0, 0.5]),
        ],
    ];
    for effects in all {
        let (few, many) = (run::<FEW>(effects), run::<MANY>(effects));
        for (k, (few, many)) in few.iter().zip(&many).enumerate() {
            for (few, many) in few.to_array().iter().zip(many.to_array()) {
                assert_eq!(few.v.to_bits(), many.v.to_bits(), "{effects:?} at step {k}");
                assert_eq!(few.d, many.d[..FEW], "{effects:?} at step {k}");
            }
        }
    }
}
