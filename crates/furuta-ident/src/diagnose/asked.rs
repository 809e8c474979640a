//! Entries that a diagnosis was asked to look for beside those that it always does.

use furuta_model::Spec;
use furuta_model::effects::Offered;

use super::candidates::{can_hold, lacks_room};
use super::hypothesis::Hypothesis;

/// Those of the entries that can be looked for beside what the rig file has, each id once; and a notice about each of
/// the others.
pub(super) fn asked(
    base: &Hypothesis,
    given: &[&'static Spec],
) -> (Vec<&'static Spec>, Vec<String>) {
    let (mut asked, mut notices): (Vec<&'static Spec>, Vec<String>) = (Vec::new(), Vec::new());
    let present = |id: &str| base.sheet.present.iter().any(|e| e.spec().id == id);
    let actuation = base.sheet.params.motor.actuation;
    for spec in given.iter().copied().filter(|s| !s.offered.is_always()) {
        if asked.iter().any(|other| other.id == spec.id) {
            continue;
        }
        let id = spec.id;
        if present(id) {
            notices.push(format!(
                "candidate {id} is in the rig file: it is part of the model and not looked for; take it out of the \
                 file to have it judged"
            ));
        } else if let Some(why) = spec.acts.not_on(actuation) {
            notices.push(format!("candidate {id} is not looked for: {why}"));
        } else if !spec.acts.shows_in(base.sheet.tells) {
            notices.push(format!(
                "candidate {id} is not looked for: recordings of this part of the rig do not show it"
            ));
        } else if let Offered::Never(why) = spec.offered {
            notices.push(format!("candidate {id} is not looked for: {why}"));
        } else if lacks_room(base, spec) {
            notices.push(format!(
                "candidate {id} is not looked for: the rig file has as many laws with a state or a memory \
                 as a plant can hold"
            ));
        } else if can_hold(base, spec) {
            asked.push(spec);
        } else {
            notices.push(format!(
                "candidate {id} is not looked for: beside the recordings' zeros its parameters are too many for a fit"
            ));
        }
    }
    (asked, notices)
}
