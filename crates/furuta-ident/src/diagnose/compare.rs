//! Two states of one rig: which of the named effects differ between them.
//!
//! A laboratory proves a cable by taking it off and recording again. Each state is diagnosed for itself; then the model
//! with all that was named in either is fitted to both, and the numbers of the two fits are held against each other.

use std::sync::Arc;

use furuta_model::Spec;
use furuta_model::effects::{Acts, Kind};
use rayon::prelude::*;

use super::hypothesis::{Hypothesis, Sheet};
use super::result::{Comparison, Diagnosis, Difference, NamedEffect};
use super::{Fit, Options, Request, SEARCH, horizons, repair};
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

/// What two diagnoses of one rig, each of recordings of its own, say of the effects named in either. Both must have
/// been asked for with these `options`.
///
/// Effects that act once are left out, and angles of rest and phases: encoders are zeroed anew.
///
/// ```
/// use furuta_ident::diagnose::{Options, Request, compare, diagnose};
/// use furuta_ident::recording::Recording;
/// use furuta_model::{Effect, Plant, Rig, State};
///
/// let rig = Rig::builtin("qube-servo-2").expect("built in");
/// let recorded = |stiffness: f64| {
///     let cable = Effect::new("arm.spring", &[stiffness, 0.2]).expect("valid");
///     let plant: Plant<f64> = Plant::new(&rig.params, &[cable]).expect("one effect");
///     let mut x = plant.rest(State::hanging());
///     let samples = (0..3000).map(|k| {
///         let t = f64::from(k) * 0.002;
///         let u = 1.5 * (3.0 * t * (1.0 + t)).sin();
///         let [theta, alpha] = rig.sensors.quantised(plant.measure(&x));
///         plant.step(&mut x, u, 0.002);
///         [t, u, theta, alpha]
///     });
///     Recording::from_samples("sweep", samples.collect::<Vec<_>>())
/// };
/// let states = [[recorded(2e-3)?.0], [recorded(0.0)?.0]];
/// let requests = states.each_ref().map(|recordings| Request { recordings, rig: &rig, verify: &[] });
/// let found = [diagnose(&requests[0], &|_| ())?.diagnosis, diagnose(&requests[1], &|_| ())?.diagnosis];
/// let comparison = compare(&requests, [&found[0], &found[1]], Options::default())?;
/// let stiffness = &comparison.differences[0];
/// assert_eq!((stiffness.id.as_str(), stiffness.differs), ("arm.spring", true));
/// assert!((stiffness.here.value - 2e-3).abs() < 1e-4 && stiffness.there.value.abs() < 1e-4);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// As [`super::diagnose`].
pub fn compare(
    requests: &[Request<'_>; 2],
    found: [&Diagnosis; 2],
    options: Options<'_>,
) -> Result<Comparison, Insufficient> {
    let find = |d: usize, spec: &Spec| found[d].effects.iter().find(|e| e.id == spec.id);
    let named = |spec: &&'static Spec| (0..2).any(|d| find(d, spec).is_some());
    let effects: Vec<InEither<'_>> = super::entries()
        .filter(|spec| named(spec) && !spec.acts.includes(Acts::JUMPS))
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
            if p.kind != Kind::Real || !(in_both || k < effect.spec.strengths) {
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
