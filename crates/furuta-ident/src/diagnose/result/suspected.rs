//! Effects that gain in the sample alone.

use furuta_model::Spec;
use serde::{Deserialize, Serialize};

use crate::answer::significant;

/// An effect that fits the recordings better, and predicts data kept apart worse or was not judged to the end:
/// suspected, not named.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Suspected {
    /// Id in the catalogue.
    pub id: String,
    /// The catalogue's name.
    pub name: String,
    /// Why it is not named, in a sentence.
    pub reason: String,
    /// Whether the repaired model has it all the same: it imitates what is missing, and predicts better than none.
    #[serde(default)]
    pub kept: bool,
}

/// The horizons of `held_out::Unseen`, in words.
const HORIZONS: [&str; 4] = ["0.25 s", "0.5 s", "2 s", "whole runs"];

impl Suspected {
    fn because(spec: &Spec, reason: impl Into<String>) -> Self {
        Self {
            id: spec.id.into(),
            name: spec.name.into(),
            reason: reason.into(),
            kept: false,
        }
    }

    /// One that was found and, for want of time, not judged on data kept apart.
    pub(crate) fn unjudged(spec: &Spec) -> Self {
        Self::because(
            spec,
            "the diagnosis ended before it was judged on data kept apart",
        )
    }

    /// One of the best set so far, where the search ended before it was gone through.
    pub(crate) fn unfinished(spec: &Spec) -> Self {
        Self::because(
            spec,
            "the best fit so far has it; the diagnosis ended before others were tried in its place",
        )
    }

    /// One whose strength may as well be none.
    pub(crate) fn uncertain(spec: &Spec) -> Self {
        Self::because(
            spec,
            "the recordings do not tell how strong it is: a third of its strength is less than its standard deviation",
        )
    }

    /// One that acts once and does not help over long windows.
    pub(crate) fn transient(spec: &Spec) -> Self {
        Self::because(
            spec,
            "predicted over 2 s, its recording gains nothing by it",
        )
    }

    /// One that acts once, where another moment (s, recording) gains nearly as much.
    pub(crate) fn recurrent(spec: &Spec, (time, recording): (f64, usize)) -> Self {
        let reason = format!(
            "what acts once does not come again, and another at {} s of recording {} would gain nearly as much",
            significant(time, 3),
            recording + 1
        );
        Self::because(spec, reason)
    }

    /// One whose strength scatters from window to window by this share of its size.
    pub(crate) fn scattered(spec: &Spec, scatter: f64) -> Self {
        let reason = format!(
            "its strength is not the same everywhere: from quarter-second to quarter-second it scatters by {} of its \
             size, so its law is another; the repaired model keeps it as an imitation",
            significant(scatter, 2)
        );
        Self {
            kept: true,
            ..Self::because(spec, reason)
        }
    }

    /// One whose values contradict its name.
    pub(crate) fn contradicted(spec: &Spec, why: &str) -> Self {
        Self {
            kept: true,
            ..Self::because(
                spec,
                format!("{why}: its law is another; the repaired model keeps it as an imitation"),
            )
        }
    }

    /// One that makes the rig late, of readings that were filtered.
    pub(crate) fn filtered(spec: &Spec) -> Self {
        Self {
            kept: true,
            ..Self::because(
                spec,
                "the angles look filtered, and a filter makes them late as this does; the repaired model keeps it as \
                 an imitation",
            )
        }
    }

    /// One in whose place an entry on request explains more.
    pub(crate) fn explained_better(spec: &Spec, other: &Spec) -> Self {
        let name = other.name.to_lowercase();
        let reason = format!(
            "{name} explains more in its place; to have it compared, ask for candidate {}",
            other.id
        );
        Self::because(spec, reason)
    }

    /// One that is not needed beside an entry on request.
    pub(crate) fn unneeded(spec: &Spec, other: &Spec) -> Self {
        let name = other.name.to_lowercase();
        let reason = format!(
            "{name} explains the same; to have it compared, ask for candidate {}",
            other.id
        );
        Self::because(spec, reason)
    }

    /// One that is not needed beside an expression.
    pub(crate) fn expressed(spec: &Spec) -> Self {
        Self::because(spec, "the empirical expression explains the same")
    }

    /// One that convinces beside an entry on request and not without it.
    pub(crate) fn needs(spec: &Spec, other: &Spec) -> Self {
        let name = other.name.to_lowercase();
        let reason = format!(
            "it convinces beside {name} alone; to have both compared, ask for candidate {}",
            other.id
        );
        Self::because(spec, reason)
    }

    /// One that makes most of the data kept apart a little better and some of it much worse: all in all the squared
    /// error is this many times as large with it.
    pub(crate) fn worse(spec: &Spec, times: f64) -> Self {
        let reason = format!(
            "on data kept apart, predicted over 0.5 s, it helps in most places and harms in others: all in all the \
             squared error is {} times as large with it",
            significant(times, 3)
        );
        Self::because(spec, reason)
    }

    /// From the mean squared errors on data kept apart, with the effect and without it.
    pub(crate) fn new(spec: &Spec, with: [f64; 4], without: [f64; 4]) -> Self {
        let worst = (0..HORIZONS.len())
            .filter(|&i| (with[i] / without[i]).is_finite())
            .max_by(|&a, &b| (with[a] / without[a]).total_cmp(&(with[b] / without[b])));
        let reason = match worst {
            Some(i) => format!(
                "on data kept apart, predicted over {}, the error is {} times the noise with it and {} without",
                HORIZONS[i],
                significant(with[i].sqrt(), 3),
                significant(without[i].sqrt(), 3)
            ),
            None => "nothing could be predicted with it on data kept apart".into(),
        };
        Self::because(spec, reason)
    }
}
