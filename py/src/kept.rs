//! What classes have in common: how they are copied; results are equal where all that was found is, and pickle.

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

/// A class whose objects cannot be changed: a copy is the object itself.
macro_rules! immutable {
    ($class:ident) => {
        #[pymethods]
        impl $class {
            /// The object itself: it cannot be changed.
            fn __copy__(slf: Bound<'_, Self>) -> Bound<'_, Self> {
                slf
            }

            fn __deepcopy__<'py>(
                slf: Bound<'py, Self>,
                _memo: &Bound<'py, PyAny>,
            ) -> Bound<'py, Self> {
                slf
            }
        }
    };
}
pub(crate) use immutable;

/// A result: `immutable!`, and equal, with an equal hash, where its `Kept::content` is.
macro_rules! kept {
    ($class:ident) => {
        $crate::kept::immutable!($class);

        #[pymethods]
        impl $class {
            /// Equal where all that was found is; the time that it took does not count.
            fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
                let other = other.cast::<Self>();
                other.is_ok_and(|other| other.get().content() == self.content())
            }

            fn __hash__(&self) -> u64 {
                Kept::hash(self)
            }
        }
    };
}
pub(crate) use kept;

/// A class whose objects remember something: a copy remembers the same, and goes its own way.
macro_rules! cloned {
    ($class:ident) => {
        #[pymethods]
        impl $class {
            fn __copy__(&self) -> Self {
                self.clone()
            }

            fn __deepcopy__(&self, _memo: &Bound<'_, PyAny>) -> Self {
                self.clone()
            }
        }
    };
}
pub(crate) use cloned;
