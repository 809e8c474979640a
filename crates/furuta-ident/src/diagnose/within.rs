//! How much of long recordings a diagnosis looks at, for the sake of its time limit.

use super::request::Options;
use crate::recording::Recording;

/// Samples for each second of the time limit: with two effects 50,000 take about half a minute on two cores
/// (`py/tests/test_long_recordings.py` prints it).
const PER_SECOND: f64 = 1000.0;
/// A shorter time limit leaves no more out: it is for who wants an answer at once.
const USUAL: f64 = 60.0;
/// What is looked at is in stretches of this length, s: two of the longest windows, and their start.
const STRETCH: f64 = 5.0;

/// What is looked at of recordings that are too long, and what is said of it; `None` where the time limit suffices for
/// all of them, and where everything was asked for.
pub(super) fn within(
    recordings: &[Recording],
    options: &Options<'_>,
) -> Option<(Vec<Recording>, String)> {
    let limit = options.time_limit.filter(|_| !options.thorough)?;
    let seconds = |all: &[Recording]| -> f64 {
        let of = |r: &Recording| r.samples_used() as f64 * r.sample_period;
        all.iter().map(of).sum()
    };
    let all = samples(recordings) as f64;
    let share = PER_SECOND * limit.as_secs_f64().max(USUAL) / all;
    if share >= 1.0 {
        return None;
    }
    let used: Vec<Recording> = (recordings.iter())
        .map(|r| r.in_stretches(STRETCH, share))
        .collect();
    let said = format!(
        "{:.0} s of {:.0} s were looked at, in stretches of {STRETCH} s, for the sake of the time limit; with a time \
         limit of {:.0} s all would be",
        seconds(&used),
        seconds(recordings),
        (all / PER_SECOND).ceil()
    );
    Some((used, said))
}

fn samples(recordings: &[Recording]) -> usize {
    recordings.iter().map(Recording::samples_used).sum()
}

/// How many samples of these recordings a diagnosis with these options looks at.
///
/// ```
/// use furuta_ident::diagnose::{Options, samples_looked_at};
/// use furuta_ident::recording::Recording;
/// use std::time::Duration;
///
/// let sway = |k: u32| [0.001 * f64::from(k), 0.0, (0.001 * f64::from(k)).sin(), 3.1];
/// let (long, _) = Recording::from_samples("two minutes", (0..120_000).map(sway))?;
/// let all = Options::default();
/// let a_minute = Options { time_limit: Some(Duration::from_secs(60)), ..all };
/// let looked_at = [all, a_minute].map(|options| samples_looked_at(&[long.clone()], &options));
/// assert_eq!(looked_at, [120_000, 60_000]);
/// # Ok::<(), furuta_ident::recording::RecordingError>(())
/// ```
#[must_use]
pub fn samples_looked_at(recordings: &[Recording], options: &Options<'_>) -> usize {
    within(recordings, options).map_or_else(|| samples(recordings), |(used, _)| samples(&used))
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    fn recording(name: &str, seconds: u32) -> Recording {
        let sway = |k: u32| [0.001 * f64::from(k), 0.0, (0.001 * f64::from(k)).sin(), 3.1];
        let (recording, _) =
            Recording::from_samples(name, (0..1000 * seconds).map(sway)).expect("even");
        recording
    }

    fn limited(seconds: u64) -> Options<'static> {
        Options {
            time_limit: Some(Duration::from_secs(seconds)),
            ..Options::default()
        }
    }

    #[test]
    fn every_recording_is_looked_at_in_its_share_and_a_short_one_as_it_is() {
        let all = [
            recording("long", 100),
            recording("short", 4),
            recording("longer", 136),
        ];
        let (used, said) = within(&all, &limited(60)).expect("240 s at 1 kHz are too many");
        let seconds: Vec<usize> = used.iter().map(|r| r.samples_used() / 1000).collect();
        assert_eq!(seconds, [25, 4, 35]);
        assert!(
            used[0].segments.iter().all(|s| s.len() == 5000),
            "{:?}",
            used[0].segments
        );
        assert!(
            said.starts_with("64 s of 240 s were looked at") && said.contains("limit of 240 s"),
            "{said}"
        );
        // An answer at once is of as much.
        assert_eq!(within(&all, &limited(1)).expect("too many").0, used);
    }

    #[test]
    fn of_many_recordings_a_stretch_of_each_is_looked_at() {
        let all: Vec<Recording> = (0..40).map(|i| recording(&i.to_string(), 20)).collect();
        let (used, _) = within(&all, &limited(60)).expect("800 s at 1 kHz are too many");
        assert!(used.iter().all(|r| r.samples_used() == 5000));
    }

    #[test]
    fn all_is_looked_at_where_time_suffices_or_everything_was_asked_for() {
        let all = [recording("minute", 60)];
        assert!(within(&all, &limited(60)).is_none());
        let longer = [recording("longer", 61)];
        assert!(within(&longer, &limited(61)).is_none());
        assert!(within(&longer, &Options::default()).is_none());
        let thorough = Options {
            thorough: true,
            ..limited(60)
        };
        assert!(within(&longer, &thorough).is_none());
    }
}
