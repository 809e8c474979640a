//! Ending a diagnosis early, by a flag that a person's Ctrl-C sets.

use core::sync::atomic::{AtomicBool, Ordering};

/// What a fit or a search asks before it goes on.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Stop<'a>(Option<&'a AtomicBool>);

impl<'a> Stop<'a> {
    pub(crate) const NEVER: Self = Self(None);

    pub(crate) const fn when(flag: Option<&'a AtomicBool>) -> Self {
        Self(flag)
    }

    /// Whether to go no further.
    pub(crate) fn wanted(self) -> bool {
        self.0.is_some_and(|flag| flag.load(Ordering::Relaxed))
    }
}
