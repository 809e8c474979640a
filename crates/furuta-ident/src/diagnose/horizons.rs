//! What long windows say of a model that short ones leave incomplete: what else is missing, and with which parameters
//! whole runs are predicted best.

use super::additions::Trial;
use super::hypothesis::Hypothesis;
use super::predict;
use super::savers::Savers;
use super::search::Search;
use super::{Fit, LONG, REPORT};
use crate::shooting::{Data, Effort, Problem, Run, Window};
use crate::stop::Stop;

/// Horizons by which an incomplete model is led to whole runs, s.
const LADDER: [f64; 4] = [1.0, LONG, 5.0, 10.0];

/// Windows for judging an incomplete model: `seconds` long where the plant is stable, short elsewhere.
pub(super) fn long_windows(data: &Data, seconds: f64) -> Vec<Window> {
    let mut windows = data.windows(seconds, Run::hangs);
    windows.extend(data.windows(REPORT, |r| !r.hangs()));
    windows
}

/// A fit from windows whose initial states are not yet known.
pub(super) fn fitted(problem: &Problem<'_>, h: &Hypothesis, z: &[f64]) -> Fit {
    let start = problem.solve_states(h, z, None);
    problem.fit(h, z.to_vec(), &start.states, Effort::FULL)
}

/// Looks for what matters over long windows; a name is kept only if it helps over short ones as well.
pub(super) fn search(
    short: &Problem<'_>,
    data: &Data,
    named: Fit,
    savers: &'static Savers,
    report: &(dyn Fn(&str) + Sync),
) -> Fit {
    if !data.runs.iter().any(Run::hangs) {
        return named;
    }
    let long = Problem::new(data, long_windows(data, LONG)).until(short.stop);
    let start = fitted(&long, &named.model, &named.z);
    let helps_at_short = |t: &Trial| {
        let h = t.fit.model.without(t.spec.id);
        let z = t.fit.model.reduced(&t.fit.z, t.spec.id);
        let smaller = short.fit(&h, z, &named.states, Effort::FULL);
        let h = &t.fit.model;
        let larger = short.fit(h, t.fit.z.clone(), &smaller.states, Effort::FULL);
        short.evidence(&smaller, &larger).helps()
    };
    let found = Search::new(&long, start, &helps_at_short, savers, report).run();
    if found.model.effects.len() == named.model.effects.len() {
        return named;
    }
    short.fit(&found.model, found.z.clone(), &named.states, Effort::FULL)
}

/// The parameters to be used: from half-second windows for a model that explains the data. For one that does not, what
/// it lacks pulls the parameters of each horizon elsewhere: of those led to longer and longer windows, those that
/// predict whole runs best, and deviations that hold how far they were pulled. In a hurry, those at hand.
pub(super) fn finish(data: &Data, fit: &Fit, explained: bool, stop: Stop<'_>) -> Fit {
    if stop.wanted() {
        return fit.clone();
    }
    let h = &fit.model;
    let refit = |last: &Fit, seconds: f64| {
        let problem = Problem::new(data, long_windows(data, seconds)).until(stop);
        fitted(&problem, h, &last.z)
    };
    let mut last = refit(fit, REPORT);
    if explained || !data.runs.iter().any(Run::hangs) {
        return last;
    }
    let mut best = (predict::open_loop(data, &last), last.clone());
    let mut values = vec![last.z.clone()];
    for seconds in LADDER {
        if stop.wanted() {
            break;
        }
        last = refit(&last, seconds);
        values.push(last.z.clone());
        let error = predict::open_loop(data, &last);
        if error < best.0 {
            best = (error, last.clone());
        }
    }
    let mut best = best.1;
    for (i, moved) in scatter(&values).into_iter().enumerate() {
        for std in [&mut best.std[i], &mut best.std_by_itself[i]] {
            *std = std.hypot(moved);
        }
    }
    best
}

/// Standard deviation of each number over fits.
fn scatter(fits: &[Vec<f64>]) -> Vec<f64> {
    let count = fits.len() as f64;
    let of = |i: usize| {
        let mean = fits.iter().map(|z| z[i]).sum::<f64>() / count;
        let squares = fits.iter().map(|z| (z[i] - mean).powi(2)).sum::<f64>();
        (squares / (count - 1.0).max(1.0)).sqrt()
    };
    (0..fits.first().map_or(0, Vec::len)).map(of).collect()
}
