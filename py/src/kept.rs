//! What results have in common: they are equal where all that was found is, and pickle.

use crate::error;
use pyo3::{Bound, PyAny};
use std::hash::{DefaultHasher, Hash, Hasher};

/// Something that was found.
pub(crate) trait Kept {
    /// All of it as text, without the time that it took.
    fn content(&self) -> String;

    /// The same for what is equal.
    fn hash(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        self.content().hash(&mut hasher);
        hasher.finish()
    }
}

/// What `__reduce__` answers: what makes the object again, and of which parts.
pub(crate) type Reduced<'py, Parts> = (Bound<'py, PyAny>, Parts);

/// A pickle that this version did not write.
pub(crate) fn unreadable(what: &str, why: impl std::fmt::Display) -> pyo3::PyErr {
    error::recording(format!(
        "{what}: this pickle cannot be read ({why}); it is of another version: make the result again"
    ))
}

/// The text that serde gives; of what has string keys and numbers alone nothing can fail.
pub(crate) fn json<T: serde::Serialize>(value: &T) -> String {
    serde_json::to_string(value).unwrap_or_default()
}
