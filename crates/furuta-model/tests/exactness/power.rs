//! Where energy goes at every moment: what motor and effects put in is what the rig gains, and what rubs only takes.

use crate::exactness::plants::{any_state, effect, rigs};
use furuta_model::dynamics::Angle;
use furuta_model::effects::{self, Clock, Instant, Law};
use furuta_model::{CATALOGUE, Effect, Jet, Params, Plant, RARE, State, energy};
use proptest::prelude::*;
use std::f64::consts::TAU;

/// The motor's voltage for the command `u` and the power (W) of one effect, as the catalogue's formulas say, written
/// down once more here. `None` where this has not been done; then the effect's own hooks are asked.
fn by_formula(
    e: &Effect<f64>,
    p: &Params<f64>,
    x: &State<f64>,
    t: f64,
    u: f64,
) -> Option<(f64, f64)> {
    let v = e.values();
    let (w, s) = (x.theta_dot, x.alpha_dot);
    Some(match e.spec().id {
        "arm.coulomb" => (u, -v[0] * w.abs()),
        "arm.stribeck" => {
            let level = v[0] + (v[1] - v[0]) * (-(w / v[2]).powi(2)).exp();
            (u, -level * w.abs())
        }
        "arm.quadratic" => (u, -v[0] * w.abs().powi(3)),
        "arm.spring" => (u, -v[0] * (x.theta - v[1]) * w),
        "arm.cable" => {
            let e = x.theta - v[3];
            (u, -(v[0] * e + v[1] * e.powi(2) + v[2] * e.powi(3)) * w)
        }
        "arm.cogging" => (u, v[0] * (v[1] * x.theta + v[2]).sin() * w),
        // The weight acts at the centre of mass: its speed along the change of gravity's direction.
        "arm.tilt" => {
            let e = x.theta - v[1];
            let (l, c) = (p.arm.length, p.pendulum.com);
            // Centre of mass along the downhill direction: l cos(e) + c sin(alpha) sin(e); above the pivot: c
            // cos(alpha).
            let downhill =
                -l * e.sin() * w + c * (x.alpha.cos() * e.sin() * s + x.alpha.sin() * e.cos() * w);
            let up = -c * x.alpha.sin() * s;
            let mg = p.pendulum.mass * p.gravity;
            let own = -v[2] * l * e.sin() * w;
            (
                u,
                mg * (v[0].sin() * (downhill + own) + (1.0 - v[0].cos()) * up),
            )
        }
        "motor.deadzone" => (u.signum() * (u.abs() - v[0]).max(0.0), 0.0),
        "motor.bias" => (u + v[0], 0.0),
        "motor.saturation" => (u.clamp(-v[0], v[0]), 0.0),
        "motor.asymmetry" => (if u < 0.0 { v[0] * u } else { u }, 0.0),
        "motor.drift" => ((1.0 + v[0] * t) * u, 0.0),
        // A share of what the voltage gives.
        "motor.ripple" => {
            let drive = p.coefficients().drive;
            (u, v[0] * (v[1] * x.theta + v[2]).sin() * drive * u * w)
        }
        "motor.resolution" => (v[0] * (u / v[0]).round(), 0.0),
        "motor.current_limit" => {
            let c = p.coefficients();
            let wanted = c.drive * u - v[1] * c.arm_damping * w;
            (u, (wanted.clamp(-v[0], v[0]) - wanted) * w)
        }
        "arm.load_friction" => {
            let c = p.coefficients();
            (
                u,
                -v[0] * (c.drive * u - v[1] * c.arm_damping * w).abs() * w.abs(),
            )
        }
        "arm.angle_friction" => {
            let level = v[0] * (1.0 + v[1] * (v[2] * x.theta + v[3]).sin());
            (u, -level * w.abs())
        }
        "arm.fading_friction" => (u, -v[0] * (-t / v[1]).exp() * w.abs()),
        "arm.stop" => {
            let from_middle = x.theta - v[3];
            let deep = from_middle.abs() - v[1];
            let side = from_middle.signum();
            let push = (v[0] * deep + v[2] * side * w).max(0.0);
            (u, if deep > 0.0 { -side * push * w } else { 0.0 })
        }
        "pendulum.coulomb" => (u, -v[0] * s.abs()),
        "pendulum.quadratic" => (u, -v[0] * s.abs().powi(3)),
        "pendulum.spring" => (u, -v[0] * (x.alpha - v[1]) * s),
        "pendulum.bias" => (u, v[0] * s),
        "disturbance.vibration" => (u, v[0] * (TAU * v[1] * t + v[2]).sin() * w),
        "disturbance.kick" => (
            u,
            if t >= v[1] && t < v[1] + v[2] {
                v[0] * s
            } else {
                0.0
            },
        ),
        "disturbance.arm_kick" => (
            u,
            if t >= v[1] && t < v[1] + v[2] {
                v[0] * w
            } else {
                0.0
            },
        ),
        // These change neither voltage nor torque at one moment; presliding as relaxed, so is a cable.
        "arm.relaxation"
        | "motor.inductance"
        | "sensor.theta.eccentricity"
        | "sensor.alpha.eccentricity"
        | "sensor.jitter"
        | "sensor.theta.lost_counts"
        | "sensor.alpha.lost_counts" => (u, 0.0),
        "arm.presliding" => (u, 0.0),
        // As relaxed bristles that begin to bend.
        "arm.lugre" => (u, -v[2] * w * w),
        "motor.lag"
        | "motor.delay"
        | "drive.backlash"
        | "drive.compliance"
        | "pendulum.inertia_transverse"
        | "sensor.alpha.offset"
        | "sensor.alpha.scale"
        | "sensor.theta.scale"
        | "sensor.delay" => (u, 0.0),
        _ => return None,
    })
}

/// The power of an effect's torques by its own hooks, W: friction as that of a sliding axis.
fn by_hooks(e: &Effect<f64>, at: &Instant<'_, f64>) -> f64 {
    let (torque, dry) = (e.torque(at), e.dry_friction(at));
    let v = [at.x.theta_dot, at.x.alpha_dot];
    torque[0] * v[0] + torque[1] * v[1] - dry[0] * v[0].abs() - dry[1] * v[1].abs()
}

proptest! {
    /// `dE/dt`, by the chain rule along the plant's own rate, is the power of motor, viscous friction and effect: every
    /// effect, every rig.
    #[test]
    fn what_the_rig_gains_is_what_is_put_in(x in any_state(), u in -10.0_f64..10.0, t in 0.0..2.0_f64,
        size in 0.1..3.0_f64) {
        // Axes that slide, rather than are about to stop.
        prop_assume!(x.theta_dot.abs() > 1e-3 && x.alpha_dot.abs() > 1e-3);
        for rig in rigs() {
            for spec in CATALOGUE.iter().chain(RARE) {
                let e = effect(spec, &rig.params, size);
                let plant = Plant::new(&rig.params, &[e]).expect("one");
                let c = plant.coefficients;
                let hooks = || {
                    let at = Instant { clock: Clock::at(t), x: &x, angle: Angle::of(x.alpha), coefficients: &c,
                        memory: 0.0, volts: 0.0 };
                    (e.voltage(t, u), by_hooks(&e, &at))
                };
                let (volts, extra) = by_formula(&e, &rig.params, &x, t, u).unwrap_or_else(hooks);
                prop_assert!((volts - e.voltage(t, u)).abs() < 1e-12, "{}", spec.id);
                let rate = plant.rate(t, &x, e.voltage(t, u), 1e12).to_array();
                let mut i = 0;
                let jets = State::from(x.to_array().map(|v| { i += 1; Jet::<f64, 4>::variable(v, i - 1) }));
                let gain: f64 = energy::total(&c.cast(), &jets).d.iter().zip(rate).map(|(g, v)| g * v).sum();
                let motor = (c.drive * volts - c.arm_damping * x.theta_dot) * x.theta_dot;
                let hinge = -c.pendulum_damping * x.alpha_dot * x.alpha_dot;
                // Rounding of torques that nearly cancel: 1e-16 of M q'' q'.
                let turnover = energy::kinetic(&c, &x) * (rate[2].abs() + rate[3].abs()) + c.weight * x.alpha_dot.abs();
                let input = motor + hinge + extra;
                prop_assert!((gain - input).abs() < 1e-11 * (turnover + motor.abs() + extra.abs()),
                    "{} {}: {gain} {input}", rig.name, spec.id);
            }
        }
    }

    /// What rubs never gives, whatever its parameters and wherever the rig is: not by rounding either.
    #[test]
    fn what_rubs_only_takes(x in prop::array::uniform4(-1e3..1e3_f64),
        exponents in prop::array::uniform3(-9.0..3.0_f64)) {
        let x = State::from(x);
        let params = rigs().next().expect("one").params;
        let c = params.coefficients();
        for id in ["arm.coulomb", "arm.stribeck", "arm.quadratic", "pendulum.coulomb", "pendulum.quadratic"] {
            let spec = effects::spec(id).expect("in the catalogue");
            let pairs = spec.parameters.iter().zip(exponents);
            let values: Vec<f64> = pairs.map(|(p, e)| 10_f64.powf(e).clamp(p.min, p.max)).collect();
            let e = Effect::new(id, &values).expect("within its range");
            let at = Instant { clock: Clock::at(0.0), x: &x, angle: Angle::of(x.alpha), coefficients: &c, memory: 0.0,
                volts: 0.0 };
            let power = by_hooks(&e, &at);
            prop_assert!(power <= 0.0, "{id} {values:?}: {power} W");
            // and only on the axis that moves
            let still = State::new(x.theta, x.alpha, 0.0, 0.0);
            prop_assert_eq!(by_hooks(&e, &Instant { x: &still, ..at }), 0.0);
        }
    }

    /// Dahl's bristles store `½ stiffness z²` and give no more back than they were given: over any way the arm's work
    /// against them is that and what sliding burns.
    #[test]
    fn bristles_only_take_beyond_what_they_store(torque in 1e-4..1.0_f64, stiffness in 1e-2..1e3_f64,
        bend in -1.0..1.0_f64, way in -5.0..5.0_f64) {
        let e: Effect<f64> = Effect::new("arm.presliding", &[torque, stiffness]).expect("valid");
        let most = torque / stiffness;
        let (bend, way) = (bend * most, way * most);
        // Simpson's rule over the way; the law is smooth between reversals.
        let n = 200;
        let part = way / f64::from(n);
        let force = |k: i32| stiffness * e.travelled(bend, part * f64::from(k));
        let over_two = |k: i32| part / 3.0 * (force(2 * k) + 4.0 * force(2 * k + 1) + force(2 * k + 2));
        let work: f64 = (0..n / 2).map(over_two).sum();
        let store = |z: f64| 0.5 * stiffness * z * z;
        let end = e.travelled(bend, way);
        let burnt = work - (store(end) - store(bend));
        let scale = torque * most;
        prop_assert!(end.abs() <= most * (1.0 + 1e-15));
        prop_assert!(burnt >= -1e-7 * scale, "{burnt} of {scale}");
        // The dissipation in closed form: the integral of stiffness² z²/torque over the way's length.
        let loss: f64 = (0..n / 2).map(|k| {
            let at = |k: i32| force(k) * force(k) / torque;
            part.abs() / 3.0 * (at(2 * k) + 4.0 * at(2 * k + 1) + at(2 * k + 2))
        }).sum();
        prop_assert!((burnt - loss).abs() <= 1e-7 * scale, "{burnt} {loss}");
    }
}
