//! Bad input: typed errors that name what is wrong and what is allowed; and whatever reaches a step, it does not panic.

use furuta_model::Actuation;
use furuta_model::effects::{Kind, ParameterSpec};
use furuta_model::params::RANGES;
use furuta_model::simulate::{SimulationError, trajectory};
use furuta_model::{
    CATALOGUE, Effect, EffectError, Params, Plant, PlantError, RARE, Rig, Spec, State,
};
use proptest::prelude::*;

fn qube() -> Params<f64> {
    Rig::builtin("qube-servo-2").expect("built in").params
}

/// Values within their ranges, not zero where that is possible.
fn valid_values(spec: &Spec) -> Vec<f64> {
    let value = |p: &ParameterSpec| (p.off + p.typical(&qube())).clamp(p.min, p.max);
    let mut values: Vec<f64> = spec.parameters.iter().map(value).collect();
    while let Err(EffectError::NotWhole { parameter, .. }) = Effect::new(spec.id, &values) {
        let i = spec.parameters.iter().position(|p| p.name == parameter);
        let value = &mut values[i.expect("its own parameter")];
        *value = value.floor();
    }
    values
}

#[test]
fn every_parameter_of_every_effect_refuses_what_is_outside_its_range() {
    for spec in CATALOGUE.iter().chain(RARE) {
        let good = valid_values(spec);
        Effect::new(spec.id, &good).expect("typical values are valid");
        for (i, p) in spec.parameters.iter().enumerate() {
            let with = |value: f64| {
                let mut values = good.clone();
                // All zero is off whatever the ranges: the others are not zero.
                values[i] = value;
                Effect::new(spec.id, &values)
            };
            for edge in [p.min, p.max] {
                assert!(with(edge).is_ok(), "{} {} = {edge}", spec.id, p.name);
            }
            for bad in [
                p.min.next_down(),
                p.min - 1.0,
                -1e300,
                p.max.next_up(),
                p.max + 1.0,
                1e300,
                f64::NAN,
                f64::INFINITY,
                f64::NEG_INFINITY,
            ] {
                let error = with(bad).expect_err("outside");
                let (effect, parameter) = match error {
                    EffectError::OutOfRange {
                        effect,
                        parameter,
                        min,
                        max,
                        ..
                    } => {
                        assert_eq!((min, max), (p.min, p.max));
                        let text = error.to_string();
                        let range = format!("[{min}, {max}] {}", p.unit);
                        assert!(
                            text.contains(spec.id)
                                && text.contains(p.name)
                                && text.contains(&range),
                            "{text}"
                        );
                        (effect, parameter)
                    }
                    EffectError::NotWhole {
                        effect, parameter, ..
                    } => {
                        assert!(!p.kind.is_amount() && bad.floor() != bad, "{bad}");
                        (effect, parameter)
                    }
                    other => panic!("{other:?}"),
                };
                assert_eq!((effect, parameter), (spec.id, p.name));
                // The same through a plant, for an effect that a fit made.
                let mut values = good.clone();
                values[i] = bad;
                let unchecked = Effect::unchecked(spec.id, &values).expect("known");
                let error = Plant::new(&qube(), &[unchecked]).expect_err("outside");
                assert!(
                    matches!(error, PlantError::Effect(_)) && error.to_string().contains(p.name)
                );
            }
            if matches!(p.kind, Kind::Whole | Kind::Choice(_)) {
                let error = with(p.min + 0.5).expect_err("a fraction");
                assert!(matches!(error,
                        EffectError::NotWhole { effect, parameter, .. } if effect == spec.id && parameter == p.name));
                assert!(error.to_string().contains("whole number"));
            }
        }
        for count in [0, good.len() - 1, good.len() + 1] {
            let values = vec![1.0; count];
            let error = Effect::new(spec.id, &values).expect_err("wrong count");
            assert_eq!(
                error,
                EffectError::WrongCount {
                    effect: spec.id,
                    given: count,
                    expected: good.len()
                }
            );
        }
    }
    assert_eq!(
        Effect::new("arm.colomb", &[1.0]),
        Err(EffectError::UnknownEffect)
    );
}

#[test]
fn every_physical_parameter_refuses_what_is_outside_its_range() {
    let good = qube().to_array();
    for (i, r) in RANGES.iter().enumerate() {
        let with = |value: f64| {
            let mut values = good;
            values[i] = value;
            Plant::new(&Params::from_array(Actuation::Voltage, values), &[])
        };
        assert!(
            with(r.max).is_ok() && with(r.min.next_up()).is_ok(),
            "{}",
            r.key
        );
        assert_eq!(with(r.min).is_ok(), r.min_allowed, "{}", r.key);
        for bad in [
            r.min.next_down(),
            -1.0,
            r.max.next_up(),
            1e300,
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
        ] {
            let error = with(bad).expect_err("outside");
            let PlantError::Parameter(inner) = error else {
                panic!("{error:?}")
            };
            assert_eq!((inner.key, inner.min, inner.max), (r.key, r.min, r.max));
            let text = error.to_string();
            let range = format!("{}, {}] {}", r.min, r.max, r.unit);
            assert!(text.starts_with(r.key) && text.contains(&range), "{text}");
        }
    }
}

#[test]
fn more_effects_than_there_is_room_for_are_refused() {
    let spring = Effect::new("arm.spring", &[0.1, 0.0]).expect("valid");
    let error = Plant::new(&qube(), &[spring; 9]).expect_err("nine");
    assert_eq!(error, PlantError::TooManyEffects { given: 9 });
    assert!(error.to_string().contains("at most 8"));
}

#[test]
fn a_period_that_cannot_be_stepped_is_refused() {
    let plant: Plant<f64> = Plant::new(&qube(), &[]).expect("no effects");
    for bad in [
        0.0,
        -0.0,
        -1e-3,
        1.0_f64.next_up(),
        1e9,
        f64::NAN,
        f64::INFINITY,
        f64::NEG_INFINITY,
    ] {
        let error = plant.check_period(bad).expect_err("not a period");
        assert!(matches!(error, PlantError::SamplePeriod { .. }));
        assert!(error.to_string().contains("(0, 1] s"), "{error}");
        let start = plant.rest(State::hanging());
        let refused = trajectory(&plant, start, &[1.0; 3], bad, 1, |_| true);
        assert!(matches!(
            refused,
            Err(SimulationError::Plant(PlantError::SamplePeriod { .. }))
        ));
    }
    for good in [f64::MIN_POSITIVE, 1e-3, 1.0] {
        plant.check_period(good).expect("a period");
    }
    // Too short for what a delay has to remember, too long for what a coupling rings.
    for id in ["motor.delay", "sensor.delay"] {
        let plant = Plant::new(&qube(), &[Effect::new(id, &[0.2]).expect("valid")]).expect("one");
        plant.check_period(2e-3).expect("100 samples");
        let error = plant.check_period(1e-3).expect_err("200 samples");
        assert_eq!(
            error,
            PlantError::DelayTooLong {
                delay: 0.2,
                longest: 0.126
            }
        );
        assert!(error.to_string().contains("0.126 s"));
    }
    let stiff = Effect::new("drive.compliance", &[1e6, 0.0, 0.5, 0.0]).expect("valid");
    let plant = Plant::new(&qube(), &[stiff]).expect("one");
    let error = plant.check_period(1e-3).expect_err("rings");
    assert!(matches!(error, PlantError::CouplingTooStiff { .. }));
}

#[test]
fn a_start_or_command_that_is_no_number_is_refused() {
    let plant: Plant<f64> = Plant::new(&qube(), &[]).expect("no effects");
    let names = ["theta", "alpha", "theta_dot", "alpha_dot"];
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for (i, name) in names.iter().enumerate() {
            let mut x = [0.1, 0.2, 0.3, 0.4];
            x[i] = bad;
            let start = plant.rest(State::from(x));
            let error = trajectory(&plant, start, &[0.0], 1e-3, 1, |_| true).expect_err("start");
            assert!(
                matches!(error, SimulationError::Start { component, .. } if component == *name)
            );
            assert!(error.to_string().contains(name));
        }
        let start = plant.rest(State::hanging());
        let error = trajectory(&plant, start, &[0.0, bad], 1e-3, 1, |_| true).expect_err("command");
        assert!(matches!(error, SimulationError::Command { sample: 1, .. }));
    }
}

/// Any pattern of 64 bits, and more often than chance would have it the peculiar ones.
fn any_bits() -> impl Strategy<Value = f64> {
    prop_oneof![
        any::<u64>().prop_map(f64::from_bits),
        prop::sample::select(vec![
            0.0,
            -0.0,
            1.0,
            -1.0,
            1e-3,
            1e9,
            -1e9,
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::MAX,
            f64::MIN,
            f64::MIN_POSITIVE,
            5e-324,
            f64::EPSILON,
        ]),
        -10.0..10.0_f64,
    ]
}

/// A step's length of any bits; more often one that could be meant.
fn any_length() -> impl Strategy<Value = f64> {
    prop_oneof![any_bits(), 1e-5..0.1_f64]
}

/// Steps, readings and rates from anywhere to anywhere.
fn step_around(plant: &Plant<f64>, x: [f64; 4], commands: &[f64], periods: &[f64]) {
    let x = State::from(x);
    let _ = plant.rate(commands[0], &x, commands[1], periods[0]);
    let mut s = plant.rest_under(x, commands[0]);
    for (u, h) in commands.iter().zip(periods) {
        plant.step(&mut s, *u, *h);
        let _ = plant.measure(&s);
        let _ = plant.check_period(*h);
    }
    let mut s = plant.resume(x, commands[0], commands, periods[0]);
    plant.step(&mut s, commands[0], periods[0]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    /// Nothing checks a control step's numbers for it: it must come back from any of them, with any effect.
    #[test]
    fn a_step_never_panics(
        x in prop::array::uniform4(any_bits()), commands in prop::array::uniform4(any_bits()),
        periods in prop::array::uniform4(any_length()), edge in 0..3_usize,
    ) {
        for spec in CATALOGUE.iter().chain(RARE) {
            let typical = valid_values(spec);
            let values: Vec<f64> = spec
                .parameters
                .iter()
                .zip(typical)
                .map(|(p, v)| [v, p.min, p.max][edge])
                .collect();
            let plant = Plant::new(&qube(), &[Effect::new(spec.id, &values).expect("valid")]).expect("one");
            step_around(&plant, x, &commands, &periods);
        }
    }

    /// Nor with values that a fit tried without asking for their ranges.
    #[test]
    fn a_step_never_panics_with_unchecked_effects(
        x in prop::array::uniform4(any_bits()), commands in prop::array::uniform4(any_bits()),
        periods in prop::array::uniform4(any_length()), values in prop::array::uniform4(any_bits()),
    ) {
        for spec in CATALOGUE.iter().chain(RARE) {
            let e = Effect::unchecked(spec.id, &values[..spec.parameters.len()]).expect("known");
            let plant = Plant::from_coefficients(qube().coefficients(), &[e]).expect("one");
            step_around(&plant, x, &commands, &periods);
        }
    }
}
