//! Which effects are missing: forward selection with evidence, backward elimination, and what is confusable.

use furuta_model::effects::{Acts, Law};
use furuta_model::{CATALOGUE, Spec};
use rayon::prelude::*;

use super::data::Window;
use super::fit::{Effort, Fit, Problem};
use super::hypothesis::{FIRST_EFFECT, Hypothesis, is_late};
use super::scout::{self, Scout};
use super::shooting::MAX_FREE;

/// The most effects that are looked for together.
pub(super) const MOST_EFFECTS: usize = 4;
/// The least fall of the cost (chi², in units of what the better model leaves) that names an effect: a look-elsewhere-corrected
/// five-sigma event for one or two parameters among the catalogue's entries.
const LEAST_GAIN: f64 = 30.0;
/// From how many windows, effectively, a gain must come: `n` windows that all gain alike count `n`, one window alone counts 1, gains and losses
/// that nearly cancel count less. Where there are few windows, an eighth of them.
const LEAST_WINDOWS: f64 = 2.5;

/// By which factor the excess over the noise must fall where there is much of it: a model that is wrong elsewhere gains a little from
/// almost anything.
const LEAST_FACTOR: f64 = 1.25;
/// Relative uncertainty of the noise floor's square: below, the excess is not known.
const FLOOR_UNCERTAINTY: f64 = 0.08;
/// Full fits go to so many of the candidates at most.
const SHORT_LIST: usize = 4;
/// The same for an effect that is local in time: thousands of places are looked at, and any one spoilt window must not pass for it.
const LEAST_LOCAL_GAIN: f64 = 100.0;
/// So many candidates are fitted, the most promising by a score test.
const FOLLOWED: usize = 8;
/// Each from so many starts.
const STARTS: usize = 2;
/// What promises less than this share of the best, or of what would convince, is not followed: over the catalogue, a fit gains up to four times what
/// the score test promises where the effect's form depends on its parameters.
const WORTH: f64 = 0.25;
/// The last digits are for those that gain at least this share of what the best gains.
const CLOSE: f64 = 0.8;
/// Strength (in units of the typical one) at which a candidate that starts from none is tried.
const TOUCH: f64 = 0.3;
/// A kick must gain so many times what nine of ten windows have left at most: where the model is wrong in many places, something always gains a
/// little in one.
const STANDS_OUT: f64 = 3.0;
/// A rival whose excess is within this share is confusable.
const CONFUSABLE: f64 = 0.10;

/// A candidate compared with the hypothesis it extends.
#[derive(Clone, Debug)]
pub(super) struct Trial {
    pub(super) spec: &'static Spec,
    pub(super) fit: Fit,
    pub(super) evidence: Evidence,
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

/// What speaks for the larger of two nested hypotheses.
#[derive(Clone, Copy, Debug)]
pub(super) struct Evidence {
    /// Fall of the cost without the window that gains most, in units of what the larger model leaves per sample (at least the noise).
    pub(super) elsewhere: f64,
    /// From how many windows it comes, effectively: its square over the sum of its windows' squares.
    pub(super) windows: f64,
    /// How many there must be.
    pub(super) windows_needed: f64,
    /// The least fall of the cost.
    pub(super) least: f64,
    /// Factor by which the excess over the noise falls.
    pub(super) factor: f64,
    /// Fall of the Bayesian information criterion.
    pub(super) delta_bic: f64,
}

impl Evidence {
    /// Whether the larger hypothesis is to be believed.
    pub(super) fn convinces(&self) -> bool {
        self.helps() && self.delta_bic > 0.0 && self.factor > LEAST_FACTOR
    }

    /// Whether the larger hypothesis is better, and not in one place alone.
    pub(super) fn helps(&self) -> bool {
        self.elsewhere > self.least && self.windows > self.windows_needed
    }
}

/// The catalogue's entries that are looked for. Late encoders are the same as a late command on recorded input and output, which stands
/// for both.
pub fn candidates() -> impl Iterator<Item = &'static Spec> {
    CATALOGUE
        .iter()
        .copied()
        .filter(|s| !s.acts.includes(Acts::SENSOR_DELAY))
}

/// The entries that no recording of input and output tells apart from `spec`.
pub(super) fn same_class(spec: &'static Spec) -> impl Iterator<Item = &'static Spec> {
    CATALOGUE
        .iter()
        .copied()
        .filter(move |s| s.id != spec.id && is_late(s) && is_late(spec))
}

impl Problem<'_> {
    /// Cost that a perfect model leaves: one per sample, less four per window for its initial state.
    pub(super) fn floor(&self) -> f64 {
        self.windows
            .iter()
            .map(|w| (self.window_samples(w) - 4.0).max(1.0))
            .sum()
    }

    /// Root mean square of the residuals over the noise: 1 is the floor.
    pub(super) fn chi(&self, fit: &Fit) -> f64 {
        (fit.cost / self.floor()).sqrt()
    }

    /// What speaks for `larger` over `smaller`.
    pub(super) fn evidence(&self, smaller: &Fit, larger: &Fit) -> Evidence {
        let floor = self.floor();
        let per_sample = (larger.cost / floor).max(1.0);
        let gains: Vec<f64> = smaller
            .costs
            .iter()
            .zip(&larger.costs)
            .map(|(a, b)| (a - b) / per_sample)
            .collect();
        let gain: f64 = gains.iter().sum();
        let squares: f64 = gains.iter().map(|g| g * g).sum();
        let excess = |f: &Fit| (f.cost - floor).max(FLOOR_UNCERTAINTY * floor);
        let parameters = larger.hypothesis.free() as f64 - smaller.hypothesis.free() as f64;
        let significant = (smaller.cost - floor) > FLOOR_UNCERTAINTY * floor;
        if larger.hypothesis.jumps() && !smaller.hypothesis.jumps() {
            // Judged where it acts: what the other windows gain is another minimum's.
            let gain: f64 = gains
                .iter()
                .zip(&self.windows)
                .filter(|(_, w)| self.is_kicked(larger, w))
                .map(|(g, _)| g)
                .sum();
            let mut usual = larger.costs.clone();
            usual.sort_by(f64::total_cmp);
            let usual = usual
                .get(usual.len() * 9 / 10)
                .map_or(0.0, |c| c / per_sample);
            // The part of it that is not the encoders' noise.
            let usual = usual * (1.0 - 1.0 / per_sample);
            return Evidence {
                elsewhere: gain,
                windows: 1.0,
                windows_needed: 0.0,
                least: LEAST_LOCAL_GAIN.max(STANDS_OUT * usual),
                factor: f64::INFINITY,
                delta_bic: gain - parameters * self.samples().ln(),
            };
        }
        Evidence {
            least: LEAST_GAIN,
            elsewhere: gain - gains.iter().fold(0.0, |a: f64, b| a.max(*b)),
            windows: gain * gain.abs() / squares.max(1e-300),
            windows_needed: LEAST_WINDOWS.min(gains.len() as f64 / 8.0),
            factor: if significant {
                excess(smaller) / excess(larger)
            } else {
                // Too close to the floor to judge by: the gain alone decides.
                f64::INFINITY
            },
            delta_bic: gain - parameters * self.samples().ln(),
        }
    }

    /// Whether an effect that is local in time acts within the window.
    fn is_kicked(&self, fit: &Fit, w: &Window) -> bool {
        let run = &self.data.runs[w.run];
        let begin = run.t0 + w.start as f64 * run.h;
        let end = begin + w.len as f64 * run.h;
        fit.hypothesis.local(&fit.z, self.nominal).any(|e| {
            match e.jump_after(run.recording, f64::NEG_INFINITY) {
                Some(edge) => {
                    let over = e.jump_after(run.recording, edge).unwrap_or(edge);
                    edge < end && over > begin && over > edge
                }
                None => false,
            }
        })
    }

    /// Where to start a fit with `spec` added to `from`.
    pub(super) fn starts(&self, from: &Fit, spec: &'static Spec, scout: &Scout) -> Vec<Vec<f64>> {
        // A recalibration without the effect may be far off: where the gap is large, the data sheet is a better start.
        let far = self.chi(from) > 5.0 && from.hypothesis.effects.is_empty();
        let mut starts = Vec::new();
        for nominal in [true, false] {
            if nominal && !far {
                continue;
            }
            let mut z = from.z.clone();
            if nominal {
                z[..FIRST_EFFECT].fill(0.0);
            }
            starts.push(z);
        }
        if scout::wanted(spec) {
            let typical: Vec<f64> = spec
                .parameters
                .iter()
                .map(|p| (p.typical)(&self.nominal.params))
                .collect();
            let places = scout.starts(spec, &typical);
            return starts
                .iter()
                .flat_map(|z| {
                    places.iter().map(|place| {
                        let mut z = z.clone();
                        let values = place.iter().zip(spec.parameters).zip(&typical);
                        z.extend(values.map(|((v, p), scale)| (v - p.off) / scale));
                        z
                    })
                })
                .collect();
        }
        // Every combination of the parameters' starts.
        for p in spec.parameters {
            starts = starts
                .iter()
                .flat_map(|z| {
                    p.starts.iter().map(|s| {
                        let mut z = z.clone();
                        z.push(*s);
                        z
                    })
                })
                .collect();
        }
        starts
    }

    /// The candidates that are neither in `from` nor in the rig file, and for whose parameters a fit has room.
    pub(super) fn addable(&self, from: &Fit) -> impl Iterator<Item = &'static Spec> {
        candidates()
            .filter(|s| !from.hypothesis.has(s.id) && from.z.len() + s.parameters.len() <= MAX_FREE)
            .filter(|s| {
                let present = &self.nominal.present;
                present
                    .iter()
                    .map(|e| e.spec())
                    .all(|e| e.id != s.id && !(is_late(e) && is_late(s)))
            })
    }

    /// Fits every candidate added to `from`, the best first; `report` hears of each.
    pub(super) fn candidates(&self, from: &Fit, report: &(dyn Fn(&str) + Sync)) -> Vec<Trial> {
        let specs: Vec<&'static Spec> = self.addable(from).collect();
        let scout = Scout::new(self, from);
        let jobs: Vec<(&'static Spec, Vec<f64>)> = specs
            .iter()
            .flat_map(|s| {
                self.starts(from, s, &scout)
                    .into_iter()
                    .map(move |z| (*s, z))
            })
            .collect();
        // A score test for each, with one simulation: only the most promising are fitted.
        let mut promising: Vec<(f64, &'static Spec, Vec<f64>)> = jobs
            .into_par_iter()
            .map(|(spec, z)| {
                if self.stop.wanted() {
                    return (f64::NEG_INFINITY, spec, z);
                }
                let h = from.hypothesis.with(spec);
                let mut here = from.z.clone();
                here.extend(&z[from.z.len()..]);
                // A start at no strength at all says nothing about what the effect changes.
                let strengths = &mut here[from.z.len()..][..spec.strengths];
                if strengths.iter().all(|s| *s == 0.0) {
                    strengths.fill(TOUCH);
                }
                let one_way = spec.parameters[0].min >= spec.parameters[0].off;
                let promise = scout.promise(self, from, &h, &here, one_way);
                report(spec.id);
                (promise, spec, z)
            })
            .collect();
        promising.sort_by(|a, b| b.0.total_cmp(&a.0));
        self.follow(from, &mut promising);
        let quick: Vec<(&'static Spec, Fit)> = promising
            .into_par_iter()
            .filter(|_| !self.stop.wanted())
            .map(|(_, spec, z)| {
                let h = from.hypothesis.with(spec);
                let fit = self.fit(&h, z, &from.states, Effort::QUICK);
                report(spec.id);
                (spec, fit)
            })
            .collect();
        let mut best: Vec<(&'static Spec, Fit)> = Vec::new();
        for (spec, fit) in quick {
            match best.iter_mut().find(|(s, _)| s.id == spec.id) {
                Some((_, known)) if fit.cost < known.cost => *known = fit,
                Some(_) => {}
                None => best.push((spec, fit)),
            }
        }
        best.sort_by(|a, b| a.1.cost.total_cmp(&b.1.cost));
        let lowest = best.first().map_or(0.0, |(_, f)| f.cost);
        let close = from.cost - CLOSE * (from.cost - lowest);
        let mut trials: Vec<Trial> = best
            .into_par_iter()
            .enumerate()
            .map(|(rank, (spec, fit))| {
                let fit = if rank < SHORT_LIST && fit.cost <= close {
                    self.fit(
                        &fit.hypothesis.clone(),
                        fit.z.clone(),
                        &fit.states,
                        Effort::FULL,
                    )
                } else {
                    fit
                };
                let evidence = self.evidence(from, &fit);
                Trial {
                    spec,
                    fit,
                    evidence,
                }
            })
            .collect();
        trials.sort_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost));
        trials
    }

    /// Keeps the starts that are worth a fit: of those whose promise is enough to convince, the best few of what promises nearly as much as the best.
    fn follow(&self, from: &Fit, promising: &mut Vec<(f64, &'static Spec, Vec<f64>)>) {
        let per_sample = (from.cost / self.floor()).max(1.0);
        let best = promising.first().map_or(0.0, |p| p.0);
        let mut starts: Vec<(&'static str, usize)> = Vec::new();
        promising.retain(|(promise, spec, _)| {
            let least = if spec.acts.includes(Acts::JUMPS) {
                LEAST_LOCAL_GAIN
            } else {
                LEAST_GAIN
            };
            if let Some((_, n)) = starts.iter_mut().find(|(id, _)| *id == spec.id) {
                *n += 1;
                return *n <= STARTS;
            }
            if *promise < WORTH * best || *promise < WORTH * least * per_sample {
                return false;
            }
            let room = starts.len() < FOLLOWED;
            if room {
                starts.push((spec.id, 1));
            }
            room
        });
    }

    /// Adds the most convincing effect again and again, and takes out what the others have made superfluous (but for those of `settled`, which
    /// another problem decided on).
    ///
    /// Returns the fit and, for the first step, all candidates.
    pub(super) fn select(
        &self,
        start: Fit,
        settled: &Hypothesis,
        acceptable: &dyn Fn(&Trial) -> bool,
        report: &(dyn Fn(&str) + Sync),
    ) -> (Fit, Vec<Trial>) {
        let mut here = start;
        let mut first = Vec::new();
        while here.hypothesis.effects.len() < MOST_EFFECTS && !self.stop.wanted() {
            let trials = self.candidates(&here, report);
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
                Some(t) => here = self.simplify(t.fit, settled),
                None => break,
            }
        }
        (here, first)
    }

    /// Leaves out, one at a time, the effects that the others do without; those of `settled` stay.
    pub(super) fn simplify(&self, mut here: Fit, settled: &Hypothesis) -> Fit {
        while here.hypothesis.effects.len() > 1 {
            let weakest = self
                .without_each(&here)
                .into_iter()
                .filter(|(spec, _)| !settled.has(spec.id))
                .min_by(|a, b| a.1.cost.total_cmp(&b.1.cost));
            match weakest {
                Some((_, smaller)) if !self.evidence(&smaller, &here).convinces() => here = smaller,
                _ => break,
            }
        }
        here
    }

    /// Puts another effect in the place of one found where it fits better, or as well with fewer parameters: a spring that rests far away
    /// is a bias.
    ///
    /// Returns the fit and what could stand in the place of its effects.
    pub(super) fn substitute(
        &self,
        mut here: Fit,
        first: &[Trial],
        report: &(dyn Fn(&str) + Sync),
    ) -> (Fit, Vec<Rival>) {
        let mut rivals = self.rivals(&here, first, report);
        // Each round lowers the cost or the number of parameters; a few are plenty.
        for _ in 0..MOST_EFFECTS {
            let room = LEAST_GAIN * (here.cost / self.floor()).max(1.0);
            let worth = |f: &Fit| f.cost + room * f.hypothesis.free() as f64;
            let better = rivals
                .iter()
                .flat_map(|r| &r.near)
                .min_by(|a, b| worth(&a.fit).total_cmp(&worth(&b.fit)));
            match better {
                _ if self.stop.wanted() => break,
                Some(t) if worth(&t.fit) < worth(&here) => {
                    here = self.fit(
                        &t.fit.hypothesis,
                        t.fit.z.clone(),
                        &t.fit.states,
                        Effort::FULL,
                    );
                    rivals = self.rivals(&here, first, report);
                }
                _ => break,
            }
        }
        (here, rivals)
    }

    /// For each effect, the fit without it.
    pub(super) fn without_each(&self, here: &Fit) -> Vec<(&'static Spec, Fit)> {
        here.hypothesis
            .effects
            .clone()
            .into_par_iter()
            .enumerate()
            .map(|(i, spec)| {
                let h = here.hypothesis.without(spec.id);
                let offset = here.hypothesis.offset(i);
                let mut z = here.z.clone();
                z.drain(offset..offset + spec.parameters.len());
                (spec, self.fit(&h, z, &here.states, Effort::FULL))
            })
            .collect()
    }

    /// What [`Self::rivals`] gives where nobody has the time to look for rivals.
    pub(super) fn unrivalled(&self, here: &Fit) -> Vec<Rival> {
        self.without_each(here)
            .into_iter()
            .map(|(spec, without)| Rival {
                spec,
                without,
                near: Vec::new(),
            })
            .collect()
    }

    /// A simpler rival that comes close is fitted again from where `here` ended: it may have stopped short of what it can explain.
    fn started_again(&self, here: &Fit, without: &Fit, t: Trial) -> Trial {
        let close = t.fit.cost - here.cost < (1.0 - CLOSE) * (without.cost - here.cost);
        if !close || t.fit.hypothesis.free() >= here.hypothesis.free() {
            return t;
        }
        let mut z = here.z[..FIRST_EFFECT].to_vec();
        z.extend(&t.fit.z[FIRST_EFFECT..]);
        let fit = self.fit(&t.fit.hypothesis, z, &here.states, Effort::FULL);
        if fit.cost >= t.fit.cost {
            return t;
        }
        let evidence = self.evidence(without, &fit);
        Trial { fit, evidence, ..t }
    }

    /// For each effect, the fit without it, and the others that would explain the data nearly as well in its place. `first` are the
    /// candidates for a single effect.
    pub(super) fn rivals(
        &self,
        here: &Fit,
        first: &[Trial],
        report: &(dyn Fn(&str) + Sync),
    ) -> Vec<Rival> {
        let floor = self.floor();
        let per_sample = (here.cost / floor).max(1.0);
        let tolerance = CONFUSABLE * (here.cost - floor).max(0.0) + 2.0 * LEAST_GAIN * per_sample;
        self.without_each(here)
            .into_iter()
            .map(|(spec, without)| {
                let trials = if here.hypothesis.effects.len() == 1 {
                    first.to_vec()
                } else {
                    self.candidates(&without, report)
                };
                let near = trials
                    .into_iter()
                    .filter(|t| t.spec.id != spec.id)
                    .map(|t| self.started_again(here, &without, t))
                    .filter(|t| t.fit.cost < here.cost + tolerance)
                    .collect();
                Rival {
                    spec,
                    without,
                    near,
                }
            })
            .collect()
    }
}
