//! The screen: how much each effect promises, and where its fit should start.
//!
//! The answer to any course of torque comes from impulse responses computed once, and thousands of orders, frequencies or moments are tried
//! without simulating (grid screen). Where an effect is no torque, one simulation with it gives a score statistic. What the free initial states and the
//! base parameters would absorb is projected out; what is left says how much the cost would fall, and at which strength.
//!
//! An effect that depends on the arm's absolute angle meets each recording at another one, since each encoder was zeroed elsewhere: its place in the turn is
//! looked for recording by recording.

use furuta_model::dynamics::Angle;
use furuta_model::effects::{Acts, Clock, Instant, Kind, Law, ParameterSpec};
use furuta_model::params::Coefficients;
use furuta_model::{Effect, Spec, State};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Matrix2, SVector, Vector2, Vector4};
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::Fit;
use super::hypothesis::{FIRST_EFFECT, Hypothesis, TIMING};
use crate::shooting::{Block, ImpulseResponse, Model, Problem, Windows, ZEROS, impulse_responses};

/// Places that are handed to the fit.
const PLACES: usize = 2;
/// Frequencies up to here are looked at, Hz.
const HIGHEST: f64 = 25.0;
/// Moments are looked at in steps of this, s.
const MOMENTS: f64 = 0.008;
/// Above `FAR` times the noise, every `EVERY`-th window says where to look, as long as `LEAST_SCREENED` are asked.
const FAR: f64 = 3.0;
const EVERY: usize = 3;
const LEAST_SCREENED: usize = 24;
/// Two places nearer than this many grid steps are one.
const NEAR: f64 = 6.0;
/// An angle over which a torque's slope is taken, rad.
const SLOPE: f64 = 1e-3;
/// A place in the turn is not looked for farther off than this, rad.
const MOST_OFFSET: f64 = 6.0;

/// What follows in a window: the base parameters, and the zeros of its recording.
pub(super) const FOLLOW: usize = FIRST_EFFECT + ZEROS;
pub(super) type Response = ImpulseResponse<FOLLOW>;

/// The impulse responses about a fit, whose base parameters and zeros follow; what is held or at its bound does not.
pub(super) fn responses(problem: &Problem<'_>, fit: &Fit) -> (Coefficients<f64>, Vec<Response>) {
    let layout = fit.model.layout();
    let bounds = fit.model.bounds(&fit.z);
    let (low, high) = bounds[TIMING];
    let mut held = [false; FOLLOW];
    held[TIMING] = fit.z[TIMING] <= low || fit.z[TIMING] >= high;
    for k in 0..ZEROS {
        let is_held = |r: usize| {
            let (low, high) = bounds[layout.zero(r, k)];
            low == high
        };
        held[FIRST_EFFECT + k] = layout.zeros == 0 || (0..layout.recordings).all(is_held);
    }
    impulse_responses::<{ 4 + FOLLOW }, FOLLOW, _>(problem, fit, held)
}

/// A score statistic from one simulation, in units of the noise; what initial states and base parameters can follow taken out.
#[derive(Copy, Clone, Debug)]
pub(super) struct Score {
    /// Sum of the squares of what the effect changes.
    pub(super) square: f64,
    /// Sum of the products of that with what the fit leaves.
    pub(super) product: f64,
}

impl Score {
    /// By how much the cost would fall if what the effects change about the predictions could be had at any strength, or `one_way` only with the sign it
    /// has.
    pub(super) fn statistic(&self, one_way: bool) -> f64 {
        if self.square <= 0.0 || (one_way && self.product <= 0.0) {
            0.0
        } else {
            self.product * self.product / self.square
        }
    }
}

/// Where a fit may start with one more effect: its parameters (physical) and where the zeros of theta go, recording by recording (rad).
#[derive(Clone, Debug)]
pub(super) struct Place {
    /// By how much the cost would fall.
    pub(super) gain: f64,
    pub(super) values: Vec<f64>,
    pub(super) zeros: Vec<f64>,
}

/// What a fit says about any small torque.
pub(super) struct Screen {
    responses: Vec<Response>,
    /// For a place, every `every`-th of the responses is asked, but for one in time.
    every: usize,
    coefficients: Coefficients<f64>,
    /// Normal equations of the base parameters and the zeros of all recordings, the initial states taken out.
    normal: Option<Cholesky<f64, Dyn>>,
    gradient: DVector<f64>,
    recordings: usize,
    /// Whether each recording has a zero of theta of its own that no effect of the fit tells.
    zeros_open: bool,
    longest: f64,
    period: f64,
    /// How far the arm turned, rad.
    range: f64,
}

/// Whether the grid screen finds a start: torques with a place in time, frequency or angle.
pub(super) fn is_placed(spec: &Spec) -> bool {
    let places = |p: &ParameterSpec| p.kind != Kind::Real && !matches!(p.kind, Kind::Choice(_));
    spec.acts.includes(Acts::TORQUE)
        && !spec.acts.includes(Acts::MEMORY)
        && (spec.acts.includes(Acts::ANGLE) || spec.parameters.iter().any(places))
}

/// Whether one of many places was looked for: an order, a frequency, a moment.
pub(super) fn is_scanned(spec: &Spec) -> bool {
    let scanned = |p: &ParameterSpec| matches!(p.kind, Kind::Whole | Kind::Frequency | Kind::Time);
    spec.parameters.iter().any(scanned)
}

impl Screen {
    /// Computes the impulse responses about `fit`.
    pub(super) fn new(problem: &Problem<'_>, fit: &Fit) -> Self {
        let data = problem.data;
        let (coefficients, responses) = responses(problem, fit);
        let nominal = &fit.model.nominal;
        let size = followers(nominal.recordings);
        let mut normal = DMatrix::<f64>::zeros(size, size);
        let mut gradient = DVector::<f64>::zeros(size);
        let every = if problem.chi(fit) > FAR {
            (responses.len() / LEAST_SCREENED).clamp(1, EVERY)
        } else {
            1
        };
        for response in &responses {
            for i in 0..FOLLOW {
                let at = follower(response.recording, i);
                gradient[at] += response.base_gradient[i];
                for j in 0..FOLLOW {
                    normal[(at, follower(response.recording, j))] += response.base_normal[(i, j)];
                }
            }
        }
        // What is known beforehand holds a parameter that the data leave open.
        let (priors, bounds) = (fit.model.priors(), fit.model.bounds(&fit.z));
        let layout = fit.model.layout();
        let weight = problem.per_sample(fit);
        for i in 0..size {
            normal[(i, i)] += 1e-9 + 1e-9 * normal[(i, i)];
            let place = if i < FIRST_EFFECT {
                i
            } else if layout.zeros > 0 {
                layout.shared + i - FIRST_EFFECT
            } else {
                continue;
            };
            if bounds[place].0 == bounds[place].1 {
                normal.row_mut(i).fill(0.0);
                normal.column_mut(i).fill(0.0);
                normal[(i, i)] = 1.0;
                gradient[i] = 0.0;
            } else if let Some(prior) = priors[place] {
                let weight = weight * prior.std.powi(-2);
                normal[(i, i)] += weight;
                gradient[i] += weight * (prior.mean - fit.z[place]);
            }
        }
        let angles = data.runs.iter().flat_map(|r| &r.y).map(|y| y[0]);
        let (least, most) = angles.fold((f64::MAX, f64::MIN), |(a, b), y| (a.min(y), b.max(y)));
        Self {
            responses,
            every,
            range: most - least,
            coefficients,
            normal: normal.cholesky(),
            gradient,
            recordings: nominal.recordings,
            zeros_open: nominal.own_zeros && !fit.model.sees_angle(),
            longest: nominal.end,
            period: nominal.period,
        }
    }

    /// What the effects in `z` change about the predictions, held against itself and against what the fit leaves; `None` where the data do not
    /// determine the base parameters.
    pub(super) fn score(
        &self,
        problem: &Problem<'_>,
        fit: &Fit,
        h: &Hypothesis,
        z: &[f64],
    ) -> Option<Score> {
        let base = self.normal.as_ref()?;
        let windows = Windows::<4>::new(h, z);
        let (mut square, mut product) = (0.0, 0.0);
        let mut cross = DVector::<f64>::zeros(self.gradient.len());
        for response in &self.responses {
            let w = &problem.windows[response.window];
            let with = windows.predictions(problem.data, w, fit.states[response.window]);
            let (mut own, mut left, mut shared) = (0.0, 0.0, Vector4::zeros());
            let mut towards = SVector::<f64, FOLLOW>::zeros();
            for (k, with) in with.iter().enumerate() {
                for (c, with) in with.iter().enumerate() {
                    let y = (with - response.y[k][c]) * response.weight[k][c];
                    own += y * y;
                    left += y * response.left[k][c];
                    shared += response.slopes[k][c] * y;
                    towards += response.base[k][c] * y;
                }
            }
            let absorbed = response.normal.solve(&shared);
            let gain = own - absorbed.dot(&shared);
            if !gain.is_finite() {
                continue;
            }
            square += gain;
            product += left - absorbed.dot(&response.gradient);
            let own = towards - response.absorbed.tr_mul(&shared);
            for i in 0..FOLLOW {
                cross[follower(response.recording, i)] += own[i];
            }
        }
        let follows = base.solve(&cross);
        Some(Score {
            square: square - follows.dot(&cross),
            product: product - follows.dot(&self.gradient),
        })
    }

    /// The most promising places of the effect, the best first.
    pub(super) fn places(&self, spec: &'static Spec, typical: &[f64]) -> Vec<Place> {
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
        let mut tried: Vec<Place> = grid
            .into_par_iter()
            .filter_map(|values| self.gain(spec, values))
            .collect();
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
                .filter(|order| order * self.range >= PI)
                .collect(),
            _ => p.starts.iter().map(|s| p.off + s * typical).collect(),
        }
    }

    fn apart(&self, spec: &Spec, a: &[f64], b: &[f64]) -> bool {
        spec.parameters
            .iter()
            .zip(a.iter().zip(b))
            .any(|(p, (a, b))| match p.kind {
                Kind::Frequency | Kind::Time => (a - b).abs() > NEAR * self.step(p.kind),
                Kind::Whole | Kind::Run => a != b,
                _ => false,
            })
    }

    /// The effect at this place with the best strength and, where it has one, the best phase or angle of rest.
    fn gain(&self, spec: &'static Spec, mut values: Vec<f64>) -> Option<Place> {
        let turned = spec
            .parameters
            .iter()
            .position(|p| matches!(p.kind, Kind::Phase | Kind::Rest));
        let first = Effect::unchecked(spec.id, &values)?;
        let quarter = match turned {
            Some(i) if spec.parameters[i].kind == Kind::Phase => {
                let mut quarter = values.clone();
                quarter[i] = FRAC_PI_2;
                Some(Effect::unchecked(spec.id, &quarter)?)
            }
            _ => None,
        };
        let second = match (turned, &quarter) {
            (None, _) => Second::None,
            (Some(_), Some(quarter)) => Second::Quarter(quarter),
            (Some(_), None) => Second::Slope,
        };
        // A place in the turn is one for each recording whose encoder has a zero of its own, until an effect has told these zeros.
        let apart = self.zeros_open && spec.acts.includes(Acts::ANGLE);
        let mut sums =
            vec![Sums::zero(self.gradient.len()); if apart { self.recordings } else { 1 }];
        let every = if spec.acts.includes(Acts::JUMPS) {
            1
        } else {
            self.every
        };
        for response in self.responses.iter().step_by(every) {
            let sums = &mut sums[if apart { response.recording } else { 0 }];
            self.add(response, &first, &second, sums, !is_scanned(spec));
        }
        let found = self.solve(&sums, turned.is_some())?;
        let strength = &spec.parameters[0];
        let one_way = strength.min >= strength.off;
        let (mut gain, mut information, mut weighted) = (0.0, 0.0, 0.0);
        let mut offsets = Vec::new();
        for (sums, [part, along, beside]) in sums.iter().zip(&found) {
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
        values[0] = (values[0] * weighted / information).clamp(strength.min, strength.max);
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
                        Second::Quarter(_) => turn(o - offsets[0]) / per_turn,
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
    fn per_turn(&self, spec: &Spec, i: usize, values: &[f64]) -> f64 {
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
            Effect::unchecked(spec.id, &moved)
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

    /// Adds one window's normal equations for the strengths of up to two courses of torque.
    fn add(
        &self,
        response: &Response,
        first: &Effect<f64>,
        second: &Second<'_>,
        sums: &mut Sums,
        with_base: bool,
    ) {
        let jumps = first.spec().acts.includes(Acts::JUMPS);
        let blocks = if jumps {
            &response.steps
        } else {
            &response.blocks
        };
        let (Some(begin), Some(end)) = (blocks.first(), blocks.last()) else {
            return;
        };
        if jumps {
            // Elsewhere it does nothing.
            let Some(edge) = first.jump_after(response.recording, f64::NEG_INFINITY) else {
                return;
            };
            let over = first.jump_after(response.recording, edge).unwrap_or(edge);
            if edge > end.t || over < begin.t {
                return;
            }
        }
        let count = if matches!(second, Second::None) { 1 } else { 2 };
        let mut moved = [Vector4::zeros(); 2];
        let mut cross = [Vector4::zeros(); 2];
        for block in blocks {
            let torques = self.torques(response, block, first, second);
            let mut follows = [Vector4::zeros(); 2];
            for i in 0..count {
                let [arm, pendulum] = torques[i];
                let pushed = block.impulse[0] * arm + block.impulse[1] * pendulum;
                let here = moved[i] + pushed * block.share;
                moved[i] += pushed;
                follows[i] = block.square * here;
                sums.product[i] += block.product.dot(&here);
                cross[i] += follows[i];
                sums.square[(i, i)] += follows[i].dot(&here);
                if i == 1 {
                    sums.square[(0, 1)] += follows[0].dot(&here);
                }
                if with_base {
                    sums.follow(response.recording, i, &block.base.tr_mul(&here), 1.0);
                }
            }
        }
        // The initial state takes its part.
        for i in 0..count {
            let absorbed = response.normal.solve(&cross[i]);
            sums.product[i] -= absorbed.dot(&response.gradient);
            for j in i..count {
                sums.square[(i, j)] -= absorbed.dot(&cross[j]);
            }
            if with_base {
                let absorbed = response.absorbed.tr_mul(&cross[i]);
                sums.follow(response.recording, i, &absorbed, -1.0);
            }
        }
    }

    /// The torques of the effect, and of what turning it adds, over a block.
    fn torques(
        &self,
        response: &Response,
        block: &Block<FOLLOW>,
        first: &Effect<f64>,
        second: &Second<'_>,
    ) -> [[f64; 2]; 2] {
        let torque = |effect: &Effect<f64>, by: f64| {
            let x = State::new(
                block.x.theta + by,
                block.x.alpha,
                block.x.theta_dot,
                block.x.alpha_dot,
            );
            effect.torque(&Instant {
                clock: Clock {
                    run: response.recording,
                    t: block.t,
                    within: block.t,
                },
                x: &x,
                angle: Angle::of(x.alpha),
                coefficients: &self.coefficients,
                memory: 0.0,
                volts: block.volts,
            })
        };
        let beside = match second {
            Second::None => [0.0; 2],
            Second::Quarter(quarter) => torque(quarter, 0.0),
            Second::Slope => {
                let (low, high) = (torque(first, -SLOPE), torque(first, SLOPE));
                std::array::from_fn(|axis| (high[axis] - low[axis]) / (2.0 * SLOPE))
            }
        };
        [torque(first, 0.0), beside]
    }

    /// The best strengths of both courses for each place in the turn, and what they gain; the base parameters follow.
    fn solve(&self, sums: &[Sums], two: bool) -> Option<Vec<[f64; 3]>> {
        let base = self.normal.as_ref()?;
        let width = if two { 2 } else { 1 };
        let n = width * sums.len();
        let mut matrix = DMatrix::zeros(n, n);
        let mut right = DVector::zeros(n);
        for (r, a) in sums.iter().enumerate() {
            for i in 0..width {
                let follows = base.solve(&a.base.column(i).into_owned());
                right[width * r + i] = a.product[i] - follows.dot(&self.gradient);
                for j in 0..width {
                    matrix[(width * r + i, width * r + j)] += a.square[(i.min(j), i.max(j))];
                }
                for (q, b) in sums.iter().enumerate() {
                    for j in 0..width {
                        matrix[(width * r + i, width * q + j)] -= follows.dot(&b.base.column(j));
                    }
                }
            }
        }
        if (0..n).any(|i| matrix[(i, i)] <= 0.0) {
            return None;
        }
        for i in 0..n {
            matrix[(i, i)] *= 1.0 + 1e-9;
        }
        let best = matrix.cholesky()?.solve(&right);
        Some(
            (0..sums.len())
                .map(|r| {
                    let gain: f64 = (0..width)
                        .map(|i| best[width * r + i] * right[width * r + i])
                        .sum();
                    let beside = if two { best[width * r + 1] } else { 0.0 };
                    [gain, best[width * r], beside]
                })
                .collect(),
        )
    }
}

/// What an effect with a place in the turn adds where it is turned.
enum Second<'a> {
    /// It has none.
    None,
    /// A sine: itself a quarter turn further.
    Quarter(&'a Effect<f64>),
    /// Anything else: its slope with the arm's angle.
    Slope,
}

/// Normal equations of two courses of torque, the initial states taken out.
#[derive(Clone)]
struct Sums {
    square: Matrix2<f64>,
    product: Vector2<f64>,
    /// Their products with the slopes of what follows.
    base: DMatrix<f64>,
}

impl Sums {
    fn zero(followers: usize) -> Self {
        Self {
            square: Matrix2::zeros(),
            product: Vector2::zeros(),
            base: DMatrix::zeros(followers, 2),
        }
    }

    fn follow(&mut self, recording: usize, course: usize, by: &SVector<f64, FOLLOW>, sign: f64) {
        for i in 0..FOLLOW {
            self.base[(follower(recording, i), course)] += sign * by[i];
        }
    }
}

/// How many numbers follow: the base parameters, and each recording's zeros.
const fn followers(recordings: usize) -> usize {
    FIRST_EFFECT + recordings * ZEROS
}

/// Where the `i`-th number that follows in a window of a recording stands among all that do.
const fn follower(recording: usize, i: usize) -> usize {
    if i < FIRST_EFFECT {
        i
    } else {
        i + recording * ZEROS
    }
}

/// The angle within half a turn either way.
fn turn(angle: f64) -> f64 {
    angle - TAU * (angle / TAU).round()
}
