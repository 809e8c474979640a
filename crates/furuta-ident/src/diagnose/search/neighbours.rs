//! A set's neighbours fitted from where the set ended: another effect in the place of one, or one fewer.

use furuta_model::effects::Kind;
use rayon::prelude::*;

use super::super::Fit;
use super::super::alike::{contains, counterpart};
use super::super::hypothesis::Hypothesis;
use crate::shooting::{Effort, Problem};

impl Problem<'_> {
    /// A neighbour's hypothesis fitted from where `here` ended: what both have stays, what it alone has is as in
    /// `known`, or as the [`counterpart`] in the effect that it replaces. A law that [`contains`] that effect begins as
    /// that effect.
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
            let contains = replaced.is_some_and(|r| contains(spec, here.model.effects[r]));
            for (i, p) in spec.parameters.iter().enumerate() {
                let same = replaced.and_then(|r| {
                    let of = counterpart(here.model.effects[r], spec, i)?;
                    Some((physical[here.model.offset(r) + of] - p.off) / p.typical(&sheet.params))
                });
                let new = if contains && i < spec.strengths {
                    0.0
                } else {
                    p.starts[0]
                };
                z.push(same.unwrap_or(new));
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

    /// The fit without an effect that may have made up for a wrong choice of another one: with another choice it costs
    /// no more than `most`.
    pub(in super::super) fn without_chosen(&self, here: &Fit, id: &str, most: f64) -> Option<Fit> {
        let model = here.model.without(id);
        let z = here.model.reduced(&here.z, id);
        let effort = Effort::FULL.towards(most);
        let otherwise = chosen_otherwise(&model, &z).into_iter();
        let fits = otherwise.map(|z| self.fit(&model, z, &here.states, effort));
        fits.filter(|fit| fit.cost <= most)
            .min_by(|a, b| a.cost.total_cmp(&b.cost))
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

/// The vector with another choice (where an encoder was zeroed, on which side of a drive it reads) in the place of one,
/// each in turn: no fit moves a choice.
fn chosen_otherwise(model: &Hypothesis, z: &[f64]) -> Vec<Vec<f64>> {
    let mut all = Vec::new();
    for (i, effect) in model.effects.iter().enumerate() {
        for (k, p) in effect.parameters.iter().enumerate() {
            let Kind::Choice(words) = p.kind else {
                continue;
            };
            let (at, unit) = (model.offset(i) + k, p.typical(&model.sheet.params));
            for word in 0..words.len() {
                let choice = (word as f64 - p.off) / unit;
                if choice != z[at] {
                    let mut z = z.to_vec();
                    z[at] = choice;
                    all.push(z);
                }
            }
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use furuta_model::{Effect, Rig, effects};

    use super::super::super::sweep::{Recorded, extended, sticking, sweep};
    use super::*;

    /// A scale counted from where the pendulum hangs, and an offset that makes up for it, is a scale counted from where
    /// it stands upright.
    #[test]
    fn a_wrong_choice_is_found_out_without_what_makes_up_for_it() {
        let (scale, offset) = ("sensor.alpha.scale", "sensor.alpha.offset");
        let rig = Rig::builtin("qube-servo-2").expect("built in");
        let hidden = Effect::new(scale, &[0.96, 0.0]).expect("valid");
        let recorded = Recorded::new(&[sweep("scaled", &rig, &[hidden], 0.0)], &rig);
        let problem = recorded.problem();
        let add = |(h, z): (Hypothesis, Vec<f64>), id: &str, values: &[f64]| {
            let spec = effects::spec(id).expect("an entry");
            let units = values.iter().zip(spec.parameters);
            let units: Vec<f64> = units
                .map(|(v, p)| (v - p.off) / p.typical(&rig.params))
                .collect();
            (h.with(spec), h.extended(&z, &units))
        };
        let base = Hypothesis::base(&recorded.sheet);
        let z = vec![0.0; base.len()];
        let (h, z) = add(add((base, z), offset, &[0.04 * -PI]), scale, &[0.96, 1.0]);
        let start = problem.solve_states(&h, &z, None);
        let both = problem.fit(&h, start.z, &start.states, Effort::FULL);
        assert!(problem.explains(&both), "{}", problem.chi(&both));

        let effort = Effort::FULL.above(both.cost);
        let alone = problem.without(&both, offset, effort);
        assert!(!problem.explains(&alone), "{}", problem.chi(&alone));
        let most = both.cost + problem.tolerance(&both);
        let chosen = problem.without_chosen(&both, offset, most).expect("one");
        let values = chosen.model.values(&chosen.z, scale).expect("it has that");
        assert_eq!(values[1], 0.0);
        assert!(chosen.model.effects.len() == 1 && problem.explains(&chosen));
    }

    /// Coulomb's friction is Stribeck's with one torque at all speeds: a fit of the larger law begins where the smaller
    /// one ended.
    #[test]
    fn a_law_that_contains_a_simpler_one_begins_as_that_one() {
        let recorded = sticking();
        let problem = recorded.problem();
        let without = recorded.refitted(&problem);
        let simple = extended(&problem, &without, "arm.coulomb", &[1e-3], Effort::FULL);
        let with = |id: &str| without.model.with(effects::spec(id).expect("an entry"));
        let (coulomb, stribeck) = (with("arm.coulomb"), with("arm.stribeck"));

        let none = Effort::FULL.within(0);
        let begun = problem.moved(&simple, &stribeck, None, none).expect("one");
        assert!(
            (begun.cost / simple.cost - 1.0).abs() < 1e-9,
            "{} {}",
            begun.cost,
            simple.cost
        );
        let ended = problem
            .moved(&simple, &stribeck, None, Effort::FULL)
            .expect("one");
        assert!(problem.explains(&ended), "{}", problem.chi(&ended));
        // And back: the friction at high speeds is the first of its strengths.
        let back = problem.moved(&ended, &coulomb, None, none).expect("one");
        let torque = |fit: &Fit| fit.model.physical(&fit.z)[fit.model.offset(0)];
        let [here, there] = [&back, &ended].map(torque);
        assert!((here / there - 1.0).abs() < 1e-9, "{here} {there}");
    }
}
