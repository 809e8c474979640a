//! Model predictive control solved to the end in each sample, by an interior-point method.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettings, DefaultSettingsBuilder, DefaultSolver, IPSolver, NonnegativeConeT,
    SolverStatus,
};
use furuta_ctrl::controllers::{Controller, Mpc, MpcState, StateFeedback};
use furuta_ctrl::reference::Ahead;
use furuta_model::State;

/// The problem of [`Mpc`], solved by Clarabel: what the active-set method is judged by. Allocates; for a host.
///
/// (P. J. Goulart, Y. Chen, *Clarabel: an interior-point solver for conic programs with quadratic objectives*, 2024.)
///
/// ```
/// use furuta_ctrl::Site;
/// use furuta_ctrl::controllers::{self, Controller, Design, Mpc};
/// use furuta_design::mpc::InteriorPoint;
/// use furuta_model::{Rig, State};
/// let rig = Rig::builtin("qube-servo-2").ok_or("no such rig")?;
/// let settings = controllers::settings("mpc").ok_or("no such controller")?;
/// let settings = settings.with("pendulum_angle", &[0.05])?;
/// let mpc = Mpc::design(&settings, &Site::of(&rig, 0.002))?;
/// let far = State::new(1.5, 0.0, 0.0, 0.0);
/// let u = mpc.update(&mut mpc.start(), &far, &State::upright(), 0.002);
/// let exact = InteriorPoint(mpc);
/// let exact = exact.update(&mut exact.start(), &far, &State::upright(), 0.002);
/// assert!((u - exact).abs() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct InteriorPoint<const M: usize>(pub Mpc<f64, M>);

impl<const M: usize> InteriorPoint<M> {
    /// The scaled moves, or `None` where there are none: a state that is not finite, numbers beyond reason.
    #[must_use]
    pub fn moves(
        &self,
        memory: &MpcState<f64, M>,
        x: &State<f64>,
        reference: &impl Ahead<f64>,
    ) -> Option<[f64; M]> {
        let problem = self.0.problem(memory, x, reference);
        let mut build = Triplets::default();
        let mut cost = vec![0.0; M];
        for (k, [free, lowest, highest]) in problem.iter().enumerate() {
            let rows = &self.0.rows[k];
            if !rows.limit.is_finite() {
                continue;
            }
            for i in 0..M {
                // A limit at a price has a slack of its own, which costs it.
                let price = rows.price[i];
                let slack = price.is_finite().then(|| {
                    cost.push(price);
                    cost.len() - 1
                });
                for (sign, bound) in [(1.0, highest[i] - free[i]), (-1.0, free[i] - lowest[i])] {
                    let row = rows.forced[i]
                        .iter()
                        .enumerate()
                        .map(|(j, f)| (j, sign * f));
                    build.row(row.chain(slack.map(|s| (s, -1.0))), bound);
                }
                if let Some(s) = slack {
                    build.row([(s, -1.0)], 0.0);
                }
            }
        }
        if !build.bounds.iter().all(|b| b.is_finite()) {
            return None;
        }
        let n = cost.len();
        let square =
            CscMatrix::new_from_triplets(n, n, (0..M).collect(), (0..M).collect(), vec![1.0; M]);
        let m = build.bounds.len();
        let rows = CscMatrix::new_from_triplets(m, n, build.i, build.j, build.values);
        let cones = [NonnegativeConeT(m)];
        let mut solver =
            DefaultSolver::new(&square, &cost, &rows, &build.bounds, &cones, settings()?).ok()?;
        solver.solve();
        let solved = matches!(
            solver.solution.status,
            SolverStatus::Solved | SolverStatus::AlmostSolved
        );
        let moves = solver.solution.x.get(..M)?.try_into().ok()?;
        solved.then_some(moves)
    }
}

/// Silent, and to ten digits: it is the measure of another solver.
pub(crate) fn settings() -> Option<DefaultSettings<f64>> {
    DefaultSettingsBuilder::default()
        .verbose(false)
        .tol_gap_abs(1e-10)
        .tol_gap_rel(1e-10)
        .tol_feas(1e-10)
        .build()
        .ok()
}

/// A sparse matrix row by row, with the right-hand sides.
#[derive(Default)]
struct Triplets {
    i: Vec<usize>,
    j: Vec<usize>,
    values: Vec<f64>,
    bounds: Vec<f64>,
}

impl Triplets {
    fn row(&mut self, entries: impl IntoIterator<Item = (usize, f64)>, bound: f64) {
        for (j, value) in entries {
            self.i.push(self.bounds.len());
            self.j.push(j);
            self.values.push(value);
        }
        self.bounds.push(bound);
    }
}

impl<const M: usize> Controller<f64> for InteriorPoint<M> {
    type State = MpcState<f64, M>;

    fn start(&self) -> Self::State {
        self.0.start()
    }

    fn take_over(&self, x: &State<f64>, reference: &State<f64>, u: f64) -> Self::State {
        self.0.take_over(x, reference, u)
    }

    fn update(&self, memory: &mut Self::State, x: &State<f64>, r: &State<f64>, h: f64) -> f64 {
        self.update_ahead(memory, x, r, h)
    }

    fn update_ahead(
        &self,
        memory: &mut Self::State,
        x: &State<f64>,
        reference: &impl Ahead<f64>,
        _: f64,
    ) -> f64 {
        let moves = self.moves(memory, x, reference);
        let first = moves.map_or(0.0, |moves| self.0.first * moves[0]);
        let u = self.0.unlimited(memory, x, reference) + first;
        self.0.limited(memory, u)
    }

    fn surrogate(&self) -> Option<StateFeedback<f64>> {
        Some(self.0.feedback())
    }
}
