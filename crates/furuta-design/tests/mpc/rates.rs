//! The command's rate limited: problems of it solved by others, and runs.

use crate::mpc::{Draws, PERIOD, misses, textbook};
use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettingsBuilder, DefaultSolver, IPSolver, NonnegativeConeT};
use furuta_ctrl::Site;
use furuta_ctrl::controllers::{self, Bounds, Controller, Design, Mpc, MpcState, Outcome};
use furuta_ctrl::design::{Weights, balance_weights};
use furuta_design::closed_loop::{ClosedLoop, Sensing};
use furuta_design::mpc::InteriorPoint;
use furuta_model::{Rig, State, linearize};
use nalgebra::{DMatrix, DVector};

/// Changes of the active limits in a sample, where a file says nothing.
fn standard_bound(site: &Site<'_>) -> usize {
    let settings = controllers::settings("mpc").expect("listed");
    let mpc = Mpc::<f64>::design(&settings, site).expect("suits any rig");
    mpc.iterations
}

/// A controller with random weights, horizon and limits, and what the last command was.
fn drawn(draws: &mut Draws, rig: &Rig, angles: bool) -> (Mpc<f64>, MpcState<f64>) {
    let site = Site::of(rig, PERIOD);
    let mut ten = |decades: f64| 10f64.powf(decades * draws.next());
    let q = [ten(2.0), ten(2.0), 1e-2 * ten(2.0), 1e-2 * ten(2.0)];
    let u = site.command_limit;
    let weights = Weights::diagonal(q, [ten(1.0) / (u * u)]);
    let bounds = Bounds {
        command: u,
        pendulum: angles.then(|| 0.05 * ten(0.5)),
        arm: angles.then(|| 0.5 * ten(0.5)),
        // From what takes a second for the whole range to what takes two samples.
        rate: Some(20.0 * u * ten(1.0)),
    };
    let horizon = 10.0 * ten(0.5) / site.frequency();
    let linear = site.linear().expect("has one");
    let mpc = Mpc::<f64>::new(
        &linear,
        PERIOD,
        &weights,
        horizon,
        &bounds,
        standard_bound(&site),
    )
    .expect("a gain");
    let last = u * draws.next();
    let upright = State::upright();
    let memory = mpc.take_over(&upright, &upright, last);
    (mpc, memory)
}

/// 8,000 samples with all limits: all are solved, the conditions of optimality hold, and no command is farther from the
/// one before than the rate allows.
#[test]
fn random_problems_are_solved() {
    let mut draws = Draws(11);
    let (mut active, mut most) = (0, 0);
    for name in Rig::VOLTAGE {
        let rig = Rig::builtin(name).expect("built in");
        let frequency = Site::of(&rig, PERIOD).frequency();
        for _ in 0..500 {
            let (mpc, mut memory) = drawn(&mut draws, &rig, true);
            let mut x = draws.state(frequency);
            for _ in 0..4 {
                let (before, upright) = (memory, State::upright());
                let u = mpc.update(&mut memory, &x, &upright, PERIOD);
                let report = memory.report();
                assert!(
                    matches!(report.outcome, Outcome::Solved | Outcome::Regulator),
                    "{name}: {x:?}: {report:?}"
                );
                let y = memory.multipliers(&mpc);
                let asked = mpc.problem(&before, &x, &upright);
                let missed = misses(&mpc, &asked, &memory.moves(), &y);
                let limit = mpc.command_limit;
                assert!(missed < 1e-10 * limit, "{name}: {missed} V, {report:?}");
                assert!(u.abs() <= limit && (u - before.last()).abs() <= mpc.step * (1.0 + 1e-12));
                active += usize::from(y[3].iter().any(|y| *y != 0.0));
                most = most.max(report.changes);
                let further = draws.state(frequency);
                x = State::from(std::array::from_fn(|i| {
                    0.8 * x.to_array()[i] + 0.2 * further.to_array()[i]
                }));
            }
        }
    }
    assert!(active > 4000, "{active}");
    // States drawn at random are as far from each other as no two samples of a run. None of them meets the standard
    // bound of 200; a larger number here asks for another bound.
    assert_eq!(most, 138);
}

/// The first move by Clarabel, which says which limits are active, and the linear equations of these.
fn by_clarabel(mpc: &Mpc<f64>, asked: &[[[f64; 12]; 3]; 4]) -> Option<f64> {
    let mut rows: Vec<([f64; 12], f64)> = Vec::new();
    for (group, [free, low, high]) in mpc.rows.iter().zip(asked) {
        if group.is_limited() {
            for i in 0..12 {
                rows.push((group.forced[i], high[i] - free[i]));
                rows.push((group.forced[i].map(|x| -x), free[i] - low[i]));
            }
        }
    }
    let (m, n) = (rows.len(), 12);
    let entries = |each: fn(usize, usize) -> usize| (0..m * n).map(move |k| each(k / n, k % n));
    let matrix = CscMatrix::new_from_triplets(
        m,
        n,
        entries(|i, _| i).collect(),
        entries(|_, j| j).collect(),
        rows.iter().flat_map(|(row, _)| *row).collect(),
    );
    let square = CscMatrix::identity(n);
    let bounds: Vec<f64> = rows.iter().map(|(_, bound)| *bound).collect();
    let settings = DefaultSettingsBuilder::default()
        .verbose(false)
        .tol_gap_abs(1e-12)
        .tol_gap_rel(1e-12)
        .tol_feas(1e-12)
        .build()
        .expect("sound");
    let cones = [NonnegativeConeT(m)];
    let mut solver = DefaultSolver::new(&square, &vec![0.0; n], &matrix, &bounds, &cones, settings)
        .expect("fits");
    solver.solve();
    let (z, s) = (&solver.solution.z, &solver.solution.s);
    let active: Vec<usize> = (0..m).filter(|i| z[*i] > s[*i]).collect();
    let k = active.len();
    let c = DMatrix::from_fn(k, n, |i, j| rows[active[i]].0[j]);
    let b = DVector::from_fn(k, |i, _| bounds[active[i]]);
    // w = -C'y, C w = b.
    let y = (&c * c.transpose()).cholesky()?.solve(&-&b);
    let w = -c.transpose() * &y;
    let sound = y.iter().all(|y| *y >= -1e-9)
        && rows.iter().all(|(row, bound)| {
            let value: f64 = (0..n).map(|j| row[j] * w[j]).sum();
            value <= bound + 1e-9
        });
    sound.then_some(w[0])
}

/// Command and rate limited, both at all cost: the first command is that of the limits that Clarabel finds active, to
/// 1e-9 of the command limit.
#[test]
fn an_independent_solver_finds_the_same() {
    let mut draws = Draws(12);
    let (mut compared, mut doubtful) = (0, 0);
    for name in Rig::VOLTAGE {
        let rig = Rig::builtin(name).expect("built in");
        let frequency = Site::of(&rig, PERIOD).frequency();
        let mut found = 0;
        while found < 50 {
            let (mpc, mut memory) = drawn(&mut draws, &rig, false);
            let (x, upright) = (draws.state(frequency), State::upright());
            let asked = mpc.problem(&memory, &x, &upright);
            let base = mpc.unlimited(&memory, &x, &upright);
            let u = mpc.update(&mut memory, &x, &upright, PERIOD);
            if memory.multipliers(&mpc)[3] == [0.0; 12] {
                continue;
            }
            found += 1;
            // Limits that hardly push or hardly hold are not told apart by an interior-point method.
            let Some(first) = by_clarabel(&mpc, &asked) else {
                doubtful += 1;
                continue;
            };
            compared += 1;
            let other = base + mpc.first * first;
            let limit = mpc.command_limit;
            assert!(
                (u - other).abs() < 1e-9 * limit,
                "{name}: {x:?}: {u} V, not {other} V"
            );
        }
    }
    assert!(compared > 180, "{compared} compared, {doubtful} doubtful");
}

/// The textbook's problem, every state and command a variable, with the changes of the command limited.
#[test]
fn the_problem_is_the_textbooks() {
    let rig = Rig::builtin("qube-servo-2").expect("built in");
    let (samples, lean, rate) = (150, 0.08, 200.0);
    let limit = rig.params.motor.command_limit;
    let mut weights = balance_weights(&rig.params);
    weights.q[(0, 0)] = 16.0;
    let linear = linearize(&rig.nominal_plant(), State::upright(), 0.0);
    let bounds = Bounds {
        command: limit,
        pendulum: Some(lean),
        arm: None,
        rate: Some(rate),
    };
    let mpc = Mpc::<f64>::new(&linear, PERIOD, &weights, 0.3, &bounds, 1000).expect("a gain");
    let (exact, upright) = (InteriorPoint(mpc), State::upright());
    for (theta, last) in [(-0.9, -3.0), (-0.7, 1.0), (0.6, 2.0), (0.8, -1.0)] {
        let x = State::new(theta, 0.01, 0.1, 0.0);
        let change = Some((rate * PERIOD, last));
        let expected = textbook(&rig, &weights, samples, lean, change, &x);
        let u = exact.update(
            &mut exact.take_over(&x, &upright, last),
            &x,
            &upright,
            PERIOD,
        );
        assert!(
            (u - expected).abs() < 1e-5 * limit,
            "{u} V, not {expected} V"
        );
        let own = mpc.update(&mut mpc.take_over(&x, &upright, last), &x, &upright, PERIOD);
        assert!((own - expected).abs() < 1e-5 * limit);
    }
}

/// Too few changes, or a state that is no number: the command goes no faster than it may, and to 0 for what is no
/// number.
#[test]
fn the_rate_holds_whatever_happens() {
    let rig = Rig::builtin("qube-servo-2").expect("built in");
    let settings = controllers::settings("mpc")
        .and_then(|s| s.with("command_rate", &[50.0]).ok())
        .and_then(|s| s.with("pendulum_angle", &[0.02]).ok())
        .and_then(|s| s.with("iterations", &[1.0]).ok())
        .expect("in range");
    let mpc = Mpc::<f64>::design(&settings, &Site::of(&rig, PERIOD)).expect("suits it");
    let (mut memory, upright) = (mpc.start(), State::upright());
    let mut draws = Draws(13);
    let mut bounds = 0;
    for _ in 0..500 {
        let last = memory.last();
        let u = mpc.update(&mut memory, &draws.state(20.0), &upright, PERIOD);
        assert!(
            (u - last).abs() <= 0.1 * (1.0 + 1e-12) && u.abs() <= 10.0,
            "{last} V, {u} V"
        );
        bounds += usize::from(memory.report().outcome == Outcome::Bound);
    }
    assert!(bounds > 100, "{bounds}");
    let broken = State::new(f64::NAN, 0.0, 0.0, 0.0);
    assert_eq!(mpc.update(&mut memory, &broken, &upright, PERIOD), 0.0);
    let far = State::new(0.0, 1e300, 0.0, 0.0);
    let u = mpc.update(&mut memory, &far, &upright, PERIOD);
    assert!(u.abs() <= 0.1 * (1.0 + 1e-12), "{u} V");
}

/// On the nonlinear plant: an amplifier that takes a tenth of a second for its range still moves the arm.
#[test]
fn a_slow_command_moves_the_arm() {
    let rig = Rig::builtin("qube-servo-2").expect("built in");
    let settings = controllers::settings("mpc")
        .and_then(|s| s.with("command_rate", &[100.0]).ok())
        .expect("in range");
    let mpc = Mpc::<f64>::design(&settings, &Site::of(&rig, PERIOD)).expect("suits it");
    let samples = ClosedLoop {
        plants: vec![(0.0, rig.nominal_plant().into())],
        start: State::upright(),
        period: PERIOD,
        substeps: 1,
        duration: 6.0,
        sensing: Sensing::Perfect,
    }
    .run(&mpc, |_| State::new(1.0, 0.0, 0.0, 0.0));
    let steps = samples.windows(2).map(|pair| (pair[1].u - pair[0].u).abs());
    let fastest = steps.fold(0.0, f64::max);
    assert!(
        fastest <= 0.2 * (1.0 + 1e-12) && fastest > 0.19,
        "{fastest} V a sample"
    );
    let last = samples.last().expect("some").x;
    assert!(
        (last.theta - 1.0).abs() < 0.01 && last.alpha.abs() < 0.01,
        "{last:?}"
    );
}
