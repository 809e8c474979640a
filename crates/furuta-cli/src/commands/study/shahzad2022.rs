//! `furuta study shahzad2022`: arm steps and a push.

use std::io::Write;

use furuta_chart::{Chart, Line, Panel};
use furuta_design::closed_loop::Sample;
use furuta_design::shahzad2022::{Figures, On, Settings, Task, figures, gain, run as experiment};
use furuta_model::Rig;
use serde_json::json;

use crate::failure::Failure;
use crate::outputs::{self, Output};
use crate::print::significant;
use crate::streams;

/// Shahzad, Munshi, Azam, Khan 2022: the LQR of Q = I, R = 1 holds the pendulum while the arm's reference steps by 0.1
/// rad, and when the pendulum is pushed. 10 s from rest, on the paper's linear model, on the nonlinear one, and on that
/// with encoders and friction.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// What happens; everything if not given.
    #[arg(long, value_enum)]
    task: Option<Experiment>,
    /// Draw the task: arm, pendulum, command (SVG).
    #[arg(long, value_name = "OUT.svg", requires = "task", value_parser = outputs::picture())]
    plot: Option<Output>,
    /// Built-in rig or rig file.
    #[arg(long, value_name = "RIG", default_value = "shahzad2022-srv02")]
    rig: String,
    /// Print one line of JSON in place of text.
    #[arg(long)]
    json: bool,
}

#[derive(clap::ValueEnum, Copy, Clone, Debug)]
enum Experiment {
    /// Fig. 3: one step of the arm, after a second.
    Step,
    /// Fig. 5 and 6: a step every second, there and back.
    Steps,
    /// The pendulum is pushed.
    Push,
    /// All three.
    All,
}

impl Experiment {
    fn tasks(self) -> &'static [Task] {
        match self {
            Self::Step => &[Task::Step],
            Self::Steps => &[Task::Steps],
            Self::Push => &[Task::Push],
            Self::All => &Task::ALL,
        }
    }
}

const fn name(task: Task) -> &'static str {
    match task {
        Task::Step => "step",
        Task::Steps => "steps",
        Task::Push => "push",
    }
}

/// On what a task is looked at: the effect that pushes acts in the nonlinear model alone.
fn models(task: Task) -> &'static [On] {
    match task {
        Task::Step | Task::Steps => &On::ALL,
        Task::Push => &[On::Nonlinear, On::Rig],
    }
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let rig = Rig::load(&args.rig)?;
    let settings = Settings::default();
    let mut rows = Vec::new();
    for &task in args.task.unwrap_or(Experiment::All).tasks() {
        let mut runs = Vec::new();
        for &on in models(task) {
            let samples = experiment(&rig, task, on, &settings)
                .map_err(|e| Failure::new(format!("rig {}: {e}", rig.name)))?;
            rows.push((task, on, figures(task, &samples)));
            runs.push((on, samples));
        }
        if let Some(path) = &args.plot {
            path.write(chart(task, &runs).svg());
        }
    }
    let gain = gain(&rig)?;
    let mut out = streams::output();
    if args.json {
        let runs: Vec<_> = rows
            .iter()
            .map(|(task, on, f)| {
                json!({
                    "task": name(*task), "on": on.name(), "settle": f.settle, "overshoot": f.overshoot,
                    "undershoot": f.undershoot,
                    "alpha_max": f.alpha, "theta_error_max": f.theta, "u_max": f.command, "effort": f.effort,
                    "up": f.up,
                })
            })
            .collect();
        return Ok(writeln!(
            out,
            "{}",
            json!({"rig": rig.name, "k": gain, "runs": runs})
        )?);
    }
    out.write_all(text(&rig, gain, &rows).as_bytes())?;
    Ok(())
}

fn text(rig: &Rig, gain: [f64; 4], rows: &[(Task, On, Figures)]) -> String {
    let mut text = format!(
        "{}: K = [{}] on theta, alpha, theta_dot, alpha_dot (LQR, Q = I, R = 1)\n",
        rig.name,
        gain.map(significant).join(", ")
    );
    text += "  task   model               settle  overshoot  undershoot   pendulum        arm    command    effort\n";
    text += "                                s          %           %        rad        rad          V      V^2 s\n";
    for (task, on, f) in rows {
        let settle = f
            .settle
            .map_or_else(|| "-".to_owned(), |s| format!("{s:.2}"));
        let percent = |x: f64| match task {
            Task::Step => format!("{:.1}", 100.0 * x),
            Task::Steps | Task::Push => "-".to_owned(),
        };
        text += &format!(
            "  {:5}  {:18}  {settle:>6} {:>10} {:>11} {:>10.4} {:>10.4} {:>10.3} {:>10.5}{}\n",
            name(*task),
            on.name(),
            percent(f.overshoot),
            percent(f.undershoot),
            f.alpha,
            f.theta,
            f.command,
            f.effort,
            if f.up { "" } else { "  fell" }
        );
    }
    text += "settle: the arm stays within 2 % of the step (push: of its largest deflection); -: not before \
        the next step, or not at all\n";
    text += "pendulum, arm, command: largest angle from upright, from the reference, largest voltage; \
        effort: integral of its square\n";
    text
}

fn chart(task: Task, runs: &[(On, Vec<Sample>)]) -> Chart {
    let degrees = f64::to_degrees(1.0);
    let line = |value: fn(&Sample) -> f64, scale: f64| -> Vec<Line> {
        runs.iter()
            .enumerate()
            .map(|(k, (on, samples))| {
                let line = Line::new(on.name(), samples.iter().map(|s| (s.t, scale * value(s))));
                // The linear model lies under the nonlinear one: dashed above it, both are seen.
                let colour = match on {
                    On::Linear => 1,
                    On::Nonlinear => 0,
                    On::Rig => 2,
                };
                let line = line.colour(colour);
                if k == 0 && *on == On::Linear {
                    line.dashed()
                } else {
                    line
                }
            })
            .rev()
            .collect()
    };
    let mut arm = line(|s| s.x.theta, degrees);
    if let Some((_, samples)) = runs.first() {
        let reference = samples.iter().map(|s| (s.t, degrees * s.reference.theta));
        arm.insert(0, Line::new("reference", reference).colour(6));
    }
    let title = match task {
        Task::Step => "Shahzad et al. 2022, Fig. 3: the arm steps by 5.7 degrees",
        Task::Steps => "Shahzad et al. 2022, Fig. 5 and 6: a step every second",
        Task::Push => "Shahzad et al. 2022: the pendulum is pushed",
    };
    Chart::new(
        title,
        "t [s]",
        vec![
            Panel::new("arm [deg]", arm),
            Panel::new("pendulum [deg]", line(|s| s.x.alpha, degrees)),
            Panel::new("command [V]", line(|s| s.u, 1.0)),
        ],
    )
}
