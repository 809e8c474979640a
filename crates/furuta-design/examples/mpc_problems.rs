//! The problems of model predictive control over a run, with what this project's solver finds and how long it takes,
//! as JSON: what `py/bench/mpc.py` hands to other solvers.
//!
//! `cargo run --release -p furuta-design --example mpc_problems -- RIG [RATE] > problems.json`; RATE limits the
//! command's rate, V/s.

use std::fmt::Write;
use std::time::Instant;

use furuta_ctrl::Site;
use furuta_ctrl::controllers::{self, Controller, Design, LIMITED, MOVES, Mpc, MpcState};
use furuta_model::{Rig, State};
use nalgebra::SMatrix;

const PERIOD: f64 = 0.002;
const SAMPLES: usize = 4000;
/// Each sample's time is the shortest of this number of runs: what the operating system does meanwhile is not counted.
const RUNS: usize = 15;

/// What was used before: 30 steps of ADMM (`rho` = 1, over-relaxation 1.6) that go on from sample to sample.
struct Admm {
    inverse: [[f64; MOVES]; MOVES],
    moves: [f64; MOVES],
    multipliers: [[f64; MOVES]; LIMITED],
}

impl Admm {
    fn new(mpc: &Mpc<f64>) -> Self {
        let mut normal = SMatrix::<f64, MOVES, MOVES>::identity();
        for row in mpc.rows.iter().flat_map(|r| r.forced) {
            normal += SMatrix::from_fn(|i, j| row[i] * row[j]);
        }
        let inverse = normal.try_inverse().expect("positive definite");
        Self {
            inverse: std::array::from_fn(|i| std::array::from_fn(|j| inverse[(i, j)])),
            moves: [0.0; MOVES],
            multipliers: [[0.0; MOVES]; LIMITED],
        }
    }

    fn update(
        &mut self,
        mpc: &Mpc<f64>,
        memory: &MpcState<f64>,
        x: &State<f64>,
        reference: &State<f64>,
    ) -> f64 {
        let feedback = mpc.feedback().unlimited(x, reference);
        let problem = mpc.problem(memory, x, reference);
        let kept = |[free, low, high]: &[[f64; MOVES]; 3]| {
            (0..MOVES).all(|i| free[i] >= low[i] && free[i] <= high[i])
        };
        let limit = mpc.command_limit;
        if problem.iter().all(kept) {
            self.moves = [0.0; MOVES];
            self.multipliers = [[0.0; MOVES]; LIMITED];
            return feedback.clamp(-limit, limit);
        }
        let mut before: Option<[[f64; MOVES]; LIMITED]> = None;
        for _ in 0..30 {
            let mut inside = [[0.0; MOVES]; LIMITED];
            let mut pull = [0.0; MOVES];
            for (k, rows) in mpc.rows.iter().enumerate() {
                let [free, lowest, highest] = &problem[k];
                let mut values = *free;
                add_rows(&mut values, &rows.by_move, &self.moves);
                let mut targets = [0.0; MOVES];
                for i in 0..MOVES {
                    let value = match &before {
                        Some(before) => 1.6 * values[i] - 0.6 * before[k][i],
                        None => values[i],
                    };
                    let wanted = value + self.multipliers[k][i];
                    let excess = wanted - wanted.max(lowest[i]).min(highest[i]);
                    let multiplier = excess.max(-rows.price[i]).min(rows.price[i]);
                    self.multipliers[k][i] = multiplier;
                    inside[k][i] = wanted - multiplier;
                    targets[i] = inside[k][i] - free[i] - multiplier;
                }
                add_rows(&mut pull, &rows.forced, &targets);
            }
            let mut moves = [0.0; MOVES];
            add_rows(&mut moves, &self.inverse, &pull);
            self.moves = moves;
            before = Some(inside);
        }
        (feedback + mpc.first * self.moves[0]).clamp(-limit, limit)
    }
}

fn add_rows(out: &mut [f64; MOVES], rows: &[[f64; MOVES]; MOVES], x: &[f64; MOVES]) {
    for (row, x) in rows.iter().zip(x) {
        for (out, a) in out.iter_mut().zip(row) {
            *out += *a * *x;
        }
    }
}

/// The arm is sent to and fro, and kicked.
fn run(rig: &Rig, mpc: &Mpc<f64>) -> Vec<(State<f64>, State<f64>)> {
    let plant = rig.nominal_plant::<f64>();
    let mut mechanics = plant.rest(State::upright());
    let mut memory = mpc.start();
    let mut seen = Vec::new();
    for k in 0..SAMPLES {
        let reference = State::new(if k / 500 % 2 == 0 { 0.5 } else { -0.5 }, 0.0, 0.0, 0.0);
        if k % 700 == 350 {
            mechanics.x.alpha_dot += 0.3;
        }
        let x = mechanics.x;
        seen.push((x, reference));
        let u = mpc.update(&mut memory, &x, &reference, PERIOD);
        plant.step(&mut mechanics, u, PERIOD);
    }
    seen
}

fn main() {
    let mut words = std::env::args().skip(1);
    let name = words.next();
    let name = name.as_deref().unwrap_or("qube-servo-2");
    let rig = Rig::builtin(name).expect("a built-in rig");
    let site = Site::of(&rig, PERIOD);
    let u = site.command_limit;
    let settings = controllers::settings("mpc")
        .and_then(|s| s.with("q", &[16.0, 4.0, 0.0, 0.0]).ok())
        .and_then(|s| s.with("r", &[1.0 / (u * u)]).ok())
        .and_then(|s| s.with("pendulum_angle", &[0.1]).ok())
        .and_then(|s| s.with("arm_angle", &[0.6]).ok())
        .expect("in range");
    // The command's rate may be limited, V/s.
    let settings = match words.next() {
        Some(rate) => settings
            .with("command_rate", &[rate.parse().expect("a rate in V/s")])
            .expect("in range"),
        None => settings,
    };
    let mpc = Mpc::<f64>::design(&settings, &site).expect("suits it");
    let seen = run(&rig, &mpc);
    let (mut fast, mut slow) = (vec![f64::MAX; SAMPLES], vec![f64::MAX; SAMPLES]);
    let mut samples = Vec::new();
    for round in 0..RUNS {
        let mut memory = mpc.start();
        let mut admm = Admm::new(&mpc);
        for (k, (x, reference)) in seen.iter().enumerate() {
            let before = memory;
            let from = Instant::now();
            let u = std::hint::black_box(mpc.update(&mut memory, x, reference, PERIOD));
            fast[k] = fast[k].min(from.elapsed().as_secs_f64());
            if round == 0 {
                let asked = mpc.problem(&before, x, reference);
                samples.push((u, memory, asked, before));
            }
        }
        for (k, (x, reference)) in seen.iter().enumerate() {
            let from = Instant::now();
            std::hint::black_box(admm.update(&mpc, &samples[k].3, x, reference));
            slow[k] = slow[k].min(from.elapsed().as_secs_f64());
        }
    }
    let floor = (0..1000)
        .map(|_| Instant::now().elapsed().as_secs_f64())
        .fold(f64::MAX, f64::min);
    let limited = |k: usize| mpc.rows[k].is_limited();
    let mut out = format!(
        "{{\"rig\":\"{name}\",\"floor\":{floor:e},\"first\":{:e},",
        mpc.first
    );
    let list = |numbers: &mut dyn Iterator<Item = f64>| {
        let numbers: Vec<_> = numbers.map(|x| format!("{x:e}")).collect();
        format!("[{}]", numbers.join(","))
    };
    let groups: Vec<usize> = (0..LIMITED).filter(|k| limited(*k)).collect();
    let rows: Vec<String> = groups
        .iter()
        .flat_map(|k| mpc.rows[*k].forced)
        .map(|row| list(&mut row.into_iter()))
        .collect();
    let prices = groups.iter().flat_map(|k| mpc.rows[*k].price);
    let prices = list(&mut prices.map(|p| if p.is_finite() { p } else { -1.0 }));
    // For solvers that take the model itself.
    let (a, b) = site.upright().expect("has a model");
    let _ = write!(
        out,
        "\"a\":{},\"b\":{},\"q\":[16,4,0,0],\"r\":{:e},\"command_limit\":{u:e},\"pendulum_limit\":0.1,",
        list(&mut a.transpose().iter().copied()),
        list(&mut b.iter().copied()),
        1.0 / (u * u),
    );
    let _ = write!(
        out,
        "\"rows\":[{}],\"prices\":{prices},\"samples\":[",
        rows.join(",")
    );
    let mut admm = Admm::new(&mpc);
    for (k, (u, memory, asked, before)) in samples.iter().enumerate() {
        let bound = |side: usize| {
            let each = groups.iter().map(|g| asked[*g]);
            list(&mut each.flat_map(|a| (0..MOVES).map(move |i| a[side][i] - a[0][i])))
        };
        let y = memory.multipliers(&mpc);
        let before = admm.update(&mpc, before, &seen[k].0, &seen[k].1);
        let report = memory.report();
        let _ = write!(
            out,
            "{}{{\"x\":{},\"reference\":{},\"u\":{u:e},\"lower\":{},\"upper\":{},\"w\":{},\"y\":{},\"s\":{:e},\"changes\":{},\"active\":{},\
             \"admm_u\":{before:e},\"admm_s\":{:e}}}",
            if k > 0 { "," } else { "" },
            list(&mut seen[k].0.to_array().into_iter()),
            list(&mut seen[k].1.to_array().into_iter()),
            bound(1),
            bound(2),
            list(&mut memory.moves().into_iter()),
            list(&mut groups.iter().flat_map(|g| y[*g])),
            fast[k],
            report.changes,
            report.active,
            slow[k],
        );
    }
    println!("{out}]}}");
}
