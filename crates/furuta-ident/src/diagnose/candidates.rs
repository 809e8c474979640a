//! Which entries of the catalogue can be looked for, beside what a hypothesis and the rig file have.

use furuta_model::effects::{Acts, OF_ACCELERATION, Offered};
use furuta_model::{CATALOGUE, MAX_OWN_STATES, Spec};

use super::hypothesis::Hypothesis;
use crate::shooting::{MAX_FREE, Model, is_late};

/// The catalogue's entries that are looked for from the outset, those of one kind of rig included. Late encoders are
/// the same as a late command on recorded input and output, which stands for both; others are looked for where these
/// leave something, or on request ([`super::Options::candidates`]).
pub fn candidates() -> impl Iterator<Item = &'static Spec> {
    CATALOGUE
        .iter()
        .chain(OF_ACCELERATION)
        .copied()
        .filter(|s| s.offered.is_always() && !s.acts.includes(Acts::SENSOR_DELAY))
}

/// The entries that no recording of input and output tells apart from `spec`.
pub(super) fn same_class(spec: &'static Spec) -> impl Iterator<Item = &'static Spec> {
    CATALOGUE
        .iter()
        .copied()
        .filter(move |s| s.id != spec.id && is_late(s) && is_late(spec))
}

/// Whether hypothesis and rig file have as many laws with a state, or with a memory of the arm's way, as a plant can
/// hold, and this is one more.
pub(super) fn lacks_room(h: &Hypothesis, spec: &Spec) -> bool {
    let full = |kind: Acts, most: usize| {
        let present = h.sheet.present.iter().map(|e| e.spec());
        let others = present.chain(h.effects.iter().copied());
        spec.acts.includes(kind) && others.filter(|s| s.acts.includes(kind)).count() >= most
    };
    full(Acts::STATE, MAX_OWN_STATES) || full(Acts::MEMORY, 1)
}

/// Whether an effect can act on the rig and show in its recordings, is neither in the hypothesis nor in the rig file,
/// and plant and fit can still hold it.
pub(super) fn can_hold(h: &Hypothesis, spec: &Spec) -> bool {
    let numbers = h.layout().local() + spec.parameters.len();
    let present = h.sheet.present.iter().map(|e| e.spec());
    !h.has(spec.id)
        && !matches!(spec.offered, Offered::Never(_))
        && numbers <= MAX_FREE
        && !lacks_room(h, spec)
        && spec.acts.not_on(h.sheet.params.motor.actuation).is_none()
        && spec.acts.shows_in(h.sheet.tells)
        && present
            .into_iter()
            .all(|e| e.id != spec.id && !(is_late(e) && is_late(spec)))
}
