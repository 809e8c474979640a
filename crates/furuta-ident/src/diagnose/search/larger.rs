//! A law that can do more in the place of an effect: Stribeck's friction where Coulomb's leaves something.
//!
//! Fitted from where the set ended, it need only add what the simpler law lacks. From a set without friction it has to
//! find everything at once, and may lose its way there.

use rayon::prelude::*;

use super::super::Fit;
use super::super::alike::contains;
use super::super::criteria::CRITERIA;
use super::Search;
use crate::shooting::Effort;

impl Search<'_> {
    /// Tries a law that can do more in the place of each effect, from where a set ended that leaves something.
    pub(super) fn enlarge(&mut self, here: &Fit) {
        if self.problem.explains(here) {
            return;
        }
        let mut larger = Vec::new();
        for (spec, smaller) in self.without_each(here) {
            let laws = self.problem.addable(&smaller).filter(|c| contains(c, spec));
            larger.extend(laws.map(|c| (smaller.clone(), smaller.model.with(c))));
        }
        let goal = here.cost - CRITERIA.effect * self.problem.per_sample(here);
        let effort = Effort::FULL.towards(goal);
        let fits: Vec<(Fit, Fit)> = larger
            .into_par_iter()
            .filter_map(|(smaller, h)| {
                let there = self.problem.moved(here, &h, None, effort)?;
                (there.cost <= goal).then_some((smaller, there))
            })
            .collect();
        for (smaller, fit) in fits {
            let eligible = self.problem.evidence(&smaller, &fit).convinces();
            self.keep(fit, eligible);
        }
    }
}

#[cfg(test)]
mod tests {
    use furuta_model::{Effect, Rig, effects};

    use super::super::super::savers::USUAL;
    use super::super::super::sweep::{Recorded, sweep};
    use super::*;

    #[test]
    fn what_coulomb_friction_leaves_is_stribecks() {
        let rig = Rig::builtin("qube-servo-2").expect("built in");
        let hidden = Effect::new("arm.stribeck", &[1e-3, 2e-3, 0.5]).expect("valid");
        let recorded = Recorded::new(&[sweep("stick", &rig, &[hidden], 0.0)], &rig);
        let problem = recorded.problem();
        let mut base = recorded.refitted(&problem);
        base.model = base
            .model
            .looking_for(effects::spec("arm.stribeck").into_iter());
        let h = base
            .model
            .with(effects::spec("arm.coulomb").expect("an entry"));
        let z = h.extended(&base.z, &[1.0]);
        let coulomb = problem.fit(&h, z, &base.states, Effort::FULL);
        assert!(!problem.explains(&coulomb), "{}", problem.chi(&coulomb));

        let mut search = Search::new(&problem, base, &|_| true, &USUAL, &|_| ());
        search.keep(coulomb.clone(), true);
        search.enlarge(&coulomb);
        let found = search.closest();
        assert!(found.model.has("arm.stribeck") && problem.explains(&found));
    }
}
