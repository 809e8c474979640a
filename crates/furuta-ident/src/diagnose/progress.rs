//! How far a diagnosis has come.

use std::sync::Mutex;

use crate::stages::Stages;

/// The stages of a diagnosis in their order, with the per cent that a progress bar shows when each begins. Some are
/// skipped where there is nothing to do.
const BEGINS: Stages<10> = Stages([
    ("recalibrating", 0.0),
    ("searching", 5.0),
    ("searching among rare effects", 40.0),
    (
        "looking for a stretch in which something else happened",
        50.0,
    ),
    ("searching over long windows", 60.0),
    ("judging", 70.0),
    ("looking for an expression", 80.0),
    ("fitting", 85.0),
    ("planning", 90.0),
    ("verifying", 95.0),
]);

/// The names of the stages.
pub const STAGES: [&str; 10] = BEGINS.names();

/// Of a stage's share, each candidate of it is counted as this part of what is left: how many there will be is not
/// known beforehand.
const EACH: f64 = 0.01;

/// What a diagnosis is doing.
#[derive(Clone, Debug, PartialEq)]
pub struct Progress {
    /// The stage, in words: one of [`STAGES`].
    pub stage: &'static str,
    /// The candidate just tried, if any.
    pub candidate: Option<String>,
    /// How much is done, per cent: an estimate that never falls.
    pub percent: f64,
}

/// Tells a listener what is being done, and how much of it is.
pub(super) struct Teller<'a> {
    listener: &'a (dyn Fn(Progress) + Sync),
    percent: Mutex<f64>,
}

impl<'a> Teller<'a> {
    pub(super) fn new(listener: &'a (dyn Fn(Progress) + Sync)) -> Self {
        Self {
            listener,
            percent: Mutex::new(0.0),
        }
    }

    /// A stage begins.
    pub(super) fn stage(&self, stage: &'static str) {
        self.tell(stage, None);
    }

    /// What is told of each candidate of a stage.
    pub(super) fn candidates(&self, stage: &'static str) -> impl Fn(&str) + Sync {
        move |id| self.tell(stage, Some(id.to_owned()))
    }

    fn tell(&self, stage: &'static str, candidate: Option<String>) {
        let [begin, end] = BEGINS.span(stage);
        let mut known = self
            .percent
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner);
        *known = known.max(begin);
        if candidate.is_some() && *known < end {
            *known += EACH * (end - *known);
        }
        let percent = *known;
        drop(known);
        (self.listener)(Progress {
            stage,
            candidate,
            percent,
        });
    }
}
