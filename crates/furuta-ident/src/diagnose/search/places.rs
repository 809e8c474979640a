//! What stands in one of many places (a cogging's order, a vibration's frequency, a kick's moment) looked for again.
//!
//! Its place was chosen when less was known, and a fit leads from one place to another only over worse ones.

use super::super::Fit;
use super::super::additions::{Asked, Earlier};
use super::super::criteria::CRITERIA;
use super::super::screen;
use super::Search;
use crate::shooting::Effort;

impl Search<'_> {
    /// The best fit of the same effects with one of them in another place; `None` where none gains what an effect must.
    /// The place is looked for beside what the others are here: they fit better without it, and hide where it was.
    pub(super) fn placed_elsewhere(&self, here: &Fit) -> Option<Fit> {
        let effects = &here.model.effects;
        if effects.len() < 2 || self.problem.explains(here) {
            return None;
        }
        let goal = here.cost - CRITERIA.effect * self.problem.per_sample(here);
        let asked = Asked {
            instead: None,
            earlier: &|_| Earlier::New,
            savers: self.savers,
            report: self.report,
        };
        let movable = effects
            .iter()
            .filter(|e| !self.fixed.has(e.id) && screen::is_scanned(e));
        let effort = Effort::FULL.towards(goal);
        movable
            .flat_map(|spec| {
                let without = self.problem.without(here, spec.id, Effort::QUICK);
                (self.problem).quickly(&without, (&[*spec], Vec::new()), Some(goal), &asked)
            })
            .map(|(_, fit)| (self.problem).fit(&fit.model, fit.z, &fit.states, effort))
            .filter(|fit| fit.cost < goal)
            .min_by(|a, b| a.cost.total_cmp(&b.cost))
    }
}

#[cfg(test)]
mod tests {
    use furuta_model::{Effect, Rig};

    use super::super::super::savers::USUAL;
    use super::super::super::sweep::{Recorded, extended, sweep};
    use super::*;

    /// A cogging torque whose order was taken for another one, before the friction beside it was known.
    #[test]
    fn a_wrong_order_is_found_out_beside_what_hid_the_right_one() {
        let (cogging, friction) = ("arm.cogging", "arm.coulomb");
        let rig = Rig::builtin("qube-servo-2").expect("built in");
        let hidden = [
            Effect::new(cogging, &[1e-3, 6.0, 0.5]).expect("valid"),
            Effect::new(friction, &[1e-3]).expect("valid"),
        ];
        let recorded = Recorded::new(&[sweep("cogs", &rig, &hidden, 0.0)], &rig);
        let problem = recorded.problem();
        let base = recorded.refitted(&problem);
        let none = Effort::FULL.within(0);
        let cogs = extended(&problem, &base, cogging, &[1e-3, 9.0, 0.5], none);
        let wrong = extended(&problem, &cogs, friction, &[1e-3], Effort::FULL);
        assert!(!problem.explains(&wrong), "{}", problem.chi(&wrong));

        let search = Search::new(&problem, base, &|_| true, &USUAL, &|_| ());
        let right = search.placed_elsewhere(&wrong).expect("another place");
        assert!(problem.explains(&right), "{}", problem.chi(&right));
        let values = right.model.values(&right.z, cogging).expect("it has that");
        assert_eq!(values[1], 6.0);
        // Nothing is left, so no place is wrong.
        assert!(search.placed_elsewhere(&right).is_none());
    }
}
