//! A calibration in words and tables.

use super::parameters::Space;
use super::result::{Calibration, Held, Why};
use super::{EXPLAINED, identifiable::per_cent};
use crate::answer::significant;
use crate::pendulum::Pendulum;
use crate::shooting::Data;

/// A condition number beyond which the parameters are known as a bundle rather than one by one.
const ILL: f64 = 300.0;
/// Errors of two parameters that are correlated by more than this are spoken of.
const CORRELATED: f64 = 0.95;
/// At most this many singular values are printed.
const DIRECTIONS: usize = 12;

/// The keys of all parameters, with commas.
pub(super) fn keys(space: &Space) -> String {
    let keys: Vec<&str> = space.parameters.iter().map(|p| p.key.as_str()).collect();
    keys.join(", ")
}

/// What a person should know of recordings of a part of the rig, `main` recordings first and others beside them.
pub(super) fn of_parts(main: usize, data: &Data) -> Vec<String> {
    let states = data.states();
    let (here, beside) = states.split_at(main.min(states.len()));
    if beside.is_empty() {
        let state = here.first().copied().unwrap_or_default();
        return state.notice().map(str::to_owned).into_iter().collect();
    }
    let count = |state: Pendulum| states.iter().filter(|s| **s == state).count();
    let parts: Vec<String> = Pendulum::ALL
        .into_iter()
        .map(|state| (count(state), state))
        .filter(|(n, _)| *n > 0)
        .map(|(n, state)| format!("{n} {}", state.words()))
        .collect();
    vec![format!(
        "one fit of recordings in several states: {}",
        parts.join(", ")
    )]
}

/// What a person should know of the result.
pub(super) fn notices(c: &Calibration, space: &Space, free: &[usize]) -> Vec<String> {
    let mut out = Vec::new();
    if c.chi > EXPLAINED {
        out.push(format!(
            "the calibrated model is off by {:.2} times the encoders' noise: it lacks something, and the parameters \
             carry what it lacks; `furuta diagnose` names it",
            c.chi
        ));
    }
    for key in &c.fitted {
        let Some(p) = c.parameters.get(key).filter(|p| p.at_bound) else {
            continue;
        };
        let what = match key.as_str() {
            "arm.viscous" => {
                "the back-EMF of the rig file alone damps the arm more than the recordings show: hold arm.viscous and \
                 free motor.back_emf_constant, or mend the motor's constants"
            }
            "pendulum.inertia" => {
                "the pendulum swings faster than a point mass at its centre of mass: pendulum.com is too long in the \
                 rig file, or free it as well"
            }
            _ => {
                "what is held is wrong, or the model lacks something: `furuta diagnose` looks for it"
            }
        };
        out.push(format!(
            "{key} is at the bound of what is physical, {} {}: {what}",
            significant(p.fitted, 3),
            p.unit
        ));
    }
    if space.follows()
        && free
            .iter()
            .any(|&i| space.parameters[i].key == "pendulum.inertia")
    {
        out.push(
            "pendulum.inertia_transverse follows pendulum.inertia, as in a rod; name it with --free to fit it by itself"
                .to_owned(),
        );
    }
    if c.identifiability.condition > ILL {
        out.push(format!(
            "the fitted parameters are known as a bundle (condition number {:.0}): their correlations are large, and \
             the combinations are known far better than each",
            c.identifiability.condition
        ));
    }
    for (a, row) in c.correlation.iter().enumerate() {
        for (b, r) in row.iter().enumerate().take(a) {
            if let Some(r) = r.filter(|r| r.abs() > CORRELATED) {
                out.push(format!(
                    "the errors of {} and {} go together (correlation {r:+.3}): each is known less well than {}",
                    c.fitted[b],
                    c.fitted[a],
                    if r > 0.0 { "their ratio" } else { "their product" }
                ));
            }
        }
    }
    out
}

impl Calibration {
    /// What the recordings can tell, as printed before anything is fitted.
    #[must_use]
    pub fn identifiability_text(&self) -> String {
        let i = &self.identifiability;
        let mut out = format!(
            "What these recordings can tell: {} of {} parameters' combinations show; condition number of the fitted \
             {}: {}\n",
            i.rank,
            i.parameters,
            self.fitted.len(),
            significant(i.condition, 3)
        );
        out += "  known to      combination (exponents of the singular vector; ± one standard deviation)\n";
        for d in i.directions.iter().take(DIRECTIONS) {
            out += &format!("  {:<12}  {}\n", per_cent(d.std), d.words);
        }
        let told = |why: Why| -> Vec<&Held> { i.held.iter().filter(|h| h.why == why).collect() };
        for (why, heading) in [
            (Why::OnlyTogether, "Held, since others do the same:"),
            (Why::TooWeak, "Held, since they show too weakly:"),
            (Why::NoInfluence, "Held, since they do not show:"),
            (Why::NotAsked, "Held, since not asked for:"),
        ] {
            let held = told(why);
            if held.is_empty() {
                continue;
            }
            out += heading;
            out.push('\n');
            for h in held {
                out += &format!("  {}\n", h.sentence);
            }
        }
        out
    }

    /// The calibration for a person: what can be told, the parameters with their 95 % intervals, the ratios, how well
    /// the model follows.
    #[must_use]
    pub fn summary(&self) -> String {
        let mut out = self.identifiability_text();
        out += &format!(
            "\n{:<34} {:>11} {:>11} {:>9}   {:<26} unit\n",
            "fitted", "rig file", "calibrated", "std", "95 % interval"
        );
        for key in &self.fitted {
            let Some(p) = self.parameters.get(key) else {
                continue;
            };
            let interval = match p.interval {
                Some([low, high]) => {
                    format!("[{}, {}]", significant(low, 4), significant(high, 4))
                }
                None if p.at_bound => "at its bound".to_owned(),
                None => "unknown".to_owned(),
            };
            let std = if p.std.is_finite() {
                format!("{:.2} %", 100.0 * p.std / p.fitted.abs())
            } else {
                "-".to_owned()
            };
            out += &format!(
                "  {key:<32} {:>11} {:>11} {std:>9}   {interval:<26} {}\n",
                significant(p.nominal, 4),
                significant(p.fitted, 4),
                if p.unit == "1" { "" } else { &p.unit }
            );
        }
        if !self.combinations.is_empty() {
            out += &format!(
                "\n{:<34} {:>11} {:>11} {:>9}   formula [unit]\n",
                "whatever is held is right or not", "rig file", "calibrated", "std"
            );
        }
        for r in &self.combinations {
            let std = if r.std.is_finite() {
                format!("{:.2} %", 100.0 * r.std / r.fitted.abs())
            } else {
                "-".to_owned()
            };
            out += &format!(
                "  {:<32} {:>11} {:>11} {std:>9}   {} [{}]\n",
                r.name,
                significant(r.nominal, 4),
                significant(r.fitted, 4),
                r.formula,
                r.unit
            );
        }
        out += &format!(
            "\n{:<34} {:>11} {:>11} {:>11} {:>8}\n",
            format!("RMS error over {} s at most [rad]", self.horizon),
            "rig file",
            "calibrated",
            "noise",
            "fit"
        );
        for f in &self.fit {
            out += &format!(
                "  {:<24} {:<7} {:>11.6} {:>11.6} {:>11.6} {:>6.1} %\n",
                f.run, f.channel, f.nominal, f.calibrated, f.noise_floor, f.fit_percent
            );
        }
        for p in &self.profiles {
            let side = |x: Option<f64>| x.map_or("open".to_owned(), |x| significant(x, 4));
            out += &format!(
                "profile of {}: 95 % interval [{}, {}] {}\n",
                p.key,
                side(p.interval[0]),
                side(p.interval[1]),
                p.unit
            );
        }
        for notice in &self.notices {
            out += &format!("note: {notice}\n");
        }
        if let Some(v) = &self.verification {
            for (words, judged) in [("as given", &v.as_given), ("calibrated", &v.calibrated)] {
                out += &format!("\nUnseen recordings, rig file {words}\n");
                out += &judged.summary();
            }
        }
        out + &format!("\n{:.2} s\n", self.seconds)
    }
}
