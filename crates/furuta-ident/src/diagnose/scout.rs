//! Where to start the fit of an effect that has many possible places: an order, a frequency, a moment.
//!
//! The answer to any course of torque comes from sensitivities computed once (`echo`), and thousands of orders, frequencies or moments can be tried
//! without simulating. What the free initial states would absorb is projected out; what is left says how much the cost would fall, and at which
//! strength and phase.

use furuta_model::dynamics::Angle;
use furuta_model::effects::{Acts, Clock, Instant, Kind, Law, ParameterSpec};
use furuta_model::params::Coefficients;
use furuta_model::{Effect, Spec};
use nalgebra::{Cholesky, Const, SMatrix, Vector4};
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI};

use super::echo::{Base, Block, Echo, echoes};
use super::fit::{Fit, Problem};
use super::hypothesis::{FIRST_EFFECT, Hypothesis};
use super::shooting::Inner;

/// So many places are handed to the fit.
const PLACES: usize = 2;
/// Frequencies up to here are looked at, Hz.
const HIGHEST: f64 = 25.0;
/// Moments are looked at so far apart, s.
const MOMENTS: f64 = 0.008;
/// Far from the noise (this many times its size), every so-many-th window says where to look, as long as so many are listened to.
const FAR: f64 = 3.0;
const EVERY: usize = 3;
const LISTENED: usize = 24;
/// Two places nearer than so many grid steps are one.
const NEAR: f64 = 6.0;

/// A score test with one simulation, in units of the noise; what initial states and base parameters can follow taken out.
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
    pub(super) fn promise(&self, one_way: bool) -> f64 {
        if self.square <= 0.0 || (one_way && self.product <= 0.0) {
            0.0
        } else {
            self.product * self.product / self.square
        }
    }
}

/// What a fit says about any small torque.
pub(super) struct Scout {
    echoes: Vec<Echo>,
    /// For a place, every so-many-th of the echoes is listened to, but for one in time.
    every: usize,
    coefficients: Coefficients<f64>,
    /// Normal equations of the base parameters, the initial states taken out.
    normal: Option<Cholesky<f64, Const<FIRST_EFFECT>>>,
    gradient: Base,
    recordings: usize,
    longest: f64,
    period: f64,
    /// How far the arm turned, rad.
    range: f64,
}

/// Whether a scout is needed to find a start.
pub(super) fn wanted(spec: &Spec) -> bool {
    spec.acts.includes(Acts::TORQUE)
        && !spec.acts.includes(Acts::MEMORY)
        && spec
            .parameters
            .iter()
            .any(|p| p.kind != Kind::Real && !matches!(p.kind, Kind::Choice(_)))
}

impl Scout {
    /// Computes the sensitivities about `fit`.
    pub(super) fn new(problem: &Problem<'_>, fit: &Fit) -> Self {
        let data = problem.data;
        let (coefficients, echoes) = echoes(problem, fit);
        let mut normal = SMatrix::<f64, FIRST_EFFECT, FIRST_EFFECT>::zeros();
        let mut gradient = Base::zeros();
        let every = if problem.chi(fit) > FAR {
            (echoes.len() / LISTENED).clamp(1, EVERY)
        } else {
            1
        };
        for echo in &echoes {
            normal += echo.base_normal;
            gradient += echo.base_gradient;
        }
        for i in 0..FIRST_EFFECT {
            normal[(i, i)] += 1e-9 + 1e-9 * normal[(i, i)];
        }
        let angles = data.runs.iter().flat_map(|r| &r.y).map(|y| y[0]);
        let (least, most) = angles.fold((f64::MAX, f64::MIN), |(a, b), y| (a.min(y), b.max(y)));
        Self {
            echoes,
            every,
            range: most - least,
            coefficients,
            normal: normal.cholesky(),
            gradient,
            recordings: 1 + data.runs.iter().map(|r| r.recording).max().unwrap_or(0),
            longest: problem.nominal.end,
            period: data.runs[0].h,
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
        let inner = Inner::<4>::new(h, z, problem.nominal);
        let (mut square, mut product, mut cross) = (0.0, 0.0, Base::zeros());
        for echo in &self.echoes {
            let w = &problem.windows[echo.window];
            let with = inner.predictions(problem.data, w, fit.states[echo.window]);
            let (mut own, mut left, mut shared) = (0.0, 0.0, Vector4::zeros());
            let mut towards = Base::zeros();
            for (k, with) in with.iter().enumerate() {
                for (c, with) in with.iter().enumerate() {
                    let y = (with - echo.y[k][c]) * echo.weight[k][c];
                    own += y * y;
                    left += y * echo.left[k][c];
                    shared += echo.slopes[k][c] * y;
                    towards += echo.base[k][c] * y;
                }
            }
            let absorbed = echo.normal.solve(&shared);
            let gain = own - absorbed.dot(&shared);
            if !gain.is_finite() {
                continue;
            }
            square += gain;
            product += left - absorbed.dot(&echo.gradient);
            cross += towards - echo.absorbed.tr_mul(&shared);
        }
        let follows = base.solve(&cross);
        Some(Score {
            square: square - follows.dot(&cross),
            product: product - follows.dot(&self.gradient),
        })
    }

    /// The most promising values of the effect's parameters.
    pub(super) fn starts(&self, spec: &'static Spec, typical: &[f64]) -> Vec<Vec<f64>> {
        let mut places: Vec<Vec<f64>> = vec![Vec::new()];
        for (p, typical) in spec.parameters.iter().zip(typical) {
            let values = self.grid(p, *typical);
            places = places
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
        let mut tried: Vec<(f64, Vec<f64>)> = places
            .into_par_iter()
            .filter_map(|place| self.gain(spec, place))
            .collect();
        // A stable sort: the same starts whatever the number of threads.
        tried.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut best: Vec<Vec<f64>> = Vec::new();
        for (_, place) in tried {
            if best.iter().all(|b| self.apart(spec, b, &place)) {
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
            Kind::Phase => vec![0.0],
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

    /// By how much the cost would fall with the effect at this place, and the place with the best strength and phase.
    fn gain(&self, spec: &'static Spec, mut place: Vec<f64>) -> Option<(f64, Vec<f64>)> {
        let phase = spec.parameters.iter().position(|p| p.kind == Kind::Phase);
        let first = Effect::unchecked(spec.id, &place)?;
        let second = match phase {
            Some(i) => {
                let mut quarter = place.clone();
                quarter[i] = FRAC_PI_2;
                Some(Effect::unchecked(spec.id, &quarter)?)
            }
            None => None,
        };
        let (mut square, mut product) = ([[0.0; 2]; 2], [0.0; 2]);
        let every = if spec.acts.includes(Acts::JUMPS) {
            1
        } else {
            self.every
        };
        for echo in self.echoes.iter().step_by(every) {
            self.hear(echo, &first, second.as_ref(), &mut square, &mut product);
        }
        let strength = &spec.parameters[0];
        if let Some(i) = phase {
            let det = square[0][0] * square[1][1] - square[0][1] * square[0][1];
            if det <= 1e-9 * square[0][0] * square[1][1] {
                return None;
            }
            let a = (square[1][1] * product[0] - square[0][1] * product[1]) / det;
            let b = (square[0][0] * product[1] - square[0][1] * product[0]) / det;
            place[i] = b.atan2(a);
            place[0] = (place[0] * a.hypot(b)).clamp(strength.min, strength.max);
            return Some((a * product[0] + b * product[1], place));
        }
        if square[0][0] <= 0.0 {
            return None;
        }
        let a = product[0] / square[0][0];
        if a < 0.0 && strength.min >= 0.0 {
            return None;
        }
        place[0] = (place[0] * a).clamp(strength.min, strength.max);
        Some((a * product[0], place))
    }

    /// Adds one window's normal equations for the strengths of up to two courses of torque.
    fn hear(
        &self,
        echo: &Echo,
        first: &Effect<f64>,
        second: Option<&Effect<f64>>,
        square: &mut [[f64; 2]; 2],
        product: &mut [f64; 2],
    ) {
        let jumps = first.spec().acts.includes(Acts::JUMPS);
        let blocks = if jumps { &echo.steps } else { &echo.blocks };
        let (Some(begin), Some(end)) = (blocks.first(), blocks.last()) else {
            return;
        };
        if jumps {
            // Elsewhere it does nothing.
            let Some(edge) = first.jump_after(echo.recording, f64::NEG_INFINITY) else {
                return;
            };
            let over = first.jump_after(echo.recording, edge).unwrap_or(edge);
            if edge > end.t || over < begin.t {
                return;
            }
        }
        let mut moved = [Vector4::zeros(); 2];
        let mut cross = [Vector4::zeros(); 2];
        let (mut own, mut with) = ([[0.0; 2]; 2], [0.0; 2]);
        let count = if second.is_some() { 2 } else { 1 };
        for block in blocks {
            let at = self.instant(echo, block);
            let mut follows = [Vector4::zeros(); 2];
            for (i, effect) in [Some(first), second].into_iter().flatten().enumerate() {
                let torque = effect.torque(&at);
                let pushed = block.impulse[0] * torque[0] + block.impulse[1] * torque[1];
                let here = moved[i] + pushed * block.share;
                moved[i] += pushed;
                follows[i] = block.square * here;
                with[i] += block.product.dot(&here);
                cross[i] += follows[i];
                own[i][i] += follows[i].dot(&here);
                if i == 1 {
                    own[0][1] += follows[0].dot(&here);
                }
            }
        }
        // The initial state takes its part.
        for i in 0..count {
            let absorbed = echo.normal.solve(&cross[i]);
            product[i] += with[i] - absorbed.dot(&echo.gradient);
            for j in i..count {
                square[i][j] += own[i][j] - absorbed.dot(&cross[j]);
            }
        }
    }

    fn instant<'a>(&'a self, echo: &Echo, block: &'a Block) -> Instant<'a, f64> {
        Instant {
            clock: Clock {
                run: echo.recording,
                t: block.t,
                within: block.t,
            },
            x: &block.x,
            angle: Angle::of(block.x.alpha),
            coefficients: &self.coefficients,
            memory: 0.0,
            volts: block.volts,
        }
    }
}
