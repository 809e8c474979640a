//! What the recordings say: the refitted sheet, the names that hold beside it, and what else was suspected.

use std::sync::Arc;

use furuta_model::{Spec, effects};

use super::additions::Trial;
use super::apart::Apart;
use super::custom::{self, Custom};
use super::deadlines::Deadlines;
use super::filtered::makes_late;
use super::hypothesis::{Hypothesis, Sheet};
use super::judge::{Judge, Judged};
use super::progress::Teller;
use super::request::Options;
use super::result::{Part, Suspected};
use super::search::{Rival, Search, Searched};
use super::stretch::Stretch;
use super::subset::Subset;
use super::{Fit, constancy, horizons, savers};
use crate::shooting::{Data, Effort, Problem};

/// The most usual effects that are looked for together before those that few rigs have, so that these are found before
/// larger sets that imitate them are searched.
pub(super) const USUAL: usize = 2;

/// What a diagnosis works on.
pub(super) struct Work<'a> {
    pub(super) data: &'a Data,
    /// Short windows, until it is time to judge; and the same until there is no time at all.
    pub(super) short: Problem<'a>,
    pub(super) calm: Problem<'a>,
    pub(super) apart: Apart<'a>,
    /// Whether the readings were filtered.
    pub(super) filtered: bool,
    pub(super) options: Options<'a>,
    pub(super) deadlines: Deadlines<'a>,
    pub(super) teller: &'a Teller<'a>,
}

/// Stages that a person is told of.
const SEARCHING: &str = "searching";
const SEARCHING_RARE: &str = "searching among rare effects";

/// What a search among the effects that few rigs have came to.
enum Rare<'s> {
    /// It explains the data: the search, over all windows, with the names.
    Explain(Box<Search<'s>>, Fit),
    /// Something is left beside the nearest set with such an effect; a fit to the windows where the search ended.
    Left(Fit),
    /// No such effect came near.
    None,
}

/// What was found.
pub(super) struct Found {
    /// The sheet as given, and refitted.
    pub(super) as_given: Fit,
    pub(super) refitted: Fit,
    /// With the names that hold.
    pub(super) named: Fit,
    /// Each name, what the data say without it, and who may stand in its place.
    pub(super) rivals: Vec<Rival>,
    pub(super) suspected: Vec<Suspected>,
    /// An expression for what no name explains.
    pub(super) custom: Option<Custom>,
    /// Each candidate added to the refitted sheet alone.
    pub(super) first: Vec<Trial>,
    /// The names fitted over long horizons, where that was done.
    pub(super) finished: Option<Fit>,
    /// What was left out for want of time.
    pub(super) unfinished: Vec<Part>,
}

impl Found {
    /// The fit with everything that was found.
    pub(super) fn whole(&self) -> &Fit {
        self.custom.as_ref().map_or(&self.named, |c| &c.fit)
    }

    /// Names that the expression says in other words are suspected, not named; and what is suspected is no rival.
    fn settle_rivals(&mut self) {
        let model = self.whole().model.clone();
        for rival in self.rivals.iter().filter(|r| !model.has(r.spec.id)) {
            self.suspected.retain(|s| s.id != rival.spec.id);
            self.suspected.push(Suspected::expressed(rival.spec));
        }
        self.rivals.retain(|r| model.has(r.spec.id));
        for rival in &mut self.rivals {
            (rival.near).retain(|t| self.suspected.iter().all(|s| s.id != t.spec.id));
        }
    }
}

impl Work<'_> {
    /// Effects that explain the data and are not named: their values contradict the name, or the readings were filtered
    /// and they make the rig late, as a filter does.
    pub(super) fn contradicted(&self, named: &Fit) -> impl Iterator<Item = Suspected> {
        let by_values = named.model.contradictions(&named.z);
        let late = named.model.effects.iter();
        let late = late.filter(|e| self.filtered && makes_late(e));
        by_values
            .map(|(spec, why)| Suspected::contradicted(spec, why))
            .chain(late.map(|spec| Suspected::filtered(spec)))
    }

    /// Refits the sheet, looks for names, and judges them; or a stretch that is to be left out, where one may be.
    pub(super) fn find(&self, sheet: &Arc<Sheet>, may_leave_out: bool) -> Result<Found, Stretch> {
        let (short, calm) = (&self.short, &self.calm);
        let Deadlines { stop, hurry, end } = self.deadlines;
        let mut unfinished: Vec<Part> = Vec::new();
        self.teller.stage("recalibrating");
        let base = Hypothesis::base(sheet);
        let mut given = vec![0.0; base.len()];
        if base.sees_angle() {
            // Where an encoder was zeroed says nothing against a rig.
            given = short.with_zeros(&base, &given);
        }
        let as_given = short.solve_states(&base, &given, None);
        let refitted = short.fit(&base, as_given.z.clone(), &as_given.states, Effort::FULL);
        if hurry.wanted() {
            unfinished.push(Part::Parameters);
        }

        self.teller.stage(SEARCHING);
        let told = self.teller.candidates(SEARCHING);
        let told_rare = self.teller.candidates(SEARCHING_RARE);
        let subset = short.subset(&refitted, savers::of(&self.options).windows);
        let few = |search: &Search<'_>| {
            search.explains() || search.closest().model.effects.len() <= USUAL
        };
        let begun = self.begun(subset.as_ref(), &refitted, &told);
        let mut search = self.go_on(begun, subset.as_ref(), &refitted, &few);
        // What the usual effects leave may be one that few rigs have; what several of them explain may be one such.
        let several = search.explains().then(|| search.closest());
        let rare = match &several {
            _ if hurry.wanted() => Rare::None,
            Some(several) if several.model.effects.len() < 2 => Rare::None,
            _ => {
                let known = (subset.as_ref(), search.at_first());
                self.among_all(&refitted, several.as_ref(), known, &told_rare)
            }
        };
        let (mut by_rare, mut left) = (None, None);
        match rare {
            Rare::Explain(search, named) => by_rare = Some((*search, named)),
            Rare::Left(fit) => left = Some(fit),
            Rare::None => (),
        }
        if may_leave_out && by_rare.is_none() && !search.explains() && !stop.wanted() {
            let closest = match search.closest() {
                closest if search.is_over(short) => closest,
                of_subset => calm.transferred(&refitted, &of_subset, Effort::FULL),
            };
            if let Some(stretch) = self.stretch(&refitted, &closest) {
                return Err(stretch);
            }
        }
        if by_rare.is_none() {
            search = self.go_on(search, subset.as_ref(), &refitted, &|_| true);
        }
        let first = std::mem::take(&mut search.first);
        let cut = by_rare.is_none() && !search.is_through();
        // What comes of the names is asked of the search that found them.
        let (mut search, mut named) = by_rare.unwrap_or_else(|| {
            let named = search.best();
            (search, named)
        });
        let mut rivals = search.rivals(&named);
        // Limits are for what is always looked for, and for what was asked for.
        named.model.sheet = Arc::clone(&refitted.model.sheet);
        let explains = |f: &Fit| short.explains(f);
        // Where even short windows are far from what was measured, long ones say no more.
        if !explains(&named) && !short.is_far(&named) && !hurry.wanted() {
            let further = self.over_long_windows(&named);
            if further.model.effects.len() > named.model.effects.len() {
                named = further;
                rivals = search.rivals(&named);
            }
        }

        // From here on every fit is made to its end, as long as there is time at all.
        search.calmly(calm);
        let mut suspected = Vec::new();
        if cut || (!explains(&named) && hurry.wanted()) {
            // Names of finished rounds stay if they stand up to a fit to the end; who else might stand in their place
            // was not looked at.
            unfinished.extend([Part::Search, Part::Rivals]);
            // Far from the data an effect may stand for what was not come to.
            if short.is_far(&named) {
                named = refitted.clone();
            }
            // What the best set so far has beside the names is suspected: it was not gone through.
            let so_far = search.closest().model;
            let beside = so_far.effects.iter().filter(|e| !named.model.has(e.id));
            suspected.extend(beside.map(|e| Suspected::unfinished(e)));
            if !named.model.effects.is_empty() {
                let (model, z) = (named.model.clone(), named.z.clone());
                named = calm.simplified(calm.fit(&model, z, &named.states, Effort::FULL));
            }
            rivals = search.rivals(&named);
            if end.wanted() {
                // Even that was not made to its end.
                suspected.extend(named.model.effects.iter().map(|e| Suspected::unjudged(e)));
                (named, rivals) = (refitted.clone(), Vec::new());
            }
        }

        let judge = Judge {
            problem: calm,
            apart: &self.apart,
            finished: &|fit: &Fit, explained| horizons::finish(self.data, fit, explained, stop),
            base: &refitted,
            search: &search,
            stop,
        };
        // A model that leaves no more than the noise has nothing that a name could stand in for.
        let explained = explains(&named);
        let judged = if explained {
            judge.certain(named, rivals)
        } else {
            self.teller.stage("judging");
            let nearer = left
                .filter(|_| !hurry.wanted())
                .map(|left| calm.transferred(&refitted, &left, Effort::FULL));
            judge.judge(named, rivals, nearer)
        };
        let Judged {
            named,
            rivals,
            finished,
            ..
        } = judged;
        suspected.extend(judged.suspected);
        if explained && named.model.has_blows() {
            // Blows are not quite the law's, and what they leave is imitated like any other rest.
            suspected.extend(constancy::scattered(calm, &named));
        }
        // What has one strength everywhere is of another law all the same if it contradicts its name.
        for reason in self.contradicted(&named) {
            suspected.retain(|s: &Suspected| s.id != reason.id);
            suspected.push(reason);
        }
        let mut custom = None;
        if !explains(&named) && stop.wanted() {
            unfinished.push(Part::Expression);
        } else if !explains(&named) && self.options.pendulum.is_whole() {
            self.teller.stage("looking for an expression");
            let without = self.apart.unseen(&named);
            let folds = &self.apart.folds;
            custom = custom::propose(calm, folds, &refitted, (&named, &without));
            if end.wanted() {
                unfinished.push(Part::Expression);
            }
        }
        let mut found = Found {
            as_given,
            refitted,
            named,
            rivals,
            suspected,
            // With an expression beside them, the names were not fitted over long horizons.
            finished: finished.filter(|_| custom.is_none()),
            custom,
            first,
            unfinished,
        };
        found.settle_rivals();
        Ok(found)
    }

    /// A search over short windows, on a subset of them where there is one.
    fn begun<'s>(
        &'s self,
        subset: Option<&'s Subset<'s>>,
        start: &Fit,
        report: &'s (dyn Fn(&str) + Sync),
    ) -> Search<'s> {
        let (problem, mut here) = subset.map_or_else(
            || (&self.short, start.clone()),
            |subset| (&subset.problem, subset.start.clone()),
        );
        here.model = start.model.clone();
        Search::new(problem, here, &|_| true, savers::of(&self.options), report)
    }

    /// Goes on with a search from `start` as long as that is `wanted`: on the subset where it was begun until nothing
    /// is left there, or nothing more can be found, then on all windows.
    fn go_on<'s>(
        &'s self,
        mut search: Search<'s>,
        subset: Option<&'s Subset<'s>>,
        start: &Fit,
        wanted: &dyn Fn(&Search<'s>) -> bool,
    ) -> Search<'s> {
        if let Some(subset) = subset.filter(|subset| search.is_over(&subset.problem)) {
            // Where a drive gives way a window takes from the one before how the rotor stands, and in a subset many
            // have none before them: what is near the data there may explain it.
            let has_more = |search: &Search<'s>| {
                let best = search.closest();
                let is_told = match best.model.has_drive() {
                    true => !subset.problem.is_far(&best),
                    false => subset.problem.explains(&best),
                };
                !(search.is_settled() && is_told)
            };
            search.run_while(|search| has_more(search) && wanted(search));
            if has_more(&search) && !wanted(&search) {
                return search;
            }
            search = search.onto(&self.short, start.clone());
        }
        search.run_while(wanted);
        search
    }

    /// The names that explain the data, and the search that found them, where what few rigs have is looked for as well;
    /// or what came nearest. All windows are looked at only where nothing is left in a subset of them. One such effect
    /// beside the usual ones must do: larger sets imitate. Where `several` effects explain the data, fewer must do it
    /// better. What the search for the usual ones has found in the `subset` where it began need not be found again.
    fn among_all<'s>(
        &'s self,
        refitted: &Fit,
        several: Option<&Fit>,
        (subset, known): (Option<&'s Subset<'s>>, Searched),
        told: &'s (dyn Fn(&str) + Sync),
    ) -> Rare<'s> {
        self.teller.stage(SEARCHING_RARE);
        let mut start = refitted.clone();
        let usual = &refitted.model.sheet.looked_for;
        start.model = start
            .model
            .looking_for(usual.iter().copied().chain(effects::on_request()));
        // In the place of several stand entries on request, alone or beside some of the several.
        let mut narrow = start.clone();
        if let Some(several) = several {
            narrow.model = (narrow.model)
                .looking_for(effects::on_request().chain(several.model.effects.iter().copied()));
        }
        let mut search = self.begun(subset, &narrow, told).knowing(known);
        let most = several.map_or(USUAL + 1, |f| f.model.effects.len() - 1);
        let may_grow = |search: &Search<'_>| {
            let explains = search.explains();
            let has_room = search.closest().model.effects.len() < most;
            (explains && !search.is_settled()) || (has_room && (several.is_some() || !explains))
        };
        search.run_while(may_grow);
        let is_rare = |e: &&Spec| effects::on_request().any(|rare| rare.id == e.id);
        let found = |search: &Search<'_>| search.closest().model.effects.iter().any(is_rare);
        // What happens once need not happen in a subset: where the usual effects explain that, all is looked at.
        if several.is_none() && subset.is_some() && search.explains() && !found(&search) {
            search = search.onto(&self.short, start.clone());
            search.run_while(may_grow);
        }
        if !found(&search) {
            return Rare::None;
        }
        if !search.explains() {
            return Rare::Left(search.closest());
        }
        if !search.is_over(&self.short) {
            search = search.onto(&self.short, start);
        }
        let named = search.run();
        let is_worse = |several: &Fit| {
            let unit = (self.short.per_sample(several)).min(self.short.per_sample(&named));
            self.short.score(several, unit) <= self.short.score(&named, unit)
                || several.model.effects.len() <= named.model.effects.len()
        };
        if !self.short.explains(&named) || !search.is_through() || several.is_some_and(is_worse) {
            return Rare::None;
        }
        Rare::Explain(Box::new(search), named)
    }

    /// What long windows add to the names of short ones.
    fn over_long_windows(&self, named: &Fit) -> Fit {
        const STAGE: &str = "searching over long windows";
        self.teller.stage(STAGE);
        horizons::search(
            &self.short,
            self.data,
            named.clone(),
            savers::of(&self.options),
            &self.teller.candidates(STAGE),
        )
    }
}
