//! Model predictive control: its fixed number of steps against an interior-point method, its problem against the
//! textbook's, its limits on the nonlinear plant.

mod ahead;
mod rates;

use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettingsBuilder, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus, ZeroConeT,
};
use furuta_ctrl::Site;
use furuta_ctrl::controllers::{self, Bounds, Controller, Design, Mpc, Outcome};
use furuta_ctrl::design::{Prediction, Weights, balance_weights, dlqr};
use furuta_design::arm_step::{Contender, Experiment};
use furuta_design::mpc::InteriorPoint;
use furuta_model::discretize::zero_order_hold;
use furuta_model::{Rig, State, linearize};

const PERIOD: f64 = 0.002;

/// Uniform in -1..1: Knuth's linear congruential generator, the same on every machine.
struct Draws(u64);

impl Draws {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / f64::from(1u32 << 30) - 1.0
    }

    /// Up to 0.8 rad of the arm, 0.15 rad of the pendulum, what a pendulum falls with from there.
    fn state(&mut self, frequency: f64) -> State<f64> {
        let [theta, alpha, arm, pendulum] = [0.8, 0.15, 0.3 * frequency, 0.15 * frequency];
        State::new(
            theta * self.next(),
            alpha * self.next(),
            arm * self.next(),
            pendulum * self.next(),
        )
    }
}

/// Standard weights with a narrow range; an eager regulator with very little.
fn tasks(rig: &Rig, iterations: f64) -> [Mpc<f64>; 2] {
    let site = Site::of(rig, PERIOD);
    let u = site.command_limit;
    let standard = controllers::settings("mpc")
        .and_then(|s| s.with("arm_angle", &[1.0]).ok())
        .and_then(|s| s.with("iterations", &[iterations]).ok())
        .expect("in range");
    let calm = standard.with("pendulum_angle", &[0.1]).expect("in range");
    let eager = standard
        .with("pendulum_angle", &[0.05])
        .and_then(|s| s.with("q", &[16.0, 4.0, 0.0, 0.0]))
        .and_then(|s| s.with("r", &[1.0 / (u * u)]))
        .expect("in range");
    [calm, eager].map(|settings| Mpc::design(&settings, &site).expect("suits any rig"))
}

/// The optimality conditions of the problem, from its rows alone: by how much the moves and multipliers miss them, in
/// V.
///
/// `w = -C'y`; `y` above 0 only at or beyond an upper limit, below 0 only at or beyond a lower one, `|y|` within the
/// price; a row inside its price is within its limits.
fn misses(mpc: &Mpc<f64>, asked: &[[[f64; 12]; 3]; 4], w: &[f64; 12], y: &[[f64; 12]; 4]) -> f64 {
    let mut stationary = *w;
    let mut worst: f64 = 0.0;
    for (k, rows) in mpc.rows.iter().enumerate() {
        let [free, lowest, highest] = &asked[k];
        for i in 0..12 {
            let y = y[k][i];
            if !rows.limit.is_finite() {
                assert_eq!(y, 0.0);
                continue;
            }
            for (s, x) in stationary.iter_mut().zip(rows.forced[i]) {
                *s += y * x;
            }
            let forced: f64 = (0..12).map(|j| rows.forced[i][j] * w[j]).sum();
            let value = free[i] + forced;
            let (over, under) = (value - highest[i], lowest[i] - value);
            let price = rows.price[i];
            assert!(y.abs() <= price, "{y} costs {price}");
            if y.abs() < price {
                worst = worst.max(over).max(under);
            }
            if y > 0.0 {
                worst = worst.max(-over);
            }
            if y < 0.0 {
                worst = worst.max(-under);
            }
        }
    }
    // In units of the multipliers: of pushes that cancel, what is left counts by their size.
    let size = 1.0 + y.iter().flatten().fold(0.0, |a: f64, y| a.max(y.abs()));
    stationary
        .iter()
        .fold(worst, |worst, x| worst.max(x.abs() / size))
}

/// Cold, from 200 states in which limits are active: the conditions of optimality hold to 1e-10 of the command limit,
/// and so does the command against the solution of the linear equations of Clarabel's active rows.
#[test]
fn the_solution_is_exact() {
    let mut draws = Draws(1);
    let mut compared = 0;
    for name in Rig::VOLTAGE {
        let rig = Rig::builtin(name).expect("built in");
        let frequency = Site::of(&rig, PERIOD).frequency();
        for mpc in tasks(&rig, 100.0) {
            let exact = InteriorPoint(mpc);
            let single: Mpc<f32> = mpc.cast();
            let mut found = 0;
            while found < 25 {
                let x = draws.state(frequency);
                let upright = State::upright();
                let mut memory = mpc.start();
                let u = mpc.update(&mut memory, &x, &upright, PERIOD);
                if memory.report().outcome == Outcome::Regulator {
                    continue;
                }
                found += 1;
                compared += 1;
                let limit = mpc.command_limit;
                assert_eq!(memory.report().outcome, Outcome::Solved, "{name}: {x:?}");
                let asked = mpc.problem(&mpc.start(), &x, &upright);
                let missed = misses(&mpc, &asked, &memory.moves(), &memory.multipliers(&mpc));
                assert!(missed < 1e-10 * limit, "{name}: {x:?}: {missed}");
                // An interior-point method ends near the solution: at a corner of three prices 1e-6 away.
                let other = exact.update(&mut exact.start(), &x, &upright, PERIOD);
                assert!(
                    (u - other).abs() < 1e-5 * limit,
                    "{name}: {x:?}: {u} V, not {other} V"
                );
                // 24 bits, rows that depend on each other by one part in a thousand.
                let (x32, upright32) = (x.map(|v| v as f32), State::<f32>::upright());
                let narrow = f64::from(single.update(&mut single.start(), &x32, &upright32, 0.002));
                assert!(
                    (narrow - u).abs() < 1e-3 * limit,
                    "{name}: {x:?}: {narrow} V, not {u} V"
                );
            }
        }
    }
    assert_eq!(compared, 25 * 2 * Rig::VOLTAGE.len());
}

/// Random weights over six decades, horizons, limits (some of which cannot be kept) and states, four samples each that
/// start from the one before: all 8,000 are solved, none near the bound of changes.
#[test]
fn random_problems_are_solved_without_cycling() {
    let mut draws = Draws(3);
    let (mut active, mut beyond, mut most) = (0, 0, 0);
    for name in Rig::VOLTAGE {
        let rig = Rig::builtin(name).expect("built in");
        let site = Site::of(&rig, PERIOD);
        let linear = site.linear().expect("has one");
        let frequency = site.frequency();
        for _ in 0..500 {
            let mut ten = |decades: f64| 10f64.powf(decades * draws.next());
            let q = [ten(2.0), ten(2.0), 1e-2 * ten(2.0), 1e-2 * ten(2.0)];
            let u = site.command_limit;
            let weights = Weights::diagonal(q, [ten(1.0) / (u * u)]);
            let bounds = Bounds {
                command: u,
                pendulum: Some(0.05 * ten(0.5)),
                arm: Some(0.5 * ten(0.5)),
                rate: None,
            };
            let horizon = 10.0 * ten(0.5) / frequency;
            let mpc =
                Mpc::<f64>::new(&linear, PERIOD, &weights, horizon, &bounds, 200).expect("a gain");
            let mut memory = mpc.start();
            let mut x = draws.state(frequency);
            for _ in 0..4 {
                let upright = State::upright();
                let command = mpc.update(&mut memory, &x, &upright, PERIOD);
                let report = memory.report();
                assert!(
                    matches!(report.outcome, Outcome::Solved | Outcome::Regulator),
                    "{name}: {x:?}: {report:?}"
                );
                let y = memory.multipliers(&mpc);
                let missed = misses(
                    &mpc,
                    &mpc.problem(&memory, &x, &upright),
                    &memory.moves(),
                    &y,
                );
                assert!(missed < 1e-10 * u, "{name}: {x:?}: {missed} V, {report:?}");
                assert!(command.abs() <= u);
                active += usize::from(report.outcome == Outcome::Solved);
                let priced = |k: usize| (0..12).any(|i| y[k][i].abs() == mpc.rows[k].price[i]);
                beyond += usize::from(priced(1) || priced(2));
                most = most.max(report.changes);
                let further = draws.state(frequency);
                x = State::from(std::array::from_fn(|i| {
                    0.8 * x.to_array()[i] + 0.2 * further.to_array()[i]
                }));
            }
        }
    }
    assert!(active > 4000 && beyond > 500, "{active}, {beyond}");
    // Ten times the horizon's moves: the standard bound is not what ends it.
    assert!(most < 100, "{most} changes");
}

/// Rows that depend on each other, with the same limits and with the same prices: the arm's are the pendulum's, or all
/// are the command's.
#[test]
fn dependent_limits_do_not_cycle() {
    let mut draws = Draws(4);
    let mut active = 0;
    for name in Rig::VOLTAGE {
        let rig = Rig::builtin(name).expect("built in");
        let frequency = Site::of(&rig, PERIOD).frequency();
        for mpc in tasks(&rig, 200.0) {
            let [command, pendulum, _, changes] = mpc.rows;
            let soft = furuta_ctrl::controllers::Rows {
                price: pendulum.price,
                ..command
            };
            for rows in [
                [command, pendulum, pendulum, changes],
                [command, command, command, changes],
                [command, soft, soft, changes],
                [soft, soft, pendulum, changes],
            ] {
                let mut mpc = mpc;
                mpc.rows = rows;
                let mut memory = mpc.start();
                for _ in 0..100 {
                    let (x, upright) = (draws.state(frequency), State::upright());
                    let u = mpc.update(&mut memory, &x, &upright, PERIOD);
                    assert!(u.abs() <= mpc.command_limit);
                    let report = memory.report();
                    assert!(
                        matches!(report.outcome, Outcome::Solved | Outcome::Regulator),
                        "{name}: {x:?}: {report:?}"
                    );
                    active += usize::from(report.outcome == Outcome::Solved);
                    let y = memory.multipliers(&mpc);
                    let missed = misses(
                        &mpc,
                        &mpc.problem(&memory, &x, &upright),
                        &memory.moves(),
                        &y,
                    );
                    assert!(
                        missed < 1e-10 * mpc.command_limit,
                        "{name}: {x:?}: {missed}"
                    );
                }
            }
        }
    }
    assert!(active > 1000, "{active}");
}

/// With one change allowed in a sample the bound is reached, said and counted; the command stays within its limit, and
/// later samples, which go on from there, come to the solution.
#[test]
fn a_bound_of_changes_is_kept_and_counted() {
    let rig = Rig::builtin("qube-servo-2").expect("built in");
    let [_, hasty] = tasks(&rig, 1.0);
    let [_, patient] = tasks(&rig, 100.0);
    let (x, upright) = (State::new(-0.8, 0.05, 0.0, 0.0), State::upright());
    let u = patient.update(&mut patient.start(), &x, &upright, PERIOD);
    let mut memory = hasty.start();
    let first = hasty.update(&mut memory, &x, &upright, PERIOD);
    assert_eq!(memory.report().outcome, Outcome::Bound);
    assert_eq!((memory.report().bounds, memory.report().changes), (1, 1));
    assert!(first.abs() <= hasty.command_limit);
    // Nothing of the solution is known yet: the regulator's command, cut off.
    let regulator = hasty.feedback().update(&mut (), &x, &upright, PERIOD);
    assert_eq!(first, regulator);
    let mut last = first;
    for _ in 0..50 {
        last = hasty.update(&mut memory, &x, &upright, PERIOD);
        assert!(last.abs() <= hasty.command_limit);
    }
    assert_eq!(memory.report().outcome, Outcome::Solved);
    assert!(
        (last - u).abs() < 1e-10 * hasty.command_limit,
        "{last} V, not {u} V"
    );
    assert!(memory.report().bounds >= 2);
}

/// The textbook's problem with every state and command of every sample a variable, their costs as the LQR has them and
/// its cost matrix at the end: nothing of [`Prediction`] but which samples move together. `change`: the command's
/// largest change in a sample, and the last command.
fn textbook(
    rig: &Rig,
    weights: &Weights<f64, 4, 1>,
    samples: usize,
    lean: f64,
    change: Option<(f64, f64)>,
    x0: &State<f64>,
) -> f64 {
    const M: usize = controllers::MOVES;
    let limit = rig.params.motor.command_limit;
    let linear = linearize(&rig.nominal_plant(), State::upright(), 0.0);
    let (a, b) = zero_order_hold(&linear.a, &linear.b, PERIOD);
    let regulator = dlqr(&a, &b, weights).expect("has a gain");
    let ends = Prediction::<4, M>::new(&b, &regulator, samples).ends;
    let starts: Vec<usize> = std::iter::once(0).chain(ends).take(M).collect();
    // x_0 .. x_L, u_0 .. u_{L-1}, v_0 .. v_{M-1}.
    let (first_u, first_v) = (4 * (samples + 1), 4 * (samples + 1) + samples);
    let n = first_v + M;
    let mut cost = (Vec::new(), Vec::new(), Vec::new());
    let mut upper = |i: usize, j: usize, value: f64| {
        if i <= j && value != 0.0 {
            cost.0.push(i);
            cost.1.push(j);
            cost.2.push(2.0 * value);
        }
    };
    for k in 0..=samples {
        let q = if k < samples {
            weights.q
        } else {
            regulator.cost
        };
        for i in 0..4 {
            for j in 0..4 {
                upper(4 * k + i, 4 * k + j, q[(i, j)]);
            }
        }
    }
    for k in 0..samples {
        upper(first_u + k, first_u + k, weights.r[0]);
    }
    let mut rows = (Vec::new(), Vec::new(), Vec::new());
    let mut bounds = Vec::new();
    let mut row = |entries: Vec<(usize, f64)>, bound: f64| {
        for (j, value) in entries {
            rows.0.push(bounds.len());
            rows.1.push(j);
            rows.2.push(value);
        }
        bounds.push(bound);
    };
    for (i, x) in x0.to_array().into_iter().enumerate() {
        row(vec![(i, 1.0)], x);
    }
    let mut stretch = 0;
    for k in 0..samples {
        if k >= ends[stretch] {
            stretch += 1;
        }
        for i in 0..4 {
            let mut entries: Vec<_> = (0..4).map(|j| (4 * k + j, a[(i, j)])).collect();
            entries.push((first_u + k, b[i]));
            entries.push((4 * (k + 1) + i, -1.0));
            row(entries, 0.0);
        }
        let mut entries: Vec<_> = (0..4).map(|j| (4 * k + j, regulator.gain[j])).collect();
        entries.push((first_u + k, 1.0));
        entries.push((first_v + stretch, -1.0));
        row(entries, 0.0);
    }
    let equalities = 4 + 5 * samples;
    for sign in [1.0, -1.0] {
        for k in &starts {
            row(vec![(first_u + k, sign)], limit);
        }
        for k in ends {
            row(vec![(4 * k + 1, sign)], lean);
        }
        if let Some((step, last)) = change {
            row(vec![(first_u, sign)], step + sign * last);
            for pair in starts.windows(2) {
                let between = (pair[1] - pair[0]) as f64;
                let entries = vec![(first_u + pair[1], sign), (first_u + pair[0], -sign)];
                row(entries, step * between);
            }
        }
    }
    let m = bounds.len();
    let square = CscMatrix::new_from_triplets(n, n, cost.0, cost.1, cost.2);
    let rows = CscMatrix::new_from_triplets(m, n, rows.0, rows.1, rows.2);
    let cones = [ZeroConeT(equalities), NonnegativeConeT(m - equalities)];
    let settings = DefaultSettingsBuilder::default()
        .verbose(false)
        .tol_gap_abs(1e-10)
        .tol_gap_rel(1e-10)
        .tol_feas(1e-10)
        .build()
        .expect("sound");
    let mut solver =
        DefaultSolver::new(&square, &vec![0.0; n], &rows, &bounds, &cones, settings).expect("fits");
    solver.solve();
    assert!(matches!(
        solver.solution.status,
        SolverStatus::Solved | SolverStatus::AlmostSolved
    ));
    solver.solution.x[first_u]
}

#[test]
fn the_problem_is_the_textbooks() {
    for name in ["qube-servo-2", "fong2014-emecs"] {
        let rig = Rig::builtin(name).expect("built in");
        let (samples, lean) = (150, 0.08);
        let limit = rig.params.motor.command_limit;
        let mut weights = balance_weights(&rig.params);
        weights.q[(0, 0)] = 16.0;
        let linear = linearize(&rig.nominal_plant(), State::upright(), 0.0);
        let bounds = Bounds {
            command: limit,
            pendulum: Some(lean),
            arm: None,
            rate: None,
        };
        let mpc = Mpc::<f64>::new(&linear, PERIOD, &weights, 0.3, &bounds, 1000).expect("a gain");
        let exact = InteriorPoint(mpc);
        for theta in [-0.9, -0.7, 0.6, 0.8] {
            let x = State::new(theta, 0.01, 0.1, 0.0);
            let expected = textbook(&rig, &weights, samples, lean, None, &x);
            let u = exact.update(&mut exact.start(), &x, &State::upright(), PERIOD);
            // Two interior-point solutions of unlike problems.
            assert!(
                (u - expected).abs() < 1e-5 * limit,
                "{name}: {u} V, not {expected} V"
            );
            let regulated = mpc.feedback().unlimited(&x, &State::upright());
            assert!(
                (u - regulated).abs() > 0.01 * limit,
                "{name}, {theta} rad: no limit is active"
            );
        }
    }
}

/// Where no limit is near, the command is the LQR's to the bit, and nothing is remembered of what was before.
#[test]
fn without_limits_it_is_the_regulator() {
    let mut draws = Draws(2);
    for name in Rig::VOLTAGE {
        let rig = Rig::builtin(name).expect("built in");
        for mpc in tasks(&rig, 30.0) {
            let mut memory = mpc.start();
            for _ in 0..50 {
                let x = draws.state(1.0);
                let far = State::new(3.0 * x.theta, x.alpha, x.theta_dot, x.alpha_dot);
                let _ = mpc.update(&mut memory, &far, &State::upright(), PERIOD);
                let near = x.map(|v| 1e-3 * v);
                let u = mpc.update(&mut memory, &near, &State::upright(), PERIOD);
                assert_eq!(u, mpc.feedback().unlimited(&near, &State::upright()));
                assert_eq!(memory.multipliers(&mpc), [[0.0; 12]; 4]);
                assert_eq!(memory.moves(), [0.0; 12]);
            }
        }
    }
}

/// A pendulum that starts where its limit can be kept keeps it on the nonlinear plant, and the arm stops before its own
/// limit.
#[test]
fn limits_are_kept() {
    for name in Rig::VOLTAGE {
        let rig = Rig::builtin(name).expect("built in");
        let study = Experiment::default().run(&rig).expect("possible");
        let figures = |c| {
            let found = study.runs.iter().find(|run| run.contender == c);
            found.expect("among them").figures
        };
        let [lqr, exact, active_set] = [
            Contender::Lqr,
            Contender::InteriorPoint,
            Contender::ActiveSet,
        ]
        .map(figures);
        assert!(lqr.alpha > 1.9 * study.pendulum, "{name}");
        for f in [exact, active_set] {
            assert!(f.up && f.settle.is_some(), "{name}: {f:?}");
            assert!(f.command <= study.command, "{name}: {f:?}");
            // Between the times that are looked at, and on a plant that is not linear, a little more.
            assert!(f.alpha < 1.06 * study.pendulum, "{name}: {f:?}");
        }
        // Warm, it is the solution, which the interior-point method comes near to.
        assert!(
            (active_set.alpha - exact.alpha).abs() < 1e-6 * exact.alpha,
            "{name}"
        );
        assert!(
            (active_set.cost - exact.cost).abs() < 1e-6 * exact.cost,
            "{name}"
        );
    }
}

#[test]
fn the_arm_does_not_pass_its_limit() {
    let rig = Rig::builtin("qube-servo-2").expect("built in");
    let settings = controllers::settings("mpc")
        .and_then(|s| s.with("arm_angle", &[0.4]).ok())
        .expect("in range");
    let mpc = Mpc::<f64>::design(&settings, &Site::of(&rig, PERIOD)).expect("suits it");
    let samples = furuta_design::closed_loop::ClosedLoop {
        plants: vec![(0.0, rig.nominal_plant().into())],
        start: State::upright(),
        period: PERIOD,
        substeps: 1,
        duration: 6.0,
        sensing: furuta_design::closed_loop::Sensing::Perfect,
    }
    // Beyond the limit is where it is asked to go.
    .run(&mpc, |_| State::new(0.6, 0.0, 0.0, 0.0));
    let furthest = samples.iter().map(|s| s.x.theta).fold(0.0, f64::max);
    let last = samples.last().expect("some").x;
    assert!(furthest < 0.41, "{furthest} rad");
    assert!(
        (last.theta - 0.4).abs() < 0.01 && last.alpha.abs() < 0.01,
        "{last:?}"
    );
}

/// A state with anything in it gives a command, and a sound one follows.
#[test]
fn anything_is_answered() {
    let mpc = tasks(&Rig::builtin("qube-servo-2").expect("built in"), 30.0)[0];
    let exact = InteriorPoint(mpc);
    let mut memory = mpc.start();
    for bad in [
        f64::NAN,
        f64::INFINITY,
        f64::NEG_INFINITY,
        1e300,
        -1e30,
        1e5,
    ] {
        for i in 0..4 {
            let mut x = [0.5, 0.1, 0.0, 0.0];
            x[i] = bad;
            let (x, upright) = (State::from(x), State::upright());
            let sound = State::new(0.3, 0.02, 0.0, 0.0);
            for (at, reference) in [(x, upright), (sound, x), (x, x)] {
                for u in [
                    mpc.update(&mut memory, &at, &reference, PERIOD),
                    exact.update(&mut exact.start(), &at, &reference, PERIOD),
                ] {
                    assert!(u.abs() <= mpc.command_limit, "{at:?} {reference:?}: {u} V");
                }
            }
            let near = State::new(0.01, 0.01, 0.0, 0.0);
            let u = mpc.update(&mut memory, &near, &upright, PERIOD);
            assert_eq!(u, mpc.feedback().unlimited(&near, &upright));
        }
    }
}
