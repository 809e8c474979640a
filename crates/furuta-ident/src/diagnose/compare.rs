//! Two states of one rig: which of the named effects differ between them.
//!
//! A laboratory proves a cable by taking it off and recording again. Each state is diagnosed for itself; then the model
//! with all that was named in either is fitted to both, and the numbers of the two fits are held against each other.

use std::sync::Arc;

use furuta_model::Spec;
use furuta_model::effects;
use rayon::prelude::*;

use super::hypothesis::{Hypothesis, Sheet};
use super::result::{Comparison, Diagnosis, Difference, NamedEffect};
use super::{Fit, Looked, Options, Outcome, Progress, Request, SEARCH, horizons, repair};
use crate::insufficient::{self, Insufficient};
use crate::recording::Recording;
use crate::shooting::{Effort, Problem};
use crate::stop::Stop;

/// An effect in either state, and what each diagnosis says of it.
struct InEither<'a> {
    spec: &'static Spec,
    named: [Option<&'a NamedEffect>; 2],
}

impl InEither<'_> {
    /// The parameters from which a state's fit starts, in units of the vector: as named there, else as in the other.
    fn start(&self, state: usize, sheet: &Sheet) -> Vec<f64> {
        let known = self.named[state].or(self.named[1 - state]);
        let value = |name: &str| known.and_then(|e| e.parameters.get(name)).map(|e| e.value);
        (self.spec.parameters.iter())
            .map(|p| value(p.name).map_or(0.0, |v| (v - p.off) / p.typical(&sheet.params)))
            .collect()
    }
}

/// A diagnosis, and what the recordings of the other state say of the effects named in either.
pub(super) fn with_another_state(
    request: &Request<'_>,
    here: Looked,
    options: Options<'_>,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Outcome, Insufficient> {
    let request_there = Request {
        recordings: options.compare,
        verify: &[],
        ..*request
    };
    let options_there = Options {
        plan: false,
        ..options
    };
    let there = super::in_stretches(&request_there, options_there, progress)?;
    let mut outcome = here.outcome;
    if there.outcome.diagnosis.interrupted {
        outcome.diagnosis.interrupted = true;
        return Ok(outcome);
    }
    let found = [&outcome.diagnosis, &there.outcome.diagnosis];
    let requests = [(*request, &here.rest), (request_there, &there.rest)].map(|(request, rest)| {
        let recordings = rest.as_deref().unwrap_or(request.recordings);
        Request {
            recordings,
            ..request
        }
    });
    outcome.diagnosis.comparison = Some(compare(&requests, found, options)?);
    Ok(outcome)
}

/// What two diagnoses of one rig say of the effects named in either.
///
/// Effects that act once are left out, and angles of rest and phases: encoders are zeroed anew.
fn compare(
    requests: &[Request<'_>; 2],
    found: [&Diagnosis; 2],
    options: Options<'_>,
) -> Result<Comparison, Insufficient> {
    let find = |d: usize, spec: &Spec| found[d].effects.iter().find(|e| e.id == spec.id);
    let named = |spec: &&'static Spec| (0..2).any(|d| find(d, spec).is_some());
    let effects: Vec<InEither<'_>> = effects::all()
        .filter(|spec| named(spec) && !spec.acts_once())
        .map(|spec| InEither {
            spec,
            named: [find(0, spec), find(1, spec)],
        })
        .collect();
    let fits = (0..2)
        .into_par_iter()
        .map(|state| fitted(&requests[state], &effects, state, options))
        .collect::<Result<Vec<Fit>, Insufficient>>()?;
    let mut differences = Vec::new();
    for (i, effect) in effects.iter().enumerate() {
        let [here, there] = [0, 1].map(|state: usize| repair::effect_parameters(&fits[state], i));
        let in_both = effect.named.iter().all(Option::is_some);
        for (k, p) in effect.spec.parameters.iter().enumerate() {
            // What is not there has no form.
            if !p.kind.is_amount() || !(in_both || k < effect.spec.strengths) {
                continue;
            }
            let (Some(here), Some(there)) = (here.get(p.name), there.get(p.name)) else {
                continue;
            };
            let difference = Difference::new(effect.spec.id, p.name, here.clone(), there.clone());
            differences.push(difference);
        }
    }
    let names = |r: &Request<'_>| {
        r.recordings
            .iter()
            .map(|r: &Recording| r.name.clone())
            .collect()
    };
    Ok(Comparison {
        there: names(&requests[1]),
        verdict: found[1].verdict,
        named: found[1].effects.iter().map(|e| e.id.clone()).collect(),
        differences,
    })
}

/// The model with these effects, fitted to the recordings of one state as a diagnosis fits what it names.
fn fitted(
    request: &Request<'_>,
    effects: &[InEither<'_>],
    state: usize,
    options: Options<'_>,
) -> Result<Fit, Insufficient> {
    let data = options.data(request.recordings, request.rig);
    insufficient::check(request.recordings, request.rig, &data)?;
    let own_zeros = !options.same_zero;
    let sheet = Arc::new(Sheet::new(request.rig, &data, own_zeros, options.pendulum));
    let mut h = Hypothesis::base(&sheet);
    let mut z = vec![0.0; h.len()];
    for effect in effects {
        z = h.extended(&z, &effect.start(state, &sheet));
        h = h.with(effect.spec);
    }
    let problem = Problem::new(&data, data.windows(SEARCH, |_| true));
    let start = problem.solve_states(&h, &z, None);
    let fit = problem.fit(&h, z, &start.states, Effort::FULL);
    let explained = problem.explains(&fit);
    Ok(horizons::finish(&data, &fit, explained, Stop::NEVER))
}
