//! Swing-up of rigs drawn about the built-in ones: few draws here, many in `furuta study swing-up`.

use furuta_ctrl::supervisor::{Mode, Supervisor};
use furuta_ctrl::trajectory::{Progress, WhenLost};
use furuta_ctrl::{Config, Site, wrap};
use furuta_ctrl::{ControllerFile, Plan};
use furuta_design::optimal::{SwingUp, SwingUpError, SwingUpProblem};
use furuta_design::supervised::Supervised;
use furuta_design::swing_up::{Outcome, Study};
use furuta_model::{Effect, Plant, Rig, State};
use nalgebra::{DMatrix, DVector};
use std::sync::OnceLock;

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

/// A rig, and a swing-up on a coarse grid: one for all tests.
fn optimum() -> &'static (SwingUpProblem, SwingUp) {
    static FOUND: OnceLock<(SwingUpProblem, SwingUp)> = OnceLock::new();
    FOUND.get_or_init(|| {
        let problem = SwingUpProblem {
            intervals: 40,
            ..SwingUpProblem::new(builtin("shahzad2022-srv02"))
        };
        let found = problem.solve(&|_| ()).expect("a swing-up");
        (problem, found)
    })
}

/// The true plant under these commands, integrated in steps of 0.1 ms or less: the state at the end.
fn played(plant: &Plant<f64>, commands: &[f64], interval: f64) -> State<f64> {
    let steps = (interval / 1e-4).ceil();
    let mut x = plant.rest(State::hanging());
    for u in commands {
        for _ in 0..steps as usize {
            plant.step(&mut x, *u, interval / steps);
        }
    }
    x.x
}

/// Of the file's own precision where the motion is unstable: an error made early has grown by the end.
const REPLAYED: f64 = 2e-3;

#[test]
fn an_optimal_swing_up_is_a_motion_of_the_rig() {
    let (problem, found) = optimum();
    assert!(found.gap < 1e-8, "{:e}", found.gap);
    let limit = problem.rig.params.motor.command_limit * (1.0 - problem.reserve);
    assert!(found.commands.iter().all(|u| u.abs() <= limit + 1e-9));
    for x in &found.states {
        assert!(x.theta.abs() <= problem.arm_angle + 1e-6);
        assert!(x.theta_dot.abs() <= problem.arm_speed + 1e-6);
        assert!(x.alpha_dot.abs() <= problem.pendulum_speed + 1e-6);
    }
    // The commands alone, on the plant that everything else simulates with, at a thirtieth of the step.
    let end = played(&problem.rig.plant(), &found.commands, found.interval);
    let last = found.states.last().expect("states");
    assert!((end.theta - last.theta).abs() < REPLAYED, "{end:?}");
    assert!(wrap(end.alpha).abs() < REPLAYED, "{end:?}");
    assert!(
        end.theta_dot.abs() < 10.0 * REPLAYED && end.alpha_dot.abs() < 10.0 * REPLAYED,
        "{end:?}"
    );
}

/// Karush, Kuhn and Tucker, without the optimiser's derivatives or multipliers: the gradient of the cost by commands
/// and time is a combination of those of the three end conditions, but where a command is at its limit, and there it
/// points beyond.
#[test]
fn an_optimal_swing_up_is_a_local_optimum() {
    let (problem, found) = optimum();
    assert!(found.optimal);
    let plant = problem.rig.plant::<f64>();
    let (n, volts) = (found.commands.len(), problem.rig.params.motor.command_limit);
    let limit = volts * (1.0 - problem.reserve);
    let end = |u: &[f64], h: f64| {
        let x = played(&plant, u, h);
        DVector::from_vec(vec![wrap(x.alpha), x.theta_dot, x.alpha_dot])
    };
    // Central differences by each command and by the time, all in units of their own.
    let unit = std::f64::consts::TAU / furuta_ctrl::Site::of(&problem.rig, 0.002).frequency();
    let mut ends = DMatrix::zeros(n + 1, 3);
    for k in 0..=n {
        let moved = |by: f64| {
            let (mut u, mut h) = (found.commands.clone(), found.interval);
            match u.get_mut(k) {
                Some(u) => *u += by * volts,
                None => h += by * unit / n as f64,
            }
            end(&u, h)
        };
        let slope = (moved(1e-4) - moved(-1e-4)) / 2e-4;
        ends.set_row(k, &slope.transpose());
    }
    let mut cost = DVector::zeros(n + 1);
    for k in 0..n {
        let u = |k: usize| found.commands[k] / volts;
        cost[k] = 2.0 * problem.effort / n as f64 * u(k);
        for j in [k.checked_sub(1), (k + 1 < n).then_some(k + 1)]
            .into_iter()
            .flatten()
        {
            cost[k] += 2e-4 * (u(k) - u(j));
        }
    }
    cost[n] = 1.0;
    let free: Vec<usize> = (0..=n)
        .filter(|&k| k == n || found.commands[k].abs() < limit * (1.0 - 1e-4))
        .collect();
    let rows = |m: &DMatrix<f64>| m.select_rows(&free);
    let wanted = DVector::from_iterator(free.len(), free.iter().map(|&k| cost[k]));
    let multipliers = rows(&ends)
        .svd(true, true)
        .solve(&wanted, 1e-12)
        .expect("three unknowns");
    let left = &cost - &ends * multipliers;
    let largest = cost.rows(0, n).amax();
    for k in 0..=n {
        let bound = k < n && !free.contains(&k);
        if bound {
            // Lower cost lies beyond the limit only.
            assert!(
                left[k] * found.commands[k] < 1e-2 * largest * volts,
                "{k}: {}",
                left[k]
            );
        } else {
            assert!(
                left[k].abs() < 2e-2 * largest,
                "{k}: {} of {largest}",
                left[k]
            );
        }
    }
}

#[test]
fn a_finer_grid_finds_hardly_a_better_swing_up() {
    let (problem, found) = optimum();
    let finer = SwingUpProblem {
        intervals: 100,
        ..problem.clone()
    };
    let finer = finer.solve(&|_| ()).expect("a swing-up");
    let better = 1.0 - finer.cost / found.cost;
    assert!(
        (-1e-3..0.02).contains(&better),
        "{} {}",
        finer.cost,
        found.cost
    );
}

#[test]
fn a_swing_up_that_cannot_be_is_refused() {
    let weak = SwingUpProblem {
        intervals: 10,
        ..SwingUpProblem::new(builtin("qube-servo-2"))
    };
    let error = weak.solve(&|_| ()).expect_err("too much friction");
    assert!(
        matches!(error, SwingUpError::NotFound { gap, .. } if gap > 1e-3),
        "{error}"
    );
    let wrong = SwingUpProblem {
        reserve: 0.9,
        ..weak
    };
    let message = wrong.solve(&|_| ()).expect_err("no voltage").to_string();
    assert_eq!(
        message,
        "reserve = 0.9 is outside the allowed range [0, 0.5]"
    );
}

fn following(when_lost: WhenLost) -> Config {
    let trajectory = optimum().1.trajectory(when_lost).expect("fits");
    Config {
        trajectory: Some(trajectory),
        ..Config::default()
    }
}

#[test]
fn the_control_system_follows_it() {
    let (problem, found) = optimum();
    let config = following(WhenLost::Energy);
    // Through a file and over a wire, without a change.
    let file = ControllerFile {
        config: config.clone(),
        ..ControllerFile::default()
    };
    let again = ControllerFile::from_toml(&file.to_toml()).expect("readable");
    assert_eq!(again.config, config);
    let site = Site::of(&problem.rig, 0.002);
    let supervisor: Supervisor<f64> = Plan::new(config, &site).supervisor().expect("possible");
    let bench = Supervised::new(&supervisor, &problem.rig, 0.002).expect("possible");
    let mut run = bench.start(State::hanging());
    let mut caught = None;
    let mut furthest: f64 = 0.0;
    for k in 0..1500 {
        let s = bench.sample(&mut run, 0.0);
        if s.output.mode == Mode::SwingUp {
            assert_eq!(run.memory.following().progress(), Progress::Following);
            let phase = run.memory.following().phase() / found.interval;
            let near = found.states[(phase.round() as usize).min(found.states.len() - 1)];
            furthest = furthest.max((s.x.alpha - near.alpha).abs());
        } else {
            caught = caught.or(Some(f64::from(k) * 0.002));
            assert_eq!(s.output.mode, Mode::Balance);
        }
    }
    assert!(caught.is_some_and(|t| t < found.seconds()), "{caught:?}");
    assert!(
        furthest < 0.35,
        "{furthest} rad, half an interval's way included"
    );
}

/// The arm is pushed while the pendulum rises: typed, and either the energy swing-up goes on or the motor is off.
#[test]
fn a_lost_trajectory_is_answered() {
    let rig = &optimum().0.rig;
    let site = Site::of(rig, 0.002);
    for when_lost in [WhenLost::Energy, WhenLost::Stop] {
        let supervisor = Supervisor::<f64>::design(&following(when_lost), &site).expect("possible");
        let bench = Supervised::new(&supervisor, rig, 0.002).expect("possible");
        let mut run = bench.start(State::hanging());
        let mut after = Vec::new();
        for k in 0..5000 {
            if k == 60 {
                run.plant.x.alpha_dot -= 20.0 * run.plant.x.alpha_dot.signum();
            }
            let s = bench.sample(&mut run, 0.0);
            if k > 80 && after.last() != Some(&s.output.mode) {
                after.push(s.output.mode);
            }
            assert!(s.fault.is_none() && (s.output.mode != Mode::Stopping || s.output.u == 0.0));
        }
        let progress = run.memory.following().progress();
        match when_lost {
            WhenLost::Energy => assert_eq!(after.last(), Some(&Mode::Balance), "{after:?}"),
            WhenLost::Stop => {
                assert_eq!(progress, Progress::Lost);
                assert_eq!(after, [Mode::Stopping, Mode::Idle]);
            }
        }
    }
}

/// Where the rig does not hang at rest, the energy swing-up does what it does without a trajectory.
#[test]
fn a_rig_elsewhere_is_swung_up_by_energy() {
    let rig = &optimum().0.rig;
    let site = Site::of(rig, 0.002);
    let volts = |config: &Config| {
        let supervisor = Supervisor::<f64>::design(config, &site).expect("possible");
        let bench = Supervised::new(&supervisor, rig, 0.002).expect("possible");
        let mut run = bench.start(State::new(0.0, 2.0, 0.0, 0.0));
        (0..500)
            .map(|_| bench.sample(&mut run, 0.0).output.u)
            .collect::<Vec<_>>()
    };
    assert_eq!(
        volts(&following(WhenLost::Energy)),
        volts(&Config::default())
    );
}

#[test]
fn drawn_rigs_come_up_along_a_trajectory() {
    let (problem, found) = optimum();
    let study = Study {
        config: following(WhenLost::Energy),
        ..Study::new(problem.rig.clone(), 40)
    };
    let outcome = Outcome::of(&study.run(&|_| ()).expect("possible"));
    assert_eq!((outcome.up, outcome.faults), (40, 0), "{outcome:?}");
    assert!(outcome.arrival[0] < 1.2 * found.seconds(), "{outcome:?}");
}
