//! The normal equations of courses of torque, window by window, and what they gain. What changes the command
//! is a torque of the motor.

use furuta_model::dynamics::Angle;
use furuta_model::effects::{Acts, Clock, Instant, Law};
use furuta_model::{Effect, State};
use nalgebra::{DMatrix, DVector, Matrix2, SVector, Vector2, Vector4};

use super::{FOLLOW, Response, SLOPE, Screen, follower};
use crate::shooting::Block;

impl Screen {
    /// Adds one window's normal equations for the strengths of up to two courses of torque.
    pub(super) fn add(
        &self,
        response: &Response,
        first: &Effect<f64>,
        second: &Second<'_>,
        sums: &mut Sums,
        with_base: bool,
    ) {
        let acts = first.spec().acts;
        let transient = acts.includes(Acts::JUMPS);
        let blocks = if acts.touches(Acts::JUMPS.and(Acts::VOLTAGE)) {
            &response.steps
        } else {
            &response.blocks
        };
        let pulses = match transient.then(|| self.pulses(response, first)) {
            // Elsewhere it does nothing.
            Some(pulses) if pulses.is_empty() => return,
            pulses => pulses,
        };
        let counts = acts.includes(Acts::COUNTS);
        let count = if matches!(second, Second::None) { 1 } else { 2 };
        let mut moved = [Vector4::zeros(); 2];
        let mut cross = [Vector4::zeros(); 2];
        for (k, block) in blocks.iter().enumerate() {
            let torques = match &pulses {
                Some(pulses) => [pulses[k], [0.0; 2]],
                None => self.torques(response, block, first, second),
            };
            if torques[..count] == [[0.0; 2]; 2][..count] && moved == [Vector4::zeros(); 2] {
                continue;
            }
            let mut follows = [Vector4::zeros(); 2];
            for i in 0..count {
                let [arm, pendulum] = torques[i];
                let pushed = block.impulse[0] * arm + block.impulse[1] * pendulum;
                let here = moved[i] + pushed * block.share;
                moved[i] += pushed;
                follows[i] = block.square * here;
                sums.product[i] += block.product.dot(&here);
                if counts && i == 0 {
                    cross[i] += self.misread(response, k, first, &here, sums, with_base);
                }
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
            for (j, cross) in cross.iter().enumerate().take(count).skip(i) {
                sums.square[(i, j)] -= absorbed.dot(cross);
            }
            if with_base {
                let absorbed = response.absorbed.tr_mul(&cross[i]);
                sums.follow(response.recording, i, &absorbed, -1.0);
            }
        }
    }

    /// The torques of a transient, step by step; none where a window knows nothing of it. Between two of its edges a
    /// torque is constant, and what lies before or behind the middle of a step counts in part for its neighbour: the
    /// answer to an impulse is taken as linear from one middle to the next, so that two opposite pulses within a few
    /// steps move what they do.
    fn pulses(&self, response: &Response, effect: &Effect<f64>) -> Vec<[f64; 2]> {
        let steps = &response.steps;
        let next = |t: f64| effect.jump_after(response.recording, t);
        let edges: Vec<f64> =
            std::iter::successors(next(f64::NEG_INFINITY), |edge| next(*edge)).collect();
        let (Some(begin), Some(end)) = (steps.first(), steps.last()) else {
            return Vec::new();
        };
        let (Some(from), Some(to)) = (edges.first(), edges.last()) else {
            return Vec::new();
        };
        if *from > end.t + 0.5 * end.length || *to < begin.t - 0.5 * begin.length {
            return Vec::new();
        }
        let mut pulses = vec![[0.0; 2]; steps.len()];
        for edge in edges.windows(2) {
            let middle = 0.5 * (edge[0] + edge[1]);
            for (k, step) in steps.iter().enumerate() {
                let half = 0.5 * step.length;
                let (a, b) = (edge[0].max(step.t - half), edge[1].min(step.t + half));
                if a >= b {
                    continue;
                }
                let torque = self.torques_at(response, step, middle, effect);
                let off = 0.5 * (a + b) - step.t;
                let other = if off < 0.0 {
                    k.checked_sub(1)
                } else {
                    Some(k + 1)
                };
                let other = other.filter(|j| *j < steps.len());
                let passed = other.map_or(0.0, |j| off / (steps[j].t - step.t));
                for axis in 0..2 {
                    let impulse = torque[axis] * (b - a);
                    pulses[k][axis] += (1.0 - passed) * impulse / step.length;
                    if let Some(j) = other {
                        pulses[j][axis] += passed * impulse / steps[j].length;
                    }
                }
            }
        }
        pulses
    }

    /// Adds what a step's readings are beside the true angles, which the effect has moved as a change of the initial
    /// state by `here` does; returns its product with the slopes of the initial state.
    fn misread(
        &self,
        response: &Response,
        k: usize,
        effect: &Effect<f64>,
        here: &Vector4<f64>,
        sums: &mut Sums,
        with_base: bool,
    ) -> Vector4<f64> {
        let lost = effect.lost(response.recording, response.read[k]);
        let mut cross = Vector4::zeros();
        for (c, lost) in lost.iter().enumerate() {
            let y = lost * response.weight[k][c];
            sums.product[0] += y * response.left[k][c];
            sums.square[(0, 0)] += y * (y + 2.0 * response.slopes[k][c].dot(here));
            cross += response.slopes[k][c] * y;
            if with_base {
                sums.follow(response.recording, 0, &(response.base[k][c] * y), 1.0);
            }
        }
        cross
    }

    /// The torques of the effect, and of what turning it adds, over a block.
    pub(super) fn torques(
        &self,
        response: &Response,
        block: &Block<FOLLOW>,
        first: &Effect<f64>,
        second: &Second<'_>,
    ) -> [[f64; 2]; 2] {
        let torque = |effect: &Effect<f64>, by: f64| {
            let mut x = block.x;
            x.theta += by;
            self.torque(response, block, (block.t, &x), effect)
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

    /// The torque of an effect over a block, as if the time were `t`.
    pub(super) fn torques_at(
        &self,
        response: &Response,
        block: &Block<FOLLOW>,
        t: f64,
        effect: &Effect<f64>,
    ) -> [f64; 2] {
        self.torque(response, block, (t, &block.x), effect)
    }

    #[inline(always)]
    fn torque(
        &self,
        response: &Response,
        block: &Block<FOLLOW>,
        (t, x): (f64, &State<f64>),
        effect: &Effect<f64>,
    ) -> [f64; 2] {
        let [arm, pendulum] = effect.torque(&Instant {
            clock: Clock {
                run: response.recording,
                t,
                within: t,
            },
            x,
            angle: Angle::of(x.alpha),
            coefficients: &self.coefficients,
            memory: 0.0,
            volts: block.volts,
        });
        if effect.spec().acts.includes(Acts::VOLTAGE) {
            let more = effect.voltage(t, block.volts) - block.volts;
            return [arm + self.coefficients.drive * more, pendulum];
        }
        [arm, pendulum]
    }

    /// The best strengths of both courses for each place in the turn, and what they gain; the base parameters follow.
    /// All are 0 in a recording in which they do nothing, such as a ripple of a motor that is off.
    pub(super) fn solve(&self, sums: &[Sums], two: bool) -> Option<Vec<[f64; 3]>> {
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
        for (r, sums) in sums.iter().enumerate() {
            for i in width * r..width * (r + 1) {
                if sums.is_idle() {
                    matrix.row_mut(i).fill(0.0);
                    matrix.column_mut(i).fill(0.0);
                    matrix[(i, i)] = 1.0;
                    right[i] = 0.0;
                } else if matrix[(i, i)] <= 0.0 {
                    return None;
                }
                matrix[(i, i)] *= 1.0 + 1e-9;
            }
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
pub(super) enum Second<'a> {
    /// It has none.
    None,
    /// A sine: itself a quarter turn further.
    Quarter(&'a Effect<f64>),
    /// Anything else: its slope with the arm's angle.
    Slope,
}

/// Normal equations of two courses of torque, the initial states taken out.
#[derive(Clone)]
pub(super) struct Sums {
    pub(super) square: Matrix2<f64>,
    pub(super) product: Vector2<f64>,
    /// Their products with the slopes of what follows.
    base: DMatrix<f64>,
}

impl Sums {
    pub(super) fn zero(followers: usize) -> Self {
        Self {
            square: Matrix2::zeros(),
            product: Vector2::zeros(),
            base: DMatrix::zeros(followers, 2),
        }
    }

    /// Whether the first course does nothing here.
    pub(super) fn is_idle(&self) -> bool {
        self.square[(0, 0)] == 0.0
    }

    pub(super) fn follow(
        &mut self,
        recording: usize,
        course: usize,
        by: &SVector<f64, FOLLOW>,
        sign: f64,
    ) {
        for i in 0..FOLLOW {
            self.base[(follower(recording, i), course)] += sign * by[i];
        }
    }
}
