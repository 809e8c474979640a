//! Recordings that are given twice.

use super::Recording;

impl Recording {
    /// Whether another recording holds the same samples, whatever their files are called.
    #[must_use]
    pub fn has_samples_of(&self, other: &Self) -> bool {
        (&self.t, &self.u, &self.theta, &self.alpha)
            == (&other.t, &other.u, &other.theta, &other.alpha)
    }
}

/// A recording is given twice: its noise would count as evidence twice, or be averaged with itself.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{file}: holds the same samples as {as_given}: give each recording once")]
pub struct GivenTwice {
    /// The second of them.
    pub file: String,
    /// The first.
    pub as_given: String,
}

/// Whether no two of these recordings hold the same samples.
///
/// # Errors
/// The first recording that is given again under whatever name.
///
/// ```
/// use furuta_recording::{Recording, each_once};
/// let swing = |name, alpha| Recording::from_samples(name, (0..9).map(|k| [0.1 * f64::from(k), 0.0, 0.0, alpha]));
/// let recordings = [swing("a", 3.1)?.0, swing("b", 3.0)?.0, swing("c", 3.1)?.0];
/// let twice = each_once(&recordings).expect_err("two are the same");
/// assert_eq!([twice.as_given, twice.file], ["a", "c"]);
/// assert_eq!(each_once(&recordings[..2]), Ok(()));
/// # Ok::<(), furuta_recording::RecordingError>(())
/// ```
pub fn each_once<'a>(
    recordings: impl IntoIterator<Item = &'a Recording>,
) -> Result<(), GivenTwice> {
    let mut seen: Vec<&Recording> = Vec::new();
    for recording in recordings {
        if let Some(first) = seen.iter().find(|first| first.has_samples_of(recording)) {
            return Err(GivenTwice {
                file: recording.name.clone(),
                as_given: first.name.clone(),
            });
        }
        seen.push(recording);
    }
    Ok(())
}
