//! What the answers of all commands share: the measured angles, numbers for people, numbers that are not finite in
//! JSON.

mod channel;
mod fit_percent;
pub(crate) mod nan_for_null;
pub(crate) mod null_if_not_finite;
mod significant;

pub use channel::Channel;
pub(crate) use fit_percent::fit_percent;
pub use significant::significant;
