//! Empirical terms: each is the expression that it is called, exact in every scalar, off when it is off, and in rig
//! files.

use furuta_model::dynamics::Angle;
use furuta_model::effects::{self, Clock, EMPIRICAL, Instant, Law, TERMS};
use furuta_model::simulate::{Keep, OpenLoop, Rollout, Run, batch, trajectory};
use furuta_model::{CATALOGUE, Effect, Jet, Plant, Rig, Scalar, State};
use proptest::prelude::*;

fn qube() -> Rig {
    Rig::builtin("qube-servo-2").expect("built in")
}

fn term(place: usize, coefficient: f64, on: f64) -> Effect<f64> {
    Effect::new("custom.1", &[coefficient, on, place as f64]).expect("valid")
}

/// Reads an expression as a person does: factors between `*` outside of brackets.
fn read(word: &str, x: &State<f64>, u: f64) -> f64 {
    let mut depth = 0;
    let factors = word.split(|c: char| {
        depth += i32::from(c == '(') - i32::from(c == ')');
        c == '*' && depth == 0
    });
    factors.map(|f| factor(f, x, u)).product()
}

fn factor(text: &str, x: &State<f64>, u: f64) -> f64 {
    if let Some((base, power)) = text.rsplit_once('^') {
        return factor(base, x, u).powi(power.parse().expect("a whole power"));
    }
    if let Some((function, rest)) = text.split_once('(') {
        let inside = read(rest.strip_suffix(')').expect("closed"), x, u);
        return match function {
            "sin" => inside.sin(),
            "cos" => inside.cos(),
            "abs" => inside.abs(),
            other => panic!("no function {other}"),
        };
    }
    match text {
        "theta" => x.theta,
        "alpha" => x.alpha,
        "theta_dot" => x.theta_dot,
        "alpha_dot" => x.alpha_dot,
        "u" => u,
        number => number.parse().expect("a number"),
    }
}

/// rad, s and V as the expression has them.
fn unit(word: &str) -> (i32, i32, i32) {
    let mut depth = 0;
    let factors = word.split(|c: char| {
        depth += i32::from(c == '(') - i32::from(c == ')');
        c == '*' && depth == 0
    });
    factors.fold((0, 0, 0), |(rad, s, v), f| {
        let (base, power) = f.rsplit_once('^').unwrap_or((f, "1"));
        let n: i32 = power.parse().expect("a whole power");
        match base.trim_start_matches("abs(").trim_end_matches(')') {
            "theta" => (rad + n, s, v),
            "theta_dot" | "alpha_dot" => (rad + n, s - n, v),
            "u" => (rad, s, v + n),
            _ => (rad, s, v),
        }
    })
}

#[test]
fn units_are_those_of_the_expressions() {
    for t in TERMS {
        let mut got = (0, 0, 0);
        for (side, sign) in t.unit.split('/').zip([1, -1]) {
            for part in side.split_whitespace().filter(|p| *p != "1") {
                let name = part.trim_end_matches(|c: char| c.is_ascii_digit());
                let n: i32 = part[name.len()..].parse().unwrap_or(1);
                match name {
                    "rad" => got.0 += sign * n,
                    "s" => got.1 += sign * n,
                    "V" => got.2 += sign * n,
                    other => panic!("{}: {other}", t.word),
                }
            }
        }
        assert_eq!(got, unit(t.word), "{}: {}", t.word, t.unit);
    }
}

/// A search for causes must not find what is no cause.
#[test]
fn they_are_beside_the_catalogue() {
    assert_eq!(EMPIRICAL.len(), 4);
    for spec in EMPIRICAL {
        assert!(CATALOGUE.iter().all(|s| s.id != spec.id));
        assert_eq!(effects::spec(spec.id).map(|s| s.id), Some(spec.id));
        assert!(spec.name.contains("no law"));
    }
    for (i, t) in TERMS.iter().enumerate() {
        assert!(TERMS[..i].iter().all(|o| o.word != t.word), "{}", t.word);
    }
}

fn any_state() -> impl Strategy<Value = State<f64>> {
    (-4.0..4.0_f64, -7.0..7.0_f64, -8.0..8.0_f64, -8.0..8.0_f64)
        .prop_map(|(a, b, c, d)| State::new(a, b, c, d))
}

proptest! {
    /// Every term is what its name says, on the axis it is said to act on, and adds its power to the rig.
    #[test]
    fn a_term_is_the_expression_it_is_called(x in any_state(), u in -9.0..9.0_f64) {
        let c = qube().params.coefficients();
        let at = Instant { clock: Clock::at(0.0), x: &x, angle: Angle::of(x.alpha), coefficients: &c, memory: 0.0,
            volts: u };
        for (i, t) in TERMS.iter().enumerate() {
            let wanted = read(t.word, &x, u);
            let close = |a: f64, b: f64| (a - b).abs() <= 1e-13 * (1.0 + b.abs());
            prop_assert!(close(t.value(&at), wanted), "{}: {} {wanted}", t.word, t.value(&at));
            let arm = term(i, -0.5, 0.0).torque(&at);
            let pendulum = term(i, -0.5, 1.0).torque(&at);
            prop_assert!(close(arm[0], -0.5 * wanted) && arm[1] == 0.0, "{}", t.word);
            prop_assert!(close(pendulum[1], -0.5 * wanted) && pendulum[0] == 0.0, "{}", t.word);
        }
    }

    /// Dual numbers: the slope of every term with respect to state and coefficient, against differences.
    #[test]
    fn slopes_are_slopes(x in any_state(), u in -9.0..9.0_f64) {
        prop_assume!(x.theta_dot.abs() > 1e-3 && x.alpha_dot.abs() > 1e-3);
        let c = qube().params.coefficients();
        let cast = c.cast();
        let v = x.to_array();
        for (i, t) in TERMS.iter().enumerate() {
            let torque = |v: [f64; 4], k: f64| {
                let x = State::from(v);
                let at = Instant { clock: Clock::at(0.0), x: &x, angle: Angle::of(x.alpha), coefficients: &c,
                    memory: 0.0, volts: u };
                term(i, k, 1.0).torque(&at)[1]
            };
            let mut n = 0;
            let jets = State::from(v.map(|v| { n += 1; Jet::<f64, 5>::variable(v, n - 1) }));
            let at = Instant {
                clock: Clock::at(Jet::from_f64(0.0)), x: &jets, angle: Angle::of(jets.alpha), coefficients: &cast,
                memory: Jet::from_f64(0.0), volts: Jet::from_f64(u),
            };
            let values = [Jet::variable(0.3, 4), Jet::from_f64(1.0), Jet::from_f64(i as f64)];
            let e = Effect::new("custom.1", &values).expect("valid");
            let by_jet = e.torque(&at)[1];
            let h = 1e-5;
            for k in 0..4 {
                let (mut up, mut down) = (v, v);
                up[k] += h;
                down[k] -= h;
                let slope = (torque(up, 0.3) - torque(down, 0.3)) / (2.0 * h);
                // the third derivative times h²/6, and rounding over h
                prop_assert!((by_jet.d[k] - slope).abs() <= 1e-6 * (1.0 + slope.abs()),
                    "{} {k}: {} {slope}", t.word, by_jet.d[k]);
            }
            prop_assert!((by_jet.d[4] - torque(v, 1.0)).abs() <= 1e-12 * (1.0 + by_jet.d[4].abs()));
        }
    }

    /// A coefficient of zero changes no bit of a trajectory, and a plant has room for all the same.
    #[test]
    fn a_coefficient_of_zero_changes_no_bit(x in any_state(), u in -5.0..5.0_f64, place in 0..TERMS.len()) {
        let rig = qube();
        let ends = |effects: &[Effect<f64>]| {
            let plant: Plant<f64> = Plant::new(&rig.params, effects).expect("valid");
            let mut s = plant.rest(x);
            for _ in 0..20 {
                plant.step(&mut s, u, 2e-3);
            }
            s.x.to_array().map(f64::to_bits)
        };
        prop_assert_eq!(ends(&[]), ends(&[term(place, 0.0, 1.0)]));
        let on = term(place, 1e-3, 0.0);
        prop_assert!(!on.is_off() && term(place, 0.0, 0.0).is_off());
    }
}

fn commands() -> Vec<f64> {
    (0..300)
        .map(|k| 2.0 * (f64::from(k) * 0.05).sin())
        .collect()
}

fn start() -> State<f64> {
    State::new(0.2, 3.0, 0.5, -0.4)
}

fn run(effects: &[Effect<f64>]) -> Vec<State<f64>> {
    let plant: Plant<f64> = Plant::new(&qube().params, effects).expect("valid");
    trajectory(&plant, plant.rest(start()), &commands(), 2e-3, 1, |_| true).expect("valid")
}

/// Side by side in lanes to the bit what each is alone, also where each lane has another term.
#[test]
fn lanes_give_the_same_bits() {
    let alike: Vec<f64> = vec![11.0; 10];
    let others: Vec<f64> = (0..10).map(f64::from).collect();
    for places in [alike, others] {
        let rollouts: Vec<Rollout> = places
            .iter()
            .enumerate()
            .map(|(i, place)| Rollout {
                params: qube().params,
                effects: vec![
                    Effect::new("custom.1", &[-1e-6 * (i + 1) as f64, 0.0, *place]).expect("valid"),
                ],
                start: start(),
            })
            .collect();
        let whole = Run {
            period: 2e-3,
            samples: 300,
            keep: Keep::Every(100),
        };
        let together = batch(&rollouts, &OpenLoop(&commands()), whole, &|_| ()).expect("valid");
        for (i, r) in rollouts.iter().enumerate() {
            let alone: Vec<_> = run(&r.effects).into_iter().step_by(100).collect();
            assert_eq!(together.rollout(i), alone, "{}", places[i]);
        }
    }
}

/// In single precision as close as the rig itself.
#[test]
fn single_precision_is_close() {
    let rig = qube();
    for (i, t) in TERMS.iter().enumerate() {
        let e = term(i, -1e-6, 0.0);
        let double = run(&[e]);
        let plant: Plant<f32> = Plant::new(&rig.params.cast(), &[e.cast::<f32>()]).expect("valid");
        let mut s = plant.rest(start().map(|v| v as f32));
        for (u, wanted) in commands().iter().zip(&double[1..]) {
            plant.step(&mut s, *u as f32, 2e-3);
            // 300 steps, each rounding angles of 3 rad to 2e-7
            assert!(
                (f64::from(s.x.theta) - wanted.theta).abs() < 1e-4,
                "{}",
                t.word
            );
        }
    }
}

/// An expression is a sum: whatever order its terms are given in, the same bits.
#[test]
fn terms_of_one_rig_add_up() {
    let place = |word: &str| TERMS.iter().position(|t| t.word == word).expect(word) as f64;
    let a = Effect::new("custom.1", &[-2e-4, 0.0, place("theta_dot")]).expect("valid");
    let b = Effect::new("custom.2", &[-3e-4, 0.0, place("theta_dot")]).expect("valid");
    let both = Effect::new("custom.1", &[-5e-4, 0.0, place("theta_dot")]).expect("valid");
    assert_eq!(run(&[a, b]), run(&[b, a]));
    for (x, y) in run(&[a, b]).iter().zip(run(&[both])) {
        assert!((x.theta - y.theta).abs() < 1e-12);
    }
    // Viscous friction by another name.
    let mut damped = qube();
    damped.params.arm.viscous += 2e-4;
    let plant = damped.plant();
    let states =
        trajectory(&plant, plant.rest(start()), &commands(), 2e-3, 1, |_| true).expect("valid");
    for (x, y) in run(&[a]).iter().zip(states) {
        assert!((x.theta - y.theta).abs() < 1e-12);
    }
}

#[test]
fn rig_files_hold_them_by_their_words() {
    let mut rig = qube();
    for (spec, i) in EMPIRICAL.iter().zip([11, 40, 0, 20]) {
        rig.effects
            .push(Effect::new(spec.id, &[-2.1e-3, 1.0, i as f64]).expect("valid"));
    }
    let text = rig.to_toml();
    assert!(
        text.contains("term = \"theta_dot*abs(theta_dot)\""),
        "{text}"
    );
    assert!(
        text.contains("[effects.\"custom.1\"]   # Empirical"),
        "{text}"
    );
    assert_eq!(Rig::from_toml(&text).expect("readable"), rig);
    for place in 0..TERMS.len() {
        let mut rig = qube();
        rig.effects.push(term(place, 1e-3, 0.0));
        assert_eq!(Rig::from_toml(&rig.to_toml()).expect("readable"), rig);
    }
    let refused = |lines: &str| {
        Rig::from_toml(&(qube().to_toml() + "\n[effects.\"custom.1\"]\n" + lines))
            .expect_err("must be refused")
            .to_string()
    };
    let word = refused("coefficient = 1.0\nterm = \"thetta\"\n");
    assert!(
        word.contains("term = \"thetta\" must be") && word.contains("\"sin(theta)\""),
        "{word}"
    );
    let missing = refused("coefficient = 1.0\n");
    assert!(missing.contains("lacks `term`"), "{missing}");
    let size = refused("coefficient = 1e9\nterm = \"u\"\n");
    assert!(size.contains("coefficient = 1e9"), "{size}");
    let unknown =
        Rig::from_toml(&(qube().to_toml() + "\n[effects.\"custom.9\"]\ncoefficient = 1.0\n"))
            .expect_err("there are four")
            .to_string();
    assert!(unknown.contains("custom.4"), "{unknown}");
}
