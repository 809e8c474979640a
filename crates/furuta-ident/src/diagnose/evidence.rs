//! What speaks for a larger model over a smaller one, and when that is enough to believe it.

use furuta_model::Spec;
use furuta_model::effects::{Acts, Law};

use super::data::Window;
use super::fit::{Fit, Problem};
use super::scout;

/// A model explains the data when its residuals are within this factor of the noise (in squares; the floor itself is known to some per cent).
const EXPLAINED: f64 = 1.12;
/// The same where there is play: how rotor and arm stand to each other at the start of a window is only inferred, and blows multiply what is wrong.
const EXPLAINED_WITH_PLAY: f64 = 1.4;
/// The least fall of the cost (chi², in units of what the better model leaves) that names an effect: white noise gains so much from the best of some hundred
/// entries and starts, of two numbers each, once in 2,700 data sets (`100 exp(-25/2)`).
pub(super) const LEAST_GAIN: f64 = 25.0;
/// The same for an effect whose place was looked for among some 700 orders and frequencies: white noise would need 25 for one false alarm in 400 data sets
/// (`700 exp(-25/2)`), but rounding is not quite white, and was seen to gain 28 in one of 25.
const LEAST_PLACED_GAIN: f64 = 35.0;
/// Of the least gain, so much must be left without the window that gains most.
const ELSEWHERE: f64 = 0.6;
/// What gains less than so many times [`LEAST_GAIN`] is weak.
const WEAK: f64 = 8.0;
/// From how many windows, effectively, a gain must come: `n` windows that all gain alike count `n`, one window alone counts 1, gains and losses
/// that nearly cancel count less. Where there are few windows, an eighth of them.
const LEAST_WINDOWS: f64 = 2.5;
/// By which factor the excess over the noise must fall where there is much of it: a model that is wrong elsewhere gains a little from
/// almost anything.
const LEAST_FACTOR: f64 = 1.25;
/// Relative uncertainty of the noise floor's square: below, the excess is not known.
const FLOOR_UNCERTAINTY: f64 = 0.08;
/// [`LEAST_GAIN`] for an effect that is local in time: thousands of places are looked at, and any one spoilt window must not pass for it.
const LEAST_LOCAL_GAIN: f64 = 45.0;
/// A kick must gain so many times what nine of ten windows have left at most, in each of the windows over which it lasts: where the model is wrong in many
/// places, something always gains a little in one, and a long weak torque a little in several.
const STANDS_OUT: f64 = 3.0;
/// Where a window's start is partly inferred, one that was inferred wrongly looks kicked: a kick must gain so many times [`LEAST_LOCAL_GAIN`].
const INFERRED: f64 = 20.0;

/// The least fall of the cost that names this effect.
pub(super) fn least_gain(spec: &Spec) -> f64 {
    if spec.acts.includes(Acts::JUMPS) {
        LEAST_LOCAL_GAIN
    } else if scout::wanted(spec) {
        LEAST_PLACED_GAIN
    } else {
        LEAST_GAIN
    }
}

/// What speaks for the larger of two nested hypotheses.
#[derive(Clone, Copy, Debug)]
pub(super) struct Evidence {
    /// Fall of the cost, in the same units as `elsewhere`.
    pub(super) gain: f64,
    /// The same from how far the effect's strength is from none, in standard deviations that do not trust the noise to be white: rounding repeats itself where
    /// a motion does, and then looks like a vibration. Only where the gain is weak.
    pub(super) robust: f64,
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
        self.gain.min(self.robust) > self.least
            && self.elsewhere > ELSEWHERE * self.least
            && self.windows > self.windows_needed
    }
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

    /// Whether a fit leaves no more than the noise.
    pub(super) fn explains(&self, fit: &Fit) -> bool {
        let most = if fit.hypothesis.has_play() {
            EXPLAINED_WITH_PLAY
        } else {
            EXPLAINED
        };
        self.chi(fit).powi(2) <= most
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
            let kicked = gains.iter().zip(&self.windows);
            let kicked: Vec<f64> = kicked
                .filter(|(_, w)| self.is_kicked(larger, w))
                .map(|(g, _)| *g)
                .collect();
            let gain: f64 = kicked.iter().sum();
            let mut usual = larger.costs.clone();
            usual.sort_by(f64::total_cmp);
            let usual = usual
                .get(usual.len() * 9 / 10)
                .map_or(0.0, |c| c / per_sample);
            // The part of it that is not the encoders' noise.
            let usual = usual * (1.0 - 1.0 / per_sample) * kicked.len() as f64;
            let least = if larger.hypothesis.infers() {
                INFERRED * LEAST_LOCAL_GAIN
            } else {
                LEAST_LOCAL_GAIN
            };
            return Evidence {
                gain,
                robust: f64::INFINITY,
                elsewhere: gain,
                windows: 1.0,
                windows_needed: 0.0,
                least: least.max(STANDS_OUT * usual),
                factor: f64::INFINITY,
                delta_bic: gain - parameters * self.samples().ln(),
            };
        }
        let added = larger
            .hypothesis
            .effects
            .iter()
            .filter(|e| !smaller.hypothesis.has(e.id));
        Evidence {
            least: added.map(|e| least_gain(e)).fold(LEAST_GAIN, f64::max),
            gain,
            robust: if gain < WEAK * LEAST_GAIN {
                farthest(smaller, larger)
            } else {
                f64::INFINITY
            },
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
}

/// How far the strongest of what `larger` has and `smaller` has not is from none: its square over its variance.
fn farthest(smaller: &Fit, larger: &Fit) -> f64 {
    let h = &larger.hypothesis;
    (h.effects.iter().enumerate())
        .filter(|(_, e)| !smaller.hypothesis.has(e.id))
        .flat_map(|(i, e)| h.offset(i)..h.offset(i) + e.strengths)
        .map(|k| (larger.z[k] / larger.std[k]).powi(2))
        .fold(0.0, f64::max)
}
