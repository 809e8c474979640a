//! Rotor and arm as two bodies: energy and momentum of both together.
//!
//! The rotor's speed follows from the momentum about the motor's axis, which nothing changes without motor and
//! friction: gravity does not act about a vertical axis. Its angle is what an encoder on the motor reads.

use crate::exactness::plants::{rigs, row};
use furuta_model::dynamics::{Angle, mass_matrix};
use furuta_model::{Effect, Params, Plant, PlantState, Rig, State, energy};

struct TwoBodies {
    plant: Plant<f64>,
    rotor: f64,
    stiffness: f64,
    half_gap: f64,
    momentum: f64,
}

impl TwoBodies {
    fn new(params: &Params<f64>, effects: &[(&str, &[f64])], start: &State<f64>) -> Self {
        let effects: Vec<_> = effects
            .iter()
            .map(|(id, v)| Effect::new(id, v).expect("valid"))
            .collect();
        let mut plant = Plant::new(params, &effects).expect("valid");
        plant.coefficients.arm_damping = 0.0;
        plant.coefficients.pendulum_damping = 0.0;
        let value = |id: &str, i: usize| {
            let found = plant.effects().iter().find(|e| e.spec().id == id);
            found.map_or(0.0, |e| e.values()[i])
        };
        let share = value("drive.backlash", 1).max(value("drive.compliance", 2));
        let (stiffness, half_gap) = (
            value("drive.compliance", 0),
            0.5 * value("drive.backlash", 0),
        );
        let m = mass_matrix(&plant.coefficients, Angle::of(start.alpha));
        Self {
            rotor: share * params.arm.inertia,
            stiffness,
            half_gap,
            // the rotor starts with the arm's speed
            momentum: m.arm * start.theta_dot + m.coupling * start.alpha_dot,
            plant,
        }
    }

    /// From the momentum, rad/s.
    fn rotor_speed(&self, x: &State<f64>) -> f64 {
        let m = mass_matrix(&self.plant.coefficients, Angle::of(x.alpha));
        let rest = (m.arm - self.rotor) * x.theta_dot + m.coupling * x.alpha_dot;
        (self.momentum - rest) / self.rotor
    }

    /// Of arm, pendulum, rotor, and spring, J.
    fn energy(&self, s: &PlantState<f64>) -> f64 {
        let speed = self.rotor_speed(&s.x);
        let both = energy::total(&self.plant.coefficients, &s.x);
        let apart = 0.5 * self.rotor * (speed * speed - s.x.theta_dot * s.x.theta_dot);
        let twist = (self.plant.measure(s)[0] - s.x.theta).abs() - self.half_gap;
        both + apart + 0.5 * self.stiffness * twist.max(0.0).powi(2)
    }
}

/// A coupling that rings at about `frequency` rad/s on this rig.
fn stiffness(rig: &Rig, share: f64, frequency: f64) -> f64 {
    let c = rig.params.coefficients();
    let rotor = share * c.hub;
    let arm = c.arm - rotor - c.coupling * c.coupling / c.pendulum;
    frequency * frequency / (1.0 / rotor + 1.0 / arm)
}

const STEPS: [f64; 4] = [1e-3, 5e-4, 2.5e-4, 1.25e-4];

/// A spring with backlash between rotor and arm, an encoder on the motor: energy is kept through every contact, to 1e-9
/// at 0.25 ms, and the error falls with RK4's order. With a backlash of zero it is `drive.compliance` alone.
#[test]
fn a_flexible_drive_without_damping_keeps_its_energy() {
    println!(
        "rotor, spring with backlash, arm: energy error over 2 s / (2 m g c), for steps of 1, 0.5, 0.25, 0.125 ms"
    );
    let start = State::new(0.0, 2.6, 3.0, 0.0);
    for rig in rigs() {
        for gap in [1e-9, 0.02] {
            let share = 0.4;
            let spring = [stiffness(&rig, share, 40.0), 0.0, share, 0.0];
            let effects: [(&str, &[f64]); 2] = [
                ("drive.backlash", &[gap, share, 1.0]),
                ("drive.compliance", &spring),
            ];
            let two = TwoBodies::new(&rig.params, &effects, &start);
            let errors = STEPS.map(|h| {
                let mut s = two.plant.rest(start);
                let before = two.energy(&s);
                let mut worst = 0.0_f64;
                for _ in 0..(2.0 / h) as usize {
                    two.plant.step(&mut s, 0.0, h);
                    worst = worst.max((two.energy(&s) - before).abs());
                }
                worst / (2.0 * two.plant.coefficients.weight)
            });
            let name = format!("{}, backlash {gap}", rig.name);
            row(&name, &errors, "");
            assert!(errors[2] < 1e-9, "{name}: {errors:?}");
            for pair in errors.windows(2).filter(|pair| pair[1] > 2e-12) {
                // a contact's moment within the step makes the leading term uneven
                assert!(pair[0] / pair[1] > 8.0, "{name}: {errors:?}");
            }
        }
    }
}

/// Rigid flanks that meet, and a coupling's damper, take energy and never give any; momentum they leave alone: the
/// rotor's speed from the momentum is that of the angle that the encoder reads.
#[test]
fn impacts_and_dampers_only_take() {
    let start = State::new(0.0, 2.0, 3.0, 0.0);
    let h = 2.5e-4;
    for rig in rigs() {
        let share = 0.4;
        let k = stiffness(&rig, share, 40.0);
        // some tenth of critical damping
        let damped = [k, 0.1 * k / 40.0, share, 0.0];
        let backlash: [(&str, &[f64]); 1] = [("drive.backlash", &[0.02, share, 1.0])];
        let spring: [(&str, &[f64]); 2] = [
            ("drive.backlash", &[1e-9, share, 1.0]),
            ("drive.compliance", &damped),
        ];
        for effects in [&backlash[..], &spring[..]] {
            let two = TwoBodies::new(&rig.params, effects, &start);
            let weight = two.plant.coefficients.weight;
            let mut s = two.plant.rest(start);
            let first = two.energy(&s);
            let (mut last, mut angle, mut speed) =
                (first, two.plant.measure(&s)[0], two.rotor_speed(&s.x));
            for _ in 0..8000 {
                two.plant.step(&mut s, 0.0, h);
                let now = two.energy(&s);
                // RK4's own error over a step
                assert!(now <= last + 1e-10 * weight, "{}: {last} {now}", rig.name);
                let (angle_now, speed_now) = (two.plant.measure(&s)[0], two.rotor_speed(&s.x));
                if (speed_now - speed).abs() < 0.1 {
                    // no impact meanwhile: the trapezoidal rule
                    let way = 0.5 * h * (speed + speed_now);
                    assert!((angle_now - angle - way).abs() < 1e-5, "{}", rig.name);
                }
                (last, angle, speed) = (now, angle_now, speed_now);
            }
            let lost = (first - last) / (2.0 * weight);
            println!("{}, {effects:?}: lost {lost:.2e} of 2 m g c", rig.name);
            assert!(lost > 1e-7, "{}, {effects:?}: {lost}", rig.name);
        }
    }
}
