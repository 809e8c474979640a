//! Trajectories of every built-in rig, without effects, with each effect of the catalogue, and with many at once.

use crate::fingerprint::{Fingerprint, Float};
use arrayvec::ArrayVec;
use core::fmt;
use furuta_model::effects::MAX_PARAMETERS;
use furuta_model::plant::MAX_EFFECTS;
use furuta_model::{CATALOGUE, Effect, Params, Plant, Spec, State, linearize};

/// Name and parameters of every built-in rig; the build script writes them from the rig files.
pub const RIGS: &[(&str, Params<f64>)] = include!(concat!(env!("OUT_DIR"), "/rigs.rs"));

/// Sample period, s.
const PERIOD: f64 = 1e-3;

/// One line for each rig and choice of effects, all in the scalar `F`, over `seconds`.
///
/// # Errors
/// Those of `out`.
pub(crate) fn print<F: Float>(out: &mut impl fmt::Write, seconds: u32) -> fmt::Result {
    for (name, params) in RIGS {
        line::<F>(out, name, params, &[], seconds)?;
        for spec in CATALOGUE {
            line::<F>(out, name, params, &[spec], seconds)?;
        }
        for several in CATALOGUE.chunks(MAX_EFFECTS) {
            line::<F>(out, name, params, several, seconds)?;
        }
    }
    Ok(())
}

/// One line for each rig: its Jacobians upright and hanging.
///
/// # Errors
/// Those of `out`.
pub(crate) fn print_jacobians(out: &mut impl fmt::Write) -> fmt::Result {
    for (name, params) in RIGS {
        let mut sum = Fingerprint::new();
        if let Ok(plant) = Plant::new(params, &[]) {
            for x in [State::upright(), State::hanging()] {
                let linear = linearize(&plant, x, 0.0);
                linear.a.iter().chain(&linear.b).for_each(|v| sum.add(*v));
            }
        }
        writeln!(out, "f64 {name} jacobians {sum}")?;
    }
    Ok(())
}

fn line<F: Float>(
    out: &mut impl fmt::Write,
    rig: &str,
    params: &Params<f64>,
    specs: &[&Spec],
    seconds: u32,
) -> fmt::Result {
    write!(out, "{} {rig}", F::NAME)?;
    for spec in specs {
        write!(out, " {}", spec.id)?;
    }
    match trajectory::<F>(params, specs, seconds) {
        Ok(end) => writeln!(out, ": {end}"),
        Err(why) => writeln!(out, ": refused, {why}"),
    }
}

/// What is kept of a trajectory.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct End<F> {
    /// Of state, motor voltage and measured angles after every step.
    pub every_step: Fingerprint,
    /// The last state.
    pub state: State<F>,
}

impl<F: Float> fmt::Display for End<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.every_step)?;
        for x in self.state.to_array() {
            write!(f, " {:0width$x}", x.bits(), width = 2 * F::BYTES)?;
        }
        Ok(())
    }
}

/// A rig with `specs` at their typical sizes, set going on both axes and driven over most of the command's range.
///
/// # Errors
/// The catalogue or the plant refuses the effects, in words.
pub fn trajectory<F: Float>(
    params: &Params<f64>,
    specs: &[&Spec],
    seconds: u32,
) -> Result<End<F>, &'static str> {
    let mut effects = ArrayVec::<_, MAX_EFFECTS>::new();
    for spec in specs {
        effects
            .try_push(typical::<F>(spec, params)?)
            .map_err(|_| "too many effects")?;
    }
    let plant = Plant::new(&params.cast(), &effects).map_err(|_| "no such plant")?;
    plant
        .check_period(PERIOD)
        .map_err(|_| "no such plant at this period")?;

    let number = F::from_f64;
    let period = number(PERIOD);
    let limit = number(params.motor.command_limit);
    let mut s = plant.rest(State::new(0.3, 2.0, 0.5, -1.0).map(number));
    let mut every_step = Fingerprint::new();
    for k in 0..seconds * 1000 {
        let t = number(f64::from(k)) * period;
        // Three sines that never repeat within the run, V.
        let sine = |share: f64, hertz: f64| {
            number(share) * (number(core::f64::consts::TAU * hertz) * t).sin_cos().0
        };
        let u = limit * (sine(0.5, 0.7) + sine(0.3, 1.9) + sine(0.1, 5.3));
        plant.step(&mut s, u, period);
        for x in
            s.x.to_array()
                .into_iter()
                .chain([s.voltage])
                .chain(plant.measure(&s))
        {
            every_step.add(x);
        }
    }
    Ok(End {
        every_step,
        state: s.x,
    })
}

/// An effect at its typical size on this rig.
fn typical<F: Float>(spec: &Spec, params: &Params<f64>) -> Result<Effect<F>, &'static str> {
    let mut values = ArrayVec::<F, MAX_PARAMETERS>::new();
    for p in spec.parameters {
        let value = match p.name {
            // Some disturbances belong to one run; this is the first.
            "run" => 0.0,
            _ => (p.off + p.typical(params)).clamp(p.min, p.max),
        };
        values
            .try_push(F::from_f64(value))
            .map_err(|_| "too many parameters")?;
    }
    Effect::new(spec.id, &values).map_err(|_| "no such effect")
}
