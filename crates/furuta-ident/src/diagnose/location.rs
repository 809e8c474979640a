//! Where the gap sits: by run, arm speed, direction, command and time.

use super::result::{GapBar, GapShare};
use crate::answer::Channel;
use crate::shooting::{Data, Run};

/// Squared prediction errors of one sample, in units of the noise.
pub(super) struct Residual {
    pub(super) run: usize,
    pub(super) sample: usize,
    pub(super) refitted: [f64; 2],
    pub(super) repaired: [f64; 2],
}

type Test = Box<dyn Fn(&Run, usize) -> bool>;

/// A condition on a sample, and the heading it stands under.
struct Condition {
    group: &'static str,
    text: String,
    holds: Test,
}

fn condition(
    group: &'static str,
    text: String,
    holds: impl Fn(&Run, usize) -> bool + 'static,
) -> Condition {
    Condition {
        group,
        text,
        holds: Box::new(holds),
    }
}

/// The conditions, with limits taken from the data: a third of the samples lie below the lower, a third above the
/// higher one.
/// `unit` is the command's.
fn conditions(data: &Data, unit: &'static str) -> Vec<Condition> {
    let thirds = |value: &dyn Fn(&Run, usize) -> f64| {
        let mut all: Vec<f64> = data
            .runs
            .iter()
            .flat_map(|r| (0..r.y.len()).map(|k| value(r, k)))
            .collect();
        all.sort_by(f64::total_cmp);
        [round(all[all.len() / 3]), round(all[all.len() * 2 / 3])]
    };
    let mut out = Vec::new();
    for (group, symbol, unit, value) in [
        (
            "arm speed",
            "theta_dot",
            "rad/s",
            arm_speed as fn(&Run, usize) -> f64,
        ),
        ("pendulum speed", "alpha_dot", "rad/s", pendulum_speed),
        ("command", "u", unit, command),
    ] {
        let [low, high] = thirds(&move |r, k| value(r, k).abs());
        if !(low > 0.0 && high > low) {
            continue;
        }
        out.push(condition(
            group,
            format!("abs({symbol}) < {low} {unit}"),
            move |r, k| value(r, k).abs() < low,
        ));
        out.push(condition(
            group,
            format!("{low} <= abs({symbol}) < {high} {unit}"),
            move |r, k| (low..high).contains(&value(r, k).abs()),
        ));
        out.push(condition(
            group,
            format!("abs({symbol}) >= {high} {unit}"),
            move |r, k| value(r, k).abs() >= high,
        ));
    }
    out.push(condition(
        "arm direction",
        "theta_dot < 0".into(),
        |r, k| r.speed[k][0] < 0.0,
    ));
    out.push(condition(
        "arm direction",
        "theta_dot >= 0".into(),
        |r, k| r.speed[k][0] >= 0.0,
    ));
    out.push(condition("time", "first half of the run".into(), |r, k| {
        2 * k < r.y.len()
    }));
    out.push(condition(
        "time",
        "second half of the run".into(),
        |r, k| 2 * k >= r.y.len(),
    ));
    for run in &data.runs {
        let name = run.name.clone();
        if out.iter().all(|c| c.text != name) {
            out.push(condition("run", name.clone(), move |r, _| r.name == name));
        }
    }
    out
}

fn arm_speed(r: &Run, k: usize) -> f64 {
    r.speed[k][0]
}

fn pendulum_speed(r: &Run, k: usize) -> f64 {
    r.speed[k][1]
}

fn command(r: &Run, k: usize) -> f64 {
    r.u[k]
}

/// To two significant digits: a limit that a person can read.
fn round(x: f64) -> f64 {
    if x == 0.0 || !x.is_finite() {
        return x;
    }
    let unit = 10.0_f64.powf(x.abs().log10().floor() - 1.0);
    let rounded = (x / unit).round() * unit;
    format!("{rounded:.6}").parse().unwrap_or(rounded)
}

/// The bars of the report, and the conditions that hold more of the gap than their share of the samples.
/// `unit` is the command's.
pub(super) fn locate(
    data: &Data,
    residuals: &[Residual],
    unit: &'static str,
) -> (Vec<GapBar>, Vec<GapShare>) {
    let (mut bars, mut shares) = (Vec::new(), Vec::new());
    let total: [f64; 2] = std::array::from_fn(|c| residuals.iter().map(|r| r.refitted[c]).sum());
    for condition in conditions(data, unit) {
        let inside: Vec<&Residual> = residuals
            .iter()
            .filter(|r| (condition.holds)(&data.runs[r.run], r.sample))
            .collect();
        if inside.is_empty() || inside.len() == residuals.len() {
            continue;
        }
        let count = inside.len() as f64;
        let share_of_samples = count / residuals.len() as f64;
        for (c, channel) in Channel::ALL.into_iter().enumerate() {
            let sum: f64 = inside.iter().map(|r| r.refitted[c]).sum();
            let after: f64 = inside.iter().map(|r| r.repaired[c]).sum();
            bars.push(GapBar {
                channel,
                group: condition.group.into(),
                condition: condition.text.clone(),
                share_of_samples,
                recalibrated: sum / count,
                augmented: after / count,
            });
            let share = sum / total[c].max(1e-300);
            // Told where the angle is wrong at all, and more here than elsewhere.
            if total[c] > 1.5 * residuals.len() as f64
                && share > 0.4
                && share > 1.3 * share_of_samples
            {
                let (run, text) = if condition.group == "run" {
                    (condition.text.clone(), "whole run".to_owned())
                } else {
                    ("all".to_owned(), condition.text.clone())
                };
                shares.push(GapShare {
                    run,
                    channel,
                    condition: text,
                    share_of_gap: share,
                });
            }
        }
    }
    // Bars under one heading belong together; the sort is stable, so conditions keep their order.
    let groups: Vec<String> = bars.iter().map(|b: &GapBar| b.group.clone()).collect();
    let rank = |b: &GapBar| groups.iter().position(|g| *g == b.group);
    bars.sort_by_key(|b| (rank(b), b.channel));
    shares.sort_by(|a, b| b.share_of_gap.total_cmp(&a.share_of_gap));
    shares.truncate(8);
    (bars, shares)
}
