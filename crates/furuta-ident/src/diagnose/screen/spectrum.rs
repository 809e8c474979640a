//! Which frequencies a sine of time is tried at: those at which it may gain most.
//!
//! What a course of torque gains is `p²/q`: `p` is linear in the torque, `q` quadratic. With the weights of `p`, block
//! by block (an adjoint), `p` of every frequency is one Fourier sum. `q` changes slowly with the frequency, as a window
//! is short: it is computed on a coarse grid.

use std::f64::consts::{FRAC_PI_2, TAU};

use furuta_model::effects::Kind;
use furuta_model::{Effect, Spec};

use super::Screen;
use super::sums::{Second, Sums};

/// Frequencies that are tried: five about each of the five highest peaks, whose width is two steps of the grid.
const TRIED: usize = 25;
/// Between two frequencies at which `q` is computed, Hz: an eighth of the frequency of a window's length.
const COARSE: f64 = 0.5;

impl Screen {
    /// Of the places of a grid, those whose frequency may gain most; all of them where the effect is no sine of time.
    /// `step` is between two frequencies of the grid, Hz, which are its multiples.
    pub(super) fn promising(
        &self,
        spec: &'static Spec,
        places: Vec<Vec<f64>>,
        step: f64,
    ) -> Vec<Vec<f64>> {
        let at = |kind: Kind| spec.parameters.iter().position(|p| p.kind == kind);
        let (Some(frequency), Some(phase)) = (at(Kind::Frequency), at(Kind::Phase)) else {
            return places;
        };
        let highest = places.iter().map(|p| p[frequency]).fold(0.0, f64::max);
        if places.len() <= TRIED {
            return places;
        }
        let sine = |f: f64, turn: f64| {
            let mut values = places[0].clone();
            (values[frequency], values[phase]) = (f, turn);
            Effect::unchecked(spec.id, &values)
        };
        let count = (highest / step).round() as usize;
        let Some(largest) = sine(step, FRAC_PI_2) else {
            return places;
        };
        let products = self.products(&largest, step, count);
        let coarse: Vec<f64> = (0..=(highest / COARSE).ceil() as usize)
            .map(|k| {
                let f = (k as f64 * COARSE).max(step);
                let (Some(first), Some(quarter)) = (sine(f, 0.0), sine(f, FRAC_PI_2)) else {
                    return f64::INFINITY;
                };
                let mut sums = Sums::zero(self.gradient.len());
                for response in &self.responses {
                    self.add(
                        response,
                        &first,
                        &Second::Quarter(&quarter),
                        &mut sums,
                        false,
                    );
                }
                0.5 * (sums.square[(0, 0)] + sums.square[(1, 1)])
            })
            .collect();
        let gain = |place: &Vec<f64>| {
            let [cos, sin] =
                products[((place[frequency] / step).round() as usize - 1).min(count - 1)];
            let x = place[frequency] / COARSE;
            let k = (x.floor() as usize).min(coarse.len() - 2);
            let square = coarse[k] + (x - k as f64) * (coarse[k + 1] - coarse[k]);
            (cos * cos + sin * sin) / square
        };
        let mut gains: Vec<(f64, Vec<f64>)> = places.into_iter().map(|p| (gain(&p), p)).collect();
        gains.sort_by(|a, b| b.0.total_cmp(&a.0));
        gains.truncate(TRIED);
        gains.into_iter().map(|(_, place)| place).collect()
    }

    /// `p` of a cosine and of a sine at the first `count` multiples of `step` (Hz), as large as `largest` at time 0.
    fn products(&self, largest: &Effect<f64>, step: f64, count: usize) -> Vec<[f64; 2]> {
        let mut products = vec![[0.0; 2]; count];
        for response in &self.responses {
            let start = response.normal.solve(&response.gradient);
            // What the steps after a block say of a change of state in it, backwards.
            let mut later = nalgebra::Vector4::zeros();
            for block in response.blocks.iter().rev() {
                let product = block.product - block.square * start;
                let [arm, pendulum] = self.torques_at(response, block, 0.0, largest);
                let pushed = block.impulse[0] * arm + block.impulse[1] * pendulum;
                let weight = pushed.dot(&(product * block.share + later));
                later += product;
                let (sin_by, cos_by) = (TAU * step * block.t).sin_cos();
                let (mut cos, mut sin) = (cos_by, sin_by);
                for p in &mut products {
                    p[0] += weight * cos;
                    p[1] += weight * sin;
                    (cos, sin) = (cos * cos_by - sin * sin_by, sin * cos_by + cos * sin_by);
                }
            }
        }
        products
    }
}

#[cfg(test)]
mod tests {
    use furuta_model::{Rig, effects};

    use super::*;
    use crate::diagnose::sweep::{Recorded, sweep};

    /// Of all frequencies the best is among those that are tried, and the estimate is what the exact sums say.
    #[test]
    fn the_best_frequency_is_among_the_promising() {
        let rig = Rig::builtin("qube-servo-2").expect("built in");
        let hum = Effect::new("disturbance.vibration", &[5e-4, 7.3, 0.4]).expect("valid");
        let recorded = Recorded::new(&[sweep("hum", &rig, &[hum], 0.0)], &rig);
        let problem = recorded.problem();
        let fit = recorded.refitted(&problem);
        let screen = Screen::new(&problem, &fit);
        let spec = effects::spec("disturbance.vibration").expect("an entry");
        let run = &recorded.data.runs[0];
        let step = 0.5 / run.time(run.y.len());
        let places: Vec<Vec<f64>> = (1..=200)
            .map(|k| vec![1e-4, f64::from(k) * step, 0.0])
            .collect();
        let gain = |place: &Vec<f64>| screen.gain(spec, place.clone()).expect("a gain").gain;
        let best = places
            .iter()
            .max_by(|a, b| gain(a).total_cmp(&gain(b)))
            .expect("some")
            .clone();
        assert!((best[1] - 7.3).abs() < step, "{best:?}");
        let tried = screen.promising(spec, places, step);
        assert_eq!(tried.len(), TRIED);
        assert_eq!(tried[0], best);
        // Of what is tried the gains fall, but for what interpolating `q` misses: some per cent.
        let gains: Vec<f64> = tried.iter().map(gain).collect();
        assert!(gains.windows(2).all(|g| g[1] < 1.1 * g[0]), "{gains:?}");
    }
}
