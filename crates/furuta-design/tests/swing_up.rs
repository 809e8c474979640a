//! Swing-up of rigs drawn about the built-in ones: few draws here, many in `furuta study swing-up`.

use furuta_ctrl::supervisor::{Mode, Supervisor};
use furuta_ctrl::{Config, Site, wrap};
use furuta_design::supervised::Supervised;
use furuta_design::swing_up::{Outcome, Study};
use furuta_model::{Effect, Rig, State};

/// The QUBE of the courseware has more friction in its hinge than 10 V overcome (`furuta study reach`); this one has a
/// fifth.
fn smooth_qube() -> Rig {
    let mut rig = Rig::builtin("qube-servo-2").expect("built in");
    rig.params.pendulum.viscous = 1e-4;
    rig
}

fn builtin(name: &str) -> Rig {
    Rig::builtin(name).expect("built in")
}

#[test]
fn drawn_rigs_come_up_and_come_up_again() {
    for rig in [
        builtin("fong2014-emecs"),
        builtin("shahzad2022-srv02"),
        smooth_qube(),
    ] {
        let name = rig.name.clone();
        let outcome = Outcome::of(&Study::new(rig, 40).run(&|_| ()).expect("possible"));
        assert_eq!((outcome.up, outcome.faults), (40, 0), "{name}: {outcome:?}");
        assert!(outcome.up_again >= 39, "{name}: {outcome:?}");
    }
}

/// The same draws whatever the number of threads, others for another seed.
#[test]
fn draws_are_reproducible() {
    let study = Study::new(builtin("shahzad2022-srv02"), 6);
    let (a, b) = (study.run(&|_| ()), study.run(&|_| ()));
    assert_eq!(a.expect("possible"), b.expect("possible"));
    let other = Study {
        seed: 2,
        ..study.clone()
    };
    let (draw, another) = (study.draw(0), other.draw(0));
    assert_ne!(draw.expect("possible").0, another.expect("possible").0);
}

/// The effect `disturbance.kick` knocks over a balanced pendulum; it comes up again, and the arm stays within its
/// limit.
#[test]
fn a_kick_is_recovered_from() {
    let known = builtin("shahzad2022-srv02");
    let supervisor =
        Supervisor::<f64>::design(&Config::default(), &Site::of(&known, 0.002)).expect("possible");
    let mut rig = known.clone();
    // 0.05 s of three times the weight's moment, 10 s after the start: some 9 rad/s, more than can be held.
    let torque = 3.0 * known.params.coefficients().weight;
    let kick = Effect::new("disturbance.kick", &[torque, 10.0, 0.05, 0.0]).expect("valid");
    rig.effects.push(kick);
    let bench = Supervised::new(&supervisor, &rig, 0.002).expect("possible");
    let mut run = bench.start(State::hanging());
    let mut modes: Vec<(f64, Mode)> = Vec::new();
    let mut last = State::hanging();
    for k in 0..12_500 {
        let t = f64::from(k) * 0.002;
        let s = bench.sample(&mut run, 0.0);
        if modes.last().map(|m| m.1) != Some(s.output.mode) {
            modes.push((t, s.output.mode));
        }
        assert!(s.fault.is_none(), "{:?}", s.fault);
        last = s.x;
    }
    let up_before = modes.iter().rev().find(|(t, _)| *t < 10.0).map(|m| m.1);
    assert_eq!(up_before, Some(Mode::Balance), "{modes:?}");
    assert!(
        modes.iter().any(|(t, m)| *t > 10.0 && *m == Mode::SwingUp),
        "knocked over: {modes:?}"
    );
    assert_eq!(modes.last().map(|m| m.1), Some(Mode::Balance), "{modes:?}");
    assert!(wrap(last.alpha).abs() < 0.05, "{last:?}");
}

/// A pendulum whose weight the model has wrong: what is learnt on the way up is how wrong.
#[test]
fn the_weight_is_learnt_from_ascents() {
    let known = builtin("ramos-velasco");
    let supervisor =
        Supervisor::<f64>::design(&Config::default(), &Site::of(&known, 0.002)).expect("possible");
    for factor in [0.92, 1.0, 1.08] {
        // A point mass: omega^2 = g / com, so the weight over the inertia is by 1/factor off.
        let mut rig = known.clone();
        rig.params.pendulum.com *= factor;
        let bench = Supervised::new(&supervisor, &rig, 0.002).expect("possible");
        let mut run = bench.start(State::hanging());
        for _ in 0..3000 {
            bench.sample(&mut run, 0.0);
        }
        let learnt = supervisor
            .swing_up
            .weight_ratio(run.memory.swing_up_state());
        // The model's arm does work on an inertia that is off as well: some per cent remain.
        assert!((learnt * factor - 1.0).abs() < 0.04, "{factor}: {learnt}");
    }
}
