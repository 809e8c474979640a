//! The quadratic program of one iteration: everything linear about the present course, a step within a trust region.

use super::course::{Course, Limits};
use super::model::Step;
use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettingsBuilder, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus, ZeroConeT,
};
use nalgebra::{SMatrix, SVector};

/// What is minimised: `haste T/unit + effort/N sum (u/u_max)^2 + smooth sum (du/u_max)^2 + price sum |defects|`.
#[derive(Copy, Clone, Debug)]
pub(super) struct Objective {
    /// Weight of the time, and its unit, s.
    pub(super) haste: f64,
    pub(super) unit: f64,
    pub(super) effort: f64,
    pub(super) smooth: f64,
    /// Of a defect, in units of the state's scale.
    pub(super) price: f64,
    /// Scale of the states.
    pub(super) scale: SVector<f64, 4>,
    /// V.
    pub(super) command: f64,
}

impl Objective {
    /// Without the defects.
    pub(super) fn cost(&self, course: &Course) -> f64 {
        let n = course.u.len() as f64;
        let effort: f64 = course.u.iter().map(|u| (u / self.command).powi(2)).sum();
        let change: f64 = course
            .u
            .windows(2)
            .map(|pair| ((pair[1] - pair[0]) / self.command).powi(2))
            .sum();
        self.haste * course.time / self.unit + self.effort / n * effort + self.smooth * change
    }

    /// The sum of these defects, scaled.
    pub(super) fn size(&self, defects: &[SVector<f64, 4>]) -> f64 {
        defects
            .iter()
            .map(|d| d.component_div(&self.scale).abs().sum())
            .sum()
    }
}

/// A step, and what the linear model promises of it.
pub(super) struct Answer {
    pub(super) course: Course,
    /// Cost, curvature and price of the defects that remain in the linear model.
    pub(super) promised: f64,
    /// What remains of the defects in the linear model, scaled, all together.
    pub(super) left: f64,
    /// Multipliers of the scaled equations of motion, an interval a vector.
    pub(super) multipliers: Vec<SVector<f64, 4>>,
}

/// What the quadratic program is made of, at the present course.
pub(super) struct Linearised<'a> {
    pub(super) course: &'a Course,
    /// Where its intervals end, with derivatives.
    pub(super) steps: &'a [Step],
    /// Second derivatives of the equations of motion times their multipliers, by scaled state, command and time of each
    /// interval, made positive semidefinite.
    pub(super) curvature: &'a [SMatrix<f64, 6, 6>],
}

/// Rows of `A z + s = b`.
#[derive(Default)]
struct Rows {
    i: Vec<usize>,
    j: Vec<usize>,
    v: Vec<f64>,
    b: Vec<f64>,
}

impl Rows {
    fn push(&mut self, entries: impl IntoIterator<Item = (usize, f64)>, bound: f64) {
        for (j, v) in entries {
            if v != 0.0 {
                self.i.push(self.b.len());
                self.j.push(j);
                self.v.push(v);
            }
        }
        self.b.push(bound);
    }
}

/// Solves for the best step; no scaled state, command or time moves by more than `radius`. `correction` is what the
/// equations of motion miss at the step found before (Maratos).
pub(super) fn solve(
    at: &Linearised<'_>,
    limits: &Limits,
    objective: &Objective,
    radius: f64,
    correction: Option<&[SVector<f64, 4>]>,
) -> Option<Answer> {
    let course = at.course;
    let n = course.u.len();
    let share = 1.0 / n as f64;
    // Unknowns, all scaled: steps of the states 1..=N, of the commands, of the time; what is left of the defects.
    let state = |k: usize, i: usize| 4 * (k - 1) + i;
    let command = |k: usize| 4 * n + k;
    let time = 5 * n;
    let over = |k: usize, i: usize| 5 * n + 1 + 8 * k + i;
    let under = |k: usize, i: usize| over(k, i) + 4;
    let unknowns = 13 * n + 1;
    let (scale, volts, unit) = (&objective.scale, objective.command, objective.unit);

    let mut linear = vec![0.0; unknowns];
    let (mut pi, mut pj, mut pv) = (Vec::new(), Vec::new(), Vec::new());
    let mut square = |i: usize, j: usize, v: f64| {
        pi.push(i);
        pj.push(j);
        pv.push(v);
    };
    linear[time] = objective.haste;
    for k in 0..n {
        let u = course.u[k] / volts;
        let mut diagonal = 2.0 * objective.effort * share;
        linear[command(k)] = 2.0 * objective.effort * share * u;
        for neighbour in [k.checked_sub(1), (k + 1 < n).then_some(k + 1)]
            .into_iter()
            .flatten()
        {
            diagonal += 2.0 * objective.smooth;
            linear[command(k)] += 2.0 * objective.smooth * (u - course.u[neighbour] / volts);
        }
        if k + 1 < n {
            square(command(k), command(k + 1), -2.0 * objective.smooth);
        }
        square(command(k), command(k), diagonal);
        if let Some(h) = at.curvature.get(k) {
            let place = |a: usize| match a {
                4 => Some(command(k)),
                5 => Some(time),
                i => (k > 0).then(|| state(k, i)),
            };
            for a in 0..6 {
                for b in a..6 {
                    if let (Some(i), Some(j)) = (place(a), place(b)) {
                        square(i.min(j), i.max(j), h[(a, b)]);
                    }
                }
            }
        }
        for i in 0..4 {
            linear[over(k, i)] = objective.price;
            linear[under(k, i)] = objective.price;
        }
    }

    let mut rows = Rows::default();
    for (k, step) in at.steps.iter().enumerate() {
        let mut defect = step.x - course.x[k + 1];
        if let Some(missed) = correction {
            defect += missed[k];
        }
        for i in 0..4 {
            let s = 1.0 / scale[i];
            let before =
                (k > 0).then(|| (0..4).map(move |j| (state(k, j), step.a[(i, j)] * scale[j] * s)));
            let entries = before.into_iter().flatten().chain([
                (state(k + 1, i), -1.0),
                (command(k), step.b[i] * volts * s),
                (time, step.c[i] * share * unit * s),
                (over(k, i), -1.0),
                (under(k, i), 1.0),
            ]);
            rows.push(entries, -defect[i] * s);
        }
    }
    // The end stays where it is, but for the arm's angle.
    for i in 1..4 {
        rows.push([(state(n, i), 1.0)], 0.0);
    }
    let equalities = rows.b.len();
    let mut within = |unknown: usize, scale: f64, now: f64, [lowest, highest]: [f64; 2]| {
        rows.push(
            [(unknown, 1.0)],
            ((highest - now) / scale).min(radius).max(0.0),
        );
        rows.push(
            [(unknown, -1.0)],
            ((now - lowest) / scale).min(radius).max(0.0),
        );
    };
    for k in 1..=n {
        let x = &course.x[k];
        let last = k == n;
        for i in 0..if last { 1 } else { 4 } {
            let far = limits.state[i];
            within(
                state(k, i),
                scale[i],
                x[i],
                if i == 1 { [-1e3, 1e3] } else { [-far, far] },
            );
        }
    }
    for k in 0..n {
        within(
            command(k),
            volts,
            course.u[k],
            [-limits.command, limits.command],
        );
    }
    within(time, unit, course.time, limits.time);
    for unknown in time + 1..unknowns {
        rows.push([(unknown, -1.0)], 0.0);
    }

    let quadratic = CscMatrix::new_from_triplets(unknowns, unknowns, pi, pj, pv);
    let m = rows.b.len();
    let matrix = CscMatrix::new_from_triplets(m, unknowns, rows.i, rows.j, rows.v);
    let settings = DefaultSettingsBuilder::default()
        .verbose(false)
        .max_iter(60)
        .tol_gap_abs(1e-9)
        .tol_gap_rel(1e-9)
        .tol_feas(1e-10)
        .build()
        .ok()?;
    let cones = [ZeroConeT(equalities), NonnegativeConeT(m - equalities)];
    let mut solver =
        DefaultSolver::new(&quadratic, &linear, &matrix, &rows.b, &cones, settings).ok()?;
    solver.solve();
    let solution = &solver.solution;
    let solved = matches!(
        solution.status,
        SolverStatus::Solved | SolverStatus::AlmostSolved | SolverStatus::MaxIterations
    );
    if !solved || !solution.x.iter().all(|z| z.is_finite()) {
        return None;
    }
    let z = &solution.x;
    let mut next = course.clone();
    for k in 1..=n {
        for i in 0..4 {
            next.x[k][i] += z[state(k, i)] * scale[i];
        }
    }
    for k in 0..n {
        next.u[k] = (next.u[k] + z[command(k)] * volts).clamp(-limits.command, limits.command);
    }
    next.time += z[time] * unit;
    let left: f64 = z[time + 1..].iter().map(|z| z.max(0.0)).sum();
    let mut bent = 0.0;
    for (k, h) in at.curvature.iter().enumerate() {
        let step = SVector::<f64, 6>::from_fn(|a, _| match a {
            4 => z[command(k)],
            5 => z[time],
            i if k > 0 => z[state(k, i)],
            _ => 0.0,
        });
        bent += 0.5 * step.dot(&(h * step));
    }
    let multipliers = (0..n)
        .map(|k| SVector::from_fn(|i, _| solution.z[4 * k + i]))
        .collect();
    Some(Answer {
        promised: objective.cost(&next) + bent + objective.price * left,
        course: next,
        left,
        multipliers,
    })
}
