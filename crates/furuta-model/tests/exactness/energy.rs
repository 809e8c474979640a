//! Energy without friction and motor: kept, by the rig alone and with every effect that stores energy.
//!
//! Errors are relative to `2 m g c`, by which the energies of the upright and the hanging pendulum differ.

use crate::exactness::plants::{any_state, effect, frictionless, rigs, row, typical};
use furuta_model::dynamics::Angle;
use furuta_model::effects::{self, Clock, Instant, Law};
use furuta_model::{Effect, Plant, State, energy};
use proptest::prelude::*;

/// The energy that an effect stores, J; `None` for those that store none.
fn stored(e: &Effect<f64>, plant: &Plant<f64>, x: &State<f64>) -> Option<f64> {
    let v = e.values();
    let c = &plant.coefficients;
    Some(match e.spec().id {
        "arm.spring" => 0.5 * v[0] * (x.theta - v[1]).powi(2),
        "pendulum.spring" => 0.5 * v[0] * (x.alpha - v[1]).powi(2),
        "arm.cable" => {
            let e = x.theta - v[3];
            v[0] * e.powi(2) / 2.0 + v[1] * e.powi(3) / 3.0 + v[2] * e.powi(4) / 4.0
        }
        "arm.cogging" => v[0] / v[1] * (v[1] * x.theta + v[2]).cos(),
        // beyond the level base's m g c cos(alpha)
        "arm.tilt" => {
            let e = x.theta - v[1];
            c.weight * x.alpha.cos() * (v[0].cos() - 1.0)
                - v[0].sin()
                    * ((1.0 + v[2]) * c.lever * e.cos() + c.weight * x.alpha.sin() * e.sin())
        }
        _ => return None,
    })
}

const CONSERVATIVE: [&str; 5] = [
    "arm.spring",
    "arm.cable",
    "arm.cogging",
    "arm.tilt",
    "pendulum.spring",
];

/// The largest error of the energy over 10 s of free motion with steps of `h` seconds.
fn drift(plant: &Plant<f64>, start: State<f64>, h: f64) -> f64 {
    let total = |x: &State<f64>| {
        let effects = plant.effects().iter();
        effects
            .filter_map(|e| stored(e, plant, x))
            .fold(energy::total(&plant.coefficients, x), |sum, v| sum + v)
    };
    let before = total(&start);
    let mut s = plant.rest(start);
    let mut worst = 0.0_f64;
    for _ in 0..(10.0 / h).round() as usize {
        plant.step(&mut s, 0.0, h);
        worst = worst.max((total(&s.x) - before).abs());
    }
    worst / (2.0 * plant.coefficients.weight)
}

const STEPS: [f64; 4] = [1e-3, 5e-4, 2.5e-4, 1.25e-4];

/// Where the error is RK4's own, halving the step divides it by 16 or more (by 32 where the leading term is an exact
/// differential). Errors near rounding are left out.
fn falls_with_the_fourth_order(name: &str, errors: &[f64]) {
    for pair in errors.windows(2).filter(|pair| pair[1] > 2e-12) {
        let ratio = pair[0] / pair[1];
        assert!(ratio > 14.0, "{name}: {errors:?}");
    }
}

/// At 1 kHz a swing of 31 degrees either side keeps its energy to 1e-9 on every rig. Larger motions are faster
/// (ramos-velasco's light arm turns at 46 rad/s when its heavy pendulum falls from upright) and the error is RK4's: it
/// falls with the step, to 1e-9 at 0.125 ms or before.
#[test]
fn free_motion_keeps_its_energy() {
    println!("energy error over 10 s / (2 m g c), for steps of 1, 0.5, 0.25, 0.125 ms");
    for rig in rigs() {
        let plant = frictionless(&rig, &[]);
        for (motion, start) in [
            ("31 degrees off hanging", State::new(0.0, 2.6, 0.0, 0.0)),
            ("65 degrees, arm turning", State::new(0.3, 2.0, 0.5, -1.0)),
            ("falls from upright", State::new(0.0, 0.1, 0.0, 0.0)),
        ] {
            let errors = STEPS.map(|h| drift(&plant, start, h));
            let name = format!("{}, {motion}", rig.name);
            row(&name, &errors, "");
            falls_with_the_fourth_order(&name, &errors);
            let first = if start.alpha == 2.6 { 0 } else { 3 };
            assert!(errors[first] < 1e-9, "{name}: {errors:?}");
        }
    }
}

/// The same with each effect that stores energy, at twice the strength at which it is noticed.
#[test]
fn effects_that_store_energy_give_it_back() {
    println!("energy error over 10 s / (2 m g c), for steps of 1, 0.5, 0.25, 0.125 ms");
    for rig in rigs() {
        for id in CONSERVATIVE {
            let spec = effects::spec(id).expect("in the catalogue");
            let e = effect(spec, &rig.params, 2.0);
            let plant = frictionless(&rig, &[e]);
            let start = State::new(0.2, 2.6, 0.0, 0.0);
            assert!(stored(&e, &plant, &start).is_some_and(|v| v != 0.0));
            let errors = STEPS.map(|h| drift(&plant, start, h));
            let name = format!("{}, {id}", rig.name);
            row(&name, &errors, "");
            falls_with_the_fourth_order(&name, &errors);
            assert!(errors[3] < 1e-9, "{name}: {errors:?}");
        }
    }
}

proptest! {
    /// Around any closed way of arm and pendulum such an effect does no work.
    #[test]
    fn no_work_is_done_around_a_closed_way(
        which in 0..CONSERVATIVE.len(), size in 0.1..3.0_f64, centre in any_state(),
        radius in prop::array::uniform2(0.1..3.0_f64), lag in 0.0..6.0_f64,
    ) {
        let spec = effects::spec(CONSERVATIVE[which]).expect("in the catalogue");
        let params = rigs().next().expect("one").params;
        let c = params.coefficients();
        let e = effect(spec, &params, size);
        // The trapezoidal rule over a period of a smooth function: exact to rounding.
        let n = 512;
        let (mut work, mut turnover) = (0.0, 0.0);
        for k in 0..n {
            let s = std::f64::consts::TAU * f64::from(k) / f64::from(n);
            let x = State::new(
                centre.theta + radius[0] * s.cos(), centre.alpha + radius[1] * (s + lag).cos(),
                -radius[0] * s.sin(), -radius[1] * (s + lag).sin(),
            );
            let at = Instant { clock: Clock::at(0.0), x: &x, angle: Angle::of(x.alpha), coefficients: &c, memory: 0.0,
                volts: 0.0 };
            let torque = e.torque(&at);
            let share = torque[0] * x.theta_dot + torque[1] * x.alpha_dot;
            work += share;
            turnover += share.abs();
        }
        prop_assert!(work.abs() <= 1e-12 * turnover, "{} {:?}: {work} of {turnover}", spec.id,
            typical(spec, &params, size));
    }
}
