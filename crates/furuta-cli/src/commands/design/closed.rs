//! What every design says of its closed loop: where the rig rests, what the model leaves out, poles, margins, and how a
//! rehearsal goes.

use std::io::Write;

use furuta_chart::{Chart, Line, Panel};
use furuta_ctrl::estimators::{AnyEstimator, Estimator};
use furuta_ctrl::settings::Settings;
use furuta_ctrl::{Config, Site};
use furuta_design::rehearsal::{Rehearsal, rehearse};
use furuta_design::rig_loop::{Law, Margins, RigLoop};
use furuta_model::Rig;
use furuta_model::linear_plant::Amplitudes;
use nalgebra::Complex;
use serde_json::{Value, json};

use crate::failure::Failure;
use crate::outputs::{self, Output};
use crate::print::{self, significant};
use crate::streams::note;

/// Samples per second of the rehearsal where a design has no rate.
const RATE: f64 = 500.0;

/// How a design is judged.
#[derive(clap::Args, Debug)]
pub(super) struct JudgeArgs {
    /// Amplitudes of the arm's speed (rad/s), the pendulum's speed (rad/s) and the command (V) for which friction, dead
    /// zone, saturation and asymmetry are replaced by their describing functions; 0: left out of the poles.
    #[arg(long, value_name = "ARM,PENDULUM,COMMAND", value_parser = amplitudes)]
    amplitudes: Option<Amplitudes>,
    /// Draw gain and phase of the loop, broken at the command (SVG).
    #[arg(long, value_name = "OUT.svg", value_parser = outputs::picture())]
    bode: Option<Output>,
    /// Draw the loop in the complex plane (SVG).
    #[arg(long, value_name = "OUT.svg", value_parser = outputs::picture())]
    nyquist: Option<Output>,
}

fn amplitudes(text: &str) -> Result<Amplitudes, String> {
    match super::numbers::<3>(text) {
        Some(all) if all.iter().all(|a| *a >= 0.0) => Ok(Amplitudes {
            arm_speed: all[0],
            pendulum_speed: all[1],
            command: all[2],
        }),
        _ => Err("must be three numbers of at least 0 with commas between them".to_owned()),
    }
}

/// A design's closed loop.
pub(super) struct Judged {
    /// Of the command.
    unit: &'static str,
    pub(super) closed: RigLoop,
    pub(super) poles: Vec<Complex<f64>>,
    margins: Margins,
    /// Growth (1/s) and margins with the standard estimator in the loop, where it is sampled.
    observed: Option<(f64, Margins)>,
    /// Samples per second of the rehearsal, and how it went.
    rehearsal: (f64, Result<Rehearsal, String>),
}

impl JudgeArgs {
    /// The whole loop of `rig` under `law`, and a rehearsal of the control system with `controller`; pictures are drawn
    /// where they are asked for.
    pub(super) fn judge(
        &self,
        rig: &Rig,
        law: Law,
        rate: Option<f64>,
        controller: &Settings,
    ) -> Result<Judged, Failure> {
        let failure = |e: &dyn std::fmt::Display| Failure::new(format!("rig {}: {e}", rig.name));
        let amplitudes = self.amplitudes.unwrap_or(Amplitudes::NONE);
        let period = rate.map(|rate| 1.0 / rate);
        let closed = RigLoop::new(rig, law, period, &amplitudes).map_err(|e| failure(&e))?;
        let config = Config::with_controller(controller.clone());
        let rehearsed = rate.unwrap_or(RATE);
        let rehearsal = rehearse(&config, rig, 1.0 / rehearsed, 0.0).map_err(|e| e.to_string());
        let observed = period.and_then(|period| {
            let site = Site::of(rig, period);
            let estimator = AnyEstimator::<f64>::design(&config.estimator, &site).ok()?;
            let observed = closed.observed(estimator.linear()?)?;
            Some((observed.growth(), observed.margins()))
        });
        let judged = Judged {
            unit: rig.params.motor.actuation.unit(),
            observed,
            poles: closed.poles(),
            margins: closed.margins(),
            rehearsal: (rehearsed, rehearsal),
            closed,
        };
        judged.warn(rig);
        if let Some(path) = &self.bode {
            path.write(bode(rig, &judged.closed).svg());
        }
        if let Some(path) = &self.nyquist {
            path.write(nyquist(rig, &judged.closed).svg());
        }
        Ok(judged)
    }
}

impl Judged {
    /// Says so where the loop does not hold.
    fn warn(&self, rig: &Rig) {
        let growth = match &self.observed {
            Some((growth, _)) => *growth,
            None => self.closed.growth(),
        };
        if growth.is_nan() || growth >= 0.0 {
            note!(
                "warning: rig {}: the closed loop has a pole at {growth:+.3} 1/s with the effects of the rig file",
                rig.name
            );
        }
        match &self.rehearsal {
            (rate, Ok(found)) if found.fell.is_some() => {
                note!("warning: rig {}: rehearsed at {rate} Hz, {found}", rig.name);
            }
            (rate, Err(why)) => {
                note!(
                    "warning: rig {}: no rehearsal at {rate} Hz: {why}",
                    rig.name
                );
            }
            _ => {}
        }
    }

    /// Its lines of text.
    pub(super) fn print(&self, out: &mut impl Write) -> Result<(), Failure> {
        let plant = &self.closed.plant;
        let at = &plant.at;
        if at.x.theta != 0.0 || at.x.alpha != 0.0 || at.command != 0.0 {
            writeln!(
                out,
                "  rests at theta {} rad, alpha {} rad under {} {}",
                significant(at.x.theta),
                significant(at.x.alpha),
                significant(at.command),
                self.unit
            )?;
        }
        let states = self.closed.states();
        let beyond: Vec<_> = states.iter().skip(4).filter(|s| *s != "integral").collect();
        if !beyond.is_empty() {
            let names: Vec<&str> = beyond.iter().map(|s| s.as_str()).collect();
            writeln!(out, "  states beside the rig's four: {}", shortened(&names))?;
        }
        for remark in &plant.remarks {
            writeln!(out, "  {remark}")?;
        }
        super::print_poles(out, &self.poles, self.closed.period.map(|h| 1.0 / h))?;
        writeln!(
            out,
            "  margins  {}",
            text(&self.margins, self.closed.growth())
        )?;
        if let Some((growth, margins)) = &self.observed {
            writeln!(
                out,
                "  with the standard estimator: {}",
                text(margins, *growth)
            )?;
        }
        match &self.rehearsal {
            (rate, Ok(found)) => writeln!(
                out,
                "  rehearsed at {rate} Hz, nonlinear, with encoders: {found}"
            )?,
            (rate, Err(why)) => writeln!(out, "  not rehearsed at {rate} Hz: {why}")?,
        }
        Ok(())
    }

    /// `{"equilibrium": ..., "states": ..., "remarks": ..., "growth": ...}`, margins and rehearsal.
    pub(super) fn json(&self) -> [(&'static str, Value); 4] {
        let plant = &self.closed.plant;
        let at = &plant.at;
        let remarks: Vec<Value> = plant
            .remarks
            .iter()
            .map(|r| json!({"effect": r.effect, "text": r.to_string()}))
            .collect();
        let (rate, rehearsal) = &self.rehearsal;
        let rehearsal = match rehearsal {
            Ok(r) => json!({
                "rate": rate, "fell": r.fell, "fault": r.fault.map(|f| f.to_string()), "arm": r.swept[0],
                "pendulum": r.swept[1],
                "at_limit": r.at_limit,
            }),
            Err(why) => json!({"rate": rate, "error": why}),
        };
        [
            (
                "loop",
                json!({
                    "equilibrium": {"theta": at.x.theta, "alpha": at.x.alpha, "motor": at.volts, "command": at.command},
                    "states": self.closed.states(), "delay": self.closed.delay(), "remarks": remarks,
                    "growth": self.closed.growth(),
                }),
            ),
            ("margins", margins_json(&self.margins)),
            (
                "with_estimator",
                self.observed.as_ref().map_or(
                    Value::Null,
                    |(growth, margins)| json!({"growth": growth, "margins": margins_json(margins)}),
                ),
            ),
            ("rehearsal", rehearsal),
        ]
    }

    /// Adds [`Judged::json`] to an object.
    pub(super) fn extend(&self, line: &mut Value) {
        if let Some(object) = line.as_object_mut() {
            object.extend(self.json().map(|(k, v)| (k.to_owned(), v)));
        }
    }
}

/// Long lists of delayed commands by their ends.
fn shortened(names: &[&str]) -> String {
    let commands: Vec<&&str> = names.iter().filter(|n| n.starts_with("command ")).collect();
    if let ([first, _, _, .., last], true) = (&commands[..], commands.len() > 4) {
        let others = names.iter().filter(|n| !n.starts_with("command ")).copied();
        let range = format!("{first} to {last}");
        return others
            .chain([range.as_str()])
            .collect::<Vec<_>>()
            .join(", ");
    }
    names.join(", ")
}

/// In a line.
fn text(m: &Margins, growth: f64) -> String {
    if !m.stable {
        return format!("none: the loop is unstable, {growth:+.3} 1/s");
    }
    let or = |x: f64, unit: &str| {
        if x.is_finite() {
            format!("{}{unit}", significant(x))
        } else {
            "any".to_owned()
        }
    };
    format!(
        "gain {} to {}, phase {}, delay {}, disk {}",
        significant(m.gain[0]),
        or(m.gain[1], ""),
        or(m.phase.to_degrees(), " deg"),
        or(1e3 * m.delay, " ms"),
        significant(m.disk)
    )
}

/// Infinite: null.
fn margins_json(m: &Margins) -> Value {
    let [below, above, phase, disk] = m.at;
    json!({
        "stable": m.stable, "gain": m.gain, "phase": m.phase, "delay": m.delay, "disk": m.disk,
        "frequencies": {"gain": [below, above], "phase": phase, "disk": disk},
    })
}

/// Frequencies of a picture, rad/s.
fn frequencies(closed: &RigLoop) -> Vec<f64> {
    let high = closed.period.map_or(1e3, |h| std::f64::consts::PI / h);
    let low = 1e-2;
    (0..=2000)
        .map(|k| low * (high / low).powf(f64::from(k) / 2000.0))
        .collect()
}

/// Gain and phase of the loop.
fn bode(rig: &Rig, closed: &RigLoop) -> Chart {
    let all: Vec<(f64, Complex<f64>)> = frequencies(closed)
        .into_iter()
        .map(|w| (w, closed.response(w)))
        .collect();
    let gain = all.iter().map(|(w, l)| (*w, 20.0 * l.norm().log10()));
    let mut turned = 0.0;
    let mut before: Option<f64> = None;
    let phase: Vec<(f64, f64)> = all
        .iter()
        .map(|(w, l)| {
            let angle = l.arg().to_degrees();
            // Without jumps by a turn.
            if let Some(last) = before {
                turned -= 360.0 * ((angle + turned - last) / 360.0).round();
            }
            before = Some(angle + turned);
            (*w, angle + turned)
        })
        .collect();
    Chart::new(
        &format!("{}: the loop, broken at the command", rig.name),
        "frequency [rad/s]",
        vec![
            Panel::new("gain [dB]", vec![Line::new("L", gain)]),
            Panel::new("phase [deg]", vec![Line::new("L", phase)]),
        ],
    )
    .logarithmic()
}

/// The loop in the complex plane.
fn nyquist(rig: &Rig, closed: &RigLoop) -> furuta_chart::Plane {
    let points = frequencies(closed).into_iter().map(|w| closed.response(w));
    let curve: Vec<(f64, f64)> = points.map(|l| (l.re, l.im)).collect();
    let mirrored = curve.iter().map(|(re, im)| (*re, -im)).collect();
    furuta_chart::Plane::new(
        &format!("{}: the loop, broken at the command", rig.name),
        ["Re L", "Im L"],
        3.0,
    )
    .curve("frequencies above 0", curve)
    .curve("below 0", mirrored)
    .point("-1", (-1.0, 0.0))
}

/// The poles of [`Judged`] for JSON.
pub(super) fn poles_json(judged: &Judged) -> Value {
    print::poles_json(&judged.poles)
}
