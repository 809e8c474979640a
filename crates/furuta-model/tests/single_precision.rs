//! How far a trajectory in single precision strays from the same one in double precision: 10 s at 1 kHz, every built-in
//! rig.
//!
//! `cargo test -p furuta-model --test model single_precision -- --nocapture` prints the distances as tables,
//! docs/target.md quotes them.

use furuta_model::{CATALOGUE, Effect, Params, Plant, RARE, Rig, Scalar, Spec, State, linearize};
use nalgebra::{Matrix4, RowVector4};

/// Sample period, s.
const PERIOD: f64 = 1e-3;
/// 10 s.
const STEPS: u32 = 10_000;

/// The largest distance allowed: of either angle, rad, and of either speed, rad/s.
#[derive(Copy, Clone, Debug)]
struct Bound {
    angle: f64,
    speed: f64,
}

/// Adding a step's change to an angle of a few radians rounds it by up to 1.2e-7 rad. 10,000 such errors of either sign
/// add up to about 100 times that, 1.2e-5 rad, where the motion neither damps nor amplifies them. Measured: up to
/// 1.9e-5 rad, 1.5e-4 rad/s, most of it on ramos-velasco, whose light arm the pendulum throws about.
const OPEN_LOOP: Bound = Bound {
    angle: 1e-4,
    speed: 1e-3,
};

/// A stable loop forgets its errors: what stays is a step's own rounding, at angles below 0.3 rad. Measured: 4e-7 rad,
/// 3e-6 rad/s.
const CLOSED_LOOP: Bound = Bound {
    angle: 3e-6,
    speed: 3e-5,
};

/// With an effect the open-loop motions stray further where it takes away what brings them together (a constant bias
/// turns the arm many times: larger angles, coarser rounding), or where speeds change quickly at one moment, which the
/// two find some microseconds apart (friction, kicks). Measured: 9.3e-5 rad, 1.3e-3 rad/s.
const WITH_EFFECT: Bound = Bound {
    angle: 5e-4,
    speed: 1e-2,
};

/// Backlash: whether a flank is touched or just missed may depend on the last bit, and what follows differs by a part
/// of the backlash, 0.03 rad here. Measured: 1.2e-3 rad, 1.4e-2 rad/s.
const WITH_PLAY: Bound = Bound {
    angle: 1e-2,
    speed: 1e-1,
};

/// The plant's clock adds up 10,000 periods and rounds each time: in single precision it is 0.4 ms off after 10 s, and
/// with it the phase of a vibration. Measured: 2.1e-3 rad, 2.7e-2 rad/s.
const WITH_TIME: Bound = Bound {
    angle: 1e-2,
    speed: 1e-1,
};

/// What the motor is told.
#[derive(Copy, Clone, Debug)]
enum Command {
    /// Nothing: a free swing.
    None,
    /// Three sines, in shares of the limit.
    Sines,
    /// State feedback with this gain, V/rad and V s/rad.
    Feedback([f64; 4]),
}

impl Command {
    /// For sample `k`, V, in the arithmetic of `S` throughout.
    fn volts<S: Scalar>(self, limit: f64, k: u32, x: &State<S>) -> S {
        let number = S::from_f64;
        match self {
            Self::None => S::ZERO,
            Self::Sines => {
                let t = number(f64::from(k)) * number(PERIOD);
                let sine = |share: f64, hertz: f64| {
                    number(share * limit) * (number(std::f64::consts::TAU * hertz) * t).sin_cos().0
                };
                sine(0.1, 0.7) + sine(0.06, 1.9) + sine(0.02, 5.3)
            }
            Self::Feedback(gain) => gain
                .iter()
                .zip(x.to_array())
                .fold(S::ZERO, |u, (g, x)| u - number(*g) * x)
                .clamp(number(-limit), number(limit)),
        }
    }
}

struct Motion {
    name: &'static str,
    command: Command,
    start: State<f64>,
    bound: Bound,
}

fn motions(params: &Params<f64>) -> [Motion; 3] {
    [
        Motion {
            name: "swing",
            command: Command::None,
            start: State::new(0.3, 2.0, 0.0, 0.0),
            bound: OPEN_LOOP,
        },
        // Not from `State::hanging()`: pi in single precision is not pi, and the torque of that difference alone would
        // decide on which side of its backlash a drive at rest begins.
        Motion {
            name: "driven",
            command: Command::Sines,
            start: State::new(0.0, 3.0, 0.0, 0.0),
            bound: OPEN_LOOP,
        },
        Motion {
            name: "balanced",
            command: Command::Feedback(upright_gain(params)),
            start: State::new(0.2, 0.05, 0.0, 0.0),
            bound: CLOSED_LOOP,
        },
    ]
}

/// The gain that places the poles of the loop about upright at multiples of the rate at which the pendulum falls
/// (Ackermann's formula).
fn upright_gain(params: &Params<f64>) -> [f64; 4] {
    let plant = Plant::new(params, &[]).expect("a built-in rig");
    let (a, b) = {
        let linear = linearize(&plant, State::upright(), 0.0);
        (linear.a, linear.b)
    };
    let fall = a[(3, 1)].sqrt();
    let reachable = Matrix4::from_columns(&[b, a * b, a * a * b, a * a * a * b]);
    let wanted = [0.5, 1.0, 1.0, 1.5]
        .iter()
        .fold(Matrix4::identity(), |p, multiple| {
            p * (a + Matrix4::identity() * (multiple * fall))
        });
    let last = RowVector4::new(0.0, 0.0, 0.0, 1.0);
    let gain = last * reachable.try_inverse().expect("controllable") * wanted;
    [gain[0], gain[1], gain[2], gain[3]]
}

fn plant<S: Scalar>(params: &Params<f64>, spec: Option<&Spec>) -> Plant<S> {
    let effects: Vec<Effect<S>> = spec
        .iter()
        .map(|spec| {
            let values: Vec<S> = spec
                .parameters
                .iter()
                .map(|p| match p.name {
                    // Some disturbances belong to one run; this is the first.
                    "run" => S::ZERO,
                    _ => S::from_f64((p.off + p.typical(params)).clamp(p.min, p.max)),
                })
                .collect();
            Effect::new(spec.id, &values).expect("its typical size is within its range")
        })
        .collect();
    Plant::new(&params.cast(), &effects).expect("a built-in rig, at most one effect")
}

/// The largest distance of either angle (rad) within 0.1, 1 and 10 s, and of either speed (rad/s) within 10 s.
struct Distance {
    angle: [f64; 3],
    speed: f64,
}

impl std::fmt::Display for Distance {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [a, b, c] = self.angle;
        write!(
            f,
            "{a:8.1e} {b:8.1e} {c:8.1e} rad {:8.1e} rad/s",
            self.speed
        )
    }
}

fn distance(params: &Params<f64>, spec: Option<&Spec>, motion: &Motion) -> Distance {
    let (single, double) = (plant::<f32>(params, spec), plant::<f64>(params, spec));
    #[allow(clippy::cast_possible_truncation)]
    let mut a = single.rest(motion.start.map(|x| x as f32));
    let mut b = double.rest(motion.start);
    let limit = params.motor.command_limit;
    let (mut angle, mut speed) = ([0.0_f64; 3], 0.0_f64);
    for k in 0..STEPS {
        let u = (
            motion.command.volts(limit, k, &a.x),
            motion.command.volts(limit, k, &b.x),
        );
        #[allow(clippy::cast_possible_truncation)]
        single.step(&mut a, u.0, PERIOD as f32);
        double.step(&mut b, u.1, PERIOD);
        assert!(a.x.is_finite() && b.x.is_finite());
        let apart = a.x.map(f64::from) - b.x;
        for (largest, until) in angle.iter_mut().zip([100, 1000, STEPS]) {
            if k < until {
                *largest = largest.max(apart.theta.abs()).max(apart.alpha.abs());
            }
        }
        speed = speed.max(apart.theta_dot.abs()).max(apart.alpha_dot.abs());
    }
    Distance { angle, speed }
}

fn rigs() -> impl Iterator<Item = Rig> {
    Rig::VOLTAGE
        .iter()
        .map(|n| Rig::builtin(n).expect("built in"))
}

/// Prints a line and says whether the distance is within the bound.
fn within(rig: &Rig, motion: &Motion, spec: Option<&Spec>, bound: Bound) -> bool {
    let found = distance(&rig.params, spec, motion);
    let effect = spec.map_or("", |s| s.id);
    let ok = found.angle[2] <= bound.angle && found.speed <= bound.speed;
    println!(
        "{:18} {:9} {effect:28} {found}{}",
        rig.name,
        motion.name,
        if ok { "" } else { "  too far" }
    );
    ok
}

#[test]
fn rigid_bodies() {
    let mut far = Vec::new();
    for rig in rigs() {
        for motion in motions(&rig.params) {
            if !within(&rig, &motion, None, motion.bound) {
                far.push((rig.name.clone(), motion.name, motion.bound));
            }
        }
    }
    assert!(far.is_empty(), "{far:#?}");
}

/// Without feedback. In closed loop an effect that makes the loop hunt about upright (a dead zone) parts neighbouring
/// motions, in any precision.
#[test]
fn each_effect_without_feedback() {
    let mut far = Vec::new();
    for rig in rigs() {
        for motion in motions(&rig.params).iter().take(2) {
            for spec in CATALOGUE.iter().chain(RARE) {
                let bound = match spec.id {
                    "drive.backlash" => WITH_PLAY,
                    "disturbance.vibration" => WITH_TIME,
                    _ => WITH_EFFECT,
                };
                if !within(&rig, motion, Some(spec), bound) {
                    far.push((rig.name.clone(), motion.name, spec.id, bound));
                }
            }
        }
    }
    assert!(far.is_empty(), "{far:#?}");
}
