//! When the parts of a diagnosis end, whatever is left to do.

use std::time::Instant;

use super::request::Options;
use crate::stop::Stop;

/// Share of the time limit that the search may take.
const FOR_SEARCH: f64 = 0.6;

/// When a diagnosis goes no further.
#[derive(Clone, Copy)]
pub(super) struct Deadlines<'a> {
    /// With everything that is asked for.
    pub(super) stop: Stop<'a>,
    /// With the search: the rest of the time is for judging what was found.
    pub(super) hurry: Stop<'a>,
    /// With fits that were begun, which a person's Ctrl-C leaves to their end.
    pub(super) end: Stop<'a>,
}

impl<'a> Deadlines<'a> {
    pub(super) fn from(begin: Instant, options: &Options<'a>) -> Self {
        let by = |share: f64| {
            let limit = options.time_limit?;
            begin.checked_add(limit.mul_f64(share))
        };
        Self {
            stop: Stop::when(options.stop).or_at(by(1.0)),
            hurry: Stop::when(options.stop).or_at(by(FOR_SEARCH)),
            end: Stop::NEVER.or_at(by(1.0)),
        }
    }
}
