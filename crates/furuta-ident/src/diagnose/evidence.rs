//! What speaks for a larger model over a smaller one, and when that is enough to believe it.

use super::Fit;
use super::bounds::is_at_bound;
use super::criteria::CRITERIA;
use super::hypothesis::Hypothesis;
use crate::shooting::{Problem, Window};
use furuta_model::effects::{Acts, Law};
use furuta_model::{Effect, Spec};

/// A fit is far from the data where half of the windows leave more than this many times the noise.
pub(super) const FAR: f64 = 3.0;

/// What speaks for the larger of two nested hypotheses.
#[derive(Clone, Copy, Debug)]
pub(super) struct Evidence {
    /// Fall of the cost, in the same units as `elsewhere`.
    pub(super) gain: f64,
    /// The same from how far the effect's strength is from none, in standard deviations that do not trust the noise to
    /// be white: rounding repeats itself where a motion does, and then looks like a vibration. Only where the gain is
    /// weak.
    pub(super) robust: f64,
    /// How far the effect's strength is from none, in those deviations, squared; infinite where something is left.
    pub(super) known: f64,
    /// Fall of the cost without the window that gains most, in units of what the larger model leaves per sample (at
    /// least the noise).
    pub(super) elsewhere: f64,
    /// From how many windows it comes, effectively: [`windows_behind`].
    pub(super) windows: f64,
    /// How many there must be.
    pub(super) windows_needed: f64,
    /// The part of the gain that comes from where the recordings' zeros were before: each is known beforehand, whatever
    /// is wrong beside.
    pub(super) zeros: f64,
    /// The least fall of the cost.
    pub(super) least: f64,
    /// Factor by which the excess over the noise falls.
    pub(super) factor: f64,
    /// Fall of the Bayesian information criterion.
    pub(super) delta_bic: f64,
    /// Whether what was added has values that can be: none ended at a bound of its range, where it stands for something
    /// else (a rotor without inertia is a lag).
    pub(super) possible: bool,
}

impl Evidence {
    /// Whether the larger hypothesis is to be believed.
    pub(super) fn convinces(&self) -> bool {
        let much = self.factor > CRITERIA.factor || self.zeros > self.least;
        let known = self.known > CRITERIA.known;
        self.possible && known && self.helps() && self.delta_bic > 0.0 && much
    }

    /// Whether the larger hypothesis is better, and not in one place alone.
    pub(super) fn helps(&self) -> bool {
        self.gain.min(self.robust) > self.least
            && self.elsewhere > CRITERIA.elsewhere * self.least
            && self.windows > self.windows_needed
    }
}

impl Problem<'_> {
    /// Whether a fit leaves no more than the noise.
    pub(super) fn explains(&self, fit: &Fit) -> bool {
        self.chi(fit).powi(2) <= most_explained(fit)
    }

    /// The same of the windows in which none of its effects acts that acts once.
    fn explains_elsewhere(&self, fit: &Fit) -> bool {
        let once: Vec<Effect<f64>> = fit.model.local(&fit.z).collect();
        let elsewhere =
            (self.windows.iter().zip(&fit.costs)).filter(|(w, _)| !self.is_kicked(&once, w));
        let (cost, floor) = elsewhere.fold((0.0, 0.0), |(cost, floor), (w, c)| {
            (cost + c, floor + self.data.floor(w))
        });
        cost <= most_explained(fit) * floor
    }

    /// Whether a fit is far from the data in more than half of the windows. A kick is not: the others are near.
    pub(super) fn is_far(&self, fit: &Fit) -> bool {
        let mut left = self.left_in_windows(fit);
        left.sort_by(f64::total_cmp);
        left.get(left.len() / 2).is_some_and(|m| *m > FAR * FAR)
    }

    /// What speaks for `larger` over `smaller`.
    pub(super) fn evidence(&self, smaller: &Fit, larger: &Fit) -> Evidence {
        let floor = self.floor();
        let per_sample = self.per_sample(larger);
        // What is known beforehand is gained or lost in all windows that depend on it.
        let (before, after) = (smaller.prior_by_recording(), larger.prior_by_recording());
        let mut windows_of = vec![0.0; self.data.recordings];
        for w in &self.windows {
            windows_of[self.data.runs[w.run].recording] += 1.0;
        }
        let prior = |w: &Window| {
            let r = self.data.runs[w.run].recording;
            let zeros = |p: &[f64]| p.get(r).copied().unwrap_or(0.0) / windows_of[r];
            let shared = (before.0 - after.0) / self.windows.len() as f64;
            shared + zeros(&before.1) - zeros(&after.1)
        };
        let zeros = before.1.iter().sum::<f64>() - after.1.iter().sum::<f64>();
        let gains: Vec<f64> = (smaller.costs.iter().zip(&larger.costs))
            .zip(&self.windows)
            .map(|((a, b), w)| (a - b) / per_sample + prior(w))
            .collect();
        let gain: f64 = gains.iter().sum();
        let excess = |f: &Fit| f.cost - floor;
        let parameters = larger.model.free() as f64 - smaller.model.free() as f64;
        let strength = match farthest(smaller, larger) {
            // What no fit moves has no deviation: what it gains stands for it, less where errors are correlated.
            f64::INFINITY => gain / larger.widened.powi(2),
            strength => strength,
        };
        // A deviation is in units of what is left: beside what is not found yet it says nothing of an effect. Data kept
        // apart judge it then.
        let known = if self.explains(larger) {
            strength
        } else {
            f64::INFINITY
        };
        let added = larger
            .model
            .effects
            .iter()
            .filter(|e| !smaller.model.has(e.id));
        let least = added
            .map(|e| self.least(&larger.model, e))
            .reduce(f64::max)
            .unwrap_or(CRITERIA.effect);
        let general = Evidence {
            least,
            gain,
            known,
            robust: if gain < CRITERIA.weak * CRITERIA.effect {
                strength
            } else {
                f64::INFINITY
            },
            elsewhere: gain - gains.iter().fold(0.0, |a: f64, b| a.max(*b)),
            windows: windows_behind(&gains, least),
            windows_needed: CRITERIA.windows.min(gains.len() as f64 / 8.0),
            zeros,
            factor: if excess(larger) > CRITERIA.floor_uncertainty * floor {
                excess(smaller) / excess(larger)
            } else {
                // Nothing is left that the noise may not be: the gain alone decides.
                f64::INFINITY
            },
            delta_bic: gain - parameters * self.samples().ln(),
            possible: possible(&smaller.model, larger),
        };
        let once: Vec<Effect<f64>> = (larger.model.local(&larger.z))
            .filter(|e| !smaller.model.has(e.spec().id))
            .collect();
        let there: Vec<f64> = if !once.is_empty() {
            // Judged where it acts: what the other windows gain is another minimum's.
            let acts = gains.iter().zip(&self.windows);
            acts.filter(|(_, w)| self.is_kicked(&once, w))
                .map(|(g, _)| *g)
                .collect()
        } else if !general.helps() && limits_alone(smaller, larger) {
            // A limit that one peak alone reaches acts once, too.
            vec![gains.iter().fold(0.0, |a: f64, b| a.max(*b))]
        } else {
            return general;
        };
        let gain: f64 = there.iter().sum();
        Evidence {
            gain,
            robust: f64::INFINITY,
            elsewhere: gain,
            windows: 1.0,
            windows_needed: 0.0,
            least: self.least_once(smaller, larger, there.len()),
            factor: f64::INFINITY,
            delta_bic: gain - parameters * self.samples().ln(),
            possible: general.possible || !once.is_empty(),
            ..general
        }
    }

    /// The least gain that names what acts once, in the `windows` in which it does.
    fn least_once(&self, smaller: &Fit, larger: &Fit, windows: usize) -> f64 {
        // What is wrong everywhere looks like several of them.
        if smaller.model.is_transient() && !self.explains_elsewhere(larger) {
            return f64::INFINITY;
        }
        let per_sample = self.per_sample(larger);
        let mut usual = larger.costs.clone();
        usual.sort_by(f64::total_cmp);
        let usual = usual
            .get(usual.len() * 9 / 10)
            .map_or(0.0, |c| c / per_sample);
        // The part of it that is not the encoders' noise.
        let usual = usual * (1.0 - 1.0 / per_sample) * windows as f64;
        let local = CRITERIA.effect + CRITERIA.moment;
        // A blow that comes a little later, or bristles bent a little otherwise, look like a kick.
        let least = match larger.model.infers() {
            true if self.explains(smaller) => f64::INFINITY,
            true => CRITERIA.inferred * local,
            false => local,
        };
        least.max(CRITERIA.stands_out * usual)
    }

    /// The cost with what each effect must earn, in units of `per_sample`: the lower, the better.
    pub(super) fn score(&self, fit: &Fit, per_sample: f64) -> f64 {
        let effects = &fit.model.effects;
        let charge = |e: &&Spec| CRITERIA.charge(e, self.zeros_beside(&fit.model, e));
        let charges: f64 = effects.iter().map(charge).sum();
        let zeros = fit.model.free_zeros() as f64 * CRITERIA.zero;
        fit.cost / per_sample + charges + zeros
    }

    /// The least gain that names an effect of a model.
    pub(super) fn least(&self, model: &Hypothesis, spec: &Spec) -> f64 {
        CRITERIA.least(spec, self.zeros_beside(model, spec))
    }

    /// Of how many recordings the own zeros follow an effect.
    fn zeros_beside(&self, model: &Hypothesis, spec: &Spec) -> Option<usize> {
        let follow = model.sheet.zeros_follow(spec);
        follow.then_some(self.data.recordings)
    }

    /// By how much more than `here` a rival may cost that is said to be confusable.
    pub(super) fn tolerance(&self, here: &Fit) -> f64 {
        CRITERIA.confusable * (here.cost - self.floor()).max(0.0)
            + 2.0 * CRITERIA.effect * self.per_sample(here)
    }

    /// Whether one of these effects, which are local in time, acts within the window.
    fn is_kicked(&self, effects: &[Effect<f64>], w: &Window) -> bool {
        let run = &self.data.runs[w.run];
        let [begin, end] = [w.start, w.start + w.len].map(|k| run.time(k));
        effects
            .iter()
            .any(|e| match e.jump_after(run.recording, f64::NEG_INFINITY) {
                Some(edge) => {
                    let over = e.jump_after(run.recording, edge).unwrap_or(edge);
                    edge < end && over > begin
                }
                None => false,
            })
    }
}

/// The mean squared residual, in units of the noise's, up to which a fit explains the data.
fn most_explained(fit: &Fit) -> f64 {
    if fit.model.has_blows() {
        CRITERIA.explained_with_blows
    } else {
        CRITERIA.explained
    }
}

/// From how many windows a gain comes, effectively: the square of its sum over the sum of squares. A window that gains
/// all that is needed by itself counts as one, however much more it gains. Far from the data every window gains or
/// loses more than that as the other numbers move: there it is a window's share of the gain that counts as one.
fn windows_behind(gains: &[f64], least: f64) -> f64 {
    let share = gains.iter().sum::<f64>() / gains.len() as f64;
    let most = least.max(share);
    let counted = gains.iter().map(|g| g.clamp(-most, most));
    let (sum, squares) = counted.fold((0.0, 0.0), |(s, q): (f64, f64), g| (s + g, q + g * g));
    sum * sum.abs() / squares.max(1e-300)
}

/// Whether no number of what `larger` has and `smaller` has not ended at a bound of its range.
pub(super) fn possible(smaller: &Hypothesis, larger: &Fit) -> bool {
    let h: &Hypothesis = &larger.model;
    let values = h.physical(&larger.z);
    (h.effects.iter().enumerate())
        .filter(|(_, e)| !smaller.has(e.id))
        .flat_map(|(i, e)| e.parameters.iter().zip(&values[h.offset(i)..]))
        .all(|(p, value)| !is_at_bound(p, *value, h))
}

/// Whether a limit is all that `larger` has and `smaller` has not.
fn limits_alone(smaller: &Fit, larger: &Fit) -> bool {
    let mut added = (larger.model.effects.iter()).filter(|e| !smaller.model.has(e.id));
    added.next().is_some_and(|e| e.acts.includes(Acts::LIMIT)) && added.next().is_none()
}

/// How far the strongest of what `larger` has and `smaller` has not is from none: [`known`].
fn farthest(smaller: &Fit, larger: &Fit) -> f64 {
    (larger.model.effects.iter().enumerate())
        .filter(|(_, e)| !smaller.model.has(e.id))
        .map(|(i, _)| known(larger, i))
        .fold(f64::NAN, f64::max)
}

/// How far the strength of an effect is from none: its square over its variance. Infinite where no fit moves it.
///
/// The numbers that tell how, where or when it acts are as fitted: of a short push only the product of torque and
/// duration may be known, and it is not none for that.
fn known(fit: &Fit, effect: usize) -> f64 {
    let (first, spec) = (fit.model.offset(effect), fit.model.effects[effect]);
    (spec.parameters.iter().take(spec.strengths).enumerate())
        .map(|(i, p)| match p.kind.is_continuous() {
            true => (fit.z[first + i] / fit.std_by_itself[first + i]).powi(2),
            false => f64::INFINITY,
        })
        .fold(f64::NAN, f64::max)
}

/// Of the effects that are `asked` about, the one whose strength may best be none, if there is one.
pub(super) fn uncertain(fit: &Fit, asked: impl Fn(&Spec) -> bool) -> Option<&'static Spec> {
    (fit.model.effects.iter().enumerate())
        .filter(|(_, e)| asked(e))
        .map(|(i, e)| (*e, known(fit, i)))
        .filter(|(_, known)| *known <= CRITERIA.known)
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(e, _)| e)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gain_comes_from_the_windows_that_gain_their_share() {
        let least = 25.0;
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a}, not {b}");
        // One window, whatever it gains.
        let mut gains = [0.0; 36];
        gains[3] = 1e5;
        near(windows_behind(&gains, least), 1.0);
        // Eight with all that is needed.
        gains = [0.0; 36];
        gains[..8].fill(40.0);
        near(windows_behind(&gains, least), 8.0);
        // A limit that is reached in eight of 36 windows. In the others the sheet had made up for it and gives a little
        // back, more than what is needed: (8 - 28 / 8)^2 / (8 + 28 / 64) with shares of 400.
        gains = [-50.0; 36];
        gains[..8].fill(1975.0);
        near(windows_behind(&gains, least), 20.25 / 8.4375);
    }
}
