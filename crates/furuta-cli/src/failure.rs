//! How a command fails: one line for the user.

use std::error::Error;

/// What is printed where a command fails. Every error of the libraries becomes one; their texts say what, where and
/// what to do.
#[derive(Debug)]
pub(crate) struct Failure(String);

impl Failure {
    /// A failure that no library knows of.
    pub(crate) fn new(text: impl Into<String>) -> Self {
        Self(text.into())
    }
}

impl<E: Error> From<E> for Failure {
    fn from(error: E) -> Self {
        Self(error.to_string())
    }
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        furuta_input::plain(&self.0).fmt(f)
    }
}
