//! What acts once (a kick) must help over long windows, and must not come again.

use furuta_model::Spec;

use super::criteria::CRITERIA;
use super::horizons::{fitted, long_windows};
use super::result::Suspected;
use super::screen::Screen;
use super::{Fit, LONG, REPORT};
use crate::shooting::{Effort, Problem};

/// The transient effects of a model that are none: another moment gains nearly as much; or they do not help over long
/// windows, for what is wrong everywhere looks like a transient somewhere.
pub(super) fn to_drop(problem: &Problem<'_>, named: &Fit) -> Vec<(&'static Spec, Suspected)> {
    let transients: Vec<&'static Spec> = (named.model.effects.iter().copied())
        .filter(|e| e.acts_once())
        .collect();
    if transients.is_empty() {
        return Vec::new();
    }
    let long = Problem::new(problem.data, long_windows(problem.data, LONG));
    let larger = fitted(&long, &named.model, &named.z);
    let helps = |spec: &Spec| {
        let z = named.model.reduced(&named.z, spec.id);
        let smaller = fitted(&long, &named.model.without(spec.id), &z);
        long.evidence(&smaller, &larger).helps()
    };
    transients
        .into_iter()
        .filter_map(|spec| {
            // What comes again says more than that it does not help.
            if let Some(again) = comes_again(problem, named, spec) {
                return Some((spec, Suspected::recurrent(spec, again)));
            }
            (!helps(spec)).then(|| (spec, Suspected::transient(spec)))
        })
        .collect()
}

/// The moment (s) and the recording of a second transient of this kind that would gain nearly as much as the first.
fn comes_again(problem: &Problem<'_>, named: &Fit, spec: &'static Spec) -> Option<(f64, usize)> {
    let typical: Vec<f64> = (spec.parameters.iter())
        .map(|p| p.typical(&named.model.sheet.params))
        .collect();
    let without = problem.without(named, spec.id, Effort::FULL);
    let before = Screen::new(problem, &without).places(spec, &typical);
    let mut local = named.model.local(&named.z);
    let here = local.find(|e| e.spec().id == spec.id)?.values();
    let value = |values: &[f64], name: &str| {
        let i = spec.parameters.iter().position(|p| p.name == name);
        i.map_or(0.0, |i| values[i])
    };
    // What is left of a push that is no rectangle is the same push.
    let begin = value(&here, "time") - REPORT;
    let end = value(&here, "time") + value(&here, "duration") + REPORT;
    let elsewhere = |values: &[f64]| {
        let time = value(values, "time");
        value(values, "run") != value(&here, "run") || time < begin || time > end
    };
    let after = Screen::new(problem, named).places_where(spec, &typical, elsewhere);
    let (most, again) = (before.first()?.gain, after.first()?);
    (again.gain > CRITERIA.recurs * most).then(|| {
        (
            value(&again.values, "time"),
            value(&again.values, "run") as usize,
        )
    })
}
