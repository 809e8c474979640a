//! Where an effect with a place (an order, a frequency, a moment, a phase) acts: all places are tried, without
//! simulating.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use furuta_model::dynamics::Angle;
use furuta_model::effects::{Clock, Instant, Kind, Law, ParameterSpec};
use furuta_model::{Effect, Spec, State};
use rayon::prelude::*;

use super::sums::{Second, Sums};
use super::{Looks, SLOPE, Screen, TOUCH, is_scanned, looks};

/// Places that are handed to the fit.
pub(super) const PLACES: usize = 2;
/// Frequencies up to here are looked at, Hz.
const HIGHEST: f64 = 25.0;
/// Moments are looked at in steps of this, s.
const MOMENTS: f64 = 0.008;
/// Two places nearer than this many grid steps are one.
const NEAR: f64 = 6.0;
/// A place in the turn is not looked for farther off than this, rad.
const MOST_OFFSET: f64 = 6.0;

/// Where a fit may start with one more effect: its parameters (physical) and where the zeros of theta go, recording by
/// recording (rad).
#[derive(Clone, Debug)]
pub(in super::super) struct Place {
    /// By how much the cost would fall.
    pub(in super::super) gain: f64,
    pub(in super::super) values: Vec<f64>,
    pub(in super::super) zeros: Vec<f64>,
}

impl Screen {
    /// The places of the effect with the largest statistics, the best first.
    pub(in super::super) fn places(&self, spec: &'static Spec, typical: &[f64]) -> Vec<Place> {
        self.places_where(spec, typical, |_| true)
    }

    /// The same of the places (by their parameters) that are asked for.
    pub(in super::super) fn places_where(
        &self,
        spec: &'static Spec,
        typical: &[f64],
        asked: impl Fn(&[f64]) -> bool + Sync,
    ) -> Vec<Place> {
        match looks(spec) {
            Some(Looks::Grid) => self.best(spec, self.on_grid(spec, typical, asked)),
            Some(Looks::Moments) => self.best(spec, self.steps_of_zero(spec, asked)),
            Some(Looks::Levels) => self.levels(spec),
            Some(Looks::Stops) => self.stops(spec, typical),
            None => Vec::new(),
        }
    }

    /// What the effect gains at each place of a grid that is asked for.
    fn on_grid(
        &self,
        spec: &'static Spec,
        typical: &[f64],
        asked: impl Fn(&[f64]) -> bool + Sync,
    ) -> Vec<Place> {
        let mut grid: Vec<Vec<f64>> = vec![Vec::new()];
        for (p, typical) in spec.parameters.iter().zip(typical) {
            let values = self.grid(p, *typical);
            grid = grid
                .iter()
                .flat_map(|place| {
                    values.iter().map(|v| {
                        let mut place = place.clone();
                        place.push(*v);
                        place
                    })
                })
                .collect();
        }
        for values in &mut grid {
            touch(spec, values, typical);
        }
        grid.retain(|values| asked(values));
        self.promising(spec, grid, self.step(Kind::Frequency))
            .into_par_iter()
            .filter_map(|values| self.gain(spec, values))
            .collect()
    }

    /// The best of the places tried that are apart.
    fn best(&self, spec: &Spec, mut tried: Vec<Place>) -> Vec<Place> {
        // A stable sort: the same starts whatever the number of threads.
        tried.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        let mut best: Vec<Place> = Vec::new();
        for place in tried {
            if best
                .iter()
                .all(|b| self.apart(spec, &b.values, &place.values))
            {
                best.push(place);
                if best.len() == PLACES {
                    break;
                }
            }
        }
        best
    }

    fn step(&self, kind: Kind) -> f64 {
        match kind {
            Kind::Frequency => 0.5 / self.longest,
            _ => MOMENTS.max(self.period),
        }
    }

    fn grid(&self, p: &ParameterSpec, typical: f64) -> Vec<f64> {
        let even = |step: f64, end: f64| {
            (1..)
                .map(|i| f64::from(i) * step)
                .take_while(move |v| *v < end)
                .collect()
        };
        match p.kind {
            Kind::Phase | Kind::Rest => vec![0.0],
            Kind::Frequency => even(self.step(p.kind), HIGHEST.min(0.25 / self.period)),
            Kind::Time => even(self.step(p.kind), self.longest),
            Kind::Run => (0..self.recordings).map(|r| r as f64).collect(),
            // What repeats with the angle must have been seen to turn back: half a period.
            Kind::Whole => p
                .starts
                .iter()
                .map(|s| p.off + s * typical)
                .filter(|order| order * self.turned() >= PI)
                .collect(),
            _ => p.starts.iter().map(|s| p.off + s * typical).collect(),
        }
    }

    fn apart(&self, spec: &Spec, a: &[f64], b: &[f64]) -> bool {
        spec.parameters
            .iter()
            .zip(a.iter().zip(b))
            .any(|(p, (a, b))| match p.kind {
                Kind::Frequency | Kind::Time | Kind::Moment => {
                    (a - b).abs() > NEAR * self.step(p.kind)
                }
                Kind::Whole | Kind::Run => a != b,
                _ => false,
            })
    }

    /// The effect at this place with the best strength and, where it has one, the best phase or angle of rest.
    pub(super) fn gain(&self, spec: &'static Spec, mut values: Vec<f64>) -> Option<Place> {
        let turned = spec.origin();
        let first = Effect::of(spec, &values)?;
        let quarter = match turned {
            Some(i) if spec.parameters[i].kind == Kind::Phase => {
                let mut quarter = values.clone();
                quarter[i] = FRAC_PI_2;
                Some(Effect::of(spec, &quarter)?)
            }
            _ => None,
        };
        let second = match (turned, &quarter) {
            (None, _) => Second::None,
            (Some(_), Some(quarter)) => Second::Quarter(quarter),
            (Some(_), None) => Second::Slope,
        };
        // A place in the turn is one for each recording whose encoder has a zero of its own, until an effect has told
        // these zeros.
        let apart = self.zeros_open && spec.sees_angle();
        let mut sums =
            vec![Sums::zero(self.gradient.len()); if apart { self.recordings } else { 1 }];
        for response in &self.responses {
            let sums = &mut sums[if apart { response.recording } else { 0 }];
            self.add(response, &first, &second, sums, !is_scanned(spec));
        }
        let found = self.solve(&sums, turned.is_some())?;
        let strength = &spec.parameters[0];
        let one_way = strength.min >= strength.off;
        let (mut gain, mut information, mut weighted) = (0.0, 0.0, 0.0);
        let mut offsets = Vec::new();
        for (sums, [part, along, beside]) in sums.iter().zip(&found) {
            if sums.is_idle() {
                // Nothing is known of where it acts in this recording: its zero stays.
                offsets.push(offsets.first().copied().unwrap_or(0.0));
                continue;
            }
            let size = match second {
                Second::Quarter(_) => along.hypot(*beside),
                _ => *along,
            };
            if one_way && size <= 0.0 {
                offsets.push(0.0);
                continue;
            }
            gain += part;
            information += sums.square[(0, 0)];
            weighted += sums.square[(0, 0)] * size;
            offsets.push(match second {
                Second::None => 0.0,
                Second::Quarter(_) => beside.atan2(*along),
                Second::Slope => (beside / along).clamp(-MOST_OFFSET, MOST_OFFSET),
            });
        }
        if information <= 0.0 {
            return None;
        }
        let size = (values[0] - strength.off) * weighted / information;
        values[0] = (strength.off + size).clamp(strength.min, strength.max);
        let mut zeros = vec![0.0; self.recordings];
        if let Some(i) = turned {
            let per_turn = self.per_turn(spec, i, &values);
            // The first recording's place is the effect's; what turns the others' to theirs are their zeros.
            values[i] = match second {
                Second::Quarter(_) => offsets[0],
                _ => offsets[0] * per_turn,
            };
            if apart {
                zeros = offsets
                    .iter()
                    .map(|o| match second {
                        Second::Quarter(_) => half_turn(o - offsets[0]) / per_turn,
                        _ => o - offsets[0],
                    })
                    .collect();
            }
        }
        Some(Place {
            gain,
            values,
            zeros,
        })
    }

    /// By how much a phase or an angle of rest changes to do what turning the arm by one radian does.
    fn per_turn(&self, spec: &'static Spec, i: usize, values: &[f64]) -> f64 {
        let torque = |effect: &Effect<f64>, by: f64| {
            let x = State::new(0.3 + by, 0.7, 0.0, 0.0);
            let at = Instant {
                clock: Clock::at(0.0),
                x: &x,
                angle: Angle::of(x.alpha),
                coefficients: &self.coefficients,
                memory: 0.0,
                volts: 1.0,
            };
            effect.torque(&at)[0]
        };
        let at = |value: f64| {
            let mut moved = values.to_vec();
            moved[i] = value;
            Effect::of(spec, &moved)
        };
        let (Some(low), Some(here), Some(high)) = (at(-SLOPE), at(0.0), at(SLOPE)) else {
            return 1.0;
        };
        let by_parameter = torque(&high, 0.0) - torque(&low, 0.0);
        let by_angle = torque(&here, SLOPE) - torque(&here, -SLOPE);
        if by_parameter == 0.0 || by_angle == 0.0 {
            1.0
        } else {
            by_angle / by_parameter
        }
    }
}

/// A start at no strength at all says nothing about what the effect changes.
fn touch(spec: &Spec, values: &mut [f64], typical: &[f64]) {
    let strengths = || spec.parameters.iter().zip(typical).take(spec.strengths);
    if strengths().zip(&*values).all(|((p, _), v)| *v == p.off) {
        for (v, (p, typical)) in values.iter_mut().zip(strengths()) {
            *v = (p.off + TOUCH * typical).clamp(p.min, p.max);
        }
    }
}

/// The angle within half a turn either way.
fn half_turn(angle: f64) -> f64 {
    angle - TAU * (angle / TAU).round()
}

#[cfg(test)]
mod tests {
    use furuta_model::{Plant, Rig, effects};

    use super::*;
    use crate::diagnose::criteria::CRITERIA;
    use crate::diagnose::sweep::{Recorded, sweep};
    use crate::recording::Recording;

    /// The pendulum lifted and let go, the motor off: a ripple of the motor does nothing then.
    fn let_go(rig: &Rig, ripple: Effect<f64>) -> Recording {
        let plant: Plant<f64> = Plant::new(&rig.params, &[ripple]).expect("a plant");
        let mut x = plant.rest(State::new(0.0, PI - 0.8, 0.0, 0.0));
        let samples = (0..1500).map(|k| {
            let [theta, alpha] = rig.sensors.quantised(plant.measure(&x));
            plant.step(&mut x, 0.0, 0.002);
            [f64::from(k) * 0.002, 0.0, theta, alpha]
        });
        let samples: Vec<[f64; 4]> = samples.collect();
        Recording::from_samples("let go", samples).expect("sound").0
    }

    #[test]
    fn a_recording_in_which_an_effect_does_nothing_does_not_hide_it() {
        let rig = Rig::builtin("qube-servo-2").expect("built in");
        let ripple = Effect::new("motor.ripple", &[0.05, 8.0, 0.7]).expect("valid");
        let recordings = [sweep("driven", &rig, &[ripple], 0.0), let_go(&rig, ripple)];
        let recorded = Recorded::new(&recordings, &rig);
        let problem = recorded.problem();
        let fit = recorded.refitted(&problem);
        let spec = effects::spec("motor.ripple").expect("an entry");
        let typical: Vec<f64> = (spec.parameters.iter())
            .map(|p| p.typical(&rig.params))
            .collect();
        let places = Screen::new(&problem, &fit).places(spec, &typical);
        let best = places.first().expect("the other recording shows it");
        assert!(best.gain > CRITERIA.least(spec, None), "{best:?}");
        assert_eq!(best.zeros, [0.0; 2]);
    }
}
