//! What every design says of its closed loop: where the rig rests, what the model leaves out, poles, margins, and how a
//! rehearsal goes.

use std::io::Write;

use furuta_chart::{Chart, Line, Panel};
use furuta_ctrl::estimators::{AnyEstimator, Estimator};
use furuta_ctrl::settings::Settings;
use furuta_ctrl::{Config, Site};
use furuta_design::rehearsal::{Rehearsal, rehearse};
use furuta_design::rig_loop::{Law, Margins, RigLoop};
use furuta_ident::report;
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
    #[arg(long, value_name = "ARM,PENDULUM,COMMAND", value_parser = amplitudes, allow_hyphen_values = true)]
    amplitudes: Option<Amplitudes>,
    /// Draw gain and phase of the loop, broken at the command (SVG).
    #[arg(long, value_name = "OUT.svg", value_parser = outputs::picture())]
    bode: Option<Output>,
    /// Draw the loop in the complex plane (SVG).
    #[arg(long, value_name = "OUT.svg", value_parser = outputs::picture())]
    nyquist: Option<Output>,
    /// Write a report, one HTML page that needs no network: the loop's Bode and Nyquist plot with the margins, what
    /// should be known, the numbers.
    #[arg(long, value_name = "OUT.html", value_parser = outputs::page())]
    report: Option<Output>,
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
        self.judge_system(rig, law, rate, &Config::with_controller(controller.clone()))
    }

    /// The same with a whole control system that `law` is part of.
    pub(super) fn judge_system(
        &self,
        rig: &Rig,
        law: Law,
        rate: Option<f64>,
        config: &Config,
    ) -> Result<Judged, Failure> {
        let failure = |e: &dyn std::fmt::Display| Failure::new(format!("rig {}: {e}", rig.name));
        let amplitudes = self.amplitudes.unwrap_or(Amplitudes::NONE);
        let period = rate.map(|rate| 1.0 / rate);
        let closed = RigLoop::new(rig, law, period, &amplitudes).map_err(|e| failure(&e))?;
        let rehearsed = rate.unwrap_or(RATE);
        let rehearsal = rehearse(config, rig, 1.0 / rehearsed, 0.0).map_err(|e| e.to_string());
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
        let warnings = judged.warnings(rig);
        for warning in &warnings {
            note!("warning: {warning}");
        }
        if let Some(path) = &self.bode {
            path.write(judged.bode(rig).svg());
        }
        if let Some(path) = &self.nyquist {
            path.write(judged.nyquist(rig).svg());
        }
        if let Some(path) = &self.report {
            path.write(judged.report(rig, &warnings)?);
        }
        Ok(judged)
    }
}

impl Judged {
    /// What is said where the loop does not hold.
    fn warnings(&self, rig: &Rig) -> Vec<String> {
        let mut warnings = Vec::new();
        let (growth, estimator) = match &self.observed {
            Some((growth, _)) => (*growth, " with the standard estimator"),
            None => (self.closed.growth(), ""),
        };
        if growth.is_nan() || growth >= 0.0 {
            let effects = match rig.effects.is_empty() {
                true => "",
                false => ", the effects of the rig file included,",
            };
            warnings.push(format!(
                "rig {}: the closed loop{estimator}{effects} has a pole at {growth:+.3} 1/s",
                rig.name
            ));
        }
        match &self.rehearsal {
            (rate, Ok(found)) if found.fell.is_some() => {
                warnings.push(format!("rig {}: rehearsed at {rate} Hz, {found}", rig.name));
            }
            (rate, Err(why)) => {
                warnings.push(format!(
                    "rig {}: no rehearsal at {rate} Hz: {why}",
                    rig.name
                ));
            }
            _ => {}
        }
        warnings
    }

    /// The page of `--report`.
    fn report(&self, rig: &Rig, warnings: &[String]) -> Result<String, Failure> {
        let mut text = Vec::new();
        writeln!(text, "gain {:?}", self.closed.law.gain)?;
        self.print(&mut text)?;
        let figures = [
            ("Bode plot of the loop", self.bode(rig).svg()),
            ("Nyquist plot of the loop", self.nyquist(rig).svg()),
        ];
        let title = format!("{}: closed loop", rig.name);
        let text = String::from_utf8_lossy(&text);
        Ok(report::figures(&title, &figures, &text, warnings))
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

impl Judged {
    /// Gain and phase of the loop; each margin as the distance that is left, where it is reached.
    fn bode(&self, rig: &Rig) -> Chart {
        let w = frequencies(&self.closed);
        let all: Vec<Complex<f64>> = w.iter().map(|w| self.closed.response(*w)).collect();
        let decibels = |x: f64| 20.0 * x.log10();
        let gain = w.iter().zip(&all).map(|(w, l)| (*w, decibels(l.norm())));
        let mut gains = vec![Line::new("L", gain)];
        let mut turned = 0.0;
        let mut before: Option<f64> = None;
        let phase: Vec<(f64, f64)> = w
            .iter()
            .zip(&all)
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
        let m = &self.margins;
        for (factor, at) in m.gain.into_iter().zip(m.at) {
            if at.is_finite() && factor > 0.0 && factor.is_finite() {
                let left = [(at, -decibels(factor)), (at, 0.0)];
                gains.push(Line::new(
                    &format!("gain margin {}", significant(factor)),
                    left,
                ));
            }
        }
        let mut phases = vec![Line::new("L", phase.clone())];
        if let (true, Some(drawn)) = (m.at[2].is_finite(), near(&phase, m.at[2])) {
            // The edge is the odd multiple of half a turn that is nearest.
            let edge = 360.0 * ((drawn - 180.0) / 360.0).round() + 180.0;
            let name = format!("phase margin {} deg", significant(m.phase.to_degrees()));
            phases.push(Line::new(&name, [(m.at[2], drawn), (m.at[2], edge)]));
        }
        Chart::new(
            &format!("{}: the loop, broken at the command", rig.name),
            "frequency [rad/s]",
            vec![
                Panel::new("gain [dB]", gains),
                Panel::new("phase [deg]", phases),
            ],
        )
        .logarithmic()
    }

    /// The loop in the complex plane, and the disk that the disk margin keeps it out of.
    fn nyquist(&self, rig: &Rig) -> furuta_chart::Plane {
        let points = frequencies(&self.closed)
            .into_iter()
            .map(|w| self.closed.response(w));
        let curve: Vec<(f64, f64)> = points.map(|l| (l.re, l.im)).collect();
        let mirrored = curve.iter().map(|(re, im)| (*re, -im)).collect();
        let m = &self.margins;
        let mut plane = furuta_chart::Plane::new(
            &format!("{}: the loop, broken at the command", rig.name),
            ["Re L", "Im L"],
            3.0,
        )
        .curve("frequencies above 0", curve)
        .curve("below 0", mirrored);
        // |1 + L| = c |1 - L| is a circle about (c^2 + 1) / (c^2 - 1), of radius 2 c / |c^2 - 1|.
        let c = 0.5 * m.disk;
        if m.stable && c < 1.0 {
            let (centre, radius) = ((c * c + 1.0) / (c * c - 1.0), 2.0 * c / (1.0 - c * c));
            let disk = (0..=360)
                .map(|k| f64::from(k).to_radians().sin_cos())
                .map(|(sin, cos)| (centre + radius * cos, radius * sin));
            plane = plane.curve(
                &format!("disk margin {}", significant(m.disk)),
                disk.collect(),
            );
        }
        plane.point("-1", (-1.0, 0.0))
    }
}

/// The value of a curve at the point next to `at`.
fn near(curve: &[(f64, f64)], at: f64) -> Option<f64> {
    let next = curve
        .iter()
        .min_by(|a, b| (a.0 - at).abs().total_cmp(&(b.0 - at).abs()));
    next.map(|(_, value)| *value)
}

/// The poles of [`Judged`] for JSON.
pub(super) fn poles_json(judged: &Judged) -> Value {
    print::poles_json(&judged.poles)
}
