//! The section on the torque that is missing: against each state and over time.

use core::fmt::Write as _;

use super::charts::figure;
use super::escape;
use crate::diagnose::result::{
    Channel, Curves, Diagnosis, TorqueByState, TorqueInTime, significant,
};

const WIDTH: f64 = 960.0;
/// Height of one panel, and of the numbers below it.
const PANEL: f64 = 120.0;
const BELOW: f64 = 34.0;
/// Margins beside and above the panels.
const LEFT: f64 = 52.0;
const TOP: f64 = 30.0;
/// A curve over time has at most this many points.
const POINTS: usize = 700;

pub(super) fn section(diagnosis: &Diagnosis, curves: &Curves) -> String {
    if curves.torque_by_state.is_empty() {
        return String::new();
    }
    let told: String = diagnosis
        .missing_torque
        .iter()
        .map(|t| format!("<li>{}</li>", escape(&t.sentence())))
        .collect();
    let told = if told.is_empty() {
        String::new()
    } else {
        format!("<ul>{told}</ul>")
    };
    let by_state: String = Channel::ALL
        .into_iter()
        .map(|axis| panels(axis, &curves.torque_by_state))
        .collect();
    let in_time: String = Channel::ALL
        .into_iter()
        .enumerate()
        .map(|(c, axis)| course(c, axis, &curves.torque_in_time))
        .collect();
    format!(
        "<section><h2>The torque that is missing</h2><p class=\"lead\">What would have to push on arm and pendulum \
         beside the model for it to follow the recordings: \
         against one state after the other, and over time.</p>{told}<div class=\"card\"><div class=\"legend\"><span \
         class=\"key\"><i class=\"before\"></i>refitted</span>\
         <span class=\"key\"><i class=\"after\"></i>repaired</span></div>{by_state}<p class=\"note\">mN m, with 95 % \
         intervals; between two points lie equally many samples; \
         a friction is a step at speed zero, a spring a line over the angle, a dead zone a kink over the \
         command.</p></div><div class=\"card\">{in_time}\
         <p class=\"note\">mN m over time in the recording that lacks most, with the 95 % band of the refitted model: \
         the most likely smooth course.</p></div></section>\n"
    )
}

/// Values from `low` to `high` onto a stretch of the picture.
#[derive(Clone, Copy)]
struct Scale {
    low: f64,
    high: f64,
    from: f64,
    to: f64,
}

impl Scale {
    /// Torques up to `most` mN m either way over the height of a panel.
    fn torque(most: f64) -> Self {
        Self {
            low: -most,
            high: most,
            from: TOP + PANEL,
            to: TOP,
        }
    }

    fn at(&self, value: f64) -> f64 {
        let share = (value - self.low) / (self.high - self.low);
        self.from + share.clamp(-0.02, 1.02) * (self.to - self.from)
    }
}

/// The numbers beside a panel.
fn ticks(y: &Scale) -> String {
    let tick = |value: f64| {
        format!(
            r#"<text class="soft small" x="{:.1}" y="{:.1}" text-anchor="end">{}</text>"#,
            LEFT - 6.0,
            y.at(value) + 4.0,
            significant(value, 2)
        )
    };
    [y.low, 0.0, y.high].map(tick).concat()
}

/// The larger of what is in `values` and `least`, in mN m.
fn largest(values: impl Iterator<Item = f64>) -> f64 {
    let most = values
        .filter(|v| v.is_finite())
        .fold(0.0, |m: f64, v| m.max(v.abs()));
    if most > 0.0 { 1e3 * most } else { 1.0 }
}

/// One axis' torque against every state, side by side on one scale.
fn panels(axis: Channel, all: &[TorqueByState]) -> String {
    let shown: Vec<&TorqueByState> = all.iter().filter(|t| t.axis == axis).collect();
    if shown.is_empty() {
        return String::new();
    }
    let most = largest(shown.iter().flat_map(|t| {
        let band = |v: &[f64], s: &[f64]| -> Vec<f64> {
            v.iter().zip(s).map(|(v, s)| v.abs() + s).collect()
        };
        let mut all = band(&t.recalibrated, &t.recalibrated_std);
        all.extend(band(&t.augmented, &t.augmented_std));
        all
    }));
    let width = (WIDTH - LEFT) / shown.len() as f64;
    let y = Scale::torque(most);
    let mut svg = format!(
        r#"<text class="strong" x="0" y="14">Torque missing on the {}</text>"#,
        axis.part()
    );
    svg += &ticks(&y);
    for (k, t) in shown.into_iter().enumerate() {
        let (Some(first), Some(last)) = (t.at.first(), t.at.last()) else {
            continue;
        };
        let from = LEFT + k as f64 * width + 6.0;
        let to = from + width - 18.0;
        let x = Scale {
            low: *first,
            high: if last > first { *last } else { first + 1.0 },
            from: from + 5.0,
            to: to - 5.0,
        };
        let _ = write!(
            svg,
            "<line class=\"axis\" x1=\"{from:.1}\" x2=\"{to:.1}\" y1=\"{0:.1}\" y2=\"{0:.1}\"/><text class=\"mono \
             small\" x=\"{1:.1}\" y=\"{2:.1}\" text-anchor=\"middle\">{3} [{4}]</text><text class=\"soft small\" \
             x=\"{from:.1}\" y=\"{5:.1}\">{6}</text><text class=\"soft small\" x=\"{to:.1}\" y=\"{5:.1}\" \
             text-anchor=\"end\">{7}</text>",
            y.at(0.0),
            0.5 * (from + to),
            TOP + PANEL + 30.0,
            escape(&t.state),
            escape(&t.unit),
            TOP + PANEL + 15.0,
            significant(*first, 2),
            significant(*last, 2)
        );
        if x.low < 0.0 && x.high > 0.0 {
            let zero = x.at(0.0);
            let _ = write!(
                svg,
                r#"<line class="grid" x1="{zero:.1}" x2="{zero:.1}" y1="{TOP}" y2="{:.1}"/>"#,
                TOP + PANEL
            );
        }
        for (class, values, deviations) in [
            ("before", &t.recalibrated, &t.recalibrated_std),
            ("after", &t.augmented, &t.augmented_std),
        ] {
            let line: Vec<String> = (t.at.iter().zip(values))
                .map(|(at, value)| format!("{:.1},{:.1}", x.at(*at), y.at(1e3 * value)))
                .collect();
            let _ = write!(
                svg,
                r#"<polyline class="line {class}" points="{}"/>"#,
                line.join(" ")
            );
            for ((at, value), std) in t.at.iter().zip(values).zip(deviations) {
                let (at, low, high) = (
                    x.at(*at),
                    y.at(1e3 * (value - 1.96 * std)),
                    y.at(1e3 * (value + 1.96 * std)),
                );
                let _ = write!(
                    svg,
                    "<rect class=\"{class}\" x=\"{:.1}\" y=\"{high:.1}\" width=\"1\" height=\"{:.1}\"/><circle \
                     class=\"{class}\" cx=\"{at:.1}\" cy=\"{:.1}\" r=\"2.5\"/>",
                    at - 0.5,
                    (low - high).max(0.5),
                    y.at(1e3 * value)
                );
            }
        }
    }
    figure(
        &format!("torque missing on the {}, against each state", axis.part()),
        [WIDTH, TOP + PANEL + BELOW],
        &svg,
    )
}

/// One axis' torque over time, in the run that lacks most on it.
fn course(c: usize, axis: Channel, runs: &[TorqueInTime]) -> String {
    let power = |t: &TorqueInTime| t.recalibrated[c].iter().map(|v| v * v).sum::<f64>();
    let Some(run) = runs
        .iter()
        .filter(|r| r.t.len() > 1)
        .max_by(|a, b| power(a).total_cmp(&power(b)))
    else {
        return String::new();
    };
    let most = largest(run.recalibrated[c].iter().chain(&run.augmented[c]).copied());
    let stride = run.t.len().div_ceil(POINTS);
    let x = Scale {
        low: run.t[0],
        high: run.t[run.t.len() - 1],
        from: LEFT,
        to: WIDTH,
    };
    let y = Scale::torque(most);
    let points = |value: &dyn Fn(usize) -> f64| -> Vec<String> {
        (0..run.t.len())
            .step_by(stride)
            .filter(|k| value(*k).is_finite())
            .map(|k| format!("{:.1},{:.1}", x.at(run.t[k]), y.at(1e3 * value(k))))
            .collect()
    };
    let (values, std) = (&run.recalibrated[c], &run.recalibrated_std[c]);
    let mut band = points(&|k| values[k] + 1.96 * std[k]);
    let mut lower = points(&|k| values[k] - 1.96 * std[k]);
    lower.reverse();
    band.append(&mut lower);
    let mut svg = format!(
        "<text class=\"strong\" x=\"0\" y=\"14\">Torque missing on the {}, {}</text><line class=\"axis\" x1=\"{LEFT}\" \
         x2=\"{WIDTH}\" y1=\"{zero:.1}\" y2=\"{zero:.1}\"/><polygon class=\"band\" points=\"{}\"/>",
        axis.part(),
        escape(&run.run),
        band.join(" "),
        zero = y.at(0.0),
    );
    for (class, values) in [
        ("before", &run.recalibrated[c]),
        ("after", &run.augmented[c]),
    ] {
        let _ = write!(
            svg,
            r#"<polyline class="line {class}" points="{}"/>"#,
            points(&|k| values.get(k).copied().unwrap_or(f64::NAN)).join(" ")
        );
    }
    svg += &ticks(&y);
    for (at, anchor) in [(x.low, "start"), (x.high, "end")] {
        let _ = write!(
            svg,
            r#"<text class="soft small" x="{:.1}" y="{:.1}" text-anchor="{anchor}">{} s</text>"#,
            x.at(at),
            TOP + PANEL + 16.0,
            significant(at, 2)
        );
    }
    figure(
        &format!("torque missing on the {}, over time", axis.part()),
        [WIDTH, TOP + PANEL + 22.0],
        &svg,
    )
}
