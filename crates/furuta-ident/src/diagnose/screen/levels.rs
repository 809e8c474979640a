//! How far the levels of a command are apart: every distance is tried, without simulating.

use furuta_model::{Effect, Spec};
use rayon::prelude::*;

use super::scan::{PLACES, Place};
use super::sums::{Second, Sums};
use super::{Response, Screen};

/// From one distance to the next, the levels at the largest command move by this share of a level: with half of one,
/// what is rounded there is rounded the other way.
const SHARE: f64 = 0.25;
/// The share is halved this often about the best distances, to a hundred-thousandth of a level.
const HALVINGS: usize = 14;
/// Distances are tried down to this share of the largest command: those of a timer of 8 bits.
const MOST_LEVELS: f64 = 256.0;

impl Screen {
    /// The distances at which rounding the command to levels gains more than at the next ones; the effect has no other
    /// parameter.
    pub(super) fn levels(&self, spec: &'static Spec) -> Vec<Place> {
        let steps = self.responses.iter().flat_map(|r: &Response| &r.steps);
        let largest = steps.map(|step| step.volts.abs()).fold(0.0, f64::max);
        // Half a level is the least that is rounded to one.
        let count = (MOST_LEVELS / SHARE) as usize;
        let levels = |i: usize| 0.5 + SHARE * i as f64;
        let fall = |levels: f64| self.fall(spec, largest / levels);
        let falls: Vec<f64> = (0..count)
            .into_par_iter()
            .map(|i| fall(levels(i)))
            .collect();
        let at = |i: usize| falls.get(i).copied().unwrap_or(0.0);
        let is_top = |i: &usize| at(*i) > at(i + 1) && at(*i) >= i.checked_sub(1).map_or(0.0, at);
        let mut tops: Vec<usize> = (0..count).filter(is_top).collect();
        tops.sort_by(|a, b| at(*b).total_cmp(&at(*a)));
        let sharpened = |top: usize| {
            let mut here = (at(top), levels(top));
            for k in 1..=HALVINGS {
                let by = SHARE * 0.5_f64.powi(k as i32);
                for levels in [here.1 - by, here.1 + by] {
                    let there = fall(levels);
                    if there > here.0 {
                        here = (there, levels);
                    }
                }
            }
            Place {
                gain: here.0,
                values: vec![largest / here.1],
                zeros: vec![0.0; self.recordings],
            }
        };
        tops.truncate(PLACES);
        let mut places: Vec<Place> = tops.into_par_iter().map(sharpened).collect();
        places.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        places
    }

    /// By how much the cost falls with this distance of the levels; what follows follows.
    fn fall(&self, spec: &'static Spec, distance: f64) -> f64 {
        let Some(effect) = Effect::of(spec, &[distance]) else {
            return 0.0;
        };
        let mut sums = Sums::zero(self.gradient.len());
        for response in &self.responses {
            self.add(response, &effect, &Second::None, &mut sums, true);
        }
        match self.solve(&[sums], false).as_deref() {
            // What is rounded has one size: `gain` is at `strength` times it.
            Some([[gain, strength, _]]) if *strength > 0.5 => {
                gain * (2.0 * strength - 1.0) / (strength * strength)
            }
            _ => 0.0,
        }
    }
}
