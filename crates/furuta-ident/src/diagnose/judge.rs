//! Names must hold on data kept apart: an effect that gains in the sample alone is suspected, not named.

use furuta_model::effects::Acts;

use super::Fit;
use super::held_out::Unseen;
use super::horizons;
use super::result::Suspected;
use super::search::{Rival, Search};
use crate::shooting::{Effort, Problem};
use crate::stop::Stop;

/// What is left of a search.
pub(super) struct Judged {
    pub(super) named: Fit,
    pub(super) rivals: Vec<Rival>,
    pub(super) suspected: Vec<Suspected>,
    /// What the named effects leave on data kept apart, where they were judged.
    pub(super) unseen: Option<Unseen>,
}

/// Takes out, one at a time, the effects without which data kept apart are predicted better. What acts once is judged
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
