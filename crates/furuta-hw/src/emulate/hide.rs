//! Effects to hide, as written on a command line.

use furuta_model::effects::own::{self, HypothesisError};
use furuta_model::effects::{Kind, ParameterSpec};
use furuta_model::{Effect, EffectError, Params, Spec, effects};

/// A text does not say which effect to hide.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum HideError {
    /// No such effect.
    #[error(
        "unknown effect {id:?}: give a file with a law of your own (its name ends in .toml), or one of {}",
        known()
    )]
    UnknownEffect {
        /// The id given.
        id: String,
    },
    /// The effect has no such parameter.
    #[error("{id} has no parameter {name:?}: it has {has}")]
    UnknownParameter {
        /// The effect.
        id: &'static str,
        /// The name given.
        name: String,
        /// The names it has.
        has: String,
    },
    /// Not `name=value` with a number.
    #[error("{text:?} is not NAME=NUMBER, as in {example}")]
    NotAssignment {
        /// What was given.
        text: String,
        /// What it should look like.
        example: String,
    },
    /// A colon with no values behind it.
    #[error(
        "{id}: nothing stands behind the colon: give {id}:NAME=VALUE, or {id} alone for a size that would be noticed"
    )]
    NoAssignment {
        /// The effect.
        id: &'static str,
    },
    /// A parameter with two values.
    #[error("{id}: {name} is given twice, as {first} and as {again}: leave one out")]
    Twice {
        /// The effect.
        id: &'static str,
        /// The parameter.
        name: &'static str,
        /// Its first value.
        first: f64,
        /// Its second value.
        again: f64,
    },
    /// A word that is none of those the parameter can be.
    #[error("{id}: {name} = {word:?} must be {words}")]
    UnknownWord {
        /// The effect.
        id: &'static str,
        /// The parameter.
        name: &'static str,
        /// The word given.
        word: String,
        /// The words it can be.
        words: String,
    },
    /// A value outside its range.
    #[error("{0}")]
    Effect(EffectError),
    /// A file of laws that cannot be read, or has a mistake in it.
    #[error("{0}")]
    Hypothesis(HypothesisError),
    /// A file with another law, or with several of which none is chosen.
    #[error("{file} has the laws {has}: write {file}#ID with one of them")]
    WhichHypothesis {
        /// The file.
        file: String,
        /// The ids that it has.
        has: String,
    },
}

/// Reads an effect to hide: `ID` at the size that would be noticed on this rig, or `ID:NAME=VALUE,NAME=VALUE` in SI
/// units, words where there is a
/// choice, with all parameters that have no default. In place of the id there may be a file (`FILE.toml`, or
/// `FILE.toml#ID` where it has several) with a law of the user's own ([`furuta_model::effects::own`]).
///
/// # Errors
/// [`HideError`].
///
/// ```
/// use furuta_hw::emulate::hidden_effect;
/// use furuta_model::Rig;
/// let params = Rig::builtin("qube-servo-2").expect("built in").params;
/// let spring = hidden_effect("arm.spring:stiffness=1e-3,rest=-0.5", &params)?;
/// assert_eq!(spring.values()[..], [1e-3, -0.5]);
/// assert!(hidden_effect("arm.coulomb", &params)?.values()[0] > 0.0);
/// let backlash = hidden_effect("drive.backlash:gap=0.05,motor_share=0.5,encoder=motor", &params)?;
/// assert_eq!(backlash.values()[..], [0.05, 0.5, 1.0]);
/// let error = hidden_effect("arm.spring:stifness=1", &params).expect_err("misspelt");
/// assert_eq!(error.to_string(), "arm.spring has no parameter \"stifness\": it has stiffness, rest");
/// # Ok::<(), furuta_hw::emulate::HideError>(())
/// ```
pub fn hidden_effect(text: &str, params: &Params<f64>) -> Result<Effect<f64>, HideError> {
    let (id, assignments) = match text.split_once(':') {
        Some((id, assignments)) => (id, Some(assignments)),
        None => (text, None),
    };
    let spec = named(id.trim())?;
    if assignments.is_some_and(|a| a.trim().is_empty()) {
        return Err(HideError::NoAssignment { id: spec.id });
    }
    let typical = |p: &ParameterSpec| p.off + p.typical(params);
    let mut values: Vec<Option<f64>> = match assignments {
        None => spec
            .parameters
            .iter()
            .map(|p| p.default.or(Some(typical(p))))
            .collect(),
        Some(_) => vec![None; spec.parameters.len()],
    };
    let assignments = assignments.unwrap_or_default().split(',');
    for assignment in assignments.filter(|a| !a.trim().is_empty()) {
        let not_assignment = || {
            let first = spec.parameters.first().map_or("value", |p| p.name);
            HideError::NotAssignment {
                text: assignment.to_owned(),
                example: format!("{id}:{first}=0.001"),
            }
        };
        let (name, text) = assignment.split_once('=').ok_or_else(not_assignment)?;
        let (name, text) = (name.trim(), text.trim());
        let Some((p, slot)) = spec
            .parameters
            .iter()
            .zip(&mut values)
            .find(|(p, _)| p.name == name)
        else {
            let has = spec
                .parameters
                .iter()
                .map(|p| p.name)
                .collect::<Vec<_>>()
                .join(", ");
            return Err(HideError::UnknownParameter {
                id: spec.id,
                name: name.to_owned(),
                has,
            });
        };
        let value = match p.kind {
            Kind::Choice(words) => p.choice(text).ok_or_else(|| HideError::UnknownWord {
                id: spec.id,
                name: p.name,
                word: text.to_owned(),
                words: words.join(" or "),
            })?,
            _ => text.parse().map_err(|_| not_assignment())?,
        };
        if let Some(first) = slot.replace(value) {
            return Err(HideError::Twice {
                id: spec.id,
                name: p.name,
                first,
                again: value,
            });
        }
    }
    let given = |name: &str| {
        spec.parameters
            .iter()
            .position(|p| p.name == name)
            .and_then(|i| values[i])
    };
    let values = spec.values(given).map_err(HideError::Effect)?;
    Effect::checked(spec, &values).map_err(HideError::Effect)
}

/// The entry with this id, or the law in this file.
fn named(id: &str) -> Result<&'static Spec, HideError> {
    let (file, wanted) = match id.split_once('#') {
        Some((file, wanted)) => (file, Some(wanted)),
        None => (id, None),
    };
    if !file.ends_with(".toml") {
        return effects::spec(id).ok_or_else(|| HideError::UnknownEffect { id: id.to_owned() });
    }
    let laws = own::load(file).map_err(HideError::Hypothesis)?;
    let chosen = match wanted {
        Some(wanted) => laws.iter().find(|spec| spec.id == wanted),
        None => laws.first().filter(|_| laws.len() == 1),
    };
    chosen.copied().ok_or_else(|| HideError::WhichHypothesis {
        file: file.to_owned(),
        has: laws.iter().map(|s| s.id).collect::<Vec<_>>().join(", "),
    })
}

fn known() -> String {
    let ids: Vec<_> = effects::all().map(|s| s.id).collect();
    ids.join(", ")
}

#[cfg(test)]
mod tests {
    use furuta_model::{CATALOGUE, RARE, Rig};

    use super::*;

    #[test]
    fn what_is_wrong_is_named() {
        let params = Rig::builtin("qube-servo-2").expect("built in").params;
        let error = |text| hidden_effect(text, &params).expect_err(text);
        assert!(matches!(
            error("arm.sprong"),
            HideError::UnknownEffect { .. }
        ));
        assert!(matches!(
            error("arm.spring:1e-3"),
            HideError::NotAssignment { .. }
        ));
        assert!(matches!(
            error("arm.spring:rest=far"),
            HideError::NotAssignment { .. }
        ));
        assert!(matches!(
            error("arm.spring:stiffness=-1,rest=0"),
            HideError::Effect(_)
        ));
        assert!(matches!(
            error("arm.spring:stiffness=nan,rest=0"),
            HideError::Effect(_)
        ));
        assert!(matches!(
            error("arm.cogging:amplitude=1e-3,order=1.5,phase=0"),
            HideError::Effect(_)
        ));
        assert_eq!(
            error("arm.coulomb:").to_string(),
            "arm.coulomb: nothing stands behind the colon: give arm.coulomb:NAME=VALUE, or arm.coulomb alone for a \
             size that would be noticed"
        );
        assert_eq!(
            error("arm.coulomb:torque=1,torque=0").to_string(),
            "arm.coulomb: torque is given twice, as 1 and as 0: leave one out"
        );
        assert_eq!(
            error("drive.backlash:encoder=gear").to_string(),
            "drive.backlash: encoder = \"gear\" must be arm or motor"
        );
    }

    /// A law of the user's own is hidden by its file.
    #[test]
    fn a_law_of_a_file_is_hidden() {
        let params = Rig::builtin("qube-servo-2").expect("built in").params;
        let law = |id: &str| {
            format!(
                "[hypothesis.\"{id}\"]\narm = \"-k*theta_dot\"\n\
                 parameters.k = {{ unit = \"N m s/rad\", min = 0.0, max = 1.0, typical = 1e-4 }}\n"
            )
        };
        let folder = std::env::temp_dir().join(format!("furuta-hide-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        let file = |name: &str, text: &str| {
            let path = folder.join(name);
            std::fs::write(&path, text).expect("written");
            path.to_str().expect("plain").to_owned()
        };
        let one = file("one.toml", &law("user.hidden"));
        let values = |text: &str| hidden_effect(text, &params).expect(text).values();
        assert_eq!(values(&one)[..], [1e-4]);
        assert_eq!(values(&format!("{one}:k=2e-3"))[..], [2e-3]);
        let two = file("two.toml", &(law("user.hidden") + &law("user.other")));
        assert_eq!(values(&format!("{two}#user.other:k=0.5"))[..], [0.5]);
        let error = |text: &str| hidden_effect(text, &params).expect_err(text).to_string();
        assert!(error(&two).contains("has the laws user.hidden, user.other"));
        assert!(error(&format!("{one}#user.none")).contains("has the laws user.hidden"));
        let wrong = file(
            "wrong.toml",
            &law("user.hidden").replace("theta_dot", "thetta"),
        );
        assert!(
            error(&wrong).contains("wrong.toml: hypothesis user.hidden, arm (line 2), character 4")
        );
        assert!(error("none.toml").contains("none.toml"));
        std::fs::remove_dir_all(&folder).expect("removed");
    }

    /// Sizes are distances from where the effect does nothing; what has a default keeps it.
    #[test]
    fn what_is_not_given_is_sensible() {
        let params = Rig::builtin("qube-servo-2").expect("built in").params;
        let values = |text| hidden_effect(text, &params).expect(text).values();
        assert_eq!(values("sensor.alpha.scale")[..], [1.02, 0.0]);
        assert_eq!(values("motor.asymmetry")[..], [1.1]);
        assert_eq!(values("motor.saturation")[..], [5.0]);
        let error = hidden_effect("arm.spring:stiffness=1e-3", &params).expect_err("no rest");
        assert_eq!(
            error.to_string(),
            "arm.spring lacks rest (rad): give it a value"
        );
        assert_eq!(values("disturbance.kick")[3], 0.0);
    }

    #[test]
    fn every_effect_can_be_hidden_at_its_typical_size() {
        for name in Rig::VOLTAGE {
            let params = Rig::builtin(name).expect("built in").params;
            for spec in CATALOGUE.iter().chain(RARE) {
                let effect = hidden_effect(spec.id, &params).expect(spec.id);
                assert!(!effect.is_off(), "{name}: {}", spec.id);
            }
        }
    }
}
