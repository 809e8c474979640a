//! Thousands of rollouts: side by side in the lanes of the processor's vectors, and on all its cores.

use super::Policy;
use super::error::{SimulationError, finite_start};
use crate::effects::{Effect, Kind};
use crate::lanes::Lanes;
use crate::params::Params;
use crate::plant::{Plant, PlantError, PlantState};
use crate::scalar::Scalar;
use crate::state::State;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Rollouts side by side: a whole vector of doubles with AVX-512, two with AVX2, four with SSE2. More hide the latency
/// of one step's chain of operations, until the registers run out.
pub(super) const LANES: usize = 8;

/// Batches of fewer steps than this, a millisecond of work, are done by the calling thread: to wake others takes
/// longer.
pub const FEW: usize = 20_000;

/// One rollout of a batch.
#[derive(Clone, Debug, PartialEq)]
pub struct Rollout {
    /// The rig's parameters.
    pub params: Params<f64>,
    /// Its effects.
    pub effects: Vec<Effect<f64>>,
    /// Where it starts.
    pub start: State<f64>,
}

/// How long a batch runs, and what is kept of it.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Run {
    /// Sample period, one step of the integrator, s.
    pub period: f64,
    /// How many samples.
    pub samples: usize,
    /// Which states are kept.
    pub keep: Keep,
}

/// Which states of a rollout are kept.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Keep {
    /// The last alone.
    Last,
    /// The start and every n-th sample after it.
    Every(usize),
}

impl Run {
    /// How many states are kept of each rollout.
    fn rows(&self) -> usize {
        match self.keep {
            Keep::Last => 1,
            Keep::Every(n) => self.samples / n + 1,
        }
    }

    /// Whether the state after `done` samples is kept.
    #[inline(always)]
    fn keeps(&self, done: usize) -> bool {
        match self.keep {
            Keep::Last => done == self.samples,
            Keep::Every(n) => done.is_multiple_of(n),
        }
    }
}

/// What a batch leaves: for each rollout as many states as [`Keep`] says.
#[derive(Clone, Debug, PartialEq)]
pub struct Batch {
    rows: usize,
    states: Vec<State<f64>>,
}

impl Batch {
    /// The kept states of rollout `i`, oldest first. Those of a rollout that left all numbers are not finite from then
    /// on.
    ///
    /// # Panics
    /// If there are fewer rollouts.
    #[must_use]
    pub fn rollout(&self, i: usize) -> &[State<f64>] {
        &self.states[i * self.rows..(i + 1) * self.rows]
    }

    /// All kept states, rollout after rollout.
    #[must_use]
    pub fn states(&self) -> &[State<f64>] {
        &self.states
    }

    /// How many states each rollout has.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }
}

/// Runs every rollout under `policy`; `progress` hears how many rollouts are done.
///
/// Each rollout has the very bits that [`super::trajectory`] gives it, whatever the processor and the number of
/// threads.
///
/// # Errors
/// A rollout whose plant or start is not possible, or a period that is not; before anything is run.
///
/// ```
/// use furuta_model::simulate::{Keep, OpenLoop, Rollout, Run, batch};
/// use furuta_model::{Rig, State};
/// let rig = Rig::builtin("qube-servo-2").expect("built in");
/// let rollouts: Vec<_> = (0..100)
///     .map(|i| {
///         let mut params = rig.params;
///         params.pendulum.mass *= 1.0 + 0.001 * f64::from(i);
///         Rollout { params, effects: vec![], start: State::hanging() }
///     })
///     .collect();
/// let run = Run { period: 0.001, samples: 1000, keep: Keep::Last };
/// let batch = batch(&rollouts, &OpenLoop(&[1.0; 1000]), run, &|_| ())?;
/// assert!(batch.rollout(0)[0].theta > batch.rollout(99)[0].theta); // the heavier, the slower
/// # Ok::<(), furuta_model::simulate::SimulationError>(())
/// ```
pub fn batch(
    rollouts: &[Rollout],
    policy: &impl Policy,
    run: Run,
    progress: &(dyn Fn(usize) + Sync),
) -> Result<Batch, SimulationError> {
    if run.keep == Keep::Every(0) {
        return Err(SimulationError::KeepNothing);
    }
    let mut plants = Vec::with_capacity(rollouts.len());
    for (rollout, r) in rollouts.iter().enumerate() {
        let named = |error| SimulationError::Rollout { rollout, error };
        finite_start(&r.start)?;
        let plant = Plant::new(&r.params, &r.effects).map_err(named)?;
        plant.check_period(run.period).map_err(named)?;
        plants.push(plant);
    }
    let rows = run.rows();
    let mut states = vec![State::default(); rows * rollouts.len()];
    let done = AtomicUsize::new(0);
    let side_by_side = |out: &mut [State<f64>], rollouts: &[Rollout], plants: &[Plant<f64>]| {
        match in_lanes(rollouts) {
            Ok((plant, start)) => Arch::new().dispatch(Side {
                plant: &plant,
                start,
                policy,
                run,
                rows,
                out,
            }),
            Err(_) => {
                for ((r, plant), out) in rollouts.iter().zip(plants).zip(out.chunks_mut(rows)) {
                    alone(plant, plant.rest(r.start), policy, run, out);
                }
            }
        }
        progress(done.fetch_add(rollouts.len(), Ordering::Relaxed) + rollouts.len());
    };
    if run.samples.saturating_mul(rollouts.len()) < FEW {
        let plants = rollouts.chunks(LANES).zip(plants.chunks(LANES));
        let parts = states.chunks_mut(rows * LANES).zip(plants);
        parts.for_each(|(out, (rollouts, plants))| side_by_side(out, rollouts, plants));
    } else {
        let plants = rollouts.par_chunks(LANES).zip(plants.par_chunks(LANES));
        let parts = states.par_chunks_mut(rows * LANES).zip(plants);
        parts.for_each(|(out, (rollouts, plants))| side_by_side(out, rollouts, plants));
    }
    Ok(Batch { rows, states })
}

pub(super) type Several = Lanes<f64, LANES>;

/// Up to [`LANES`] rollouts side by side; where there are fewer, the last fills up.
pub(super) fn in_lanes(
    rollouts: &[Rollout],
) -> Result<(Plant<Several>, PlantState<Several>), PlantError> {
    let lane = |i: usize| &rollouts[i.min(rollouts.len() - 1)];
    let gather = |f: &dyn Fn(&Rollout) -> f64| Lanes(std::array::from_fn(|i| f(lane(i))));
    let actuation = lane(0).params.motor.actuation;
    if rollouts
        .iter()
        .any(|r| r.params.motor.actuation != actuation)
    {
        return Err(PlantError::EventsInLanes);
    }
    let values = std::array::from_fn(|k| gather(&|r| r.params.to_array()[k]));
    let params = Params::from_array(actuation, values);
    let mut effects = Vec::with_capacity(lane(0).effects.len());
    for (place, first) in lane(0).effects.iter().enumerate() {
        let spec = first.spec();
        // A word (which encoder, which term) is a branch, and lanes take the same one.
        let same_words = |r: &Rollout| {
            let values = r.effects[place].values();
            let pairs = first.values().into_iter().zip(values);
            (first.spec().parameters.iter().zip(pairs))
                .all(|(p, (a, b))| !matches!(p.kind, Kind::Choice(_)) || a == b)
        };
        let alike = rollouts.iter().all(|r| {
            r.effects.len() == lane(0).effects.len()
                && r.effects[place].spec().is_same(spec)
                && same_words(r)
        });
        if !alike {
            return Err(PlantError::EventsInLanes);
        }
        let values: Vec<_> = (0..first.values().len())
            .map(|k| gather(&|r| r.effects[place].values()[k]))
            .collect();
        effects.extend(Effect::of(spec, &values));
    }
    if rollouts.iter().any(|r| r.effects.len() != effects.len()) {
        return Err(PlantError::EventsInLanes);
    }
    let plant = Plant::from_coefficients(params.coefficients(), &effects)?;
    let start = State::from(std::array::from_fn(|k| gather(&|r| r.start.to_array()[k])));
    let start = plant.rest(start);
    Ok((plant, start))
}

/// Rollouts in lanes, compiled once for each of the processor's vector widths.
struct Side<'a, P> {
    plant: &'a Plant<Several>,
    start: PlantState<Several>,
    policy: &'a P,
    run: Run,
    rows: usize,
    out: &'a mut [State<f64>],
}

impl<P: Policy> WithSimd for Side<'_, P> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let mut s = self.start;
        let mut row = 0;
        let keep = |row: &mut usize, x: &State<Several>, out: &mut [State<f64>]| {
            for (lane, out) in out.chunks_mut(self.rows).enumerate() {
                out[*row] = x.map(|v| v.0[lane]);
            }
            *row += 1;
        };
        if self.run.keeps(0) {
            keep(&mut row, &s.x, self.out);
        }
        if self.plant.effects().is_empty() {
            let mut x = s.x;
            for k in 0..self.run.samples {
                let u = self.policy.command(k, &x);
                x = self.plant.bare_step(x, u, self.run.period);
                if self.run.keeps(k + 1) {
                    keep(&mut row, &x, self.out);
                }
            }
            return;
        }
        for k in 0..self.run.samples {
            let u = self.policy.command(k, &s.x);
            self.plant.step(&mut s, u, self.run.period);
            if self.run.keeps(k + 1) {
                keep(&mut row, &s.x, self.out);
            }
        }
    }
}

/// One rollout by itself.
fn alone<S: Scalar<Real = f64>>(
    plant: &Plant<S>,
    mut s: PlantState<S>,
    policy: &impl Policy,
    run: Run,
    out: &mut [State<f64>],
) {
    let mut out = out.iter_mut();
    let mut keep = |x: &State<S>| {
        if let Some(out) = out.next() {
            *out = x.map(|v| v.value());
        }
    };
    if run.keeps(0) {
        keep(&s.x);
    }
    for k in 0..run.samples {
        let u = policy.command(k, &s.x);
        plant.step(&mut s, u, run.period);
        if run.keeps(k + 1) {
            keep(&s.x);
        }
    }
}
