//! The numbers that decide a name, in one place. Numbers that only save time stand in `savers`.

use furuta_model::Spec;
use furuta_model::effects::Kind;

use super::screen;
use crate::shooting::WHITE;

/// What decides whether an effect is named. Gains are falls of the cost (chi²) in units of what the better model leaves
/// per sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct Criteria {
    /// A model explains the data when its mean squared residual is within this factor of the noise's.
    pub(super) explained: f64,
    /// The same where bodies meet in blows, which multiply what is wrong before them.
    pub(super) explained_with_blows: f64,
    /// Gain of an effect with one number.
    pub(super) effect: f64,
    /// Gain of each further number.
    pub(super) number: f64,
    /// Gain of each recording whose zero of theta an effect makes free.
    pub(super) zero: f64,
    /// Gain, for each recording, of an effect that the recordings' own zeros follow as well.
    pub(super) zeroed: f64,
    /// Further gain where an order or a frequency was looked for.
    pub(super) scanned: f64,
    /// Further gain where a moment was looked for, or a distance of levels.
    pub(super) moment: f64,
    /// Share of the least gain that must be left without the window that gains most.
    pub(super) elsewhere: f64,
    /// Effective number of windows that a gain must come from; an eighth of them where there are few.
    pub(super) windows: f64,
    /// A gain of less than this many least gains is judged by a deviation that does not trust the noise to be white as
    /// well.
    pub(super) weak: f64,
    /// Least square of a strength over its variance where no more than the noise is left: one that may as well be none
    /// names nothing, whatever is gained.
    pub(super) known: f64,
    /// Factor by which the excess over the noise must fall where some of it is certain to be left.
    pub(super) factor: f64,
    /// Relative uncertainty of the noise floor's square: below, the excess is not known.
    pub(super) floor_uncertainty: f64,
    /// In the windows over which it lasts, a transient must gain this many times what nine of ten windows have left at
    /// most.
    pub(super) stands_out: f64,
    /// A second transient elsewhere that would gain this share of what the first gains says that it comes again.
    pub(super) recurs: f64,
    /// A transient must gain this many times more where a window's start is partly inferred: a blow that comes a little
    /// later looks like one.
    pub(super) inferred: f64,
    /// From window to window a strength scatters by less than this share of its size.
    pub(super) scatters: f64,
    /// A rival is confusable within this share of the excess.
    pub(super) confusable: f64,
    /// By which factor the mean squared error of data kept apart may grow over long windows and whole runs.
    pub(super) no_worse: f64,
    /// The same over short windows.
    pub(super) alike: f64,
}

/// The criteria of every diagnosis.
pub(super) const CRITERIA: Criteria = Criteria {
    explained: WHITE,
    explained_with_blows: 1.4,
    // White noise gains 25 from the best of some hundred entries and starts, of two numbers each, once in 2,700 data
    // sets: `100 exp(-25/2)`.
    effect: 25.0,
    // Above `ln(3e4) = 10.3`, what the Bayesian criterion charges at 30 s of 500 Hz, two angles.
    number: 25.0,
    // White noise gains 1 from each; `chi²` of one degree of freedom exceeds 6 once in 70.
    zero: 6.0,
    // One zeroing may serve all recordings: three standard deviations of it.
    zeroed: 9.0,
    // Some 700 orders and frequencies: `2 ln 700 = 13` more for the same rate, of which the first number's 25 holds a
    // part already.
    scanned: 10.0,
    // Thousands of moments, and any one spoilt window must not pass for a transient; a thousand distances and halves.
    moment: 20.0,
    elsewhere: 0.6,
    windows: 2.5,
    weak: 8.0,
    // Three standard deviations.
    known: 9.0,
    factor: 1.25,
    floor_uncertainty: 0.08,
    stands_out: 3.0,
    // Of what comes again and again, with gains above `g` as rare as `1/g²`, the second largest is below a fifth of the
    // largest once in 25: `0.2²`.
    recurs: 0.2,
    inferred: 20.0,
    // Of 48 cases with a foreign effect (`benchmark.py --seed 211 --groups foreign`), right names scatter by up to
    // 0.34, wrong ones by 0.46 to 1.5 or, where they imitate well, as little as right ones.
    scatters: 0.4,
    confusable: 0.10,
    // Over long windows, dry friction and an unstable upright make errors of their own.
    no_worse: 1.1,
    // Mean squared errors over short windows are known to some per cent.
    alike: 1.02,
};

impl Criteria {
    /// The least gain that names an effect; `zeros` is of how many recordings the own zeros follow it.
    pub(super) fn least(&self, spec: &Spec, zeros: Option<usize>) -> f64 {
        if let Some(recordings) = zeros {
            return self.zeroed * recordings as f64;
        }
        let place = if spec.acts_once() || screen::looks(spec) == Some(screen::Looks::Levels) {
            self.moment
        } else if screen::is_scanned(spec) {
            self.scanned
        } else {
            0.0
        };
        self.effect + place
    }

    /// What an effect must earn to be preferred: its least gain and a part for each further number.
    pub(super) fn charge(&self, spec: &Spec, zeros: Option<usize>) -> f64 {
        let numbers = spec
            .parameters
            .iter()
            .filter(|p| p.kind.is_continuous() && p.kind != Kind::Time)
            .count();
        self.least(spec, zeros) + self.number * numbers.saturating_sub(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The table of docs/diagnosis.md.
    fn table() -> String {
        // Without `..`: a criterion that is added has to be described.
        let Criteria {
            explained,
            explained_with_blows,
            effect,
            number,
            zero,
            zeroed,
            scanned,
            moment,
            elsewhere,
            windows,
            weak,
            known,
            factor,
            floor_uncertainty,
            stands_out,
            recurs,
            inferred,
            scatters,
            confusable,
            no_worse,
            alike,
        } = CRITERIA;
        let rows = [
            (
                "explained",
                "mean squared residual over the noise's up to which a model explains the data",
                explained,
            ),
            (
                "explained_with_blows",
                "the same of a model in which bodies meet in blows (backlash)",
                explained_with_blows,
            ),
            ("effect", "least gain (fall of chi²) of an effect", effect),
            (
                "number",
                "further gain for each further number, in the score",
                number,
            ),
            (
                "zero",
                "further gain for each zero of theta that an effect makes free, in the score",
                zero,
            ),
            (
                "zeroed",
                "least gain, for each recording, of an effect that the recordings' own zeros of alpha follow (an \
                 offset)",
                zeroed,
            ),
            (
                "scanned",
                "further gain where an order or a frequency was looked for",
                scanned,
            ),
            (
                "moment",
                "further gain where a moment was looked for, or a distance of levels",
                moment,
            ),
            (
                "elsewhere",
                "share of the least gain that must be left without the window that gains most",
                elsewhere,
            ),
            (
                "windows",
                "effective number of windows that a gain must come from (an eighth of them where there are few), each \
                 counted up to the least gain or to its share of the whole, whichever is more",
                windows,
            ),
            (
                "weak",
                "below this many least gains, the strength must also be as far from none in deviations that are robust \
                 within windows",
                weak,
            ),
            (
                "known",
                "how far a strength must be from none, in those deviations with what tells how, where or when it acts \
                 as fitted, squared, where no more than the noise is left, and of what data kept apart say nothing of; \
                 whatever it gains",
                known,
            ),
            (
                "factor",
                "factor by which the excess over the noise must fall where some of it is certain to be left",
                factor,
            ),
            (
                "floor_uncertainty",
                "relative uncertainty of the floor's square; below, the excess is not known",
                floor_uncertainty,
            ),
            (
                "stands_out",
                "a kick must gain this many times what nine of ten windows have left, in each window over which it \
                 lasts",
                stands_out,
            ),
            (
                "recurs",
                "a kick is none where another moment would gain this share of what it gains",
                recurs,
            ),
            (
                "inferred",
                "a kick must gain this many times more where a window's start is partly inferred (backlash, a flexible drive, bristles)",
                inferred,
            ),
            (
                "scatters",
                "where something is left, or bodies meet in blows, a strength may scatter from window to window by this \
                 share of its size",
                scatters,
            ),
            (
                "confusable",
                "a rival is confusable when its excess is within this share",
                confusable,
            ),
            (
                "no_worse",
                "factor by which the mean squared error of data kept apart may grow over 2 s and whole runs",
                no_worse,
            ),
            (
                "alike",
                "the same over windows of a quarter and of half a second",
                alike,
            ),
        ];
        let rows = rows.map(|(name, what, value)| format!("| `{name}` | {what} | {value} |\n"));
        format!(
            "| Criterion | What it is | Value |\n|---|---|---|\n{}",
            rows.concat()
        )
    }

    #[test]
    fn the_documentation_has_this_table() {
        let page = include_str!("../../../../docs/diagnosis.md");
        assert!(
            page.contains(&table()),
            "docs/diagnosis.md should have\n{}",
            table()
        );
    }
}
