//! A stretch of one recording in which something else happened: the motor was cut off while the command went on, a hand
//! held the rig.
//!
//! A fit to everything is drawn towards such a stretch and is far from all. So each recording is left out in turn of
//! what came closest; where what is left falls by most, a search goes over the others. If that explains them, and is
//! near the recording but for one stretch, the stretch is left out, and everything else is diagnosed anew.

use super::evidence::FAR;
use super::find::{USUAL, Work};
use super::result::LeftOut;
use super::search::Search;
use super::{Fit, SEARCH, Verdict, savers};
use crate::recording::Recording;
use crate::shooting::{Effort, Problem, Window};

/// Without its recording, what is left above the noise falls by this factor at least: half of it and more is that
/// recording's own, of two or more.
const OWN: f64 = 2.0;
/// A shorter stretch may be what acts once and has a name, s: eight times the longest push from which a fit starts.
const LEAST: f64 = 1.0;
/// A longer one, as a share of its recording, is not something that happened but how the rig is.
const MOST: f64 = 0.5;
/// Of the quarters of a recording, one at least is free of a stretch that takes no more than `MOST` of it.
const QUARTERS: usize = 4;
/// Of its windows, at least this share is far from what explains all else.
const TOGETHER: f64 = 0.5;

/// The stretch, as found.
pub(super) struct Stretch {
    recording: usize,
    /// From where to where, s from the recording's first sample.
    from: f64,
    to: f64,
}

impl Work<'_> {
    /// The stretch that the others' best model is far from, if there is one. `refitted` and `closest` are fits to all
    /// windows: the sheet, and what came closest so far.
    pub(super) fn stretch(&self, refitted: &Fit, closest: &Fit) -> Option<Stretch> {
        if self.data.recordings < 2 {
            return None;
        }
        self.teller.stage(STAGE);
        let told = self.teller.candidates(STAGE);
        let short = &self.short;
        let recording_of = |w: &Window| self.data.runs[w.run].recording;
        let without = |recording: usize, fit: &Fit| {
            let (windows, states) = (short.windows.iter().zip(&fit.states))
                .filter(|(w, _)| recording_of(w) != recording)
                .map(|(w, state)| (*w, *state))
                .unzip::<_, _, Vec<_>, Vec<_>>();
            let rest = Problem::new(self.data, windows).until(self.deadlines.stop);
            let fit = rest.fit(&fit.model, fit.z.clone(), &states, Effort::FULL);
            (rest, fit)
        };
        let above = |problem: &Problem<'_>, fit: &Fit| problem.chi(fit).powi(2) - 1.0;
        let (recording, least) = (0..self.data.recordings)
            .map(|recording| (recording, without(recording, closest)))
            .filter(|(_, (rest, _))| !rest.windows.is_empty())
            .map(|(recording, (rest, fit))| (recording, above(&rest, &fit)))
            .min_by(|(_, a), (_, b)| a.total_cmp(b))?;
        if least * OWN > above(short, closest) {
            return None;
        }
        let (rest, start) = without(recording, refitted);
        let mut search = Search::new(&rest, start, &|_| true, savers::of(&self.options), &told);
        search.run_while(|search| {
            !search.explains() && search.closest().model.effects.len() <= USUAL
        });
        let found = search.closest();
        if !rest.explains(&found) {
            return None;
        }
        let windows = (short.windows.iter().copied()).filter(|w| recording_of(w) == recording);
        let here = self.far_from(&found, windows.collect());
        let is_far = |(_, far): &(Window, bool)| *far;
        let (first, last) = (
            here.iter().position(is_far)?,
            here.iter().rposition(is_far)?,
        );
        let stretch = here.get(first..=last)?;
        let share = stretch.iter().filter(|w| is_far(w)).count() as f64 / stretch.len() as f64;
        let of_all = stretch.len() as f64 / here.len() as f64;
        let seconds = stretch.len() as f64 * SEARCH;
        if share < TOGETHER || of_all > MOST || seconds < LEAST {
            return None;
        }
        // A window before and after: it begins and ends within one.
        let time = |w: Window, k: usize| self.data.runs[w.run].time(k);
        let (before, after) = (stretch.first()?.0, stretch.last()?.0);
        Some(Stretch {
            recording,
            from: time(before, before.start) - SEARCH,
            to: time(after, after.start + after.len) + SEARCH,
        })
    }

    /// Which windows of a recording a fit to the others is far from. The recording's zeros are those of one of its
    /// quarters, that of which the fewest windows are far.
    fn far_from(&self, found: &Fit, windows: Vec<Window>) -> Vec<(Window, bool)> {
        let problem = |windows| Problem::new(self.data, windows).until(self.deadlines.stop);
        let all = problem(windows.clone());
        let far = |z: Vec<f64>| -> Vec<bool> {
            let left = all.left_in_windows(&all.solve_states(&found.model, &z, None));
            left.into_iter().map(|left| left > FAR * FAR).collect()
        };
        let by_quarter = (windows.chunks(windows.len().div_ceil(QUARTERS)))
            .map(|part| far(problem(part.to_vec()).with_zeros(&found.model, &found.z)));
        let fewest = by_quarter.min_by_key(|far| far.iter().filter(|far| **far).count());
        windows
            .into_iter()
            .zip(fewest.unwrap_or_default())
            .collect()
    }
}

/// What a person is told.
const STAGE: &str = "looking for a stretch in which something else happened";

impl Stretch {
    /// The recordings without it.
    pub(super) fn left_out(&self, recordings: &[Recording]) -> Vec<Recording> {
        let mut rest = recordings.to_vec();
        if let Some(recording) = rest.get_mut(self.recording) {
            *recording = recording.without(self.from, self.to);
        }
        rest
    }

    /// What is said of it, the rest not known yet.
    pub(super) fn said(&self, recordings: &[Recording]) -> LeftOut {
        let recording = recordings.get(self.recording);
        let times = recording.map_or(&[][..], |r| &r.t);
        let start = times.first().copied().unwrap_or(0.0);
        let end = times.last().copied().unwrap_or(0.0);
        LeftOut {
            run: recording.map(|r| r.name.clone()).unwrap_or_default(),
            from: (start + self.from).max(start),
            to: (start + self.to).min(end),
            rest: Verdict::Unexplained,
        }
    }
}
