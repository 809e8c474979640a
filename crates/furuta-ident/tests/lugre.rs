//! Whether LuGre friction (Canudas de Wit, Olsson, Astrom, Lischinsky: A new model for control of systems with
//! friction, IEEE TAC 40, 1995) shows in recordings beside what the catalogue has: Dahl's (`arm.presliding`), Coulomb's
//! and Stribeck's.
//!
//! ```text
//! dz/dt = v - sigma0 |v| z / g(v)      g(v) = coulomb + (static - coulomb) exp(-(v / velocity)²)
//! torque = -(sigma0 z + sigma1 dz/dt)
//! ```
//!
//! The viscous part is the arm's. The plant is not the library's stepper: RK4 in steps of 20 µs over its equations of
//! motion, with the bristles as a fifth state.

mod common;

use common::{diagnosis, qube, sweep};
use furuta_ident::recording::Recording;
use furuta_model::dynamics::{self, Angle};
use furuta_model::{Rig, State};

/// Friction by bristles.
#[derive(Clone, Copy, Debug)]
struct LuGre {
    /// N m.
    coulomb: f64,
    /// N m.
    rest: f64,
    /// rad/s.
    velocity: f64,
    /// N m/rad.
    sigma0: f64,
    /// N m s/rad.
    sigma1: f64,
}

const STEP: f64 = 2e-5;
const EVERY: usize = 100;

impl LuGre {
    fn rate(&self, v: f64, z: f64) -> f64 {
        let g = self.coulomb + (self.rest - self.coulomb) * (-(v / self.velocity).powi(2)).exp();
        v - self.sigma0 * v.abs() * z / g
    }
}

fn recorded(name: &str, rig: &Rig, friction: LuGre, amplitude: f64, phase: f64) -> Recording {
    let c = rig.params.coefficients();
    let slope = |x: [f64; 5], u: f64| {
        let state = State::new(x[0], x[1], x[2], x[3]);
        let angle = Angle::of(x[1]);
        let (torque, bias) = (
            dynamics::torque(&c, &state, u),
            dynamics::bias(&c, angle, &state),
        );
        let gravity = dynamics::gravity(&c, angle);
        let bend = friction.rate(x[2], x[4]);
        let held = friction.sigma0 * x[4] + friction.sigma1 * bend;
        let free = [
            torque[0] - bias[0] - gravity[0] - held,
            torque[1] - bias[1] - gravity[1],
        ];
        let a = dynamics::mass_matrix(&c, angle).inverse().times(free);
        [x[2], x[3], a[0], a[1], bend]
    };
    let volts = sweep(amplitude, phase);
    let mut x = [0.0, std::f64::consts::PI, 0.0, 0.0, 0.0];
    let mut samples = Vec::new();
    for k in 0..5000 {
        let t = STEP * (EVERY * k) as f64;
        let state = State::new(x[0], x[1], x[2], x[3]);
        let u = volts(t, &state) - 0.2 * x[0];
        let [theta, alpha] = rig.sensors.quantised([x[0], x[1]]);
        samples.push([t, u, theta, alpha]);
        for _ in 0..EVERY {
            let at = |d: [f64; 5], h: f64| std::array::from_fn(|i| x[i] + h * d[i]);
            let a = slope(x, u);
            let b = slope(at(a, 0.5 * STEP), u);
            let c = slope(at(b, 0.5 * STEP), u);
            let d = slope(at(c, STEP), u);
            for i in 0..5 {
                x[i] += STEP * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]) / 6.0;
            }
        }
    }
    Recording::from_samples(name, samples)
        .expect("a recording")
        .0
}

/// What is named, and what is left of the gap, by the way over which the bristles bend and by how much more friction
/// there is at rest: the table of docs/effects.md.
#[test]
#[ignore = "some minutes: make test-long"]
fn the_table_of_lugre() {
    let rig = qube();
    let coulomb = 2e-3;
    let inertia = rig.params.coefficients().arm;
    println!("| bend [rad] | at rest | sigma1 | verdict | named | left, theta and alpha [noise] |");
    println!("|---|---|---|---|---|---|");
    for bend in [0.01, 0.1] {
        let sigma0 = coulomb / bend;
        // As a damping ratio of the arm on its bristles.
        let critical = 2.0 * (sigma0 * inertia).sqrt();
        for (rest, ratio) in [(1.0, 0.0), (1.0, 0.5), (1.5, 0.5)] {
            let friction = LuGre {
                coulomb,
                rest: rest * coulomb,
                velocity: 0.5,
                sigma0,
                sigma1: ratio * critical,
            };
            let found = diagnosis(
                &[
                    recorded("a.csv", &rig, friction, 2.0, 0.0),
                    recorded("b.csv", &rig, friction, 3.0, 2.0),
                ],
                &rig,
            );
            let named: Vec<&str> = found.effects.iter().map(|e| e.id.as_str()).collect();
            let gap = &found.gap;
            println!(
                "| {bend} | {rest} | {ratio} | {} | {} | {:.2}, {:.2} |",
                found.verdict,
                named.join(", "),
                gap.augmented.theta / gap.noise_floor.theta,
                gap.augmented.alpha / gap.noise_floor.alpha
            );
        }
    }
}
