//! Regions of attraction: from where a controller brings the pendulum back to upright.

use crate::closed_loop::{ClosedLoop, FALLEN, Model, Sensing};
use crate::rig_loop::LoopError;
use furuta_ctrl::Site;
use furuta_ctrl::controllers::Controller;
use furuta_ctrl::design::poles;
use furuta_model::linear_plant::{Hold, rigid};
use furuta_model::{Linear, Rig, State};
use nalgebra::SMatrix;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Starts: the arm at its reference and at rest, the pendulum's angle and speed on a grid symmetric about upright at
/// rest.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Grid {
    /// Largest angle from upright, rad; at most a quarter of a turn counts as standing.
    pub alpha: f64,
    /// Largest speed, of the pendulum's small-angle frequency.
    pub speed: f64,
    /// Points along each axis, at least 2.
    pub points: usize,
}

impl Grid {
    /// How many starts it has.
    #[must_use]
    pub fn starts(&self) -> usize {
        self.points.max(2).pow(2)
    }

    /// Angles (rad) and speeds (rad/s), ascending, for a pendulum of this small-angle frequency, rad/s.
    fn axes(&self, frequency: f64) -> [Vec<f64>; 2] {
        [self.alpha, self.speed * frequency].map(|largest| axis(largest, self.points))
    }
}

impl Default for Grid {
    fn default() -> Self {
        Self {
            alpha: 1.2,
            speed: 2.0,
            points: 61,
        }
    }
}

/// A run settles if the pendulum is nearer to upright than this, rad, ...
pub const SETTLED: f64 = 0.05;
/// ... during this last share of it; its whole length is [`LENGTH`].
const LAST: f64 = 0.1;
/// Of a run, over the pendulum's small-angle frequency (rad/s).
pub const LENGTH: f64 = 40.0;
/// Longest step of the integrator, s.
const LONGEST_STEP: f64 = 2e-3;

/// What a controller acts on.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum On {
    /// The model with the effects of the rig file.
    Rig,
    /// The upright linearisation: what can be said for sure of it is [`Reach`].
    Linear,
}

/// Which starts of a grid a controller brings upright.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// Angles, rad, ascending.
    pub alpha: Vec<f64>,
    /// Speeds, rad/s, ascending.
    pub alpha_dot: Vec<f64>,
    /// Start `(alpha[i], alpha_dot[j])` is `inside[j * alpha.len() + i]`.
    pub inside: Vec<bool>,
}

impl Region {
    /// Runs `controller` (perfect states, no delay; the voltage limited as on the rig) from every start. A start is
    /// inside if the pendulum settles without having lain down and without the arm leaving `arm_range` (rad).
    ///
    /// `progress` hears how many starts are done. Every run is alone: the same whatever the number of threads.
    ///
    /// # Errors
    /// A rig that cannot be, or not be stepped with this period.
    ///
    /// ```
    /// use furuta_ctrl::{controllers::StateFeedback, design::balance};
    /// use furuta_design::region::{Grid, On, Region};
    /// let rig = furuta_model::Rig::builtin("shahzad2022-srv02").ok_or("no such rig")?;
    /// let lqr = StateFeedback::new(&balance(&rig.params, 0.002)?, 10.0);
    /// let grid = Grid { points: 5, ..Grid::default() };
    /// let region = Region::of(&rig, On::Rig, &lqr, &grid, 0.002, 6.3, &|_| ())?;
    /// assert!(region.inside[12] && !region.inside[24]); // upright at rest; leaning over and falling
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn of<C: Controller<f64> + Sync>(
        rig: &Rig,
        on: On,
        controller: &C,
        grid: &Grid,
        period: f64,
        arm_range: f64,
        progress: &(dyn Fn(usize) + Sync),
    ) -> Result<Self, LoopError> {
        let starts = 0..grid.starts();
        let inside = Self::part(
            rig, on, controller, grid, period, arm_range, starts, progress,
        )?;
        Ok(Self::from_inside(rig, grid, period, inside))
    }

    /// A region whose starts were tried elsewhere, in parts.
    #[must_use]
    pub fn from_inside(rig: &Rig, grid: &Grid, period: f64, inside: Vec<bool>) -> Self {
        let [alpha, alpha_dot] = grid.axes(Site::of(rig, period).frequency());
        Self {
            alpha,
            alpha_dot,
            inside,
        }
    }

    /// Whether these starts alone (by their places in [`Region::inside`]) are inside: what [`Region::of`] says of them,
    /// so that several machines can share a grid.
    ///
    /// # Errors
    /// As [`Region::of`].
    #[allow(clippy::too_many_arguments)] // those of `of`, and which starts
    pub fn part<C: Controller<f64> + Sync>(
        rig: &Rig,
        on: On,
        controller: &C,
        grid: &Grid,
        period: f64,
        arm_range: f64,
        starts: Range<usize>,
        progress: &(dyn Fn(usize) + Sync),
    ) -> Result<Vec<bool>, LoopError> {
        let plant = rig.try_plant::<f64>()?;
        plant.check_period(period)?;
        let frequency = Site::of(rig, period).frequency();
        let model = match on {
            On::Rig => Model::from(plant),
            On::Linear => Model::Linear(rigid(&rig.try_plant()?, Hold::Arm(0.0))?),
        };
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // some tens
        let substeps = (period / LONGEST_STEP).ceil() as usize;
        let experiment = ClosedLoop {
            plants: vec![(0.0, model)],
            start: State::upright(),
            period,
            substeps,
            duration: LENGTH / frequency,
            sensing: Sensing::Perfect,
        };
        let [alpha, alpha_dot] = grid.axes(frequency);
        let n = alpha.len();
        let done = AtomicUsize::new(0);
        Ok(starts
            .into_par_iter()
            .map(|k| {
                let start = State::new(0.0, alpha[k % n], 0.0, alpha_dot[k / n]);
                let inside = settles(&experiment, controller, start, arm_range);
                progress(done.fetch_add(1, Ordering::Relaxed) + 1);
                inside
            })
            .collect())
    }

    /// The share of the starts that are inside.
    #[must_use]
    pub fn share(&self) -> f64 {
        let inside = self.inside.iter().filter(|inside| **inside).count();
        inside as f64 / self.inside.len().max(1) as f64
    }
}

/// Points that are each other's negatives, to the bit.
fn axis(largest: f64, points: usize) -> Vec<f64> {
    let last = points.max(2) - 1;
    (0..=last)
        .map(|i| largest * (2.0 * i as f64 - last as f64) / last as f64)
        .collect()
}

fn settles<C: Controller<f64>>(
    experiment: &ClosedLoop,
    controller: &C,
    start: State<f64>,
    arm_range: f64,
) -> bool {
    let experiment = ClosedLoop {
        start,
        ..experiment.clone()
    };
    let samples = experiment.run(controller, |_| State::upright());
    let settled_from = (1.0 - LAST) * experiment.duration;
    // Written so that a NaN is outside.
    let fine = samples.iter().all(|s| {
        let allowed = if s.t < settled_from { FALLEN } else { SETTLED };
        s.x.theta.abs() <= arm_range && s.x.alpha.abs() <= allowed
    });
    fine && samples.last().is_some_and(|s| s.t >= settled_from)
}

/// What no controller can leave: the states from which a limited voltage can bring the upright linearisation back at
/// all.
///
/// With `w' A = lambda w'`, `lambda > 0`, the state's unstable part `z = w' x` obeys `z' = lambda z + w' B u`, so that
/// it grows for ever from beyond `|w' B| u_max / lambda`, whatever the voltage (W. Schmitendorf, B. Barmish, *Null
/// controllability of linear systems with constrained controls*, 1980).
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Reach {
    /// `w`, in the order of [`State`].
    pub normal: [f64; 4],
    /// Largest `|w' x|`.
    pub offset: f64,
}

impl Reach {
    /// Of a rig's upright linearisation with the effects that have a slope there, under its command limit. `None` where
    /// it is not unstable.
    ///
    /// # Errors
    /// A rig that cannot be.
    ///
    /// ```
    /// use furuta_design::region::Reach;
    /// use furuta_model::{Rig, State};
    /// let rig = Rig::builtin("qube-servo-2").ok_or("no such rig")?;
    /// let reach = Reach::of(&rig)?.ok_or("not unstable")?;
    /// assert!(reach.holds(&State::upright()));
    /// assert!(!reach.holds(&State::new(0.0, 1.5, 0.0, 20.0)));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn of(rig: &Rig) -> Result<Option<Self>, LoopError> {
        let Linear { a, b } = rigid(&rig.try_plant()?, Hold::Arm(0.0))?;
        let Some(poles) = poles(&a) else {
            return Ok(None);
        };
        let unstable = poles
            .iter()
            .map(|pole| pole.re)
            .fold(f64::NEG_INFINITY, f64::max);
        // The arm's own pole is at zero, to rounding.
        if !(unstable > 1e-6) {
            return Ok(None);
        }
        let shifted = a.transpose() - SMatrix::<f64, 4, 4>::identity() * unstable;
        let Some(v) = shifted.svd(false, true).v_t else {
            return Ok(None);
        };
        // The right singular vector of the least singular value, which is zero.
        let w = v.row(3);
        Ok(Some(Self {
            normal: std::array::from_fn(|i| w[i]),
            offset: (w * b)[0].abs() * rig.params.motor.command_limit / unstable,
        }))
    }

    /// Whether some voltage brings the linearisation back from `x`.
    #[must_use]
    pub fn holds(&self, x: &State<f64>) -> bool {
        let z: f64 = x
            .to_array()
            .iter()
            .zip(&self.normal)
            .map(|(x, w)| x * w)
            .sum();
        z.abs() <= self.offset
    }

    /// The speed (rad/s) up to which it holds at the angle `alpha` (rad), the arm at its reference and at rest; `sign`
    /// chooses the upper (1) or the lower (-1) edge.
    #[must_use]
    pub fn edge(&self, alpha: f64, sign: f64) -> f64 {
        let [_, w_alpha, _, w_speed] = self.normal;
        (sign * self.offset * w_speed.signum() - w_alpha * alpha) / w_speed
    }
}
