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

/// The first recording that is given again under whatever name, and where it is.
///
/// ```
/// use furuta_recording::{Recording, twice};
/// let swing = |name, alpha| Recording::from_samples(name, (0..9).map(|k| [0.1 * f64::from(k), 0.0, 0.0, alpha]));
/// let recordings = [swing("a", 3.1)?.0, swing("b", 3.0)?.0, swing("c", 3.1)?.0];
/// let (first, again) = twice(&recordings).expect("two are the same");
/// assert_eq!([&first.name, &again.name], ["a", "c"]);
/// assert_eq!(twice(&recordings[..2]), None);
/// # Ok::<(), furuta_recording::RecordingError>(())
/// ```
#[must_use]
pub fn twice<'a>(
    recordings: impl IntoIterator<Item = &'a Recording>,
) -> Option<(&'a Recording, &'a Recording)> {
    let mut seen: Vec<&Recording> = Vec::new();
    for recording in recordings {
        if let Some(first) = seen.iter().find(|first| first.has_samples_of(recording)) {
            return Some((first, recording));
        }
        seen.push(recording);
    }
    None
}
