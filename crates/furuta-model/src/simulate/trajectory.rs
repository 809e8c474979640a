//! One rollout.

use super::error::{SimulationError, finite_commands, finite_start};
use crate::plant::{Plant, PlantState};
use crate::state::State;

/// Steps of the integrator between two looks at whether to go on: some milliseconds of work.
const STRIDE: usize = 16_384;

/// States under commands (V) each held for `period` seconds: the start, then the state after every command.
///
/// The integrator takes `substeps` equal steps per sample. `proceed` hears from time to time how many samples are done
/// and says whether to go on.
///
/// # Errors
/// A start, command or period that is not possible; a state that grows beyond all numbers; `proceed` said no.
///
/// ```
/// use furuta_model::{Rig, State, simulate::trajectory};
/// let plant = Rig::builtin("qube-servo-2").expect("built in").plant();
/// let start = plant.rest(State::hanging());
/// let states = trajectory(&plant, start, &[0.5; 500], 0.002, 1, |_| true)?;
/// assert_eq!(states.len(), 501);
/// assert!(states[500].theta > 0.1); // half a volt turns the arm
/// # Ok::<(), furuta_model::simulate::SimulationError>(())
/// ```
pub fn trajectory(
    plant: &Plant<f64>,
    start: PlantState<f64>,
    commands: &[f64],
    period: f64,
    substeps: usize,
    proceed: impl FnMut(usize) -> bool,
) -> Result<Vec<State<f64>>, SimulationError> {
    let mut states = Vec::with_capacity(commands.len() + 1);
    follow(plant, start, commands, period, substeps, proceed, |s| {
        states.push(s.x);
    })?;
    Ok(states)
}

/// The same, every sample shown to `see` as it comes: the start, then the plant's state after every command, memory of
/// its effects included.
///
/// That is what [`Plant::measure`] asks for: readings that are late, or of an encoder on the motor, do not follow from
/// the mechanical state.
///
/// # Errors
/// As [`trajectory`]; what was seen until then was right.
///
/// ```
/// use furuta_model::{Effect, Plant, Rig, State, simulate::follow};
/// let rig = Rig::builtin("qube-servo-2").expect("built in");
/// let late = Effect::new("sensor.delay", &[0.004]).expect("valid");
/// let plant = Plant::new(&rig.params, &[late])?;
/// let start = plant.rest(State::new(0.0, 3.0, 0.0, 0.0));
/// let (mut read, mut real) = (vec![], vec![]);
/// follow(&plant, start, &[0.5; 100], 0.002, 1, |_| true, |s| {
///     read.push(plant.measure(s)[1]);
///     real.push(s.x.alpha);
/// })?;
/// assert!((read[100] - real[98]).abs() < 1e-12); // two samples late
/// # Ok::<(), furuta_model::simulate::SimulationError>(())
/// ```
pub fn follow(
    plant: &Plant<f64>,
    start: PlantState<f64>,
    commands: &[f64],
    period: f64,
    substeps: usize,
    mut proceed: impl FnMut(usize) -> bool,
    mut see: impl FnMut(&PlantState<f64>),
) -> Result<(), SimulationError> {
    if substeps == 0 {
        return Err(SimulationError::Substeps);
    }
    plant.check_period(period)?;
    let h = period / substeps as f64;
    plant.check_period(h)?;
    finite_start(&start.x)?;
    finite_commands(commands)?;
    let mut s = start;
    see(&s);
    let stride = STRIDE.div_ceil(substeps);
    let bare = plant.effects().is_empty();
    // Apart from `s`, which is shown at every sample and so lives in memory.
    let (mut x, mut t) = (s.x, s.t);
    for (k, u) in commands.iter().enumerate() {
        if bare {
            for _ in 0..substeps {
                x = plant.bare_step(x, *u, h);
                t += h;
            }
            (s.x, s.t, s.voltage) = (x, t, *u);
        } else {
            for _ in 0..substeps {
                plant.step(&mut s, *u, h);
            }
            x = s.x;
        }
        if !x.is_finite() {
            return Err(SimulationError::Diverged { sample: k });
        }
        see(&s);
        let sample = k + 1;
        if (sample.is_multiple_of(stride) || sample == commands.len()) && !proceed(sample) {
            return Err(SimulationError::Stopped { sample });
        }
    }
    Ok(())
}
