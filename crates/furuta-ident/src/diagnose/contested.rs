//! A name must stand up to what is looked for on request alone, where something is left unexplained.
//!
//! Entries that no diagnosis looks for unasked ([`effects::on_request`]) look like others: a limit of the current
//! like one of the voltage. Where the named effects leave more than the noise, each is compared with those entries that
//! list it among their look-alikes. An effect in whose place such an entry explains more is not named, nor is one that
//! is not needed beside that entry: both are suspected, and the reason says what to look for. What is left is judged
//! with the entry in place.

use furuta_model::{Spec, effects};

use super::Fit;
use super::additions::{Asked, Earlier};
use super::candidates::can_hold;
use super::evidence::Evidence;
use super::result::Suspected;
use super::savers::Savers;
use crate::shooting::{Effort, Problem};

/// Entries on request that stand in the place of effects that were found.
#[derive(Default)]
pub(super) struct StandIns {
    specs: Vec<&'static Spec>,
    /// What is not named for their sake.
    pub(super) suspected: Vec<Suspected>,
}

impl StandIns {
    /// Looks for them, and the fit in which they stand in the place of some effects. One may be known that is `nearer`.
    pub(super) fn find(
        problem: &Problem<'_>,
        mut fit: Fit,
        nearer: Option<Fit>,
        savers: &Savers,
    ) -> (Self, Fit) {
        let mut all = Self::default();
        let limit = fit.cost - problem.tolerance(&fit);
        if let Some(nearer) = nearer.filter(|nearer| nearer.cost < limit) {
            all.specs = effects::on_request()
                .filter(|other| nearer.model.has(other.id))
                .collect();
            // One such effect beside the usual ones must do.
            if let Some(other) = all.specs.first() {
                let absent = (fit.model.effects.iter()).filter(|spec| !nearer.model.has(spec.id));
                let better = absent.map(|spec| Suspected::explained_better(spec, other));
                all.suspected = better.collect();
            }
            fit = nearer;
        }
        while let Some((spec, other, better)) = all.contested(problem, &fit, savers) {
            all.suspected.push(Suspected::explained_better(spec, other));
            all.specs.push(other);
            fit = better;
            // What stood for the rest of the same effect.
            while let Some((spec, smaller)) = all.unneeded(problem, &fit, &Evidence::convinces) {
                all.suspected.push(Suspected::unneeded(spec, other));
                fit = smaller;
            }
        }
        (all, fit)
    }

    /// Whether no effect was contested.
    pub(super) fn is_empty(&self) -> bool {
        self.specs.is_empty()
    }

    /// Whether this entry stands in for another.
    pub(super) fn has(&self, spec: &Spec) -> bool {
        self.specs.iter().any(|s| s.id == spec.id)
    }

    /// What is named of a judged fit, without the entries that stand in: it must convince without them as well, or,
    /// where with them nothing is left, gain more than its numbers cost.
    pub(super) fn taken_out(mut self, problem: &Problem<'_>, judged: Fit) -> (Fit, Vec<Suspected>) {
        let explained = problem.explains(&judged);
        let holds = |e: &Evidence| {
            if explained {
                e.delta_bic > 0.0
            } else {
                e.convinces()
            }
        };
        let mut fit = judged;
        for other in std::mem::take(&mut self.specs) {
            fit = problem.without(&fit, other.id, Effort::FULL);
            while let Some((spec, smaller)) = self.unneeded(problem, &fit, &holds) {
                self.suspected.push(Suspected::needs(spec, other));
                fit = smaller;
            }
        }
        (fit, self.suspected)
    }

    /// The effect in whose place an entry on request explains most, more than what makes two effects confusable; that
    /// entry and the fit with it.
    fn contested(
        &self,
        problem: &Problem<'_>,
        fit: &Fit,
        savers: &Savers,
    ) -> Option<(&'static Spec, &'static Spec, Fit)> {
        let limit = fit.cost - problem.tolerance(fit);
        let contests = |spec: &'static Spec| {
            let without = problem.without(fit, spec.id, Effort::FULL);
            let others: Vec<_> = others(spec)
                .filter(|other| can_hold(&without.model, other))
                .collect();
            let better = added(problem, &without, &others, limit, savers);
            better.map(move |(other, better)| (spec, other, better))
        };
        self.named(fit)
            .filter(|spec| others(spec).next().is_some())
            .filter_map(contests)
            .min_by(|a, b| a.2.cost.total_cmp(&b.2.cost))
    }

    /// The effect that is missed least beside the rest, of those that do not hold, and the fit without it.
    fn unneeded(
        &self,
        problem: &Problem<'_>,
        fit: &Fit,
        holds: &dyn Fn(&Evidence) -> bool,
    ) -> Option<(&'static Spec, Fit)> {
        let effort = Effort::FULL.above(fit.cost);
        self.named(fit)
            .map(|spec| (spec, problem.without(fit, spec.id, effort)))
            .filter(|(_, smaller)| !holds(&problem.evidence(smaller, fit)))
            .min_by(|a, b| a.1.cost.total_cmp(&b.1.cost))
    }

    /// What is named of this fit: all but what stands in.
    pub(super) fn named(&self, fit: &Fit) -> impl Iterator<Item = &'static Spec> {
        (fit.model.effects.iter().copied()).filter(|spec| !self.has(spec))
    }
}

/// The entries on request that look like this effect.
fn others(spec: &'static Spec) -> impl Iterator<Item = &'static Spec> {
    effects::on_request().filter(|other| other.look_alikes.contains(&spec.id))
}

/// The best fit with one more effect, if it comes down to less than `goal`.
fn added(
    problem: &Problem<'_>,
    from: &Fit,
    specs: &[&'static Spec],
    goal: f64,
    savers: &Savers,
) -> Option<(&'static Spec, Fit)> {
    let asked = Asked {
        instead: None,
        earlier: &|_| Earlier::New,
        savers,
        report: &|_| {},
    };
    let quick = problem.quickly(from, (specs, Vec::new()), Some(goal), &asked);
    let effort = Effort::FULL.towards(goal);
    quick
        .into_iter()
        .map(|(spec, fit)| (spec, problem.fit(&fit.model, fit.z, &fit.states, effort)))
        .filter(|(_, better)| better.cost < goal)
        .min_by(|a, b| a.1.cost.total_cmp(&b.1.cost))
}

#[cfg(test)]
mod tests {
    use furuta_model::{Effect, Rig};

    use super::super::savers::USUAL;
    use super::super::sweep::{Recorded, extended, sweep};
    use super::*;

    /// A bias that was named where a cable relaxes: no entry on request is compared with a bias. With the relaxing cable
    /// of another search it is suspected; one that is further from the data stands for nothing.
    #[test]
    fn what_another_search_came_nearer_with_stands_in() {
        let (bias, relaxation) = ("motor.bias", "arm.relaxation");
        let rig = Rig::builtin("qube-servo-2").expect("built in");
        let hidden = Effect::new(relaxation, &[5e-3, 0.3]).expect("valid");
        let recorded = Recorded::new(&[sweep("relaxes", &rig, &[hidden], 0.0)], &rig);
        let problem = recorded.problem();
        let base = recorded.refitted(&problem);
        let named = extended(&problem, &base, bias, &[0.05], Effort::FULL);
        let near = extended(&problem, &base, relaxation, &[5e-3, 0.3], Effort::FULL);
        let none = Effort::FULL.within(0);
        let far = extended(&problem, &base, relaxation, &[5e-2, 0.01], none);
        assert!(near.cost < named.cost - problem.tolerance(&named) && named.cost < far.cost);

        for nearer in [None, Some(far)] {
            let (stand_ins, fit) = StandIns::find(&problem, named.clone(), nearer, &USUAL);
            assert!(stand_ins.is_empty() && fit.model.has(bias));
        }
        let (stand_ins, fit) = StandIns::find(&problem, named, Some(near), &USUAL);
        assert!(stand_ins.specs.iter().any(|s| s.id == relaxation) && fit.model.has(relaxation));
        let suspected: Vec<&str> = stand_ins.suspected.iter().map(|s| s.id.as_str()).collect();
        assert_eq!(suspected, [bias]);
    }
}
