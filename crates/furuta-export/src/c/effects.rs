//! The rig's effects as C code: torques, the motor's voltage, what the encoders read.

use std::fmt::Write as _;

use super::error::ExportError;
use super::literal::{Literal, literal};
use furuta_ctrl::Real;
use furuta_ctrl::supervisor::Supervisor;
use furuta_model::effects::Acts;
use furuta_model::{Effect, Plant, Rig};

/// Effects with C code; those behind `pendulum.inertia_transverse` act between command and motor or at the encoders.
const KNOWN: [&str; 17] = [
    "arm.spring",
    "arm.cable",
    "arm.cogging",
    "arm.quadratic",
    "arm.tilt",
    "pendulum.spring",
    "pendulum.quadratic",
    "pendulum.bias",
    "motor.ripple",
    "pendulum.inertia_transverse",
    "motor.deadzone",
    "motor.bias",
    "motor.saturation",
    "motor.asymmetry",
    "sensor.alpha.offset",
    "sensor.alpha.scale",
    "sensor.theta.scale",
];

/// What an estimator without a model need not know, beside [`KNOWN`].
const OF_MODELS: Acts = Acts::DRY_FRICTION
    .and(Acts::DELAY)
    .and(Acts::LAG)
    .and(Acts::SENSOR_DELAY)
    .and(Acts::SPEED_LIMIT)
    .and(Acts::DRIVE);

/// What would still act in the model of the compensation and of the catch.
const ANYWHERE: Acts = Acts::TORQUE
    .and(Acts::VOLTAGE)
    .and(Acts::SHAPE)
    .and(Acts::JUMPS)
    .and(Acts::MEMORY);

/// The effects' C code.
pub(super) struct Written {
    /// `add_effects` and `mapped`.
    pub(super) functions: String,
    /// `read_angles`.
    pub(super) readings: String,
}

impl Written {
    pub(super) fn of<T: Real + Literal>(
        rig: &Rig,
        supervisor: &Supervisor<T>,
        has_model: bool,
        estimator: &'static str,
    ) -> Result<Self, ExportError> {
        let plant = Plant::new(&rig.params, &rig.effects)
            .map_err(furuta_ctrl::ConfigError::from)?
            .cast::<T>();
        let smooth = supervisor.catch.plant();
        let (mut torques, mut volts, mut readings) = (String::new(), String::new(), String::new());
        for effect in plant.effects() {
            let spec = effect.spec();
            if !KNOWN.contains(&spec.id) {
                refuse(effect, has_model, estimator)?;
                continue;
            }
            let in_catch = smooth.effects().iter().any(|e| e == effect);
            torques += &torque(effect, in_catch);
            volts += &voltage(effect);
            readings += &reading(effect);
        }
        Ok(Self {
            functions: format!(
                r#"
/* The effects' torques on arm and pendulum. */
static void add_effects(const furuta_real x[4], furuta_real s, furuta_real co, furuta_real volts, int smooth,
                        furuta_real torque[2])
{{
    (void)x;
    (void)s;
    (void)co;
    (void)volts;
    (void)smooth;
    (void)torque;
{torques}}}

/* The motor's voltage for a command. */
static furuta_real mapped(furuta_real u)
{{
{volts}    return u;
}}
"#
            ),
            readings: format!(
                r#"
/* What the encoders read for true angles. */
static void read_angles(furuta_real y[2])
{{
    (void)y;
{readings}}}
"#
            ),
        })
    }
}

fn refuse<T: Real>(
    effect: &Effect<T>,
    has_model: bool,
    estimator: &'static str,
) -> Result<(), ExportError> {
    let acts = effect.spec().acts;
    let id = effect.spec().id.to_owned();
    match (acts.touches(ANYWHERE), acts.touches(OF_MODELS)) {
        (false, true) if has_model => Err(ExportError::EffectInModel {
            effect: id,
            estimator,
        }),
        (false, true) => Ok(()),
        _ => Err(ExportError::Effect {
            effect: id,
            known: &KNOWN,
        }),
    }
}

/// Adds `[arm, pendulum]`, both as the model does: adding 0 may change a zero's sign.
fn torque<T: Real + Literal>(effect: &Effect<T>, in_catch: bool) -> String {
    let values = effect.values();
    let v = |i: usize| literal(values.get(i).copied().unwrap_or(T::ZERO));
    let (before, arm, pendulum) = match effect.spec().id {
        "arm.spring" => (
            String::new(),
            format!("-({} * (x[0] - {}))", v(0), v(1)),
            "ZERO".to_owned(),
        ),
        "arm.cable" => (
            format!("const furuta_real e = x[0] - {};", v(3)),
            format!("-(e * ({} + e * ({} + e * {})))", v(0), v(1), v(2)),
            "ZERO".to_owned(),
        ),
        "arm.cogging" => (
            sine_of(&format!("{} * x[0] + {}", v(1), v(2))),
            format!("{} * sine", v(0)),
            "ZERO".to_owned(),
        ),
        "motor.ripple" => (
            sine_of(&format!("{} * x[0] + {}", v(1), v(2))),
            format!("{} * sine * FURUTA_MODEL[DRIVE] * volts", v(0)),
            "ZERO".to_owned(),
        ),
        "arm.quadratic" => (
            String::new(),
            format!("-({} * (magnitude(x[2]) * x[2]))", v(0)),
            "ZERO".to_owned(),
        ),
        "arm.tilt" => {
            let (lean_sin, lean_cos) = values[0].sin_cos();
            let (lean_sin, lean_cos) = (literal(lean_sin), literal(lean_cos));
            (
                sine_of(&format!("x[0] - {}", v(1))),
                format!(
                    "{lean_sin} * (FURUTA_MODEL[WEIGHT] * s * cosine - FURUTA_MODEL[LEVER] * ({} + ONE) * sine)",
                    v(2)
                ),
                format!("FURUTA_MODEL[WEIGHT] * ({lean_sin} * co * sine - (ONE - {lean_cos}) * s)"),
            )
        }
        "pendulum.spring" => (
            String::new(),
            "ZERO".to_owned(),
            format!("-({} * (x[1] - {}))", v(0), v(1)),
        ),
        "pendulum.quadratic" => (
            String::new(),
            "ZERO".to_owned(),
            format!("-({} * (magnitude(x[3]) * x[3]))", v(0)),
        ),
        "pendulum.bias" => (String::new(), "ZERO".to_owned(), v(0)),
        _ => return String::new(),
    };
    let open = if in_catch {
        "    {"
    } else {
        "    if (!smooth) {"
    };
    let mut out = format!("{open} /* {} */\n", effect.spec().id);
    // Writing to a String cannot fail.
    if !before.is_empty() {
        let _ = writeln!(out, "        {before}");
    }
    let _ = writeln!(out, "        torque[0] = torque[0] + {arm};");
    let _ = writeln!(out, "        torque[1] = torque[1] + {pendulum};\n    }}");
    out
}

fn sine_of(angle: &str) -> String {
    format!(
        "furuta_real sine, cosine;\n        sincos_of({angle}, &sine, &cosine);\n        (void)cosine;"
    )
}

fn voltage<T: Real + Literal>(effect: &Effect<T>) -> String {
    let v = literal(effect.values().first().copied().unwrap_or(T::ZERO));
    match effect.spec().id {
        "motor.deadzone" => format!(
            r#"    {{ /* motor.deadzone */
        const furuta_real past = magnitude(u) - {v}, left = past < ZERO ? ZERO : past;
        u = u < ZERO ? -left : left;
    }}
"#
        ),
        "motor.bias" => format!("    u = u + {v}; /* motor.bias */\n"),
        "motor.saturation" => format!("    u = limited(u, -({v}), {v}); /* motor.saturation */\n"),
        "motor.asymmetry" => format!("    u = u < ZERO ? {v} * u : u; /* motor.asymmetry */\n"),
        _ => String::new(),
    }
}

fn reading<T: Real + Literal>(effect: &Effect<T>) -> String {
    let values = effect.values();
    let v = literal(values.first().copied().unwrap_or(T::ZERO));
    match effect.spec().id {
        "sensor.alpha.offset" => format!("    y[1] = y[1] + {v}; /* sensor.alpha.offset */\n"),
        "sensor.alpha.scale" => {
            let hanging = values.get(1).is_some_and(|zero| zero.value() > 0.5);
            let zero = if hanging {
                "(furuta_real)FURUTA_PI"
            } else {
                "ZERO"
            };
            format!("    y[1] = {zero} + {v} * (y[1] - {zero}); /* sensor.alpha.scale */\n")
        }
        "sensor.theta.scale" => format!("    y[0] = {v} * y[0]; /* sensor.theta.scale */\n"),
        _ => String::new(),
    }
}
