//! Which effects are missing: forward selection with evidence, backward elimination, and what is confusable.

use furuta_model::Spec;
use rayon::prelude::*;

use super::candidates::{CLOSE, Trial};
use super::evidence::LEAST_GAIN;
use super::fit::{Effort, Fit, Problem};
use super::hypothesis::Hypothesis;

/// The most effects that are looked for together.
pub(super) const MOST_EFFECTS: usize = 4;
/// Where a search ends so far from the noise (this many times its size), pairs that begin with so many others are tried.
const ASTRAY: f64 = 5.0;
const BEAM: usize = 2;
/// A rival whose excess is within this share is confusable.
const CONFUSABLE: f64 = 0.10;

/// For each effect of a fit, the fit without it.
pub(super) type Without = Vec<(&'static Spec, Fit)>;

/// What a search has found.
pub(super) struct Selection {
    pub(super) fit: Fit,
    /// If it was looked at.
    pub(super) without: Option<Without>,
    /// All candidates of the first step.
    pub(super) first: Vec<Trial>,
}

/// What could stand in the place of an effect.
pub(super) struct Rival {
    /// The effect.
    pub(super) spec: &'static Spec,
    /// The fit without it.
    pub(super) without: Fit,
    /// Others that explain the data nearly as well in its place.
    pub(super) near: Vec<Trial>,
}

impl Problem<'_> {
    /// Adds the most convincing effect again and again, and takes out what the others have made superfluous (but for those of `settled`, which
    /// another problem decided on).
    pub(super) fn select(
        &self,
        start: Fit,
        settled: &Hypothesis,
        acceptable: &dyn Fn(&Trial) -> bool,
        report: &(dyn Fn(&str) + Sync),
    ) -> Selection {
        let mut here = start;
        let (mut without, mut first) = (None, Vec::new());
        while here.hypothesis.effects.len() < MOST_EFFECTS && !self.stop.wanted() {
            let trials = self.candidates(&here, None, report);
            if first.is_empty() {
                first.clone_from(&trials);
            }
            // Of a round that was broken off, the best may not have been looked at: nobody is named by it.
            if self.stop.wanted() {
                break;
            }
            let next = trials
                .into_iter()
                .find(|t| t.evidence.convinces() && acceptable(t));
            match next {
                Some(t) => (here, without) = self.simplify(t.fit, Some(&here), settled),
                None => break,
            }
        }
        Selection {
            fit: here,
            without,
            first,
        }
    }

    /// Where a selection from nothing ended far from the noise, tries pairs that begin with the next best of the first effects, unless those look like the
    /// best and are no simpler, and goes on from one that is better: alone, neither of a pair need be the best.
    pub(super) fn other_ways(
        &self,
        mut found: Selection,
        base: &Hypothesis,
        report: &(dyn Fn(&str) + Sync),
    ) -> Selection {
        let Some(best) = found.first.first().map(|t| t.spec) else {
            return found;
        };
        let begins: Vec<Trial> = found
            .first
            .iter()
            .filter(|t| t.spec.id != best.id && t.evidence.convinces())
            .filter(|t| {
                !best.look_alikes.contains(&t.spec.id)
                    || t.spec.parameters.len() < best.parameters.len()
            })
            .take(BEAM)
            .cloned()
            .collect();
        for Trial { fit, .. } in begins {
            if self.stop.wanted() || self.chi(&found.fit) < ASTRAY {
                break;
            }
            let start = self.fit(&fit.hypothesis, fit.z, &fit.states, Effort::FULL);
            let bar = self.worth(&found.fit, &found.fit);
            let pair = self
                .candidates(&start, None, report)
                .into_iter()
                .find(|t| t.evidence.convinces() && self.worth(&t.fit, &found.fit) < bar);
            if let (Some(pair), false) = (pair, self.stop.wanted()) {
                let first = found.first;
                let (pair, _) = self.simplify(pair.fit, Some(&start), base);
                found = self.select(pair, base, &|_| true, report);
                found.first = first;
            }
        }
        found
    }

    /// The cost with what each parameter must gain, in units of what `here` leaves: the lower, the better.
    fn worth(&self, fit: &Fit, here: &Fit) -> f64 {
        let room = LEAST_GAIN * (here.cost / self.floor()).max(1.0);
        fit.cost + room * fit.hypothesis.free() as f64
    }

    /// Leaves out, one at a time, the effects that the others do without; those of `settled` stay. `known` is a fit without one of them.
    ///
    /// Returns what is left and, where it is more than one effect, the fits without each.
    pub(super) fn simplify(
        &self,
        mut here: Fit,
        known: Option<&Fit>,
        settled: &Hypothesis,
    ) -> (Fit, Option<Without>) {
        while here.hypothesis.effects.len() > 1 {
            let without = self.without_each(&here, known);
            let weakest = without
                .iter()
                .filter(|(spec, _)| !settled.has(spec.id))
                .min_by(|a, b| a.1.cost.total_cmp(&b.1.cost));
            match weakest {
                Some((_, smaller)) if !self.evidence(smaller, &here).convinces() => {
                    here = smaller.clone();
                }
                _ => return (here, Some(without)),
            }
        }
        (here, None)
    }

    /// Puts another effect in the place of one found where it fits better, or as well with fewer parameters: a spring that rests far away
    /// is a bias.
    ///
    /// Returns the fit and what could stand in the place of its effects.
    pub(super) fn substitute(
        &self,
        found: Selection,
        report: &(dyn Fn(&str) + Sync),
    ) -> (Fit, Vec<Rival>) {
        let first = &found.first;
        let mut here = found.fit;
        let mut rivals = self.rivals(&here, found.without, first, report);
        // Each round lowers the cost or the number of parameters; a few are plenty.
        for _ in 0..MOST_EFFECTS {
            let worth = |f: &Fit| self.worth(f, &here);
            let better = rivals
                .iter()
                .enumerate()
                .flat_map(|(i, r)| r.near.iter().map(move |t| (i, t)))
                .min_by(|a, b| worth(&a.1.fit).total_cmp(&worth(&b.1.fit)));
            match better {
                _ if self.stop.wanted() => break,
                Some((i, t)) if worth(&t.fit) < worth(&here) => {
                    let spec = t.spec;
                    let fit = self.fit(
                        &t.fit.hypothesis,
                        t.fit.z.clone(),
                        &t.fit.states,
                        Effort::FULL,
                    );
                    let again = self.shaken_out(&here, &fit);
                    if self.worth(&again, &here) <= self.worth(&fit, &here) {
                        here = again;
                        let bar = here.cost + self.tolerance(&here);
                        for rival in &mut rivals {
                            rival.near.retain(|t| t.fit.cost < bar);
                        }
                    } else {
                        rivals = self.rivals_after(rivals, i, spec, &here, &fit);
                        here = fit;
                    }
                }
                _ => {
                    // What has come in an effect's place may have made another superfluous.
                    let superfluous = rivals.iter().any(|r| {
                        !r.without.hypothesis.effects.is_empty()
                            && !self.evidence(&r.without, &here).convinces()
                    });
                    if !superfluous {
                        break;
                    }
                    let without;
                    (here, without) = self.simplify(here, None, &Hypothesis::base());
                    rivals = self.rivals(&here, without, first, report);
                }
            }
        }
        (here, rivals)
    }

    /// A fit that a larger one is to replace, made again from where that one ended: stiction has windows settle beside their best initial states, and what
    /// has more parameters may only have shaken them out.
    fn shaken_out(&self, here: &Fit, larger: &Fit) -> Fit {
        if larger.hypothesis.free() <= here.hypothesis.free() {
            return here.clone();
        }
        let effort = Effort::FULL.towards(larger.cost + self.tolerance(larger));
        self.fit(&here.hypothesis, here.z.clone(), &larger.states, effort)
    }

    /// What [`Self::rivals`] gives, from what it gave before `spec` was put in the place of the `replaced`-th effect: in its place the same
    /// are near, and `before`; in those of the others, those that were near before are fitted again.
    fn rivals_after(
        &self,
        mut known: Vec<Rival>,
        replaced: usize,
        spec: &'static Spec,
        before: &Fit,
        here: &Fit,
    ) -> Vec<Rival> {
        let bar = here.cost + self.tolerance(here);
        let gone = known.remove(replaced);
        let mut rivals: Vec<Rival> = self
            .without_each(here, None)
            .into_iter()
            .zip(known)
            .map(|((kept, without), known)| {
                let near = known.near.into_par_iter().map(|t| {
                    let h = without.hypothesis.with(t.spec);
                    let mut z = without.z.clone();
                    z.extend(&t.fit.z[t.fit.z.len() - t.spec.parameters.len()..]);
                    let fit = self.fit(&h, z, &here.states, Effort::FULL.towards(bar));
                    let evidence = self.evidence(&without, &fit);
                    Trial { fit, evidence, ..t }
                });
                Rival {
                    spec: kept,
                    near: near.filter(|t| t.fit.cost < bar).collect(),
                    without,
                }
            })
            .collect();
        let mut near: Vec<Trial> = gone.near;
        near.retain(|t| t.spec.id != spec.id && t.fit.cost < bar);
        if before.cost < bar {
            near.push(Trial {
                spec: gone.spec,
                evidence: self.evidence(&gone.without, before),
                fit: before.clone(),
            });
        }
        rivals.push(Rival {
            spec,
            without: gone.without,
            near,
        });
        rivals
    }

    /// By how much more a rival may cost that is said to be confusable.
    fn tolerance(&self, here: &Fit) -> f64 {
        let floor = self.floor();
        CONFUSABLE * (here.cost - floor).max(0.0) + 2.0 * LEAST_GAIN * (here.cost / floor).max(1.0)
    }

    /// The larger what an effect gains, the fewer digits of it are computed. A fit without one of them that is `known` is where that one starts.
    fn without_each(&self, here: &Fit, known: Option<&Fit>) -> Without {
        let effort = Effort::FULL.above(here.cost);
        here.hypothesis
            .effects
            .clone()
            .into_par_iter()
            .map(|spec| {
                let (h, z) = here.without(spec);
                let fit = match known {
                    Some(k) if k.hypothesis.is(&h) => self.fit(&h, k.z.clone(), &k.states, effort),
                    _ => self.fit(&h, z, &here.states, effort),
                };
                (spec, fit)
            })
            .collect()
    }

    /// What [`Self::rivals`] gives where nobody has the time to look for rivals.
    pub(super) fn unrivalled(&self, here: &Fit) -> Vec<Rival> {
        self.without_each(here, None)
            .into_iter()
            .map(|(spec, without)| Rival {
                spec,
                without,
                near: Vec::new(),
            })
            .collect()
    }

    /// A simpler rival of `spec` that comes close is fitted again from where `here` ended: it may have stopped short of what it can explain, for what came
    /// before it had no place to be right in (a kick moves to where friction is missing).
    fn started_again(&self, here: &Fit, spec: &Spec, without: &Fit, t: Trial, bar: f64) -> Trial {
        if t.fit.hypothesis.free() >= here.hypothesis.free() {
            return t;
        }
        let (_, mut z) = here.without(spec);
        z.extend(&t.fit.z[t.fit.z.len() - t.spec.parameters.len()..]);
        let effort = Effort::FULL.towards(bar);
        let fit = self.fit(&t.fit.hypothesis, z, &here.states, effort);
        if fit.cost >= t.fit.cost {
            return t;
        }
        let evidence = self.evidence(without, &fit);
        Trial { fit, evidence, ..t }
    }

    /// Look-alikes of an effect with fewer parameters, fitted in its place from where `here` ended: what is nested in it is not to be missed for a bad
    /// start. Those that are `known` to come close are not asked.
    fn simpler(
        &self,
        here: &Fit,
        spec: &'static Spec,
        without: &Fit,
        known: &[&str],
        bar: f64,
    ) -> Vec<Trial> {
        let Some(index) = here.hypothesis.effects.iter().position(|e| e.id == spec.id) else {
            return Vec::new();
        };
        let offset = here.hypothesis.offset(index);
        let physical = here.hypothesis.physical(&here.z, self.nominal);
        self.addable(without)
            .filter(|s| {
                spec.look_alikes.contains(&s.id)
                    && s.parameters.len() < spec.parameters.len()
                    && !known.contains(&s.id)
            })
            .filter_map(|simple| {
                let h = without.hypothesis.with(simple);
                let mut z = here.z.clone();
                z.drain(offset..offset + spec.parameters.len());
                for p in simple.parameters {
                    // What has the same name is the same.
                    let same = spec.parameters.iter().position(|q| q.name == p.name);
                    let scale = (p.typical)(&self.nominal.params);
                    z.push(same.map_or(p.starts[0], |i| (physical[offset + i] - p.off) / scale));
                }
                let fit = self.fit(&h, z, &here.states, Effort::FULL.towards(bar));
                (fit.cost < bar).then(|| Trial {
                    spec: simple,
                    evidence: self.evidence(without, &fit),
                    fit,
                })
            })
            .collect()
    }

    /// For each effect, the fit without it (`without`, if known), and the others that would explain the data nearly as well in its place. `first` are
    /// the candidates for a single effect.
    pub(super) fn rivals(
        &self,
        here: &Fit,
        without: Option<Without>,
        first: &[Trial],
        report: &(dyn Fn(&str) + Sync),
    ) -> Vec<Rival> {
        let bar = here.cost + self.tolerance(here);
        without
            .unwrap_or_else(|| self.without_each(here, None))
            .into_iter()
            .map(|(spec, without)| {
                let trials = if here.hypothesis.effects.len() == 1 {
                    first.to_vec()
                } else {
                    self.candidates(&without, Some((spec, bar)), report)
                };
                let (again, mut near): (Vec<Trial>, Vec<Trial>) = trials
                    .into_iter()
                    .filter(|t| t.spec.id != spec.id)
                    .partition(|t| is_close(here, &without, t));
                let known: Vec<&str> = again.iter().map(|t| t.spec.id).collect();
                near.extend(self.simpler(here, spec, &without, &known, bar));
                near.extend(
                    again
                        .into_iter()
                        .map(|t| self.started_again(here, spec, &without, t, bar)),
                );
                near.retain(|t| t.fit.cost < bar);
                Rival {
                    spec,
                    without,
                    near,
                }
            })
            .collect()
    }
}

/// Whether a rival comes near enough to `here` to be fitted to the end.
fn is_close(here: &Fit, without: &Fit, t: &Trial) -> bool {
    t.fit.cost - here.cost < (1.0 - CLOSE) * (without.cost - here.cost)
}
