//! Names must hold on data kept apart: an effect that gains in the sample alone is suspected, not named.

use furuta_model::Spec;
use furuta_model::effects::Acts;

use super::Fit;
use super::criteria::CRITERIA;
use super::held_out::Unseen;
use super::horizons;
use super::result::Suspected;
use super::search::{Rival, Search};
use crate::shooting::{Effort, Problem};
use crate::stop::Stop;

/// How far the strongest number of a named effect is from none, in standard deviations that hold how what remains is
/// correlated over a window and over a recording; of an effect that does less the larger its number, how far from
/// nothing at all.
fn distance(named: &Fit, spec: &Spec) -> f64 {
    let index = named.model.effects.iter().position(|e| e.id == spec.id);
    index.map_or(f64::INFINITY, |i| {
        let first = named.model.offset(i);
        (first..first + spec.strengths)
            .map(|k| (named.z[k] / named.std[k]).abs())
            .fold(0.0, f64::max)
    })
}

/// What is left of a search.
pub(super) struct Judged {
    pub(super) named: Fit,
    pub(super) rivals: Vec<Rival>,
    pub(super) suspected: Vec<Suspected>,
    /// What the named effects leave on data kept apart, where they were judged.
    pub(super) unseen: Option<Unseen>,
}

/// Takes out, one at a time, the effects whose size the recordings do not agree on (errors of a model that lacks
/// something are correlated, and less certain than the encoders' noise says), and those without which data kept apart
/// are predicted better. What acts once is judged
/// by long windows of its own
/// recording (`horizons`): no other recording holds it. Where there is no time to judge, nothing but `base` is left.
pub(super) fn judge(
    problem: &Problem<'_>,
    unseen: &(dyn Fn(&Fit) -> Unseen + Sync),
    (mut named, mut rivals): (Fit, Vec<Rival>),
    base: &Fit,
    (search, stop): (&Search<'_>, Stop<'_>),
) -> Judged {
    let mut suspected = Vec::new();
    for spec in horizons::transients_to_drop(problem, &named) {
        suspected.push(Suspected::transient(spec));
        named = problem.without(&named, spec.id, Effort::FULL);
        rivals = search.rivals(&named);
    }
    let mut with = None;
    while !named.model.effects.is_empty() {
        if stop.wanted() {
            suspected.extend(named.model.effects.iter().map(|e| Suspected::unjudged(e)));
            named = base.clone();
            rivals = Vec::new();
            break;
        }
        // A size that the recordings do not agree on is of something else.
        let loosest = (named.model.effects.iter())
            .filter(|spec| !spec.acts.includes(Acts::JUMPS))
            .map(|spec| (*spec, distance(&named, spec)))
            .filter(|(spec, distance)| distance.powi(2) < CRITERIA.least(spec))
            .min_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((spec, distance)) = loosest {
            suspected.push(Suspected::loose(spec, distance));
            named = problem.without(&named, spec.id, Effort::FULL);
            rivals = search.rivals(&named);
            continue;
        }
        let here = with.insert(unseen(&named));
        let worst = rivals
            .iter()
            .filter(|r| !r.spec.acts.includes(Acts::JUMPS))
            .map(|r| (r, unseen(&r.without)))
            .filter(|(_, without)| !here.is_better_than(without))
            .min_by(|a, b| a.1.level().total_cmp(&b.1.level()));
        if stop.wanted() {
            // What was judged in a hurry was not judged.
            with = None;
            continue;
        }
        let Some((rival, without)) = worst else { break };
        suspected.push(Suspected::new(rival.spec, here.horizons, without.horizons));
        let again = problem.without(&named, rival.spec.id, Effort::FULL);
        named = if again.cost < rival.without.cost {
            again
        } else {
            rival.without.clone()
        };
        rivals = search.rivals(&named);
        with = None;
    }
    Judged {
        named,
        rivals,
        suspected,
        unseen: with,
    }
}
