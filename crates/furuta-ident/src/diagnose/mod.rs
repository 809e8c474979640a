//! Finds where model and data disagree, and names what is missing.
//!
//! 1. The noise floor is estimated from the encoders themselves (`crate::shooting`), so that "explained" is an absolute
//!    statement.
//! 2. The model is fitted by multiple shooting over short windows (`crate::shooting`): first its parameters alone, in
//!    the combinations that data can show (`hypothesis`), then with each effect of the catalogue added, the most
//!    convincing one kept, until none is left (`search`). What the usual effects leave is looked at again with those
//!    that few rigs have (`find`).
//! 3. What short windows leave unexplained is looked at again over long ones: a name must help at both.
//! 4. Where something is left, the named effects are judged (`judge`): on data they were not fitted to (`held_out`),
//!    against what few rigs have (`contested`), as transients (`transients`), by whether their strength is the same
//!    everywhere (`constancy`). Their rivals are listed.
//! 5. The repaired model goes back into a rig file (`repair`), and whole recordings are predicted with it (`predict`).

mod additions;
mod alike;
mod answer;
mod apart;
mod asked;
mod bounds;
mod candidates;
mod compare;
mod constancy;
mod contested;
mod criteria;
mod custom;
mod deadlines;
mod evidence;
mod expression;
mod filtered;
mod find;
mod gap;
mod held_out;
mod horizons;
mod hypothesis;
mod jitter;
mod judge;
mod limits;
mod location;
mod naming;
mod parts;
mod plan;
mod predict;
mod progress;
mod repair;
mod request;
pub mod result;
mod savers;
mod screen;
mod search;
mod starts;
mod stretch;
mod subset;
#[cfg(test)]
mod sweep;
mod torque;
mod transients;
mod verify;
mod within;

use std::sync::Arc;
use std::time::Instant;

pub use candidates::candidates;
pub use parts::Parts;
pub use progress::{Progress, STAGES};
pub use request::{Options, Outcome, Request};
pub use result::{Channel, Channels, Curves, Diagnosis, Part, Verdict};
pub use within::samples_looked_at;

use crate::insufficient::{self, Insufficient};
use crate::recording::{Recording, each_once};
use crate::shooting::{self, Problem};
use apart::Apart;
use deadlines::Deadlines;
use find::Work;
use hypothesis::{Hypothesis, Sheet};
use progress::Teller;
use result::LeftOut;
use stretch::Stretch;

/// A fitted hypothesis.
type Fit = shooting::Fit<Hypothesis>;

/// Length of the windows of the search, s.
const SEARCH: f64 = 0.25;
/// Length of the windows whose prediction errors are reported, s.
const REPORT: f64 = 0.5;
/// Length of the windows on which a name must hold as well, where the plant is stable, s.
const LONG: f64 = 2.0;
/// Of each worker thread, bytes.
const STACK: usize = 16 << 20;

/// Names what the model of a rig is missing.
///
/// The same input gives the same output, whatever the number of threads. `progress` is called from several threads.
///
/// ```
/// use furuta_ident::diagnose::{Request, Verdict, diagnose};
/// use furuta_ident::recording::Recording;
/// use furuta_model::{Effect, Plant, Rig, State};
///
/// // A rig with a hidden cable, recorded for six seconds by its encoders.
/// let rig = Rig::builtin("qube-servo-2").expect("built in");
/// let cable = Effect::new("arm.spring", &[2e-3, 0.2]).expect("valid");
/// let plant: Plant<f64> = Plant::new(&rig.params, &[cable]).expect("one effect");
/// let mut x = plant.rest(State::hanging());
/// let mut samples = Vec::new();
/// for k in 0..3000 {
///     let t = f64::from(k) * 0.002;
///     let u = 1.5 * (3.0 * t * (1.0 + t)).sin();
///     let [theta, alpha] = rig.sensors.quantised(plant.measure(&x));
///     samples.push([t, u, theta, alpha]);
///     plant.step(&mut x, u, 0.002);
/// }
/// let (recording, _) = Recording::from_samples("sweep", samples)?;
/// let outcome = diagnose(&Request { recordings: &[recording], rig: &rig, verify: &[] }, &|_| ())?;
/// assert_eq!(outcome.diagnosis.verdict, Verdict::MissingEffects);
/// assert_eq!(outcome.diagnosis.effects[0].id, "arm.spring");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`Insufficient`] where the recordings cannot carry a diagnosis: none, too short, nothing moves.
pub fn diagnose(
    request: &Request<'_>,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Outcome, Insufficient> {
    diagnose_with(request, Options::default(), progress)
}

/// As [`diagnose`], with [`Options`].
///
/// # Errors
/// As [`diagnose`].
pub fn diagnose_with(
    request: &Request<'_>,
    options: Options<'_>,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Outcome, Insufficient> {
    each_once(request.recordings.iter().chain(options.compare))?;
    let (here, there) = (
        within::within(request.recordings, &options),
        within::within(options.compare, &options),
    );
    let request = &Request {
        recordings: here.as_ref().map_or(request.recordings, |(used, _)| used),
        ..*request
    };
    let options = Options {
        compare: there.as_ref().map_or(options.compare, |(used, _)| used),
        ..options
    };
    // Workers that wait for others take up further jobs on the same stack.
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(rayon::current_num_threads())
        .stack_size(STACK)
        .build();
    let work = || {
        let here = in_stretches(request, options, progress)?;
        if options.compare.is_empty() || here.outcome.diagnosis.interrupted {
            return Ok(here.outcome);
        }
        compare::with_another_state(request, here, options, progress)
    };
    let mut outcome = match pool {
        Ok(pool) => pool.install(work),
        Err(_) => work(),
    }?;
    let here = here.map(|(_, said)| said);
    let there = there.map(|(_, said)| format!("in the other state {said}"));
    outcome
        .diagnosis
        .notices
        .splice(0..0, here.into_iter().chain(there));
    Ok(outcome)
}

/// What a search came to, and what it looked at where a stretch was left out.
struct Looked {
    outcome: Outcome,
    rest: Option<Vec<Recording>>,
}

/// A search over everything; or, where something else happened in a stretch of one recording, over the rest.
fn in_stretches(
    request: &Request<'_>,
    options: Options<'_>,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Looked, Insufficient> {
    let begin = Instant::now();
    let teller = Teller::new(progress);
    let (mut rest, mut left_out) = (None, None);
    let mut outcome = loop {
        let left = options
            .time_limit
            .map(|t| t.saturating_sub(begin.elapsed()));
        let options = Options {
            time_limit: left,
            ..options
        };
        let recordings = rest.as_deref().unwrap_or(request.recordings);
        let request = Request {
            recordings,
            ..*request
        };
        match search(&request, options, &teller, left_out.is_none())? {
            Answer::Outcome(outcome) => break *outcome,
            Answer::Without(stretch) => {
                left_out = Some(stretch.said(recordings));
                rest = Some(stretch.left_out(recordings));
            }
        }
    };
    let diagnosis = &mut outcome.diagnosis;
    if let Some(left_out) = left_out {
        diagnosis.left_out = Some(LeftOut {
            rest: diagnosis.verdict,
            ..left_out
        });
        diagnosis.verdict = Verdict::Unexplained;
    }
    diagnosis.seconds = begin.elapsed().as_secs_f64();
    Ok(Looked { outcome, rest })
}

/// What a search comes to.
enum Answer {
    Outcome(Box<Outcome>),
    /// To be asked again without a stretch of one recording.
    Without(Stretch),
}

fn search(
    request: &Request<'_>,
    options: Options<'_>,
    teller: &Teller<'_>,
    may_leave_out: bool,
) -> Result<Answer, Insufficient> {
    let begin = Instant::now();
    let deadlines = Deadlines::from(begin, &options);
    let data = options.data(request.recordings, request.rig);
    insufficient::check(request.recordings, request.rig, &data)?;
    let mut sheet = Sheet::new(request.rig, &data, !options.same_zero, options.pendulum);
    let base = Hypothesis::base(&Arc::new(sheet.clone()));
    let (asked, notices) = asked::asked(&base, options.candidates);
    sheet.looked_for = candidates().chain(asked).collect();

    let filtered = filtered::filtered(&data, request.rig.sensors.resolution());
    let windows = data.windows(SEARCH, |_| true);
    let work = Work {
        data: &data,
        short: Problem::new(&data, windows.clone()).until(deadlines.hurry),
        calm: Problem::new(&data, windows).until(deadlines.end),
        apart: Apart::new(&data, deadlines.end),
        filtered: filtered.is_some(),
        options,
        deadlines,
        teller,
    };
    let found = match work.find(&Arc::new(sheet), may_leave_out) {
        Ok(found) => found,
        Err(stretch) => return Ok(Answer::Without(stretch)),
    };
    let mut outcome = work.answer(request, found);
    outcome
        .diagnosis
        .notices
        .splice(0..0, notices.into_iter().chain(filtered));
    Ok(Answer::Outcome(Box::new(outcome)))
}
