//! Many rigs that are stepped together, a call at a time.

use super::batch::{FEW, LANES, Rollout, Several, in_lanes};
use super::error::{SimulationError, finite_start};
use crate::lanes::Lanes;
use crate::plant::{Plant, PlantState};
use crate::state::State;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

/// Many rigs that are stepped together, each under its own command, and remember from call to call what their effects
/// remember (a lagging voltage, late commands, bristles, backlash) and the time.
///
/// Rigs whose steps have no events within stand side by side in the lanes of the processor's vectors, the others are
/// stepped one by one. Each has the very bits that [`super::follow`] gives it, whatever the processor and the number of
/// threads. The states of a rig that leaves all numbers are not finite from then on.
///
/// ```
/// use furuta_model::simulate::{Rollout, Stepper};
/// use furuta_model::{Rig, State};
/// let rig = Rig::builtin("qube-servo-2").expect("built in");
/// let hanging = Rollout { params: rig.params, effects: vec![], start: State::hanging() };
/// let mut rigs = Stepper::new(vec![hanging.clone(); 3], 0.002)?;
/// rigs.step(&[-1.0, 0.0, 1.0], 50)?;
/// let theta: Vec<f64> = rigs.states().map(|x| x.theta).collect();
/// // Hanging down is alpha = pi, as near as a number can be to it.
/// assert!(theta[0] < -0.01 && theta[1].abs() < 1e-12 && theta[2] > 0.01);
/// rigs.replace(2, hanging)?;
/// assert_eq!(rigs.states().nth(2), Some(State::hanging()));
/// # Ok::<(), furuta_model::simulate::SimulationError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Stepper {
    /// What each rig is, and where it began.
    rollouts: Vec<Rollout>,
    groups: Vec<Group>,
    period: f64,
}

/// Up to [`LANES`] rigs.
#[derive(Clone, Debug)]
enum Group {
    /// In the lanes of vectors.
    SideBySide(Box<(Plant<Several>, PlantState<Several>)>),
    /// Rigs with events within a step, or with other effects than their neighbours.
    Apart(Vec<Alone>),
}

type Alone = (Plant<f64>, PlantState<f64>);

impl Stepper {
    /// Rigs as after a long rest where they start; `period` is one step of the integrator, s.
    ///
    /// # Errors
    /// A rollout whose plant or start is not possible, or a period that is not.
    pub fn new(rollouts: Vec<Rollout>, period: f64) -> Result<Self, SimulationError> {
        let plants = (rollouts.iter().enumerate())
            .map(|(i, rollout)| alone(i, rollout, period))
            .collect::<Result<Vec<Alone>, _>>()?;
        let parts = rollouts.chunks(LANES).zip(plants.chunks(LANES));
        let groups = parts.map(|(rollouts, plants)| match in_lanes(rollouts) {
            Ok(several) => Group::SideBySide(Box::new(several)),
            Err(_) => Group::Apart(plants.to_vec()),
        });
        Ok(Self {
            groups: groups.collect(),
            rollouts,
            period,
        })
    }

    /// Moves every rig on by `samples` periods under its command (V), held meanwhile.
    ///
    /// # Errors
    /// Other than one command a rig, or one that is not finite; nothing has moved then.
    pub fn step(&mut self, commands: &[f64], samples: usize) -> Result<(), SimulationError> {
        let (given, rollouts) = (commands.len(), self.rollouts.len());
        if given != rollouts {
            return Err(SimulationError::Commands { given, rollouts });
        }
        if let Some(rollout) = commands.iter().position(|u| !u.is_finite()) {
            let value = commands[rollout];
            return Err(SimulationError::RolloutCommand { rollout, value });
        }
        let period = self.period;
        let hold = |(group, u): (&mut Group, &[f64])| group.hold(u, samples, period);
        if samples.saturating_mul(rollouts) < FEW {
            let groups = self.groups.iter_mut().zip(commands.chunks(LANES));
            groups.for_each(hold);
        } else {
            let groups = self.groups.par_iter_mut();
            groups.zip(commands.par_chunks(LANES)).for_each(hold);
        }
        Ok(())
    }

    /// The true state of each rig.
    pub fn states(&self) -> impl Iterator<Item = State<f64>> + '_ {
        self.each(|group| group.states())
    }

    /// What the sensors of each rig say, theta and alpha in rad: effects of the sensors included, not rounded.
    pub fn angles(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        self.each(|group| group.angles())
    }

    fn each<'a, T: 'a>(
        &'a self,
        of: impl Fn(&Group) -> Vec<T> + 'a,
    ) -> impl Iterator<Item = T> + 'a {
        let sizes = self.rollouts.chunks(LANES).map(<[_]>::len);
        let groups = self.groups.iter().zip(sizes);
        groups.flat_map(move |(group, size)| of(group).into_iter().take(size))
    }

    /// Puts another rig in the place of rig `i`, as after a long rest where it starts. The others go on as they were.
    ///
    /// # Errors
    /// A plant or a start that is not possible; nothing has changed then.
    ///
    /// # Panics
    /// If there is no rig `i`.
    pub fn replace(&mut self, i: usize, rollout: Rollout) -> Result<(), SimulationError> {
        let new = alone(i, &rollout, self.period)?;
        self.rollouts[i] = rollout;
        let (group, lane) = (i / LANES, i % LANES);
        let first = group * LANES;
        let rollouts = &self.rollouts[first..self.rollouts.len().min(first + LANES)];
        let here = &mut self.groups[group];
        let before = match here {
            Group::Apart(rigs) => {
                rigs[lane] = new;
                return Ok(());
            }
            Group::SideBySide(several) => &several.1,
        };
        *here = if let Ok((plant, mut state)) = in_lanes(rollouts) {
            for other in (0..LANES).filter(|other| *other != lane) {
                Memory::of(before, other).put(&mut state, other);
            }
            Group::SideBySide(Box::new((plant, state)))
        } else {
            let mut rigs = Vec::with_capacity(rollouts.len());
            for (other, rollout) in rollouts.iter().enumerate() {
                let mut rig = alone(first + other, rollout, self.period)?;
                if other != lane {
                    Memory::of(before, other).resume(&mut rig);
                }
                rigs.push(rig);
            }
            Group::Apart(rigs)
        };
        Ok(())
    }
}

/// A rig by itself, at rest where it starts.
fn alone(rollout: usize, r: &Rollout, period: f64) -> Result<Alone, SimulationError> {
    let named = |error| SimulationError::Rollout { rollout, error };
    finite_start(&r.start)?;
    let plant = Plant::new(&r.params, &r.effects).map_err(named)?;
    plant.check_period(period).map_err(named)?;
    let state = plant.rest(r.start);
    Ok((plant, state))
}

/// All that a rig in lanes remembers: others have events within their steps.
struct Memory {
    x: State<f64>,
    t: f64,
    voltage: f64,
}

impl Memory {
    fn of(state: &PlantState<Several>, lane: usize) -> Self {
        Self {
            x: state.x.map(|v| v.0[lane]),
            t: state.t.0[lane],
            voltage: state.voltage.0[lane],
        }
    }

    fn put(&self, state: &mut PlantState<Several>, lane: usize) {
        let mut x = state.x.to_array();
        for (x, own) in x.iter_mut().zip(self.x.to_array()) {
            x.0[lane] = own;
        }
        state.x = State::from(x);
        state.t.0[lane] = self.t;
        state.voltage.0[lane] = self.voltage;
    }

    fn resume(&self, (plant, state): &mut Alone) {
        *state = plant.rest(self.x);
        (state.t, state.voltage) = (self.t, self.voltage);
    }
}

impl Group {
    fn hold(&mut self, commands: &[f64], samples: usize, period: f64) {
        match self {
            Self::SideBySide(several) => {
                let last = commands.len() - 1;
                let (plant, state) = &mut **several;
                Arch::new().dispatch(Held {
                    plant,
                    state,
                    u: Lanes(std::array::from_fn(|lane| commands[lane.min(last)])),
                    samples,
                    period,
                });
            }
            Self::Apart(rigs) => {
                for ((plant, state), u) in rigs.iter_mut().zip(commands) {
                    for _ in 0..samples {
                        plant.step(state, *u, period);
                    }
                }
            }
        }
    }

    fn states(&self) -> Vec<State<f64>> {
        match self {
            Self::SideBySide(several) => lanes(|lane| several.1.x.map(|v| v.0[lane])),
            Self::Apart(rigs) => rigs.iter().map(|(_, state)| state.x).collect(),
        }
    }

    fn angles(&self) -> Vec<[f64; 2]> {
        match self {
            Self::SideBySide(several) => {
                let angles = several.0.measure(&several.1);
                lanes(|lane| angles.map(|angle| angle.0[lane]))
            }
            Self::Apart(rigs) => rigs.iter().map(|(p, state)| p.measure(state)).collect(),
        }
    }
}

fn lanes<T>(of: impl Fn(usize) -> T) -> Vec<T> {
    (0..LANES).map(of).collect()
}

/// Steps in lanes, compiled once for each of the processor's vector widths.
struct Held<'a> {
    plant: &'a Plant<Several>,
    state: &'a mut PlantState<Several>,
    u: Several,
    samples: usize,
    period: f64,
}

impl WithSimd for Held<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for _ in 0..self.samples {
            self.plant.step(self.state, self.u, self.period);
        }
    }
}
