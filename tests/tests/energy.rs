//! Energy: kept where nothing drives and nothing rubs, lost at the rate friction says, and bought from the motor.

use furuta_model::{Plant, Rig, State, energy};

/// A built-in rig without friction and back-EMF.
fn frictionless(name: &str) -> Plant<f64> {
    let mut params = Rig::builtin(name).expect("built in").params;
    params.arm.viscous = 0.0;
    params.pendulum.viscous = 0.0;
    params.motor.back_emf_constant = 0.0;
    Plant::new(&params, &[]).expect("no effects")
}

#[test]
fn energy_is_conserved_over_ten_seconds() {
    for name in Rig::VOLTAGE {
        let plant = frictionless(name);
        let k = plant.coefficients;
        let frequency = (k.weight / k.pendulum).sqrt();
        // Large swings, over the top, with the arm turning.
        for start in [
            State::new(0.0, 0.5, 0.0, 0.0),
            State::new(0.3, 2.0, 2.0, -1.0),
            State::new(0.0, 3.0, 0.5, 2.5 * frequency),
        ] {
            let mut state = plant.rest(start);
            let before = energy::total(&k, &start);
            let size = 2.0 * k.weight + energy::kinetic(&k, &start);
            let mut worst = 0.0_f64;
            for _ in 0..40_000 {
                plant.step(&mut state, 0.0, 0.000_25);
                worst = worst.max((energy::total(&k, &state.x) - before).abs() / size);
            }
            // RK4 errs by h^4: measured 1e-9 at most at 0.25 ms; 1e-7 leaves room for other starts, a wrong sign gives
            // 1e-2.
            assert!(worst < 1e-7, "{name}, {start:?}: {worst:e}");
        }
    }
}

#[test]
fn work_of_motor_and_friction_balances_energy() {
    for name in Rig::VOLTAGE {
        let rig = Rig::builtin(name).expect("built in");
        let plant = rig.nominal_plant::<f64>();
        let k = plant.coefficients;
        let mut state = plant.rest(State::new(0.0, 2.5, 0.0, 0.0));
        let start = energy::total(&k, &state.x);
        let power = |x: &State<f64>, u: f64| {
            (k.drive * u - k.arm_damping * x.theta_dot) * x.theta_dot
                - k.pendulum_damping * x.alpha_dot * x.alpha_dot
        };
        let (h, mut work, mut turnover) = (0.000_5, 0.0, 0.0_f64);
        for step in 0..10_000 {
            let u = 0.3 * rig.params.motor.command_limit * f64::sin(f64::from(step) * h * 5.0);
            let before = power(&state.x, u);
            plant.step(&mut state, u, h);
            let share = 0.5 * h * (before + power(&state.x, u));
            work += share;
            turnover += share.abs();
        }
        let gained = energy::total(&k, &state.x) - start;
        // The trapezoidal rule for the work errs by h^2.
        assert!(
            (gained - work).abs() < 1e-4 * turnover,
            "{name}: gained {gained}, work {work}"
        );
    }
}
