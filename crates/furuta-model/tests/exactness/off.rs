//! What is off is off: an effect of zero strength changes no bit of any trajectory, whatever its other parameters.

use crate::exactness::plants::{any_state, effect, typical};
use furuta_model::{CATALOGUE, Effect, Params, Plant, RARE, Rig, State};
use proptest::prelude::*;

/// States, readings and rates along a run, bit by bit.
fn bits(plant: &Plant<f64>, start: State<f64>, u: f64, h: f64) -> Vec<u64> {
    let mut s = plant.rest_under(start, u);
    let mut bits = Vec::new();
    for k in 0..60 {
        let u = u * (9.0 * f64::from(k) * h).sin();
        let rate = plant.rate(s.t, &s.x, plant.volts(u), 1e3);
        plant.step(&mut s, u, h);
        let numbers = [s.x.to_array(), rate.to_array()].into_iter().flatten();
        bits.extend(numbers.chain(plant.measure(&s)).map(f64::to_bits));
    }
    bits.push(s.voltage.to_bits());
    bits
}

/// The ways in which an effect is off: all zero, no strength with a shape as typical, strengths where they do nothing
/// (a gain of 1).
fn ways_to_be_off(spec: &furuta_model::Spec, params: &Params<f64>) -> Vec<Effect<f64>> {
    let count = spec.parameters.len();
    let zeros = vec![0.0; count];
    let shape = typical(spec, params, 1.0);
    let weak = |strength: fn(&furuta_model::effects::ParameterSpec) -> f64| {
        let strengths = spec.parameters.iter().take(spec.strengths).map(strength);
        strengths
            .chain(shape.iter().copied().skip(spec.strengths))
            .collect::<Vec<_>>()
    };
    [zeros, weak(|_| 0.0), weak(|p| p.off)]
        .iter()
        // A gain of zero is no effect that is off, nor is it allowed.
        .filter_map(|values| Effect::new(spec.id, values).ok())
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn an_effect_of_zero_strength_changes_no_bit(start in any_state(), u in -10.0_f64..10.0, h in 1e-4..5e-3_f64,
        rig in 0..Rig::VOLTAGE.len()) {
        let rig = Rig::builtin(Rig::VOLTAGE[rig]).expect("built in");
        let without = bits(&rig.nominal_plant(), start, u, h);
        let mut all_off = Vec::new();
        for spec in CATALOGUE.iter().chain(RARE) {
            let off = ways_to_be_off(spec, &rig.params);
            prop_assert!(off.len() >= 2, "{}: all zero is off, and so are strengths of {:?}", spec.id,
                spec.parameters[0].off);
            for e in &off {
                prop_assert!(e.is_off(), "{e:?}");
                let with = bits(&Plant::new(&rig.params, &[*e]).expect("one"), start, u, h);
                prop_assert!(with == without, "{e:?} changes something");
            }
            all_off.push(off[0]);
        }
        // All of them at once, too: more than a plant has room for, if they were on.
        let with = bits(&Plant::new(&rig.params, &all_off).expect("all are off"), start, u, h);
        prop_assert!(with == without);
    }
}

/// That the test above can fail: an effect as strong as typical does change something.
#[test]
fn an_effect_that_is_on_changes_something() {
    let rig = Rig::builtin("qube-servo-2").expect("built in");
    let (start, u, h) = (State::new(0.3, 2.0, 1.0, -1.0), 8.0, 2e-2);
    let without = bits(&rig.nominal_plant(), start, u, h);
    for spec in CATALOGUE.iter().chain(RARE) {
        let e = effect(spec, &rig.params, 1.0);
        let with = bits(&Plant::new(&rig.params, &[e]).expect("one"), start, u, h);
        assert!(!e.is_off() && with != without, "{}", spec.id);
    }
}
