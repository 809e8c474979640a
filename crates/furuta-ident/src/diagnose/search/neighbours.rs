//! A set's neighbours fitted from where the set ended: another effect in the place of one, or one fewer.

use rayon::prelude::*;

use super::super::Fit;
use super::super::hypothesis::Hypothesis;
use crate::shooting::{Effort, Problem};

impl Problem<'_> {
    /// A neighbour's hypothesis fitted from where `here` ended: what both have stays, what it alone has is as in
    /// `known`, or as what has the same name in the effect that it replaces.
    pub(in super::super) fn moved(
        &self,
        here: &Fit,
        to: &Hypothesis,
        known: Option<&Fit>,
        effort: Effort,
    ) -> Option<Fit> {
        let sheet = &to.sheet;
        let mut z = here.z[..to.offset(0)].to_vec();
        let physical = here.model.physical(&here.z);
        let replaced = here.model.effects.iter().position(|e| !to.has(e.id));
        for spec in &to.effects {
            if let Some(values) = here.model.values(&here.z, spec.id) {
                z.extend(values);
                continue;
            }
            if let Some(values) = known.and_then(|k| k.model.values(&k.z, spec.id)) {
                z.extend(values);
                continue;
            }
            for p in spec.parameters {
                let same = replaced.and_then(|i| {
                    let names = here.model.effects[i].parameters;
                    let k = names.iter().position(|q| q.name == p.name)?;
                    Some((physical[here.model.offset(i) + k] - p.off) / p.typical(&sheet.params))
                });
                z.push(same.unwrap_or(p.starts[0]));
            }
        }
        z.extend(&here.z[here.model.shared()..]);
        (z.len() == to.len()).then(|| self.fit(to, z, &here.states, effort))
    }

    /// A fit without one of its effects, from where it ended.
    pub(in super::super) fn without(&self, here: &Fit, id: &str, effort: Effort) -> Fit {
        let z = here.model.reduced(&here.z, id);
        self.fit(&here.model.without(id), z, &here.states, effort)
    }

    /// Leaves out, one at a time, the effects that do not convince beside the others, the weakest first.
    pub(in super::super) fn simplified(&self, mut here: Fit) -> Fit {
        loop {
            let effort = Effort::FULL.above(here.cost);
            let weakest = (here.model.effects.par_iter())
                .map(|spec| self.without(&here, spec.id, effort))
                .filter(|smaller| !self.evidence(smaller, &here).convinces())
                .min_by(|a, b| a.cost.total_cmp(&b.cost));
            match weakest {
                Some(smaller) => here = smaller,
                None => break,
            }
        }
        here
    }
}
