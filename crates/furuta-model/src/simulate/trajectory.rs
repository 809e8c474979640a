//! One rollout.

use super::error::{SimulationError, finite_commands, finite_start};
use crate::plant::{Plant, PlantState};
use crate::state::State;

/// Samples between two looks at whether to go on: some milliseconds of work.
const STRIDE: usize = 16_384;

/// States under commands (V) each held for `period` seconds: the start, then the state after every command.
///
/// The integrator takes `substeps` equal steps per sample. `proceed` hears from time to time how many samples are done and says whether to go on.
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
    mut proceed: impl FnMut(usize) -> bool,
) -> Result<Vec<State<f64>>, SimulationError> {
    if substeps == 0 {
        return Err(SimulationError::Substeps);
    }
    plant.check_period(period)?;
    let h = period / substeps as f64;
    plant.check_period(h)?;
    finite_start(&start.x)?;
    finite_commands(commands)?;
    let mut s = start;
    let mut states = Vec::with_capacity(commands.len() + 1);
    states.push(s.x);
    for (done, part) in commands.chunks(STRIDE).enumerate() {
        for u in part {
            for _ in 0..substeps {
                plant.step(&mut s, *u, h);
            }
            states.push(s.x);
        }
        let sample = done * STRIDE + part.len();
        // A state once not finite stays so.
        if !s.x.is_finite() {
            let sample = states
                .iter()
                .position(|x| !x.is_finite())
                .unwrap_or(states.len());
            return Err(SimulationError::Diverged {
                sample: sample.saturating_sub(1),
            });
        }
        if !proceed(sample) {
            return Err(SimulationError::Stopped { sample });
        }
    }
    Ok(states)
}
