//! The answer: what was found, fitted over long horizons, judged on data kept apart, and put into words and numbers.

use std::sync::Arc;

use super::additions::Trial;
use super::find::{Found, Work};
use super::gap::gap;
use super::predict::Predictor;
use super::result::{Best, CandidateEvidence, Part};
use super::{Curves, Diagnosis, Fit, Outcome, Request, Verdict};
use super::{bounds, held_out, horizons, jitter, limits, naming, plan, repair, verify};

impl Work<'_> {
    /// From what was found to what is told.
    pub(super) fn answer(&self, request: &Request<'_>, mut found: Found) -> Outcome {
        let (data, rig, stop) = (self.data, request.rig, self.deadlines.stop);
        let explained = self.short.explains(&found.named);
        self.teller.stage("fitting");
        let finished = found.finished.take();
        let (base_fit, named_fit) = {
            let whole = found.whole();
            rayon::join(
                || horizons::finish(data, &found.refitted, explained, stop),
                || {
                    let finish = || horizons::finish(data, whole, self.short.explains(whole), stop);
                    finished.unwrap_or_else(finish)
                },
            )
        };
        if stop.wanted() && !explained {
            found.unfinished.push(Part::LongHorizons);
        }

        let mut diagnosis = Diagnosis::new(self.verdict(&found));
        if self.options.plan && self.options.pendulum.is_whole() {
            self.teller.stage("planning");
            diagnosis.plan = plan::plan(rig, data, &found.named, &found.rivals, stop);
            if stop.wanted() {
                found.unfinished.push(Part::Plan);
            }
        }
        let of_base = bounds::at_bounds(rig, &base_fit, Best::Refitted);
        let of_named = bounds::at_bounds(rig, &named_fit, Best::Repaired);
        let possible = [of_base.is_empty(), of_named.is_empty()];
        let gains = self.judged_apart(&mut found, possible, &mut diagnosis);
        let rivals = std::mem::take(&mut found.rivals);
        diagnosis.effects = naming::effects(&self.calm, &found.named, &named_fit, rivals, &gains);
        let is_kept = |id: &str| found.suspected.iter().any(|s| s.kept && s.id == id);
        diagnosis.effects.retain(|e| !is_kept(&e.id));
        diagnosis.suspected = std::mem::take(&mut found.suspected);
        diagnosis.custom = found.custom.as_ref().map(|c| c.refitted(&named_fit));
        if found.unfinished.contains(&Part::Rivals) {
            for effect in &mut diagnosis.effects {
                effect.confusable_with = naming::not_ruled_out(&effect.id, &found.named);
            }
        }
        diagnosis.next_experiment = naming::next_experiment(&diagnosis.effects);
        diagnosis.parameters = repair::parameters(
            rig,
            &repair::repaired(rig, &named_fit),
            &named_fit,
            &of_named,
        );
        diagnosis.at_bound = of_base.into_iter().chain(of_named).collect();
        if stop.wanted() {
            found.unfinished.push(Part::Limits);
        } else if diagnosis.why_no_limits().is_none() {
            diagnosis.limits = limits::limits(&self.calm, found.whole());
        }
        diagnosis.interrupted = stop.asked() && !found.unfinished.is_empty();
        diagnosis.unfinished = std::mem::take(&mut found.unfinished);

        diagnosis.jitter = jitter::jitter(data, rig.sensors.resolution());
        let best = match diagnosis.best {
            Best::Given => rig.clone(),
            Best::Refitted => repair::repaired(rig, &base_fit),
            Best::Repaired => repair::repaired(rig, &named_fit),
        };
        diagnosis.zeros = naming::zeros(request.recordings, &named_fit);
        let mut curves = Curves {
            rig: rig.name.clone(),
            repaired_rig: Some(best.to_toml()),
            evidence: evidence(&found),
            ..Curves::default()
        };
        let models = &[&found.as_given, &base_fit, &named_fit].map(Predictor::from);
        gap(data, models, &mut diagnosis, &mut curves);
        if !request.verify.is_empty() {
            self.teller.stage("verifying");
            let unseen = self.options.data(request.verify, rig);
            verify::verify(&unseen, models, &mut diagnosis, &mut curves);
        }
        if let Some(notice) = self.options.pendulum.notice() {
            diagnosis.notices.push(notice.to_owned());
            diagnosis.forget(self.options.pendulum);
        }
        Outcome {
            diagnosis,
            curves,
            repaired: best,
        }
    }

    fn verdict(&self, found: &Found) -> Verdict {
        let explains = |fit: &Fit| self.short.explains(fit);
        let contradicted = || self.contradicted(&found.named).next().is_some();
        if !explains(&found.named) || contradicted() {
            Verdict::Unexplained
        } else if !found.named.model.effects.is_empty() {
            Verdict::MissingEffects
        } else if explains(&found.as_given) {
            Verdict::NoGap
        } else {
            Verdict::ParametersOnly
        }
    }

    /// What data kept apart say of the sheet, of the names and of each name: its gain, in their order, not a number
    /// where time ran out. `possible`: whether the numbers of the refitted and of the repaired model can be.
    fn judged_apart(
        &self,
        found: &mut Found,
        possible: [bool; 2],
        diagnosis: &mut Diagnosis,
    ) -> Vec<f64> {
        let unknown = vec![f64::NAN; found.rivals.len()];
        let (stop, end) = (self.deadlines.stop, self.deadlines.end);
        let judged = (!stop.wanted()).then(|| {
            let apart = &self.apart;
            let before = apart.unseen(&found.refitted);
            let after = if found.named.model.effects.is_empty() {
                Arc::clone(&before)
            } else {
                apart.unseen(&found.named)
            };
            let whole = found.custom.as_ref().map_or(&after.errors, |c| &c.errors);
            let held_out = held_out::compared(self.data, &before.errors, whole);
            let gain = |without: &Fit| {
                let without = if without.model.effects.is_empty() {
                    Arc::clone(&before)
                } else {
                    apart.errors(without)
                };
                after.removes_of(&without)
            };
            let gains: Vec<f64> = found.rivals.iter().map(|r| gain(&r.without)).collect();
            let repaired = found.custom.as_ref().map(|c| apart.unseen(&c.fit));
            let given = apart.as_it_is(&found.as_given);
            let repaired = repaired.as_ref().unwrap_or(&after);
            let best = held_out::best(&given, [&before, repaired], possible);
            (held_out, gains, best)
        });
        // What ran out of time says nothing, and what was not judged is not written.
        diagnosis.best = Best::Given;
        match judged.filter(|_| !end.wanted()) {
            Some((held_out, gains, best)) => {
                if held_out.is_some() {
                    diagnosis.best = best;
                }
                diagnosis.held_out = held_out;
                gains
            }
            None => {
                found.unfinished.push(Part::HeldOut);
                unknown
            }
        }
    }
}

/// What spoke for each candidate added to the refitted sheet alone.
fn evidence(found: &Found) -> Vec<CandidateEvidence> {
    let of = |t: &Trial| CandidateEvidence {
        id: t.spec.id.into(),
        delta_bic: t.evidence.delta_bic,
        named: found.whole().model.has(t.spec.id),
    };
    found.first.iter().map(of).collect()
}
