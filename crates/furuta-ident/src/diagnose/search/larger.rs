//! A law that can do more in the place of an effect: Stribeck's friction where Coulomb's leaves something.
//!
//! Fitted from where the set ended, it need only add what the simpler law lacks. From a set without friction it has to
//! find everything at once, and may lose its way there.

use super::super::Fit;
use super::super::alike::contains;
use super::super::criteria::CRITERIA;
use super::{Replaced, Search};

impl Search<'_> {
    /// Tries a law that can do more in the place of each effect, from where a set ended that leaves something.
    pub(super) fn enlarge(&mut self, here: &Fit) {
        if self.problem.explains(here) {
            return;
        }
        let limit = here.cost - CRITERIA.effect * self.problem.per_sample(here);
        let mut larger = Vec::new();
        for (spec, without) in self.without_each(here) {
            let laws = self.problem.addable(&without).filter(|c| contains(c, spec));
            larger.extend(laws.map(|law| Replaced {
                law,
                without: without.clone(),
                known: None,
                limit,
            }));
        }
        self.replace(here, larger);
    }
}

#[cfg(test)]
mod tests {
    use furuta_model::effects;

    use super::super::super::savers::USUAL;
    use super::super::super::sweep::{extended, sticking};
    use super::*;
    use crate::shooting::Effort;

    #[test]
    fn what_coulomb_friction_leaves_is_stribecks() {
        let recorded = sticking();
        let problem = recorded.problem();
        let mut base = recorded.refitted(&problem);
        base.model = base
            .model
            .looking_for(effects::spec("arm.stribeck").into_iter());
        let coulomb = extended(&problem, &base, "arm.coulomb", &[1e-3], Effort::FULL);
        assert!(!problem.explains(&coulomb), "{}", problem.chi(&coulomb));

        let mut search = Search::new(&problem, base, &|_| true, &USUAL, &|_| ());
        search.keep(coulomb.clone(), true);
        search.enlarge(&coulomb);
        let found = search.closest();
        assert!(found.model.has("arm.stribeck") && problem.explains(&found));
    }
}
