//! A name must stand up to what is looked for on request alone, where something is left unexplained.
//!
//! Entries that no diagnosis looks for unasked ([`effects::on_request`]) look like others: a limit of the current
//! like one of the voltage. Where the named effects leave more than the noise, each is compared with those entries that
//! list it among their look-alikes. An effect in whose place such an entry explains more is not named, nor is one that
//! is not needed beside that entry: both are suspected, and the reason says what to look for. What is left is judged
//! with the entry in place.

use furuta_model::{Spec, effects};
use rayon::prelude::*;

use super::Fit;
use super::additions::can_hold;
use super::evidence::Evidence;
use super::result::Suspected;
use super::screen::Screen;
use crate::shooting::{Effort, Problem};

/// Entries on request that stand in the place of effects that were found.
#[derive(Default)]
pub(super) struct StandIns {
    specs: Vec<&'static Spec>,
    /// What is not named for their sake.
    pub(super) suspected: Vec<Suspected>,
}

impl StandIns {
    /// Looks for them, and the fit in which they stand in the place of some effects.
    pub(super) fn find(problem: &Problem<'_>, mut fit: Fit) -> (Self, Fit) {
        let mut all = Self::default();
        while let Some((spec, other, better)) = all.contested(problem, &fit) {
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
    ) -> Option<(&'static Spec, &'static Spec, Fit)> {
        let limit = fit.cost - problem.tolerance(fit);
        let contests = |spec: &'static Spec| {
            let without = problem.without(fit, spec.id, Effort::FULL);
            let mut screen = None;
            let better: Vec<_> = others(spec)
                .filter(|other| can_hold(&without.model, other))
                .map(|other| {
                    let screen = screen.get_or_insert_with(|| Screen::new(problem, &without));
                    (spec, other, added(problem, &without, other, screen, limit))
                })
                .filter(|(_, _, better)| better.as_ref().is_some_and(|b| b.cost < limit))
                .collect();
            better
        };
        self.named(fit)
            .filter(|spec| others(spec).next().is_some())
            .flat_map(contests)
            .filter_map(|(spec, other, better)| Some((spec, other, better?)))
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

/// The best fit with one more effect, as long as it can come down to `goal`.
fn added(
    problem: &Problem<'_>,
    from: &Fit,
    spec: &'static Spec,
    screen: &Screen,
    goal: f64,
) -> Option<Fit> {
    let model = from.model.with(spec);
    let quick = problem
        .starts(from, spec, screen)
        .into_par_iter()
        .map(|z| problem.fit(&model, z, &from.states, Effort::QUICK.towards(goal)))
        .min_by(|a, b| a.cost.total_cmp(&b.cost))?;
    Some(problem.fit(
        &model,
        quick.z.clone(),
        &quick.states,
        Effort::FULL.towards(goal),
    ))
}
