//! `furuta demo`: the whole way without hardware. A rig that hides an effect is emulated on a pseudo-terminal; the
//! real-time loop tests, swings up and balances it through that port, knowing only its data sheet; the logs are
//! diagnosed, the effect is named, the rig file repaired; and the loop balances once more, with the repaired file.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use furuta_ctrl::ControllerFile;
use furuta_hw::emulate::hidden_effect;
use furuta_hw::{
    EmulatedRig, Emulation, End, Excitation, LoopSettings, OpenLoop, Pace, Pilot, PtyRig,
    Reference, RigClock, SerialTransport, Session, Summary, SwingUpBalance, Task, provenance,
};
use furuta_ident::diagnose::result::Diagnosis;
use furuta_ident::diagnose::{Options, Outcome, Request};
use furuta_ident::recording::Recording;
use furuta_ident::report;
use furuta_log::{Metadata, Mode, Record};
use furuta_model::signals::{Harmonics, Multisine, Phases, Signal, Steps};
use furuta_model::{Effect, Rig};
use serde_json::json;

use super::diagnose::search;
use super::signal::RESTARTS;
use crate::failure::Failure;
use crate::interrupt;
use crate::outputs::{self, Folder};
use crate::streams;

/// The data sheet: a rig that its own manual's numbers swing up.
const RIG: &str = "shahzad2022-srv02";
/// How the emulated rig differs from its data sheet apart from the hidden effect, since nothing is ever built exactly:
/// factors on the arm's inertia and friction, and the hinge's friction (N m s/rad), which the data sheet leaves out.
const ARM_INERTIA: f64 = 1.06;
const ARM_VISCOUS: f64 = 1.5;
const HINGE_VISCOUS: f64 = 1e-3;

const SHEET: &str = "rig.toml";
const REPORT: &str = "report.html";
const REPAIRED: &str = "repaired.toml";
const DIAGNOSIS: &str = "diagnosis.json";
/// Everything the demo writes.
const FILES: [&str; 8] = [
    SHEET,
    REPORT,
    REPAIRED,
    DIAGNOSIS,
    "multisine.mcap",
    "steps.mcap",
    "balance.mcap",
    "balance-repaired.mcap",
];

/// Length of each recording (s).
const MULTISINE: f64 = 8.0;
const STEPS: f64 = 8.0;
const BALANCE: f64 = 12.0;
/// Arm steps while balancing (rad, s).
const ARM_STEP: f64 = 0.3;
const ARM_HOLD: f64 = 2.5;
/// The arm counts as standing where it has been asked to be at one place, and the pendulum balanced, for so long (s).
const STANDING: f64 = 1.5;
const BALANCED: f64 = 3.0;

type Wired = Session<SerialTransport>;

/// No hardware: an emulated rig hides an effect, is tested, swung up, balanced and logged in real time, diagnosed and
/// repaired. Takes less than a minute; writes logs, rig files and report.html.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Folder for everything the demo writes. What an earlier demo wrote there is replaced, nothing else.
    #[arg(long, value_name = "DIR", default_value = "out", value_parser = outputs::folder(&FILES))]
    out: Folder,
    /// Effect to hide: ID or ID:NAME=VALUE,... in SI units.
    #[arg(
        long,
        value_name = "EFFECT",
        default_value = "arm.spring:stiffness=0.03,rest=-0.5"
    )]
    hide: String,
    /// Print JSON in place of text.
    #[arg(long)]
    json: bool,
}

/// Runs the command. Fails where the hidden effect is not named, or the pendulum not up at the end.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let begin = Instant::now();
    let sheet = Rig::builtin(RIG).ok_or_else(|| Failure::new(format!("no built-in rig {RIG}")))?;
    let hidden = hidden_effect(&args.hide, &sheet.params)?;
    args.out.create()?;
    args.out.write(SHEET, &sheet.to_toml())?;
    let out = args.out.path();

    let rig = switch_on(&sheet, hidden)?;
    let mut bench = Bench {
        session: Session::open(rig.path(), SerialTransport::BAUD)?,
        out,
        quiet: args.json,
    };
    bench.say(&format!(
        "An emulated {RIG} is on {}. It hides {}; what follows knows only its data sheet.",
        rig.path(),
        args.hide
    ))?;

    bench.say("\n1. Test signals, in real time, the pendulum hanging")?;
    let sines = Multisine::new(
        1.2,
        0.1,
        0.2,
        6.0,
        Harmonics::Logarithmic(12),
        Phases::Schroeder,
    )?;
    let (sines, _) = sines.optimised(RESTARTS);
    let multisine = bench.test(&sheet, "multisine", MULTISINE, sines.into())?;
    let steps = bench.test(&sheet, "steps", STEPS, Steps::new(2.0, 0.5)?.into())?;

    bench.say("\n2. Swing-up and balance with a controller designed by the data sheet")?;
    let (balance, before) = bench.balance(&sheet, "balance")?;

    bench.say("\n3. What is the data sheet missing? (furuta diagnose)")?;
    let mut logs = vec![multisine, steps, balance];
    let outcome = find(&logs, &sheet, &args.out)?;
    let diagnosis = &outcome.diagnosis;
    bench.say(&findings(diagnosis, &hidden))?;

    bench.say("\n4. Swing-up and balance with a controller designed by the repaired rig file")?;
    let (again, after) = bench.balance(&outcome.repaired, "balance-repaired")?;
    logs.push(again);

    let path = |name: &str| out.join(name).display().to_string();
    if args.json {
        writeln!(
            streams::output(),
            "{}",
            json!({
                "hidden": args.hide,
                "named": diagnosis.effects.iter().map(|e| &e.id).collect::<Vec<_>>(),
                "verdict": diagnosis.verdict.as_str(),
                "arm_offset": { "data_sheet": before.offset, "repaired": after.offset, "unit": "rad" },
                "up_since": { "data_sheet": before.up_since, "repaired": after.up_since, "unit": "s" },
                "logs": logs.iter().map(|p| p.display().to_string()).collect::<Vec<_>>(),
                "report": path(REPORT),
                "repaired": path(REPAIRED),
                "seconds": begin.elapsed().as_secs_f64(),
            })
        )?;
    } else {
        writeln!(
            streams::output(),
            "\nThe arm stood {} rad beside its reference before, {} rad after.",
            rad(before.offset),
            rad(after.offset)
        )?;
        writeln!(
            streams::output(),
            "See {} and {}. {:.0} s in all.",
            path(REPORT),
            path(REPAIRED),
            begin.elapsed().as_secs_f64()
        )?;
    }
    conclude(diagnosis, &hidden, &after, &path(REPORT))
}

/// Whether the demo showed what it is to show.
fn conclude(
    diagnosis: &Diagnosis,
    hidden: &Effect<f64>,
    after: &Balanced,
    report: &str,
) -> Result<(), Failure> {
    let id = hidden.spec().id;
    if !diagnosis.effects.iter().any(|e| e.id == id) {
        return Err(Failure::new(format!(
            "{id} was hidden but not named: at this size these tests may not show it, see {report}; try a \
             larger one with --hide"
        )));
    }
    if after.up_since.is_none() {
        return Err(Failure::new(
            "the pendulum was not up at the end with the repaired rig file: if this machine is very busy, try again",
        ));
    }
    Ok(())
}

/// The rig on its pseudo-terminal.
fn switch_on(sheet: &Rig, hidden: Effect<f64>) -> Result<PtyRig, Failure> {
    let mut real = sheet.clone();
    real.params.arm.inertia *= ARM_INERTIA;
    real.params.arm.viscous *= ARM_VISCOUS;
    real.params.pendulum.viscous = HINGE_VISCOUS;
    let emulation = Emulation {
        hidden: vec![hidden],
        ..Emulation::default()
    };
    Ok(PtyRig::start(
        EmulatedRig::new(&real, &emulation)?,
        Pace::Patient,
    )?)
}

/// The rig, where its logs go, and whether anyone is told.
struct Bench<'a> {
    session: Wired,
    out: &'a Path,
    quiet: bool,
}

impl Bench<'_> {
    fn say(&self, line: &str) -> Result<(), Failure> {
        if !self.quiet {
            writeln!(streams::output(), "{line}")?;
        }
        Ok(())
    }

    /// An open-loop test; its log.
    fn test(
        &mut self,
        sheet: &Rig,
        name: &str,
        seconds: f64,
        signal: Signal,
    ) -> Result<PathBuf, Failure> {
        self.begin(&format!("{seconds:.0} s of {signal}"))?;
        let excitation = Excitation::new(signal, seconds)?;
        let pilot = OpenLoop::new(sheet, self.session.period(), excitation.clone());
        let task = Task::Excite {
            excitation: Box::new(excitation),
            centring: None,
        };
        let hello = self.session.hello();
        let said = provenance::metadata(sheet, None, &task, pilot.describe(), hello);
        let (path, summary) = self.fly(&pilot, &said, sheet, (name, seconds))?;
        self.say(&format!(" -> {}\n   {}", path.display(), counted(&summary)))?;
        Ok(path)
    }

    /// Swing-up and balance with a controller designed for `rig`; its log, and how it went.
    fn balance(&mut self, rig: &Rig, name: &str) -> Result<(PathBuf, Balanced), Failure> {
        let reference = Reference::Steps {
            amplitude: ARM_STEP,
            hold: ARM_HOLD,
        };
        let pilot = SwingUpBalance::design(rig, self.session.period(), reference)?;
        self.begin(&format!("{BALANCE:.0} s, {reference}"))?;
        let (file, task) = (ControllerFile::default(), Task::Balance { reference });
        let hello = self.session.hello();
        let said = provenance::metadata(rig, Some(&file), &task, pilot.describe(), hello);
        let (path, summary) = self.fly(&pilot, &said, rig, (name, BALANCE))?;
        let balanced = Balanced::of(&furuta_log::read(&path)?.records);
        self.say(&format!(
            " -> {}\n   {}\n   {balanced}",
            path.display(),
            counted(&summary)
        ))?;
        Ok((path, balanced))
    }

    /// The start of a line that [`Bench::say`] ends once the run is over.
    fn begin(&self, text: &str) -> Result<(), Failure> {
        if !self.quiet {
            let mut out = streams::output();
            write!(out, "   {text}")?;
            out.flush()?; // for those who watch
        }
        Ok(())
    }

    fn fly<P: Pilot + Sync>(
        &mut self,
        pilot: &P,
        said: &Metadata,
        rig: &Rig,
        (name, seconds): (&str, f64),
    ) -> Result<(PathBuf, Summary), Failure> {
        let path = self.out.join(format!("{name}.mcap"));
        let duration = Duration::from_secs_f64(seconds);
        let settings = LoopSettings {
            stop: Some(interrupt::flag()),
            probe: Some(LoopSettings::PROBE),
            clock: RigClock::Emulated,
            ..LoopSettings::new(rig, self.session.period(), duration)
        };
        let flown = self.session.run(pilot, &settings, Some((&path, said)));
        if !flown
            .as_ref()
            .is_ok_and(|(summary, _)| matches!(summary.end, End::Finished))
        {
            self.say("")?; // ends the line begun
        }
        let (summary, recorded) = flown?;
        if let Some(error) = recorded.and_then(|r| r.error) {
            return Err(Failure::from(error));
        }
        let kept = format!("the logs so far are kept in {}", self.out.display());
        match &summary.end {
            End::Finished => Ok((path, summary)),
            End::Stopped => Err(Failure::new(format!("stopped; {kept}"))),
            End::Failed(error) => Err(Failure::new(format!("{name}: {error}; {kept}"))),
        }
    }
}

fn counted(s: &Summary) -> String {
    format!(
        "{} samples, {} lost, {} commands missed, answered after {:.0} us",
        s.samples,
        s.lost,
        s.held,
        s.timing.compute.mean().unwrap_or_default() / 1e3
    )
}

/// How balancing went.
struct Balanced {
    /// Since when the pendulum was up at the end (s).
    up_since: Option<f64>,
    /// How often it fell after having been caught.
    falls: usize,
    /// RMS of the arm's distance from where it was asked to stand (rad), once it stood.
    offset: Option<f64>,
}

impl Balanced {
    fn of(records: &[Record]) -> Self {
        let mut up_since = None;
        let mut asked = (f64::NAN, 0.0);
        let (mut falls, mut n, mut sum) = (0, 0_u32, 0.0);
        for r in records {
            if r.mode != Mode::Balance {
                falls += usize::from(up_since.take().is_some());
                continue;
            }
            let since = *up_since.get_or_insert(r.t);
            if r.reference != asked.0 {
                asked = (r.reference, r.t);
            }
            if r.t - since > BALANCED && r.t - asked.1 > STANDING {
                n += 1;
                sum += (r.theta - r.reference).powi(2);
            }
        }
        Self {
            up_since,
            falls,
            offset: (n > 0).then(|| (sum / f64::from(n)).sqrt()),
        }
    }
}

impl std::fmt::Display for Balanced {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.up_since {
            Some(t) => write!(f, "up after {t:.1} s and to the end")?,
            None => write!(f, "not up at the end")?,
        }
        match self.falls {
            0 => {}
            1 => write!(f, ", after one fall")?,
            n => write!(f, ", after {n} falls")?,
        }
        write!(
            f,
            "; the arm stands {} rad beside its reference (RMS)",
            rad(self.offset)
        )
    }
}

fn rad(angle: Option<f64>) -> String {
    angle.map_or_else(|| "an unknown number of".to_owned(), |a| format!("{a:.3}"))
}

/// Diagnoses the logs and writes what was found.
fn find(logs: &[PathBuf], sheet: &Rig, out: &Folder) -> Result<Outcome, Failure> {
    let recordings = logs
        .iter()
        .map(Recording::load)
        .collect::<Result<Vec<_>, _>>()?;
    let request = Request {
        recordings: &recordings,
        rig: sheet,
        verify: &[],
    };
    let outcome = search(&request, Options::default())?;
    if outcome.diagnosis.interrupted {
        return Err(Failure::new("the diagnosis was interrupted"));
    }
    out.write(REPAIRED, &outcome.repaired.to_toml())?;
    out.write(DIAGNOSIS, &outcome.diagnosis.to_json())?;
    let html = report::html(&outcome.diagnosis, &outcome.curves);
    out.write(REPORT, &html)?;
    Ok(outcome)
}

/// What was found against what was hidden: only the demo can tell.
fn findings(diagnosis: &Diagnosis, hidden: &Effect<f64>) -> String {
    let mut lines = vec![format!("   {}", diagnosis.sentence())];
    for effect in &diagnosis.effects {
        let same = effect.id == hidden.spec().id;
        for (name, found) in &effect.parameters {
            let truth = hidden
                .spec()
                .parameters
                .iter()
                .position(|p| same && p.name == *name)
                .and_then(|i| hidden.values().get(i).copied())
                .map_or_else(|| "not hidden".to_owned(), |v| format!("hidden: {v}"));
            lines.push(format!(
                "   {} {name} = {} ({truth})",
                effect.id,
                found.text(3)
            ));
        }
    }
    let gap = &diagnosis.gap;
    lines.push(format!(
        "   RMS prediction error over {} s [rad]    arm    pendulum",
        gap.horizon
    ));
    for (name, g) in [
        ("data sheet", gap.nominal),
        ("parameters refitted", gap.recalibrated),
        ("repaired", gap.augmented),
        ("noise of the encoders", gap.noise_floor),
    ] {
        lines.push(format!("     {name:<30} {:>8.4} {:>8.4}", g.theta, g.alpha));
    }
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(t: f64, mode: Mode, reference: f64, theta: f64) -> Record {
        Record {
            t,
            mode,
            reference,
            theta,
            ..Record::default()
        }
    }

    /// Caught at 1 s, fallen at 2 s, up from 3 s on; the arm asked to 0.3 rad at 8 s and 0.1 rad short of it.
    #[test]
    fn falls_and_offset_are_told_from_the_log() {
        let records: Vec<Record> = (0..1200)
            .map(|k| f64::from(k) * 0.01)
            .map(|t| {
                let mode = if (1.0..2.0).contains(&t) || t >= 3.0 {
                    Mode::Balance
                } else {
                    Mode::SwingUp
                };
                let asked = if t < 8.0 { 0.0 } else { 0.3 };
                // On its way until 9 s, which does not count.
                let theta = if t < 9.0 { asked } else { 0.2 };
                record(t, mode, asked, theta)
            })
            .collect();
        let b = Balanced::of(&records);
        assert_eq!((b.up_since, b.falls), (Some(3.0), 1));
        // 2 s at 0 rad off, 2.5 s at 0.1 rad off.
        let expected = 0.1 * (2.5_f64 / 4.5).sqrt();
        assert!(b.offset.is_some_and(|o| (o - expected).abs() < 1e-3));
        let none = Balanced::of(&records[..90]);
        assert_eq!((none.up_since, none.falls, none.offset), (None, 0, None));
        assert!(!none.to_string().contains("NaN"));
    }
}
