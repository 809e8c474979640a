//! What a diagnosis says of the effects that it names: sizes, rivals, the next experiment, the zeros of the encoders.

use furuta_model::effects::spec;

use super::result::{Against, NamedEffect, Zero};
use super::search::Rival;
use super::{Fit, candidates, repair};
use crate::recording::Recording;
use crate::shooting::Problem;

/// The named effects, the most convincing first, with what they gain on data kept apart.
pub(super) fn effects(
    short: &Problem<'_>,
    named: &Fit,
    named_fit: &Fit,
    rivals: Vec<Rival>,
    held_out_gains: &[f64],
) -> Vec<NamedEffect> {
    let mut effects: Vec<NamedEffect> = rivals
        .into_iter()
        .zip(held_out_gains)
        .enumerate()
        .map(|(i, (rival, gain))| NamedEffect {
            id: rival.spec.id.into(),
            name: rival.spec.name.into(),
            parameters: repair::effect_parameters(named_fit, i),
            delta_bic: short.evidence(&rival.without, named).delta_bic,
            held_out_gain: *gain,
            confusable_with: rival
                .near
                .iter()
                .map(|t| t.spec)
                .chain(candidates::same_class(rival.spec))
                .map(|s| s.id.to_owned())
                .collect(),
        })
        .collect();
    effects.sort_by(|a, b| b.delta_bic.total_cmp(&a.delta_bic));
    effects
}

/// The zeros of each recording's encoders.
pub(super) fn zeros(recordings: &[Recording], fit: &Fit) -> Vec<Zero> {
    let sheet = &fit.model.sheet;
    let against = match sheet.reference {
        Some(_) => Against::FirstRecording,
        None => Against::RigFile,
    };
    if !sheet.own_zeros || (recordings.len() < 2 && against == Against::FirstRecording) {
        return Vec::new();
    }
    let shows = fit.model.sees_angle();
    fit.model
        .zeros(&fit.z)
        .into_iter()
        .zip(recordings)
        .map(|([theta, alpha], recording)| Zero {
            run: recording.name.clone(),
            against,
            theta: if shows { theta } else { f64::NAN },
            alpha,
        })
        .collect()
}

/// The look-alikes that the catalogue lists, for an effect whose rivals were not compared.
pub(super) fn not_ruled_out(id: &str, named: &Fit) -> Vec<String> {
    spec(id)
        .map_or(&[][..], |spec| spec.look_alikes)
        .iter()
        .filter(|other| !named.model.has(other))
        .map(|&other| other.to_owned())
        .collect()
}

/// What would tell the first effect that could be another one from it.
pub(super) fn next_experiment(named: &[NamedEffect]) -> Option<String> {
    let effect = named.iter().find(|e| !e.confusable_with.is_empty())?;
    let spec = spec(&effect.id)?;
    Some(format!(
        "to tell {} from {}: {}",
        effect.id,
        effect.confusable_with.join(", "),
        spec.experiment
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use furuta_model::CATALOGUE;

    /// The catalogue's texts are of many forms ("..., an offset does not"): the sentence must read with each.
    #[test]
    fn the_next_experiment_is_a_sentence_of_every_effect() {
        for spec in CATALOGUE {
            let effect = NamedEffect {
                id: spec.id.to_owned(),
                name: spec.name.to_owned(),
                parameters: Default::default(),
                delta_bic: 20.0,
                held_out_gain: 0.5,
                confusable_with: vec!["arm.cable".to_owned(), "arm.tilt".to_owned()],
            };
            let text = next_experiment(&[effect]).expect("it can be another one");
            let start = format!("to tell {} from arm.cable, arm.tilt: ", spec.id);
            assert_eq!(text.strip_prefix(&start), Some(spec.experiment));
            assert!(!spec.experiment.ends_with('.'), "{text}");
        }
    }
}
