//! Many rollouts at once against one at a time.

use furuta_model::simulate::{
    Feedback, Keep, OpenLoop, Policy, Rollout, Run, SimulationError, Stepper, batch, follow,
    trajectory,
};
use furuta_model::{CATALOGUE, Effect, Plant, RARE, Rig, State};
use std::sync::atomic::{AtomicUsize, Ordering};

fn rollouts(effects: &[Effect<f64>], count: usize) -> Vec<Rollout> {
    let rig = Rig::builtin("shahzad2022-srv02").expect("built in");
    (0..count)
        .map(|i| {
            let mut params = rig.params;
            let x = i as f64 / count as f64;
            params.pendulum.mass *= 0.8 + 0.4 * x;
            params.arm.inertia *= 1.2 - 0.4 * x;
            Rollout {
                params,
                effects: effects.to_vec(),
                start: State::new(x, 3.0 - x, 2.0 * x, -x),
            }
        })
        .collect()
}

/// No effect, and each of the catalogue.
fn effects_one_by_one() -> Vec<Vec<Effect<f64>>> {
    let params = Rig::builtin("shahzad2022-srv02").expect("built in").params;
    let mut sets = vec![vec![]];
    sets.extend(CATALOGUE.iter().chain(RARE).map(|spec| {
        let values: Vec<f64> = spec
            .parameters
            .iter()
            .map(|p| p.off + p.typical(&params))
            .collect();
        vec![Effect::new(spec.id, &values).expect("valid")]
    }));
    sets
}

/// Every effect of the catalogue, in lanes or not: to the bit what a rollout alone gives, also where lanes are left
/// over.
#[test]
fn a_batch_is_to_the_bit_what_its_rollouts_are_alone() {
    let commands: Vec<f64> = (0..400)
        .map(|k| 3.0 * (f64::from(k) * 0.03).sin())
        .collect();
    for effects in effects_one_by_one() {
        let rollouts = rollouts(&effects, 13);
        let run = Run {
            period: 2e-3,
            samples: 400,
            keep: Keep::Every(100),
        };
        let together = batch(&rollouts, &OpenLoop(&commands), run, &|_| ()).expect("valid");
        for (i, r) in rollouts.iter().enumerate() {
            let plant = furuta_model::Plant::new(&r.params, &r.effects).expect("valid");
            let alone = trajectory(&plant, plant.rest(r.start), &commands, 2e-3, 1, |_| true)
                .expect("valid");
            let kept: Vec<_> = alone.iter().step_by(100).copied().collect();
            assert_eq!(together.rollout(i), kept, "{effects:?}, rollout {i}");
        }
    }
}

/// Every effect again: rigs that are stepped together, of which one is replaced on the way by another, with an effect
/// or without, are to the bit what each is alone.
#[test]
fn rigs_stepped_together_are_to_the_bit_what_they_are_alone() {
    let period = 2e-3;
    let command = |call: usize, rig: usize| 3.0 * (0.3 * call as f64 + rig as f64).sin();
    let start = |r: &Rollout| {
        let plant = Plant::new(&r.params, &r.effects).expect("valid");
        let state = plant.rest(r.start);
        (plant, state)
    };
    let spring = Effect::new("arm.spring", &[0.1, 0.0]).expect("valid");
    for effects in effects_one_by_one() {
        let rollouts = rollouts(&effects, 11);
        let mut together = Stepper::new(rollouts.clone(), period).expect("valid");
        let mut alone: Vec<_> = rollouts.iter().map(start).collect();
        for call in 0..60 {
            if call == 20 || call == 40 {
                let mut other = rollouts[3].clone();
                other.params.pendulum.mass *= 1.1;
                other.effects.extend((call == 40).then_some(spring));
                together.replace(4, other.clone()).expect("valid");
                alone[4] = start(&other);
            }
            let commands: Vec<f64> = (0..11).map(|rig| command(call, rig)).collect();
            together.step(&commands, 5).expect("finite");
            for ((plant, state), u) in alone.iter_mut().zip(&commands) {
                (0..5).for_each(|_| plant.step(state, *u, period));
            }
        }
        let states: Vec<_> = together.states().collect();
        let expected: Vec<_> = alone.iter().map(|(_, state)| state.x).collect();
        assert_eq!(states, expected, "{effects:?}");
        let angles: Vec<_> = together.angles().collect();
        let expected: Vec<_> = alone.iter().map(|(plant, s)| plant.measure(s)).collect();
        assert_eq!(angles, expected, "{effects:?}");
    }
}

#[test]
fn what_rigs_stepped_together_cannot_do_is_named_and_moves_none() {
    let mut rigs = Stepper::new(rollouts(&[], 3), 1e-3).expect("valid");
    let before: Vec<_> = rigs.states().collect();
    let text = rigs.step(&[0.0; 2], 1).expect_err("too few").to_string();
    assert!(text.contains("2 commands for 3 rollouts"), "{text}");
    let bad = rigs.step(&[0.0, f64::NAN, 0.0], 1).expect_err("not finite");
    assert!(bad.to_string().contains("rollout 1: the command, NaN V"));
    let mut heavy = rollouts(&[], 1).remove(0);
    heavy.params.pendulum.mass = -1.0;
    let text = rigs.replace(2, heavy).expect_err("negative").to_string();
    assert!(text.contains("rollout 2: pendulum.mass = -1"), "{text}");
    assert_eq!(rigs.states().collect::<Vec<_>>(), before);
    assert!(Stepper::new(rollouts(&[], 2), 0.0).is_err());
}

#[test]
fn mixed_batches_run_as_well() {
    let spring = Effect::new("arm.spring", &[0.1, 0.0]).expect("valid");
    let friction = Effect::new("arm.coulomb", &[0.01]).expect("valid");
    let mut mixed = rollouts(&[], 5);
    mixed.extend(rollouts(&[spring], 5));
    mixed.extend(rollouts(&[friction], 5));
    let run = Run {
        period: 1e-3,
        samples: 200,
        keep: Keep::Last,
    };
    let done = AtomicUsize::new(0);
    let policy = Feedback {
        gain: [-1.0, 27.0, -2.0, 3.5],
        reference: State::upright(),
        limit: 10.0,
    };
    let together = batch(&mixed, &policy, run, &|n| {
        done.fetch_max(n, Ordering::Relaxed);
    })
    .expect("valid");
    assert_eq!(done.into_inner(), 15);
    for (i, r) in mixed.iter().enumerate() {
        let plant = furuta_model::Plant::new(&r.params, &r.effects).expect("valid");
        let mut s = plant.rest(r.start);
        for k in 0..200 {
            let u = policy.command(k, &s.x);
            plant.step(&mut s, u, 1e-3);
        }
        assert_eq!(together.rollout(i), [s.x]);
    }
}

#[test]
fn what_cannot_be_run_is_named() {
    let message = |rollouts: &[Rollout], run: Run| {
        batch(rollouts, &OpenLoop(&[]), run, &|_| ())
            .expect_err("must be refused")
            .to_string()
    };
    let run = Run {
        period: 1e-3,
        samples: 10,
        keep: Keep::Last,
    };
    let mut bad = rollouts(&[], 3);
    bad[2].params.pendulum.mass = -0.1;
    let text = message(&bad, run);
    assert!(
        text.contains("rollout 2: pendulum.mass = -0.1") && text.contains("(0, 100] kg"),
        "{text}"
    );
    let mut bad = rollouts(&[], 3);
    bad[1].start.alpha_dot = f64::NAN;
    assert!(message(&bad, run).contains("alpha_dot = NaN"));
    for period in [0.0, -1.0, 1e9, f64::NAN, f64::INFINITY] {
        let text = message(&rollouts(&[], 1), Run { period, ..run });
        assert!(text.contains("(0, 1] s"), "{text}");
    }
    let nothing = Run {
        keep: Keep::Every(0),
        ..run
    };
    assert!(message(&rollouts(&[], 1), nothing).contains("every 0th"));
    assert_eq!(
        batch(&[], &OpenLoop(&[]), run, &|_| ())
            .expect("empty is fine")
            .states(),
        []
    );

    let plant = Rig::builtin("qube-servo-2").expect("built in").plant();
    let one = |commands: &[f64], substeps| {
        trajectory(
            &plant,
            plant.rest(State::hanging()),
            commands,
            1e-3,
            substeps,
            |_| true,
        )
    };
    assert_eq!(one(&[0.0], 0), Err(SimulationError::Substeps));
    let text = one(&[0.0, f64::INFINITY], 1)
        .expect_err("not finite")
        .to_string();
    assert!(text.contains("sample 1, inf V"), "{text}");
    let text = one(&[1e300; 50], 1).expect_err("diverges").to_string();
    assert!(text.contains("no longer finite after sample"), "{text}");
    let stopped = trajectory(
        &plant,
        plant.rest(State::hanging()),
        &[0.0; 20_000],
        1e-3,
        1,
        |_| false,
    );
    assert_eq!(stopped, Err(SimulationError::Stopped { sample: 16_384 }));
}

/// Without effects a loop of its own runs, in which nothing is asked: the states, the time and the voltage are those of
/// steps one by one, to the bit.
#[test]
fn a_bare_plant_goes_the_way_of_its_single_steps() {
    let commands: Vec<f64> = (0..300)
        .map(|k| 5.0 * (0.03 * f64::from(k)).sin())
        .collect();
    for name in Rig::BUILTIN {
        let params = Rig::builtin(name).expect("built in").params;
        let plant = Plant::new(&params, &[]).expect("no effects");
        for substeps in [1, 3] {
            let start = plant.rest(State::new(0.2, 1e6, -0.5, 3.0)); // an angle at which another sine is taken
            let mut seen = Vec::new();
            follow(
                &plant,
                start.clone(),
                &commands,
                0.002,
                substeps,
                |_| true,
                |s| seen.push((s.x, s.t, s.voltage)),
            )
            .expect("finite");
            let mut s = start;
            for (k, u) in commands.iter().enumerate() {
                for _ in 0..substeps {
                    plant.step(&mut s, *u, 0.002 / substeps as f64);
                }
                assert_eq!(
                    seen[k + 1],
                    (s.x, s.t, s.voltage),
                    "{name}, {substeps}, {k}"
                );
            }
        }
    }
}
