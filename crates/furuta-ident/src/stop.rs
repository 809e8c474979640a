//! Ending a diagnosis early: by a flag that a person's Ctrl-C sets, or at a moment.

use core::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// What a fit or a search asks before it goes on.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Stop<'a> {
    flag: Option<&'a AtomicBool>,
    at: Option<Instant>,
}

impl<'a> Stop<'a> {
    pub(crate) const NEVER: Self = Self {
        flag: None,
        at: None,
    };

    pub(crate) const fn when(flag: Option<&'a AtomicBool>) -> Self {
        Self { flag, at: None }
    }

    /// At this moment as well.
    pub(crate) const fn or_at(self, at: Option<Instant>) -> Self {
        Self { at, ..self }
    }

    /// Whether to go no further.
    pub(crate) fn wanted(self) -> bool {
        self.asked() || self.at.is_some_and(|at| Instant::now() >= at)
    }

    /// Whether a person asked for it.
    pub(crate) fn asked(self) -> bool {
        self.flag.is_some_and(|flag| flag.load(Ordering::Relaxed))
    }
}
