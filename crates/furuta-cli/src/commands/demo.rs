//! `furuta demo`: the whole way without hardware. A rig that hides an effect is emulated on a pseudo-terminal; the
//! real-time loop tests, swings up and balances it through that port, knowing only its data sheet; the logs are
//! diagnosed, the effect is named, the rig file repaired; and the loop balances once more, with the repaired file.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use furuta_hw::emulate::hidden_effect;
use furuta_hw::{
    EmulatedRig, Emulation, End, Excitation, LoopSettings, Multisine, OpenLoop, Pace, Pilot,
    PtyRig, Reference, SerialTransport, Session, Steps, Summary, SwingUpBalance,
};
use furuta_ident::diagnose::{Diagnosis, Outcome, Request, diagnose};
use furuta_ident::recording::Recording;
use furuta_ident::report;
use furuta_log::Mode;
use furuta_model::{Effect, Rig};
use serde_json::json;

use super::run::{metadata, text};
use crate::failure::Failure;
use crate::interrupt;

/// The data sheet.
const RIG: &str = "qube-servo-2";
/// How the emulated rig differs from its data sheet apart from the hidden effect, as factors: real QUBEs have far less
/// friction than their manual says, and nothing is ever built exactly.
const ARM_INERTIA: f64 = 1.06;
const ARM_VISCOUS: f64 = 0.15;
const PENDULUM_VISCOUS: f64 = 0.12;

const REPORT: &str = "report.html";
const REPAIRED: &str = "repaired.toml";

type Wired = Session<SerialTransport>;

/// Length of each recording (s).
const MULTISINE: f64 = 8.0;
const STEPS: f64 = 8.0;
const BALANCE: f64 = 12.0;

/// No hardware: an emulated rig hides an effect, is tested, swung up, balanced and logged in real time, diagnosed and
/// repaired. Takes about a minute; writes logs, rig files and report.html.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Folder for everything the demo writes.
    #[arg(long, value_name = "DIR", default_value = "out")]
    out: PathBuf,
    /// Effect to hide: ID or ID:NAME=VALUE,... in SI units.
    #[arg(
        long,
        value_name = "EFFECT",
        default_value = "arm.spring:stiffness=0.0015,rest=-0.3"
    )]
    hide: String,
    /// Print JSON in place of text.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let begin = Instant::now();
    let say = |line: &str| {
        if !args.json {
            println!("[{:5.1} s] {line}", begin.elapsed().as_secs_f64());
        }
    };
    let sheet = Rig::builtin(RIG).ok_or_else(|| Failure::new(format!("no built-in rig {RIG}")))?;
    let hidden = hidden_effect(&args.hide, &sheet.params)?;
    let out = args.out.as_path();
    std::fs::create_dir_all(out).map_err(|e| {
        Failure::new(format!(
            "{}: cannot be created: {e}; give another folder with --out",
            out.display()
        ))
    })?;

    let rig = switch_on(&sheet, hidden)?;
    say(&format!(
        "emulated {RIG} on {}, hiding {} (nobody below is told)",
        rig.path(),
        args.hide
    ));
    let mut session = Session::open(rig.path(), SerialTransport::BAUD)?;
    let logs = record(&mut session, &sheet, out, &say)?;

    say("diagnosing the three recordings");
    let outcome = find(&logs, &sheet, out)?;
    let diagnosis = &outcome.diagnosis;
    if !args.json {
        say(&diagnosis.sentence());
        print_findings(diagnosis, &hidden);
    }

    // The loop closes: the repaired file takes the data sheet's place.
    let again = balance(
        &mut session,
        &outcome.repaired,
        "balance-repaired",
        out,
        &say,
    )?;
    let [before, after] = [arm_error(&logs[2])?, arm_error(&again)?];
    if args.json {
        println!(
            "{}",
            json!({
                "hidden": args.hide,
                "named": diagnosis.effects.iter().map(|e| &e.id).collect::<Vec<_>>(),
                "verdict": diagnosis.verdict.as_str(),
                "arm_error_while_balancing": { "data_sheet": before, "repaired": after, "unit": "rad" },
                "logs": logs.iter().chain([&again]).map(|p| p.display().to_string()).collect::<Vec<_>>(),
                "report": out.join(REPORT).display().to_string(),
                "repaired": out.join(REPAIRED).display().to_string(),
                "seconds": begin.elapsed().as_secs_f64(),
            })
        );
    } else {
        say(&format!(
            "arm's RMS error while balancing: {before:.3} rad by the data sheet, {after:.3} rad repaired"
        ));
        say(&format!(
            "before and after: {}; repaired rig: {}",
            out.join(REPORT).display(),
            out.join(REPAIRED).display()
        ));
    }
    Ok(())
}

/// The rig on its pseudo-terminal.
fn switch_on(sheet: &Rig, hidden: Effect<f64>) -> Result<PtyRig, Failure> {
    let mut real = sheet.clone();
    real.params.arm.inertia *= ARM_INERTIA;
    real.params.arm.viscous *= ARM_VISCOUS;
    real.params.pendulum.viscous *= PENDULUM_VISCOUS;
    let emulation = Emulation {
        hidden: vec![hidden],
        ..Emulation::default()
    };
    Ok(PtyRig::start(
        EmulatedRig::new(&real, &emulation)?,
        Pace::RealTime,
    )?)
}

/// Two open-loop tests with the pendulum hanging, then swing-up and balance with steps of the arm; one log each.
fn record(
    session: &mut Wired,
    sheet: &Rig,
    out: &Path,
    say: &impl Fn(&str),
) -> Result<[PathBuf; 3], Failure> {
    let test = |excitation| OpenLoop::new(sheet, session.period(), excitation);
    let multisine = test(Excitation::Multisine(Multisine {
        rms: 1.2,
        low: 0.2,
        high: 6.0,
        lines: 12,
    }));
    let steps = test(Excitation::Steps(Steps {
        amplitude: 2.0,
        hold: 0.5,
    }));
    Ok([
        fly(
            session,
            &multisine,
            multisine.describe(),
            sheet,
            ("multisine", MULTISINE),
            out,
            say,
        )?,
        fly(
            session,
            &steps,
            steps.describe(),
            sheet,
            ("steps", STEPS),
            out,
            say,
        )?,
        balance(session, sheet, "balance", out, say)?,
    ])
}

/// Swing-up and balance with a controller designed for `rig`.
fn balance(
    session: &mut Wired,
    rig: &Rig,
    name: &str,
    out: &Path,
    say: &impl Fn(&str),
) -> Result<PathBuf, Failure> {
    let pilot = SwingUpBalance::design(
        rig,
        session.period(),
        Reference::Steps {
            amplitude: 0.3,
            hold: 2.0,
        },
    )?;
    fly(
        session,
        &pilot,
        pilot.describe(),
        rig,
        (name, BALANCE),
        out,
        say,
    )
}

/// Diagnoses the logs and writes what was found.
fn find(logs: &[PathBuf], sheet: &Rig, out: &Path) -> Result<Outcome, Failure> {
    let recordings = logs
        .iter()
        .map(Recording::load)
        .collect::<Result<Vec<_>, _>>()?;
    let outcome = diagnose(
        &Request {
            recordings: &recordings,
            rig: sheet,
            verify: &[],
        },
        &|_| (),
    )?;
    for (name, content) in [
        ("rig.toml", sheet.to_toml()),
        (REPAIRED, outcome.repaired.to_toml()),
        ("diagnosis.json", outcome.diagnosis.to_json()),
        (REPORT, report::html(&outcome.diagnosis, &outcome.curves)),
    ] {
        let path = out.join(name);
        std::fs::write(&path, content)
            .map_err(|e| Failure::new(format!("{}: cannot be written: {e}", path.display())))?;
    }
    Ok(outcome)
}

/// RMS of the arm's angle against where it was asked to be while the pendulum was balanced (rad).
fn arm_error(log: &Path) -> Result<f64, Failure> {
    let records = furuta_log::read(log)?.records;
    let errors = records
        .iter()
        .filter(|r| r.mode == Mode::Balance)
        .map(|r| r.theta - r.reference);
    let (n, sum) = errors.fold((0_u32, 0.0), |(n, sum), e| (n + 1, sum + e * e));
    Ok((sum / f64::from(n)).sqrt())
}

fn fly<P: Pilot>(
    session: &mut Wired,
    pilot: &P,
    controller: String,
    sheet: &Rig,
    (name, seconds): (&str, f64),
    out: &Path,
    say: &impl Fn(&str),
) -> Result<PathBuf, Failure> {
    say(&format!(
        "{name}, {seconds:.0} s in real time: {controller}"
    ));
    let path = out.join(format!("{name}.mcap"));
    let settings = LoopSettings {
        duration: Duration::from_secs_f64(seconds),
        limits: sheet.limits,
        silence: LoopSettings::SILENCE,
        stop: Some(interrupt::flag()),
    };
    let metadata = metadata(sheet, controller, session);
    let (summary, recorded) = session.run(pilot, &settings, Some((&path, &metadata)))?;
    told(&summary, say)?;
    if let Some(error) = recorded.and_then(|r| r.error) {
        return Err(Failure::from(error));
    }
    Ok(path)
}

fn told(summary: &Summary, say: &impl Fn(&str)) -> Result<(), Failure> {
    for line in text(summary).lines() {
        say(&format!("  {line}"));
    }
    match &summary.end {
        End::Finished => Ok(()),
        End::Stopped => Err(Failure::new("stopped; the logs so far are kept")),
        End::Failed(error) => Err(Failure::from(error)),
    }
}

/// What was found against what was hidden: only the demo can tell.
fn print_findings(diagnosis: &Diagnosis, hidden: &Effect<f64>) {
    for effect in &diagnosis.effects {
        println!("  {} ({})", effect.id, effect.name);
        let same = effect.id == hidden.spec().id;
        for (i, p) in hidden.spec().parameters.iter().enumerate().filter(|_| same) {
            if let (Some(found), Some(value)) =
                (effect.parameters.get(p.name), hidden.values().get(i))
            {
                println!(
                    "    {} = {:.4} +- {:.4} {} (hidden: {value})",
                    p.name, found.value, found.std, p.unit
                );
            }
        }
    }
    let gap = &diagnosis.gap;
    println!(
        "  prediction error over {} s, arm / pendulum [rad]: data sheet {:.4} / {:.4}, recalibrated {:.4} / {:.4}, repaired {:.4} / {:.4}, noise {:.4} / {:.4}",
        gap.horizon,
        gap.nominal.theta,
        gap.nominal.alpha,
        gap.recalibrated.theta,
        gap.recalibrated.alpha,
        gap.augmented.theta,
        gap.augmented.alpha,
        gap.noise_floor.theta,
        gap.noise_floor.alpha,
    );
}
