//! The hypotheses that this process has read. Each is kept for good, and once.

use super::OwnLaws;
use crate::effects::Spec;
use std::sync::{PoisonError, RwLock};

static READ: RwLock<Vec<&'static Spec>> = RwLock::new(Vec::new());

/// The hypothesis with this id: of several with one id, the one read last.
pub(in crate::effects) fn known(id: &str) -> Option<&'static Spec> {
    let read = READ.read().unwrap_or_else(PoisonError::into_inner);
    read.iter().rev().find(|s| s.id == id).copied()
}

/// The hypothesis of this id and text, made where it is new.
pub(super) fn keep(
    id: &str,
    text: &str,
    make: impl FnOnce(&'static str, &'static str) -> (Spec, OwnLaws),
) -> &'static Spec {
    let mut read = READ.write().unwrap_or_else(PoisonError::into_inner);
    let same = |s: &&Spec| s.id == id && s.own.is_some_and(|laws| laws.text == text);
    let spec: &'static Spec = match read.iter().position(same) {
        Some(place) => read.remove(place),
        None => {
            let (spec, laws) = make(leak(id), leak(text));
            Box::leak(Box::new(Spec {
                own: Some(Box::leak(Box::new(laws))),
                ..spec
            }))
        }
    };
    read.push(spec);
    spec
}

/// The same text for the life of the process.
pub(super) fn leak(text: &str) -> &'static str {
    Box::leak(text.to_owned().into_boxed_str())
}
