//! A reference that is known ahead, and a command that acts late.

use crate::mpc::PERIOD;
use furuta_ctrl::controllers::{self, Bounds, Controller, Design, Mpc};
use furuta_ctrl::design::{Weights, dlqr};
use furuta_ctrl::reference::{Ahead, ArmSteps, ArmTable};
use furuta_ctrl::supervisor::Supervisor;
use furuta_ctrl::{Config, ConfigError, Site};
use furuta_model::discretize::zero_order_hold;
use furuta_model::{Effect, Linear, Plant, Rig, State};
use nalgebra::{DMatrix, DVector, SMatrix, SVector};

/// A reference given by its samples.
struct Samples<F>(F);

impl<F: Fn(u32) -> State<f64>> Ahead<f64> for Samples<F> {
    fn at(&self, samples: u32) -> State<f64> {
        (self.0)(samples)
    }
}

fn rig() -> (Rig, Linear) {
    let rig = Rig::builtin("qube-servo-2").expect("built in");
    let linear = Site::of(&rig, PERIOD).linear().expect("has one");
    (rig, linear)
}

fn weights() -> Weights<f64, 4, 1> {
    Weights::diagonal([16.0, 4.0, 0.1, 0.1], [0.05])
}

/// Wide limits: the rows exist and nothing is active.
const WIDE: Bounds = Bounds {
    command: 1e6,
    pendulum: Some(1e3),
    arm: Some(1e3),
    rate: Some(1e9),
};

/// The cheapest commands over `n` samples from the error `e0` under the disturbances `d`, by one set of linear
/// equations for all of them; the regulator's cost at the end.
fn batch(
    (a, b): &(SMatrix<f64, 4, 4>, SVector<f64, 4>),
    weights: &Weights<f64, 4, 1>,
    e0: SVector<f64, 4>,
    d: &[SVector<f64, 4>],
) -> (Vec<f64>, Vec<SVector<f64, 4>>) {
    let n = d.len();
    let end = dlqr(a, b, weights).expect("has a gain").cost;
    // Errors e = free + forced u.
    let (mut free, mut forced) = (vec![e0], vec![DMatrix::zeros(4, n)]);
    for k in 0..n {
        let mut next = DMatrix::from_fn(4, 4, |i, j| a[(i, j)]) * &forced[k];
        for i in 0..4 {
            next[(i, k)] += b[i];
        }
        free.push(a * free[k] + d[k]);
        forced.push(next);
    }
    let mut square = DMatrix::identity(n, n) * weights.r[0];
    let mut linear = DVector::zeros(n);
    for k in 1..=n {
        let q = if k < n { weights.q } else { end };
        let weighed = forced[k].transpose() * DMatrix::from_fn(4, 4, |i, j| q[(i, j)]);
        square += &weighed * &forced[k];
        linear += &weighed * DVector::from_fn(4, |i, _| free[k][i]);
    }
    let u = square
        .cholesky()
        .expect("positive definite")
        .solve(&-linear);
    let errors = (0..=n).map(|k| {
        let moved = &forced[k] * &u;
        SVector::from_fn(|i, _| free[k][i] + moved[i])
    });
    (u.iter().copied().collect(), errors.collect())
}

/// References that step, and one that moves with a speed: the command without limits, and what every row is without
/// moves, are those of the batch solution.
#[test]
fn a_known_reference_is_followed_at_least_cost() {
    let (rig, linear) = rig();
    let mut mpc = Mpc::<f64>::new(&linear, PERIOD, &weights(), 0.12, &WIDE, 100).expect("a gain");
    mpc.looks_ahead = true;
    let model = zero_order_hold(&linear.a, &linear.b, PERIOD);
    let upright = |theta: f64, speed: f64| State::new(theta, 0.0, speed, 0.0);
    let steps = ArmSteps {
        now: 0.1,
        period: PERIOD,
        steps: &[(0.0, 0.1), (0.114, 0.4), (0.18, -0.2), (0.9, 5.0)],
    };
    let next: Vec<f64> = (1..80).map(|k| (0.05 * f64::from(k)).sin()).collect();
    let table = ArmTable {
        now: State::upright(),
        next: &next,
    };
    let ramp = Samples(|k: u32| upright(0.1 + 1.5 * PERIOD * f64::from(k), 1.5));
    let nod = Samples(|k: u32| State::new(0.0, if k > 20 { 0.1 } else { 0.0 }, 0.0, 0.0));
    let x = State::new(0.05, 0.02, -0.3, 0.1);
    let last = 0.7;
    let memory = mpc.take_over(&x, &x, last);
    let check = |name: &str, reference: &dyn Fn(u32) -> State<f64>| {
        let reference = Samples(reference);
        let r: Vec<SVector<f64, 4>> = (0..=60)
            .map(|k| SVector::from(reference.at(k).to_array()))
            .collect();
        let d: Vec<SVector<f64, 4>> = (0..60)
            .map(|k| {
                // The pendulum's angle is kept by other means.
                let mut from = r[k];
                from[1] = 0.0;
                let mut d = model.0 * from - r[k + 1];
                d[1] += r[k][1];
                d
            })
            .collect();
        let e0 = SVector::from(x.to_array()) - r[0];
        let (u, e) = batch(&model, &weights(), e0, &d);
        let scale = u.iter().fold(1.0, |a: f64, u| a.max(u.abs()));
        let near = |what: &str, got: f64, expected: f64| {
            let off = (got - expected).abs() / scale;
            assert!(off < 1e-9, "{name}, {what}: {got}, not {expected}");
        };
        near("command", mpc.unlimited(&memory, &x, &reference), u[0]);
        let asked = mpc.problem(&memory, &x, &reference);
        let ends = furuta_ctrl::design::Prediction::<4, 12>::new(
            &model.1,
            &dlqr(&model.0, &model.1, &weights()).expect("a gain"),
            60,
        )
        .ends;
        for i in 0..12 {
            let start = if i == 0 { 0 } else { ends[i - 1] };
            let before = if i < 2 { 0 } else { ends[i - 2] };
            let of = |k: usize| asked[k][0][i] / mpc.rows[k].scale[i];
            near("commands", of(0), u[start]);
            near("pendulum", of(1), e[ends[i]][1] + r[ends[i]][1]);
            near("arm", of(2), e[ends[i]][0] + r[ends[i]][0]);
            let previous = if i == 0 { last } else { u[before] };
            near("change", of(3), u[start] - previous);
        }
        // It matters: without knowing, the command is another.
        let blind = mpc.feedback().unlimited(&x, &reference.at(0));
        assert!((blind - u[0]).abs() > 1e-3, "{name}: {blind} V, {} V", u[0]);
    };
    check("steps", &|k| steps.at(k));
    check("table", &|k| table.at(k));
    check("ramp", &|k| ramp.at(k));
    check("nod", &|k| nod.at(k));
    // A reference that stays: not a bit is another.
    let stays = upright(0.3, 0.0);
    let regulator = mpc.feedback().unlimited(&x, &stays);
    assert_eq!(mpc.unlimited(&memory, &x, &stays), regulator);
    // Single precision.
    let narrow = mpc.cast::<f32>();
    let x32 = x.map(|v| v as f32);
    let table32: Vec<f32> = next.iter().map(|v| *v as f32).collect();
    let reference = ArmTable {
        now: State::upright(),
        next: &table32,
    };
    let memory32 = narrow.take_over(&x32, &x32, 0.7);
    let (u32, u) = (
        f64::from(narrow.unlimited(&memory32, &x32, &reference)),
        mpc.unlimited(&memory, &x, &table),
    );
    assert!((u32 - u).abs() < 1e-4 * u.abs(), "{u32} V, not {u} V");
    drop(rig);
}

/// What an arm step costs on the nonlinear plant when it is known ahead, and when it is not.
#[test]
fn to_know_ahead_pays() {
    let (rig, _) = rig();
    let settings = controllers::settings("mpc")
        .and_then(|s| s.with("pendulum_angle", &[0.1]).ok())
        .expect("in range");
    let site = Site::of(&rig, PERIOD);
    let blind = Mpc::<f64>::design(&settings, &site).expect("suits it");
    let settings = settings.with("preview", &[1.0]).expect("in range");
    let knowing = Mpc::<f64>::design(&settings, &site).expect("suits it");
    let plant = rig.nominal_plant::<f64>();
    let steps = [(1.0, 0.5)];
    let miss = |mpc: &Mpc<f64>| {
        let (mut mechanics, mut memory) = (plant.rest(State::upright()), mpc.start());
        let mut sum = 0.0;
        for k in 0..1500 {
            let now = f64::from(k) * PERIOD;
            let reference = ArmSteps {
                now,
                period: PERIOD,
                steps: &steps,
            };
            let u = mpc.update_ahead(&mut memory, &mechanics.x, &reference, PERIOD);
            sum += (mechanics.x.theta - reference.at(0).theta).powi(2) * PERIOD;
            plant.step(&mut mechanics, u, PERIOD);
        }
        assert!((mechanics.x.theta - 0.5).abs() < 0.01, "{:?}", mechanics.x);
        sum
    };
    let (blind, knowing) = (miss(&blind), miss(&knowing));
    assert!(knowing < 0.5 * blind, "{knowing} and {blind} rad^2 s");
}

/// The textbook's model with the past commands as states, `N` in all: its LQR's gain is the controller's, number by
/// number.
fn augmented<const N: usize>(linear: &Linear, delay: f64) {
    let mpc = Mpc::<f64>::new(linear, PERIOD, &weights(), 0.5, &WIDE, 100)
        .expect("a gain")
        .with_delay(linear, PERIOD, delay)
        .expect("short enough");
    let whole = (delay / PERIOD + 1e-9).floor();
    let (n, part) = (whole as usize, delay - whole * PERIOD);
    let held = |time: f64| zero_order_hold(&linear.a, &linear.b, time);
    // Over a period, the older command acts for `part`, then the newer one (Åström and Wittenmark 1997, 2.3).
    let ((late_a, _), (_, early_b)) = (held(PERIOD - part), held(PERIOD - part));
    let (part_a, part_b) = held(part);
    let a = late_a * part_a;
    let older = late_a * part_b;
    // States: x, u[-1], u[-2], ...; the input is u[0].
    let mut big = SMatrix::<f64, N, N>::zeros();
    let mut input = SVector::<f64, N>::zeros();
    big.fixed_view_mut::<4, 4>(0, 0).copy_from(&a);
    let mut act = |k: usize, b: &SVector<f64, 4>| {
        for i in 0..4 {
            if k == 0 {
                input[i] += b[i];
            } else {
                big[(i, 3 + k)] += b[i];
            }
        }
    };
    act(n, &early_b);
    if part > 1e-9 {
        act(n + 1, &older);
    }
    if N > 4 {
        input[4] = 1.0;
    }
    for i in 5..N {
        big[(i, i - 1)] = 1.0;
    }
    // The cost counts the error when a command begins to act: e(t + delay), a linear function of the states.
    let mut ahead = SMatrix::<f64, 4, N>::zeros();
    ahead
        .fixed_view_mut::<4, 4>(0, 0)
        .copy_from(&SMatrix::<f64, 4, 4>::identity());
    let mut advance = |a: &SMatrix<f64, 4, 4>, b: &SVector<f64, 4>, k: usize| {
        ahead = a * ahead;
        for i in 0..4 {
            ahead[(i, 3 + k)] += b[i];
        }
    };
    if part > 1e-9 {
        advance(&part_a, &part_b, n + 1);
    }
    let (whole_a, whole_b) = held(PERIOD);
    for k in (1..=n).rev() {
        advance(&whole_a, &whole_b, k);
    }
    let weights = weights();
    let q = ahead.transpose() * weights.q * ahead;
    let gain = dlqr(&big, &input, &Weights::new(q, weights.r))
        .expect("a gain")
        .gain;
    let upright = State::upright();
    for j in 0..N {
        let mut state = [0.0; 4];
        let mut memory = mpc.start();
        if j < 4 {
            state[j] = 1e-3;
        } else {
            // The commands before the j-th last one, the latest last.
            for k in (4..N).rev() {
                memory.commanded(if k == j { 1e-3 } else { 0.0 });
            }
        }
        let u = mpc.unlimited(&memory, &State::from(state), &upright);
        let expected = -gain[j] * 1e-3;
        let size = 1e-3 * gain.norm();
        assert!(
            (u - expected).abs() < 1e-9 * size,
            "{delay} s, state {j}: {u}, not {expected}"
        );
    }
}

#[test]
fn a_delay_is_the_past_commands_as_states() {
    let (_, linear) = rig();
    augmented::<5>(&linear, PERIOD);
    augmented::<7>(&linear, 3.0 * PERIOD);
    augmented::<5>(&linear, 0.3 * PERIOD);
    augmented::<8>(&linear, 3.71 * PERIOD);
}

/// A command that is late by 50 ms: with the past commands as states the rig stands, without it falls.
#[test]
fn a_late_command_needs_its_states() {
    let (rig, _) = rig();
    let mut late = rig.clone();
    late.effects
        .push(Effect::new("motor.delay", &[0.05]).expect("possible"));
    let site = Site::of(&late, PERIOD);
    let plant = Plant::<f64>::new(&late.params, &late.effects).expect("possible");
    let stands = |delay: f64| {
        let settings = controllers::settings("mpc")
            .and_then(|s| s.with("delay", &[delay]).ok())
            .expect("in range");
        let mpc = Mpc::<f64>::design(&settings, &site).expect("suits it");
        let mut memory = mpc.start();
        let mut mechanics = plant.rest(State::new(0.0, 0.02, 0.0, 0.0));
        for _ in 0..2000 {
            let u = mpc.update(&mut memory, &mechanics.x, &State::upright(), PERIOD);
            plant.step(&mut mechanics, u, PERIOD);
            if mechanics.x.alpha.abs() > 1.5 {
                return false;
            }
        }
        mechanics.x.alpha.abs() < 1e-3
    };
    assert!(stands(1.0) && !stands(0.0));
    // Of 0.1 s at 500 Hz no controller remembers the commands.
    late.effects[0] = Effect::new("motor.delay", &[0.1]).expect("possible");
    let settings = controllers::settings("mpc")
        .expect("known")
        .with("delay", &[1.0]);
    let refused = Mpc::<f64>::design(&settings.expect("in range"), &Site::of(&late, PERIOD));
    assert!(
        matches!(refused, Err(ConfigError::Delay { .. })),
        "{refused:?}"
    );
}

/// A control system whose estimator looks ahead refuses a controller that does so, too.
#[test]
fn a_delay_is_not_counted_twice() {
    let (rig, _) = rig();
    let site = Site::of(&rig, PERIOD);
    let refused = |delay: f64, estimator: &str, predict: Option<f64>| {
        let controller = controllers::settings("mpc").expect("known");
        let controller = controller.with("delay", &[delay]).expect("in range");
        let mut config = Config::with_controller(controller);
        let estimator = furuta_ctrl::estimators::settings(estimator).expect("known");
        config.estimator = match predict {
            Some(on) => estimator.with("predict", &[on]).expect("in range"),
            None => estimator,
        };
        matches!(
            Supervisor::<f64>::design(&config, &site),
            Err(ConfigError::Contradiction { section: "mpc", .. })
        )
    };
    assert!(!refused(0.0, "observer", None));
    assert!(refused(1.0, "observer", None) && refused(1.0, "kalman", Some(1.0)));
    assert!(!refused(1.0, "observer", Some(0.0)) && !refused(1.0, "derivative", None));
    assert!(refused(2.0, "observer", Some(0.0)) && !refused(2.0, "derivative", None));
}
