//! How large each effect that was not named could still be.
//!
//! A score test gives the strength at which an effect would explain most of what the fit leaves, and how sharply the
//! data say so, errors being as correlated as they are for the fitted numbers. Its shape (a rest angle, a frequency) is
//! taken from the starts of a search: of those the largest bound counts.

use furuta_model::Spec;
use furuta_model::effects::{Acts, MAX_PARAMETERS};
use rayon::prelude::*;

use super::Fit;
use super::result::Limit;
use super::screen::{self, Score, Screen};
use crate::shooting::{MAX_FREE, Model, Problem};

/// 95 % of a normal distribution lie within this many standard deviations, to both sides or below.
const TWO_SIDED: f64 = 1.96;
const ONE_SIDED: f64 = 1.645;
/// The strength of the first test, in units of the typical one; the second is made at the limit that the first gives.
const FIRST: f64 = 0.1;
/// Strengths between which a second test is made, in the same units.
const TESTED: [f64; 2] = [1e-3, 3.0];

/// For every candidate that `named` lacks and whose strength is one plain number, beside what is named and as it is
/// named. Cogging, ripple, transients and vibration (any order, any moment, any frequency) and a drive with backlash or
/// spring are left out, and what does more the smaller its number is (a limit of voltage, current or speed): of that
/// there is no largest one.
pub(super) fn limits(problem: &Problem<'_>, named: &Fit) -> Vec<Limit> {
    // The largest effect must go in the fit's fixed size.
    if named.model.layout().local() + MAX_PARAMETERS > MAX_FREE {
        return Vec::new();
    }
    let screen = Screen::new(problem, named);
    let specs: Vec<&'static Spec> = problem
        .addable(named)
        .filter(|s| {
            s.strengths == 1
                && s.parameters[0].kind.is_amount()
                && !screen::is_scanned(s)
                && !s.acts.touches(Acts::DRIVE.and(Acts::BACKWARDS))
        })
        .collect();
    let actuation = named.model.sheet.params.motor.actuation;
    let mut limits: Vec<Limit> = specs
        .into_par_iter()
        .filter_map(|spec| {
            let (bound, deviation) = problem
                .shapes(named, spec, &screen)
                .into_iter()
                .filter_map(|z| upper_bound(problem, named, spec, &screen, &z))
                .max_by(|a, b| a.0.total_cmp(&b.0))?;
            let p = &spec.parameters[0];
            let typical = p.typical(&named.model.sheet.params);
            Some(Limit {
                id: spec.id.into(),
                parameter: p.name.into(),
                at_most: bound * typical,
                std: deviation * typical,
                typical,
                unit: match actuation.unit_of(p.unit) {
                    "-" => "1".into(),
                    unit => unit.into(),
                },
            })
        })
        .collect();
    limits.sort_by(|a, b| (a.at_most / a.typical).total_cmp(&(b.at_most / b.typical)));
    limits
}

/// The largest strength that the data leave to an effect of this shape, and the standard deviation of its strength, in
/// units of the typical one.
fn upper_bound(
    problem: &Problem<'_>,
    named: &Fit,
    spec: &'static Spec,
    screen: &Screen,
    z: &[f64],
) -> Option<(f64, f64)> {
    let per_sample = problem.per_sample(named);
    let one_way = spec.parameters[0].min >= spec.parameters[0].off;
    let first = named.model.shared();
    let h = named.model.with(spec);
    let score = |strength: f64| {
        let mut here = z.to_vec();
        here[first] = strength;
        let score = screen.score(problem, named, &h, &here)?;
        (score.square > 0.0).then_some(score)
    };
    let limit = |strength: f64, score: &Score| {
        let (best, deviation) = (
            strength * score.product / score.square,
            named.widened * strength * (per_sample / score.square).sqrt(),
        );
        let limit = if one_way {
            best.max(0.0) + ONE_SIDED * deviation
        } else {
            best.abs() + TWO_SIDED * deviation
        };
        (limit, deviation)
    };
    let first = score(FIRST)?;
    // A user's own law may do more the smaller its number is: of that there is no largest one.
    if spec.own.is_some() && first.square <= score(0.5 * FIRST)?.square {
        return None;
    }
    // What sticks is not in proportion to its strength: the second test is made where it matters.
    let first = limit(FIRST, &first);
    let second = first.0.clamp(TESTED[0], TESTED[1]);
    Some(score(second).map_or(first, |score| limit(second, &score)))
}
