//! A controller file's whole control system as one C99 file: estimator, swing-up, catch, balance, limits.
//!
//! The file allocates nothing, needs `math.h` and `string.h` alone, and does the same operations in the same order as
//! [`furuta_ctrl::supervisor::Supervisor`]: where the compiler keeps to IEEE 754 (`-std=c99`, no `-ffast-math`), its
//! commands are the same bits. Angles beyond 1e5 rad (1e4 in single precision) are the exception: there the C library's
//! `sin` and `cos` answer, which may differ by 1 ulp.
//!
//! What it cannot say is refused: see [`ExportError`].

mod effects;
mod error;
mod literal;

pub use error::ExportError;

use std::fmt::Write as _;

use effects::Written;
use furuta_ctrl::controllers::AnyController;
use furuta_ctrl::estimators::AnyEstimator;
use furuta_ctrl::numbers::Number;
use furuta_ctrl::supervisor::Supervisor;
use furuta_ctrl::{Config, Real, Site};
use furuta_model::Rig;
use literal::{Literal, literal};

/// The numbers that the C file computes with.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Default)]
pub enum Precision {
    /// `double`: the commands of `furuta run` on a host.
    #[default]
    Double,
    /// `float`: those of a microcontroller with single-precision hardware.
    Single,
}

/// Kinds of controller that can be exported.
pub const CONTROLLERS: [&str; 5] = [
    "lqr",
    "lqi",
    "output_regulator",
    "lqr_sliding",
    "normal_form_sliding",
];

/// Kinds of estimator that can be exported.
pub const ESTIMATORS: [&str; 5] = [
    "observer",
    "luenberger",
    "kalman",
    "disturbance_observer",
    "derivative",
];

/// The control system of `config` for `rig` at the sample period `period` (s), as the text of a C99 file.
///
/// # Errors
/// Settings that the rig cannot have; a controller, an estimator or an effect that cannot be exported; a number that is
/// not finite.
///
/// ```
/// use furuta_export::c::{Precision, controller};
/// let rig = furuta_model::Rig::builtin("qube-servo-2").ok_or("no such rig")?;
/// let text = controller(&furuta_ctrl::Config::default(), &rig, 0.002, Precision::Double)?;
/// assert!(text.contains("furuta_real furuta_step("));
/// let mpc = furuta_ctrl::controllers::settings("mpc").ok_or("no such controller")?;
/// let config = furuta_ctrl::Config::with_controller(mpc);
/// let error = controller(&config, &rig, 0.002, Precision::Double).unwrap_err();
/// assert!(error.to_string().starts_with("[controller] kind = \"mpc\" cannot be exported to C"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn controller(
    config: &Config,
    rig: &Rig,
    period: f64,
    precision: Precision,
) -> Result<String, ExportError> {
    match precision {
        Precision::Double => written::<f64>(config, rig, period),
        Precision::Single => written::<f32>(config, rig, period),
    }
}

fn written<T: Real + Literal>(
    config: &Config,
    rig: &Rig,
    period: f64,
) -> Result<String, ExportError> {
    if config.trajectory.is_some() {
        return Err(ExportError::Trajectory);
    }
    let supervisor = Supervisor::<T>::design(config, &Site::of(rig, period))?;
    let (controller, estimator) = (supervisor.balance.spec().id, supervisor.estimator.spec().id);
    let balance = balance(&supervisor.balance).ok_or(ExportError::Controller {
        kind: controller,
        known: &CONTROLLERS,
    })?;
    let (estimate, has_model) = estimate(&supervisor.estimator).ok_or(ExportError::Estimator {
        kind: estimator,
        known: &ESTIMATORS,
    })?;
    let effects = Written::of(rig, &supervisor, has_model, estimator)?;
    let mut code = String::new();
    for part in [
        include_str!("numbers.c"),
        T::TRIGONOMETRY,
        include_str!("model.c"),
    ] {
        if part.contains("static void rate_of") {
            code.push_str(&effects.functions);
        }
        code.push_str(part);
    }
    if has_model {
        code.push_str(&effects.readings);
        code.push_str(include_str!("estimator_step.c"));
    }
    code.push_str(estimate);
    code.push_str(include_str!("feedback.c"));
    for part in balance {
        code.push_str(part);
    }
    code.push_str(include_str!("swing_up.c"));
    code.push_str(include_str!("supervisor.c"));
    let constants = constants(&supervisor, &code)?;
    let head = head::<T>(config, rig, period, (controller, estimator));
    Ok(head + &constants + &code + "\n#endif /* FURUTA_HEADER_ONLY */\n")
}

/// The balance controller's code.
fn balance<T: Real>(controller: &AnyController<T>) -> Option<&'static [&'static str]> {
    Some(match controller {
        AnyController::StateFeedback(_) => &[include_str!("controller_lqr.c")],
        AnyController::Lqi(_) => &[include_str!("controller_lqi.c")],
        AnyController::OutputRegulator(_) => &[
            include_str!("steady.c"),
            include_str!("controller_output_regulator.c"),
        ],
        AnyController::LqrSliding(_) => &[
            include_str!("steady.c"),
            include_str!("saturation.c"),
            include_str!("controller_lqr_sliding.c"),
        ],
        AnyController::NormalFormSliding(_) => &[
            include_str!("steady.c"),
            include_str!("saturation.c"),
            include_str!("controller_normal_form_sliding.c"),
        ],
        _ => return None,
    })
}

/// The estimator's code, and whether it has the rig's model.
fn estimate<T: Real>(estimator: &AnyEstimator<T>) -> Option<(&'static str, bool)> {
    Some(match estimator {
        AnyEstimator::Observer(_) | AnyEstimator::Luenberger(_) | AnyEstimator::Kalman(_) => {
            (include_str!("estimator_gain.c"), true)
        }
        AnyEstimator::DisturbanceObserver(_) => (include_str!("estimator_disturbance.c"), true),
        AnyEstimator::FilteredDerivative(_) => (include_str!("estimator_derivative.c"), false),
        _ => return None,
    })
}

/// The numbers that `code` uses: lists as arrays, others as macros.
fn constants<T: Real + Literal>(
    supervisor: &Supervisor<T>,
    code: &str,
) -> Result<String, ExportError> {
    let mut out = String::from("/* Exact: hexadecimal floating-point numbers. */\n");
    let mut wrong = None;
    let _ = supervisor.numbers(&mut |name, number| {
        let used = format!("FURUTA_{name}");
        let is_whole_word =
            |end: &str| !end.starts_with(|c: char| c == '_' || c.is_ascii_alphanumeric());
        if !code.split(&used).skip(1).any(is_whole_word) {
            return;
        }
        // Writing to a String cannot fail.
        match number {
            Number::Whole(count) => {
                let _ = writeln!(out, "#define {used} {count}");
            }
            Number::Real(values) if values.iter().any(|v| !v.value().is_finite()) => {
                wrong = wrong.or(Some(name));
            }
            Number::Real([value]) => {
                let _ = writeln!(out, "#define {used} ({})", literal(*value));
            }
            Number::Real(values) => {
                let _ = write!(
                    out,
                    "static const furuta_real {used}[{}] = {{",
                    values.len()
                );
                for (i, value) in values.iter().enumerate() {
                    let comma = if i == 0 { "" } else { "," };
                    let gap = if i % 4 == 0 { "\n    " } else { " " };
                    let _ = write!(out, "{comma}{gap}{}", literal(*value));
                }
                out.push_str("};\n");
            }
        }
    });
    match wrong {
        Some(name) => Err(ExportError::NotFinite { name }),
        None => Ok(out + "\n"),
    }
}

/// What the file is, and what a program sees of it.
fn head<T: Literal>(
    config: &Config,
    rig: &Rig,
    period: f64,
    (controller, estimator): (&str, &str),
) -> String {
    let plain = |text: &str| -> String {
        let sound = |c: char| if c.is_control() { ' ' } else { c };
        text.chars()
            .map(sound)
            .collect::<String>()
            .replace("*/", "* /")
            .replace("/*", "/ *")
    };
    let file = furuta_ctrl::ControllerFile {
        config: config.clone(),
        ..Default::default()
    };
    let settings = plain_lines(&file.to_toml());
    format!(
        r#"/* Control system of a rotary inverted pendulum, written by furuta (`furuta export c`). Do not edit.

   rig         {}
   period      {period:?} s: call furuta_step so often, exactly
   controller  {controller}
   estimator   {estimator}
{settings}
   C99, no allocation, math.h and string.h alone. Keep to IEEE 754 (-std=c99, never -ffast-math), and add
   -ffp-contract=off where the machine has a fused multiply-add: then every command has the bits of furuta's own.

   To use it from another file: `#define FURUTA_HEADER_ONLY`, then `#include` this file there; compile it once without.

       static furuta_controller control;
       furuta_init(&control);
       furuta_ask(&control, FURUTA_START);
       every period:
           set_motor(control.u);                                          the command of the sample before
           furuta_step(&control, arm(), pendulum(), control.u, 1, 0);     the next one is in control.u */
#ifndef FURUTA_CONTROLLER_INCLUDED
#define FURUTA_CONTROLLER_INCLUDED

#include <stdint.h>

typedef {} furuta_real;

{}
#endif

#ifndef FURUTA_HEADER_ONLY

#include <math.h>
#include <string.h>

#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#endif

"#,
        plain(&rig.name),
        T::TYPE,
        include_str!("interface.c"),
    )
}

/// A file's lines, each indented, without what would end a comment.
fn plain_lines(text: &str) -> String {
    let mut out = String::new();
    for line in text.lines() {
        let line = line.replace("*/", "* /").replace("/*", "/ *");
        let _ = writeln!(out, "     {line}");
    }
    out
}
