//! The tracking controllers: commands for any input, and what each promises on its own model.

use furuta_ctrl::controllers::{
    Controller, Design, LqrSliding, NormalFormSliding, OutputRegulator, Reaching, Switching,
};
use furuta_ctrl::design::{SteadyMotion, Weights, balance};
use furuta_ctrl::{Real, Site};
use furuta_model::dynamics::acceleration;
use furuta_model::{Effect, Rig, State, linearize};
use proptest::prelude::*;

const RIG: &str = "qube-servo-2";
const LAMBDA: f64 = 3.0;

fn rig() -> Rig {
    Rig::builtin(RIG).expect("built in")
}

fn steady() -> SteadyMotion<f64> {
    SteadyMotion::solve(&rig().params.coefficients(), LAMBDA, 7).expect("solvable")
}

fn regulator<T: Real>() -> OutputRegulator<T> {
    let params = rig().params;
    let gain = balance(&params, 0.002).expect("a gain").gain;
    OutputRegulator::new(&params, &steady(), gain.into())
}

fn normal_form<T: Real>(filter: f64) -> NormalFormSliding<T> {
    let model = rig().params.coefficients();
    let switching = Switching {
        gamma: 20.0,
        eps: 0.5,
        filter,
    };
    let weights = Weights::diagonal([1.0; 4], [0.01]);
    NormalFormSliding {
        model,
        steady: steady(),
        gain: NormalFormSliding::gain(&model, &switching, &weights).expect("a gain"),
        switching,
        command_limit: 10.0,
    }
    .cast()
}

fn lqr_sliding<T: Real>(reaching: Reaching<f64>) -> LqrSliding<T> {
    let rig = rig();
    let linear = linearize(&rig.nominal_plant(), State::upright(), 0.0);
    let weights = Weights::diagonal([1.0, 10.0, 0.1, 0.1], [1.0]);
    let model = rig.params.coefficients();
    LqrSliding::on_surface(&model, &linear, &steady(), &weights, reaching, 10.0)
        .expect("a surface")
        .cast()
}

const LAYER: Reaching<f64> = Reaching::BoundaryLayer {
    gain: 2.0,
    width: 0.02,
};

/// Numbers of every kind: ordinary, huge, tiny, infinite, NaN.
fn any() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -20.0..20.0_f64,
        1 => proptest::num::f64::ANY,
        1 => Just(core::f64::consts::FRAC_PI_2), // horizontal: the arm has no hold there
        1 => Just(f64::NAN),
        1 => Just(f64::INFINITY),
    ]
}

/// Whatever goes in, what comes out is a command, at once and afterwards.
fn commands_stay_commands<T: Real, C: Controller<T>>(
    controller: &C,
    inputs: &[([f64; 4], [f64; 4], f64)],
) -> bool {
    let mut state = controller.start();
    let state_of = |x: [f64; 4]| State::from(x.map(T::from_f64));
    let bounded = inputs.iter().all(|(x, r, h)| {
        let u = controller.update(&mut state, &state_of(*x), &state_of(*r), T::from_f64(*h));
        u.value().abs() <= 10.0
    });
    let calm = state_of([0.0, 0.01, 0.0, 0.0]);
    let u = controller.update(&mut state, &calm, &State::upright(), T::from_f64(0.002));
    // Nothing that was remembered silences it for good: it answers a lean.
    bounded && u.value().is_finite() && u.value() != 0.0
}

proptest! {
    #[test]
    fn a_command_for_any_input(
        inputs in prop::collection::vec(
            ([any(), any(), any(), any()], [any(), any(), any(), any()], any()), 1..8),
    ) {
        let twisting = Reaching::super_twisting(20.0, 3.0);
        prop_assert!(commands_stay_commands(&regulator::<f64>(), &inputs));
        prop_assert!(commands_stay_commands(&regulator::<f32>(), &inputs));
        for filter in [0.0, 0.01] {
            prop_assert!(commands_stay_commands(&normal_form::<f64>(filter), &inputs));
            prop_assert!(commands_stay_commands(&normal_form::<f32>(filter), &inputs));
        }
        for reaching in [LAYER, twisting] {
            prop_assert!(commands_stay_commands(&lqr_sliding::<f64>(reaching), &inputs));
            prop_assert!(commands_stay_commands(&lqr_sliding::<f32>(reaching), &inputs));
        }
    }

    /// Both precisions are one controller.
    #[test]
    fn single_precision_is_the_same_controller(
        x in prop::array::uniform4(-0.3..0.3_f64), phase in 0.0..6.2_f64,
    ) {
        let (s, c) = phase.sin_cos();
        let reference = State::new(0.2, 0.02 * s, 0.0, 0.02 * LAMBDA * c);
        let x = State::from(x);
        let (x32, r32) = (x.map(|v| v as f32), reference.map(|v| v as f32));
        // 24 bits through some hundred operations, times gains of some 10 V/rad.
        let close = |a: f64, b: f32| (a - f64::from(b)).abs() < 2e-3;
        prop_assert!(close(
            regulator::<f64>().update(&mut (), &x, &reference, 0.002),
            regulator::<f32>().update(&mut (), &x32, &r32, 0.002)));
        let (wide, narrow) = (normal_form::<f64>(0.01), normal_form::<f32>(0.01));
        prop_assert!(close(
            wide.update(&mut wide.start(), &x, &reference, 0.002),
            narrow.update(&mut narrow.start(), &x32, &r32, 0.002)));
        let (wide, narrow) = (lqr_sliding::<f64>(LAYER), lqr_sliding::<f32>(LAYER));
        prop_assert!(close(
            wide.update(&mut wide.start(), &x, &reference, 0.002),
            narrow.update(&mut narrow.start(), &x32, &r32, 0.002)));
    }

    /// (53) makes the pendulum accelerate as the normal form says, at any state that the motor can hold.
    #[test]
    fn the_normal_form_is_linear(
        x in prop::array::uniform4(-0.05..0.05_f64), phase in 0.0..6.2_f64,
    ) {
        let control = NormalFormSliding { command_limit: 1e9, ..normal_form::<f64>(0.0) };
        let (s, c) = phase.sin_cos();
        let (amplitude, w) = (0.02, [0.02 * c, 0.02 * s]);
        let reference = State::new(0.0, amplitude * s, 0.0, -amplitude * LAMBDA * c);
        let x = State::from(x);
        let u = control.update(&mut control.start(), &x, &reference, 0.002);
        let [_, alpha_ddot] = acceleration(&control.model, &x, u);
        let e = (x - control.steady.state(w)).to_array();
        let feedback: f64 = e.iter().zip(control.gain).map(|(e, k)| e * k).sum();
        let switching = control.switching.gamma * (e[3] / control.switching.eps).clamp(-1.0, 1.0);
        let expected = -LAMBDA * LAMBDA * w[1] - feedback - switching;
        prop_assert!((alpha_ddot - expected).abs() < 1e-8 * (1.0 + expected.abs()), "{alpha_ddot} {expected}");
    }
}

/// On a rig whose springs the file names, (53) makes the pendulum accelerate as on a free one: the command differs by
/// what the springs pull with. So does the steady motion's.
#[test]
fn the_inverse_holds_the_springs_of_the_rig_file() {
    let mut rig = rig();
    let design = |rig: &Rig| {
        let spec = furuta_ctrl::config::find("normal_form_sliding").expect("in the catalogue");
        let settings = furuta_ctrl::settings::Settings::new(spec)
            .with("gain", &[0.0, 0.0, 0.0, 0.0][..])
            .expect("possible");
        NormalFormSliding::<f64>::design(&settings, &Site::of(rig, 0.002)).expect("a design")
    };
    let free = design(&rig);
    for (id, values) in [
        ("arm.spring", [0.02, 0.0]),
        ("pendulum.spring", [0.004, 0.0]),
    ] {
        rig.effects
            .push(Effect::new(id, &values).expect("possible"));
    }
    let held = design(&rig);
    let reference = State::new(0.4, 0.0, 0.0, 0.0);
    for x in [[0.42, 0.01, 0.0, 0.0], [0.3, -0.02, 0.4, 0.01]].map(State::from) {
        let [a, b] = [&free, &held].map(|c| c.update(&mut c.start(), &x, &reference, 0.002));
        let [_, expected] = acceleration(&free.model, &x, a);
        // [compensate] holds the arm at its reference; the controller has the rest.
        let plant = rig.try_plant().expect("possible");
        let b = b + furuta_ctrl::compensation::holding_voltage(&plant, reference.theta);
        let found = plant.rate(0.0, &x, b, 1.0).alpha_dot;
        assert!(
            (found - expected).abs() < 1e-9 * (1.0 + expected.abs()),
            "{found} {expected}"
        );
    }
    let linear = Site::of(&rig, 0.002).linear().expect("rests");
    let bare = linearize(&rig.nominal_plant(), State::upright(), 0.0);
    let m =
        furuta_model::dynamics::mass_matrix(&free.model, furuta_model::dynamics::Angle::of(0.0));
    for i in 0..4 {
        let more = [2, 3].map(|r| linear.a[(r, i)] - bare.a[(r, i)]);
        let torque = m.times(more);
        for (row, torque) in torque.into_iter().enumerate() {
            assert!((held.steady.load.slope[row][i] - torque).abs() < 1e-12);
        }
    }
}

/// On the surface the LQR's gain is silent, and with its own gain in the reaching law the controller is the LQR.
#[test]
fn the_surface_is_the_lqrs() {
    let rig = rig();
    let linear = linearize(&rig.nominal_plant(), State::upright(), 0.0);
    let weights = Weights::diagonal([1.0, 10.0, 0.1, 0.1], [1.0]);
    let gain = furuta_ctrl::design::lqr(&linear.a, &linear.b, &weights)
        .expect("a gain")
        .gain;
    let surface = lqr_sliding::<f64>(LAYER).surface;
    let ratio = gain[0] / surface[0];
    for (k, s) in gain.iter().zip(surface) {
        assert!((k - ratio * s).abs() < 1e-9 * k.abs(), "{gain} {surface:?}");
    }
    // sigma moves by one for each volt and second.
    let per_volt: f64 = surface.iter().zip(&linear.b).map(|(s, b)| s * b).sum();
    assert!((per_volt - 1.0).abs() < 1e-12);
}
