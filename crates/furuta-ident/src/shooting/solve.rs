//! Solving for a window's start, a nuisance, the parameters held.

use furuta_model::{Jet, PlantState, State};
use nalgebra::{Cholesky, Matrix4, Vector4};

use super::data::{Data, Window};
use super::linear::Linear;
use super::model::Pass;
use super::passes::NARROW;
use super::predict::some;
use super::slopes::{Along, Slopes};
use super::start::{Rotor, Start, is_worth_a_step};
use super::window::{Windows, cost};
use crate::least_squares::{LeastSquares, Rules, minimise};

/// How an initial state is solved for: Gauss-Newton steps with next to no damping, since four states and hundreds of
/// samples leave little doubt.
const RULES: Rules = Rules {
    iterations: 10,
    damping: 1e-6,
    ease: (0.1, 1e-9),
    stiffen: (100.0, 1e-4),
    most: 1e6,
    abandoned: 0.0,
};
/// Half widths of the polynomials that say where a window may start, samples.
const SMOOTHED: [usize; 3] = [10, 5, 20];
/// A start that costs more than this many times the best end is not followed.
const FAR_OFF: f64 = 4.0;

/// A window is linear between two starts where it costs at one, within this share, what its linear form at the other
/// says. Where bodies stick, slide or meet otherwise from one than from the other, the costs differ by far more.
const LINEAR: f64 = 0.1;

/// The initial state of one window as a problem of its own.
struct Initial<'a> {
    windows: &'a Windows,
    data: &'a Data,
    w: &'a Window,
    s: std::cell::RefCell<Box<PlantState<Jet<f64, NARROW>>>>,
}

/// A start, its cost, and what is known of its gradient there.
struct Tried {
    start: Start,
    cost: f64,
    known: Known,
}

/// What is known of a window's gradient.
enum Known {
    Nothing,
    /// By the slopes of another start.
    Along([f64; 4]),
    Linearised(Quadratic),
}

/// How a window depends on its start, near it.
struct Quadratic {
    cost: f64,
    gradient: [f64; 4],
    matrix: Matrix4<f64>,
    slopes: Slopes,
}

impl Quadratic {
    fn of(linear: Linear) -> Self {
        let gradient = linear.gradient();
        Self {
            cost: linear.cost,
            gradient: std::array::from_fn(|i| gradient[i]),
            matrix: linear.matrix().fixed_view::<4, 4>(0, 0).into_owned(),
            slopes: linear.slopes,
        }
    }
}

impl Initial<'_> {
    fn linearised(&self, start: Start) -> Quadratic {
        let (s, at) = (&mut self.s.borrow_mut(), (self.w, &start));
        let mut linear = Linear::room(self.w, NARROW);
        linear.take(&self.windows.seen, s, self.data, at, Pass::FIRST, None);
        Quadratic::of(linear)
    }

    fn at(&self, start: Start) -> Tried {
        let normal = self.linearised(start);
        Tried {
            start,
            cost: normal.cost,
            known: Known::Linearised(normal),
        }
    }
}

impl LeastSquares<Tried> for Initial<'_> {
    type Linear = Quadratic;
    type Step = Vector4<f64>;

    fn cost(&self, place: &Tried) -> f64 {
        place.cost
    }

    fn linearise(&self, place: &mut Tried) -> Quadratic {
        match std::mem::replace(&mut place.known, Known::Nothing) {
            Known::Linearised(normal) => normal,
            _ => self.linearised(place.start),
        }
    }

    fn again(&self, place: &mut Tried, before: Quadratic) -> Option<Quadratic> {
        let Known::Along(gradient) = place.known else {
            return None;
        };
        Some(Quadratic {
            cost: place.cost,
            gradient,
            ..before
        })
    }

    fn step(&self, _: &Tried, n: &Quadratic, damping: f64) -> Option<(Vector4<f64>, f64)> {
        let mut m = n.matrix;
        for i in 0..4 {
            m[(i, i)] += damping * m[(i, i)] + 1e-9;
        }
        let gradient = Vector4::from(n.gradient);
        let step = Cholesky::new(m)?.solve(&gradient);
        Some((step, step.dot(&gradient)))
    }

    fn trial(&self, place: &Tried, n: &Quadratic, step: &Vector4<f64>, last: bool) -> Tried {
        let start = place.start.less(step);
        let (plain, data, w) = (&self.windows.plain, self.data, self.w);
        let (cost, known) = if last {
            (cost(plain, data, w, &start), Known::Nothing)
        } else {
            let along = Along::new(plain, data, w, &start, &n.slopes);
            let gradient = std::array::from_fn(|i| along.gradient[i]);
            (along.cost, Known::Along(gradient))
        };
        Tried { start, cost, known }
    }

    fn is_worth_a_step(&self, place: &Tried, predicted: f64, _: usize) -> bool {
        is_worth_a_step(predicted, place.cost)
    }

    fn reached(&self, _: &mut Tried, _: f64, _: usize) -> bool {
        true
    }
}

impl Windows {
    /// Improves the start by damped Gauss-Newton steps, at most `iterations`; returns it and what it leaves.
    pub(crate) fn solve(
        &self,
        data: &Data,
        w: &Window,
        start: &Start,
        iterations: usize,
    ) -> (Start, f64) {
        let end = self.solved(data, w, start, iterations);
        (end.start, end.cost)
    }

    fn solved(&self, data: &Data, w: &Window, start: &Start, iterations: usize) -> Solved {
        let initial = Initial {
            windows: self,
            data,
            w,
            s: std::cell::RefCell::new(some(&self.seen.plant)),
        };
        let rules = Rules {
            iterations,
            ..RULES
        };
        let (end, normal) = minimise(&initial, initial.at(*start), &rules);
        Solved {
            start: end.start,
            cost: end.cost,
            normal,
        }
    }

    /// Solves for the start of a window that is not known well: of its first quarter, then of its first half, then of
    /// all of it. Near upright an error at the start is hundreds of times as large at the end of a second, and a step
    /// that is right for the first samples leads the last ones astray.
    fn grown(&self, data: &Data, w: &Window, guess: &Start) -> Solved {
        let mut start = *guess;
        for part in [4, 2] {
            let first = Window {
                len: w.len.div_ceil(part),
                ..*w
            };
            start = self.solved(data, &first, &start, RULES.iterations).start;
        }
        self.solved(data, w, &start, RULES.iterations)
    }

    /// A state near `x` of which the encoders read this: what an effect adds to a reading is taken from the angles.
    pub(super) fn where_read(
        &self,
        data: &Data,
        w: &Window,
        x: &State<f64>,
        read: [f64; 2],
    ) -> State<f64> {
        let there = self.reading(data, w, x);
        State {
            theta: x.theta - (there[0] - read[0]),
            alpha: x.alpha - (there[1] - read[1]),
            ..*x
        }
    }

    /// The best of several starts: what smoothing over several widths says, and the start given.
    pub(crate) fn search(&self, data: &Data, w: &Window, known: Option<&Start>) -> (Start, f64) {
        let rotor = known.map_or(Rotor::Measured, |k| k.rotor);
        let guess = |half| {
            let measured = data.guess(w, half);
            let x = self.where_read(data, w, &measured, [measured.theta, measured.alpha]);
            Start { x, rotor }
        };
        let mut best = known.map(|x| self.solved(data, w, x, RULES.iterations));
        for half in SMOOTHED {
            let guess = guess(half);
            let may_win = |b: &Solved| b.may_be_beaten(&guess, cost(&self.plain, data, w, &guess));
            if best.as_ref().is_none_or(may_win) {
                let found = self.grown(data, w, &guess);
                if best.as_ref().is_none_or(|b| found.cost < b.cost) {
                    best = Some(found);
                }
            }
        }
        match best {
            Some(best) => (best.start, best.cost),
            None => (guess(SMOOTHED[0]), f64::INFINITY),
        }
    }
}

/// A start that was solved for.
struct Solved {
    start: Start,
    cost: f64,
    /// How the window looks there, unless the steps ran out.
    normal: Option<Quadratic>,
}

impl Solved {
    /// Whether solving from another start, which costs `begin`, may end elsewhere: not where the window costs there
    /// what its linear form here says, nor where it costs far too much.
    fn may_be_beaten(&self, start: &Start, begin: f64) -> bool {
        let Some(normal) = &self.normal else {
            return begin < FAR_OFF * self.cost;
        };
        let (there, here) = (start.x.to_array(), self.start.x.to_array());
        let by: [f64; 4] = std::array::from_fn(|i| there[i] - here[i]);
        let mut expected = self.cost;
        for (i, row) in normal.matrix.row_iter().enumerate() {
            expected += 2.0 * normal.gradient[i] * by[i];
            expected += row.iter().zip(by).map(|(m, b)| by[i] * m * b).sum::<f64>();
        }
        begin < FAR_OFF * self.cost && (begin - expected).abs() > LINEAR * expected.abs()
    }
}

#[cfg(test)]
mod tests {
    use furuta_model::{Effect, Plant, Rig};

    use super::*;
    use crate::recording::Recording;
    use crate::shooting::{Late, Observed};

    const H: f64 = 0.002;
    const SAMPLES: usize = 1500;

    /// What the encoders of a rig with one effect see without rounding, cut into windows, and its true states.
    struct Seen {
        data: Data,
        windows: Vec<Window>,
        solver: Windows,
        truth: Vec<State<f64>>,
    }

    fn seen(effect: &str, values: &[f64]) -> Seen {
        let rig = Rig::builtin("qube-servo-2").expect("built in");
        let effect = Effect::new(effect, values).expect("an effect");
        let plant: Plant<f64> = Plant::new(&rig.params, &[effect]).expect("a plant");
        let mut s = plant.rest(State::hanging());
        let (mut samples, mut truth) = (Vec::new(), Vec::new());
        for k in 0..SAMPLES {
            let t = H * k as f64;
            let u = 2.0 * (9.0 * t).sin() + (23.0 * t).cos();
            let x = plant.seen(&s);
            samples.push([t, u, x.theta, x.alpha]);
            truth.push(x);
            plant.step(&mut s, u, H);
        }
        let (recording, _) = Recording::from_samples("swings", samples).expect("a recording");
        let data = Data::new(&[recording], &rig);
        let windows = data.windows(0.25, |_| true);
        let solver = Windows::of(Observed::from_true_zeros(plant, Late::by(0.0)).cast());
        Seen {
            data,
            windows,
            solver,
            truth,
        }
    }

    /// A drive that gives way, and what is no more than a torque.
    const KINDS: [(&str, &[f64]); 2] = [
        ("drive.compliance", &[0.2, 5e-4, 0.4, 0.0]),
        ("arm.quadratic", &[1e-4]),
    ];

    /// From a start that is far off. Steps end where they gain a hundredth of what a sample leaves, here of the noise
    /// that rounding would be: the arm is then known to a hundredth of a count of its encoder, 3e-3 rad.
    #[test]
    fn a_start_is_solved_for() {
        for (effect, values) in KINDS {
            let seen = seen(effect, values);
            for w in &seen.windows {
                let guess = seen.data.guess(w, 10);
                let x = State::new(
                    guess.theta + 0.1,
                    guess.alpha - 0.1,
                    guess.theta_dot + 2.0,
                    guess.alpha_dot - 2.0,
                );
                let rotor = Rotor::Measured;
                let (start, _) = seen.solver.solve(&seen.data, w, &Start { x, rotor }, 10);
                let (off, k) = (start.x.theta - seen.truth[w.start].theta, w.start);
                assert!(off.abs() < 3e-5, "{effect}, sample {k}: off by {off} rad");
            }
        }
    }

    /// What is off in the reading is not off in the angle: to first order, so that a scale that is a twentieth off
    /// leaves a twentieth of what it adds.
    #[test]
    fn a_guess_stands_where_the_encoders_read_it() {
        for (effect, values, left) in [
            ("sensor.alpha.offset", &[0.045][..], 1e-12),
            ("sensor.alpha.scale", &[0.95, 0.0], 0.06),
        ] {
            let seen = seen(effect, values);
            let w = &seen.windows[3];
            let guess = seen.data.guess(w, 10);
            let off = |x: &State<f64>| seen.solver.reading(&seen.data, w, x)[1] - guess.alpha;
            let there = (seen.solver).where_read(&seen.data, w, &guess, [guess.theta, guess.alpha]);
            assert!(off(&guess).abs() > 0.04, "{effect}: {}", off(&guess));
            let most = left * off(&guess).abs();
            assert!(off(&there).abs() <= most, "{effect}: {}", off(&there));
        }
    }

    #[test]
    fn the_gradient_of_a_start_is_the_slope_of_its_cost() {
        for (effect, values) in KINDS {
            let seen = seen(effect, values);
            let w = &seen.windows[3];
            // Smoothed over a tenth of a second, not where the gradient is zero.
            let start = Start {
                x: seen.data.guess(w, 25),
                rotor: Rotor::Measured,
            };
            let (plant, data) = (&seen.solver.seen, &seen.data);
            let mut linear = Linear::room(w, NARROW);
            let s = &mut some(&plant.plant);
            linear.take(plant, s, data, (w, &start), Pass::FIRST, None);
            let n = Quadratic::of(linear);
            for i in 0..4 {
                let moved = |by: f64| {
                    let mut step = Vector4::zeros();
                    step[i] = -by;
                    cost(&seen.solver.plain, data, w, &start.less(&step))
                };
                // Half the slope of a sum of squares, by a central difference that is good to 1e-5 of itself.
                let slope = (moved(1e-5) - moved(-1e-5)) / 4e-5;
                let close = (slope - n.gradient[i]).abs() < 1e-5 * slope.abs().max(1.0);
                assert!(close, "{effect}, {i}: {slope} {}", n.gradient[i]);
            }
        }
    }
}
