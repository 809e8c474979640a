//! Effects that look alike: which of their numbers mean the same, and which one can do all that another does.

use furuta_model::Spec;

/// Which number of an effect means what the `i`-th one of another means in its place: that of the same name, or, of two
/// that look alike, the first strength of the same unit (Coulomb's friction is Stribeck's with one torque at all
/// speeds).
pub(super) fn counterpart(replaced: &Spec, by: &Spec, i: usize) -> Option<usize> {
    let wanted = &by.parameters[i];
    let named = replaced
        .parameters
        .iter()
        .position(|p| p.name == wanted.name);
    let is_like = replaced.look_alikes.contains(&by.id) || by.look_alikes.contains(&replaced.id);
    named.or_else(|| {
        let mut strengths = replaced.parameters[..replaced.strengths].iter();
        let asked = is_like && i < by.strengths;
        asked
            .then(|| strengths.position(|p| p.unit == wanted.unit))
            .flatten()
    })
}

/// Whether `simple` looks like `spec` with fewer parameters.
pub(super) fn is_simpler(simple: &Spec, spec: &Spec) -> bool {
    spec.look_alikes.contains(&simple.id) && simple.parameters.len() < spec.parameters.len()
}

/// Whether a strength of `spec` means what one of `simple` means, which looks like it with fewer parameters: it can do
/// what `simple` does, its other strengths at none.
pub(super) fn contains(spec: &Spec, simple: &Spec) -> bool {
    is_simpler(simple, spec) && (0..spec.strengths).any(|i| counterpart(simple, spec, i).is_some())
}
