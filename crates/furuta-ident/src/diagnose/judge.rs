//! Where nothing is left unexplained, each strength must be known by itself. Where something is, names must hold:
//! against what is looked for on request alone (`contested`), as what acts once (`transients`), on data kept apart
//! (`held_out`), and with one strength everywhere (`constancy`). What does not is suspected, not named. What fails the
//! last test alone stays in the model: it predicts, as an imitation.

use furuta_model::Spec;

use super::Fit;
use super::apart::Apart;
use super::constancy;
use super::contested::StandIns;
use super::evidence;
use super::held_out::Unseen;
use super::result::Suspected;
use super::search::{Rival, Search};
use super::transients;
use crate::shooting::{Effort, Problem};
use crate::stop::Stop;

/// What names are judged with.
pub(super) struct Judge<'a> {
    pub(super) problem: &'a Problem<'a>,
    pub(super) apart: &'a Apart<'a>,
    /// A fit of a model over long horizons, whether or not it explains the data: its numbers are told.
    pub(super) finished: &'a dyn Fn(&Fit, bool) -> Fit,
    /// What is left where there is no time to judge.
    pub(super) base: &'a Fit,
    pub(super) search: &'a Search<'a>,
    pub(super) stop: Stop<'a>,
}

/// What is left of a search.
pub(super) struct Judged {
    pub(super) named: Fit,
    pub(super) rivals: Vec<Rival>,
    pub(super) suspected: Vec<Suspected>,
    /// The named effects fitted over long horizons, where that was done.
    pub(super) finished: Option<Fit>,
}

impl Judged {
    /// Other names are left.
    fn set_named(&mut self, search: &Search<'_>, named: Fit) {
        self.rivals = search.rivals(&named);
        self.named = named;
        self.finished = None;
    }
}

impl Judge<'_> {
    /// The names that hold. Entries on request that explain more than a name stand in its place meanwhile; a fit with
    /// such entries may be known that is nearer.
    pub(super) fn judge(&self, named: Fit, rivals: Vec<Rival>, nearer: Option<Fit>) -> Judged {
        let (stand_ins, standing) =
            StandIns::find(self.problem, named, nearer, self.search.savers());
        // Nothing is left with them: they are what was sought.
        if !stand_ins.is_empty() && self.problem.explains(&standing) {
            return Judged {
                rivals: self.search.rivals(&standing),
                named: standing,
                suspected: Vec::new(),
                finished: None,
            };
        }
        let mut judged = Judged {
            rivals: if stand_ins.is_empty() {
                rivals
            } else {
                self.search.rivals(&standing)
            },
            named: standing,
            suspected: Vec::new(),
            finished: None,
        };
        if !self.problem.explains(&judged.named) {
            self.lasting(&mut judged);
            self.predicting(&mut judged, &stand_ins, Unseen::is_better_than);
            self.known_alone(&mut judged, &stand_ins);
        }
        let left = !self.problem.explains(&judged.named);
        if !stand_ins.is_empty() {
            let (named, contested) = stand_ins.taken_out(self.problem, judged.named.clone());
            judged.suspected.extend(contested);
            judged.set_named(self.search, named);
        }
        if left {
            let scattered = constancy::scattered(self.problem, &judged.named);
            judged.suspected.extend(scattered);
        }
        judged
    }

    /// The names that hold of a model that explains the data: data kept apart must not be predicted worse, and each
    /// strength must be known by itself. Something is left after all where a name falls that was needed.
    pub(super) fn certain(&self, named: Fit, rivals: Vec<Rival>) -> Judged {
        let mut judged = Judged {
            named,
            rivals,
            suspected: Vec::new(),
            finished: None,
        };
        self.lasting(&mut judged);
        self.predicting(&mut judged, &StandIns::default(), Unseen::is_no_worse_than);
        if !self.problem.explains(&judged.named) {
            let mut left = self.judge(judged.named, judged.rivals, None);
            left.suspected.splice(0..0, judged.suspected);
            return left;
        }
        let mut finished = (self.finished)(&judged.named, true);
        while let Some(spec) = evidence::uncertain(&finished, |_| true) {
            let smaller = self.without(&judged.named, spec);
            self.drop(&mut judged, smaller, Suspected::uncertain(spec));
            finished = (self.finished)(&judged.named, true);
        }
        judged.finished = self.problem.explains(&judged.named).then_some(finished);
        judged
    }

    /// Takes out what acts once and does not last over long windows, or comes again.
    fn lasting(&self, judged: &mut Judged) {
        for (spec, why) in transients::to_drop(self.problem, &judged.named) {
            let smaller = self.without(&judged.named, spec);
            self.drop(judged, smaller, why);
        }
    }

    fn without(&self, named: &Fit, spec: &Spec) -> Fit {
        self.problem.without(named, spec.id, Effort::FULL)
    }

    fn drop(&self, judged: &mut Judged, smaller: Fit, why: Suspected) {
        judged.suspected.push(why);
        judged.set_named(self.search, smaller);
    }

    /// Whether data kept apart say nothing of an effect.
    fn is_untold(&self, spec: &Spec) -> bool {
        spec.acts_once() || self.base.model.sheet.zeros_follow(spec)
    }

    /// Takes out, one at a time, what data kept apart say nothing of and whose strength, as it would be told, may as
    /// well be none.
    fn known_alone(&self, judged: &mut Judged, stand_ins: &StandIns) {
        let asked = |spec: &Spec| self.is_untold(spec) && !stand_ins.has(spec);
        while judged.named.model.effects.iter().any(|e| asked(e)) {
            let told = (self.finished)(&judged.named, false);
            let Some(spec) = evidence::uncertain(&told, asked) else {
                judged.finished = Some(told);
                return;
            };
            let smaller = self.without(&judged.named, spec);
            self.drop(judged, smaller, Suspected::uncertain(spec));
        }
    }

    /// Takes out, one at a time, the effects with which data kept apart are not predicted as they must be (`holds`, of
    /// what is left with the effect and without it); not what acts once, which no other recording holds, nor what the
    /// own zero of a recording kept apart follows as well, nor what stands in.
    fn predicting(
        &self,
        judged: &mut Judged,
        stand_ins: &StandIns,
        holds: impl Fn(&Unseen, &Unseen) -> bool,
    ) {
        while stand_ins.named(&judged.named).next().is_some() {
            if self.stop.wanted() {
                let left = stand_ins.named(&judged.named).map(Suspected::unjudged);
                judged.suspected.extend(left);
                judged.named = self.base.clone();
                judged.rivals = Vec::new();
                judged.finished = None;
                return;
            }
            let here = self.apart.unseen(&judged.named);
            let worst = judged
                .rivals
                .iter()
                .filter(|r| !self.is_untold(r.spec) && !stand_ins.has(r.spec))
                .map(|r| (r, self.apart.unseen(&r.without)))
                .filter(|(_, without)| !holds(&here, without))
                .min_by(|a, b| a.1.level().total_cmp(&b.1.level()));
            if self.stop.wanted() {
                // What was judged in a hurry was not judged.
                continue;
            }
            let Some((rival, without)) = worst else {
                return;
            };
            let why = if here.is_mostly_better_than(&without) {
                Suspected::worse(rival.spec, here.squared / without.squared)
            } else {
                Suspected::new(rival.spec, here.horizons, without.horizons)
            };
            let again = self.without(&judged.named, rival.spec);
            if again.cost < rival.without.cost {
                self.drop(judged, again, why);
            } else {
                let smaller = rival.without.clone();
                self.drop(judged, smaller, why);
            }
        }
    }
}
