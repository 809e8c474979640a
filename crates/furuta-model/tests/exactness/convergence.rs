//! With which order of the step length trajectories converge: the fourth, also through events within a step.

use crate::exactness::plants::{effect, frictionless, rigs, row};
use furuta_model::{CATALOGUE, Plant, RARE, Rig, State};

/// Seconds for which each command is held: every step length here divides it.
const HOLD: f64 = 8e-3;

/// Where the rig is, and what its encoders read, after 2 s with `n` steps for each command.
fn end(plant: &Plant<f64>, start: State<f64>, n: usize, u: impl Fn(f64) -> f64) -> [f64; 6] {
    let h = HOLD / n as f64;
    let mut s = plant.rest(start);
    for k in 0..250 * n {
        plant.step(&mut s, u((k / n) as f64 * HOLD), h);
    }
    let (x, y) = (s.x.to_array(), plant.measure(&s));
    [x[0], x[1], x[2], x[3], y[0], y[1]]
}

fn distance(a: &[f64; 6], b: &[f64; 6]) -> f64 {
    a.iter().zip(b).fold(0.0, |m, (a, b)| m.max((a - b).abs()))
}

/// The angles and speeds of 2 s of free motion at the end of every 8 ms, with `n` steps for each.
fn path(plant: &Plant<f64>, start: State<f64>, n: usize) -> Vec<f64> {
    let mut s = plant.rest(start);
    let mut path = Vec::new();
    for _ in 0..250 {
        for _ in 0..n {
            plant.step(&mut s, 0.0, HOLD / n as f64);
        }
        path.extend(s.x.to_array());
    }
    path
}

/// Halving the step divides the error by a number that tends to 2⁴.
#[test]
fn rk4_converges_with_the_fourth_order() {
    println!(
        "RMS error over 2 s for steps of 4, 2, 1, 0.5, 0.25 ms, and what each halving divides it by"
    );
    for rig in rigs() {
        let plant = frictionless(&rig, &[]);
        let start = State::new(0.0, 2.4, 0.5, 0.0);
        let exact = path(&plant, start, 256);
        let errors = [2, 4, 8, 16, 32].map(|n| {
            let squares = path(&plant, start, n).into_iter().zip(&exact);
            let sum: f64 = squares.map(|(a, b)| (a - b).powi(2)).sum();
            (sum / exact.len() as f64).sqrt()
        });
        let ratios: Vec<f64> = errors.windows(2).map(|e| e[0] / e[1]).collect();
        row(&rig.name, &errors, &format!("{ratios:.2?}"));
        // The error's next term is a share of the step of the leading one: what the ratio lacks of 16 halves with the
        // step. Where it tends to follows from the last two, but for rounding of 64,000 steps.
        let used = errors.iter().skip(1).filter(|e| **e > 1e-11).count();
        let limit = 2.0 * ratios[used - 1] - ratios[used - 2];
        assert!(
            used >= 3 && (limit - 16.0).abs() < 0.6,
            "{}: {ratios:?}",
            rig.name
        );
    }
}

/// The order that is reached with an effect, and why not four where it is less.
fn expected_order(id: &str) -> f64 {
    match id {
        // |v| v has a kink in its slope at a reversal, which no event marks: a step over it errs by h³ at each
        // reversal.
        "arm.quadratic" | "pendulum.quadratic" => 2.5,
        // Torques that have a kink where the motor's torque passes zero or its limit, which no event marks.
        "arm.load_friction" | "motor.current_limit" => 1.8,
        _ => 3.6,
    }
}

/// Stops and breakaways, contacts, late commands, kicks: located within the step, they leave the order as it is.
#[test]
fn events_within_a_step_leave_the_order() {
    println!("error after 2 s for ever shorter steps, and the order from the first to the last");
    for name in ["qube-servo-2", "shahzad2022-srv02"] {
        let rig = Rig::builtin(name).expect("built in");
        let u = |t: f64| 0.2 * rig.params.motor.command_limit * (7.5 * t).sin();
        let start = State::new(0.2, 2.5, 0.0, 0.0);
        for spec in CATALOGUE.iter().chain(RARE) {
            let plant =
                Plant::new(&rig.params, &[effect(spec, &rig.params, 1.0)]).expect("one effect");
            let exact = end(&plant, start, 128, u);
            // A flexible coupling, an end stop and a winding take shorter steps of their own accord, as many as they
            // need for their rates: the order shows below these.
            let own_steps = ["drive.compliance", "arm.stop", "motor.inductance"].contains(&spec.id);
            let steps = if own_steps {
                [4, 8, 16, 32]
            } else {
                [2, 4, 8, 16]
            };
            let errors = steps.map(|n| distance(&end(&plant, start, n, u), &exact));
            let from = usize::from(own_steps);
            let order = (errors[from] / errors[3]).log2() / (3 - from) as f64;
            row(
                &format!("{name}, {}", spec.id),
                &errors,
                &format!("{order:.2}"),
            );
            let expected = expected_order(spec.id);
            assert!(order > expected, "{name} {}: {errors:?} {order}", spec.id);
        }
    }
}

/// The motions above do contain what they are meant to: an arm that stops and stays for a while, many times.
#[test]
fn the_arm_does_stick_meanwhile() {
    let rig = Rig::builtin("qube-servo-2").expect("built in");
    let spec = furuta_model::effects::spec("arm.coulomb").expect("in the catalogue");
    let plant = Plant::new(&rig.params, &[effect(spec, &rig.params, 1.0)]).expect("one effect");
    let mut s = plant.rest(State::new(0.2, 2.5, 0.0, 0.0));
    let (mut stops, mut moving) = (0, false);
    for k in 0..2000 {
        let t = f64::from(k / 8) * HOLD;
        plant.step(&mut s, 2.0 * (7.5 * t).sin(), 1e-3);
        stops += u32::from(moving && s.x.theta_dot == 0.0);
        moving = s.x.theta_dot != 0.0;
    }
    println!("{stops} stops");
    assert!(stops >= 3, "{stops}");
}
