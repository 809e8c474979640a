//! Charts that need no script: SVG drawn here, coloured by the page's style.

use core::fmt::Write as _;

use super::escape;
use crate::calibrate::result::Profile;
use crate::diagnose::result::{CandidateEvidence, Channel, Gap, GapBar, significant};

/// Width of the full charts, and of the one beside a table.
const WIDTH: f64 = 960.0;
const HALF: f64 = 500.0;

/// A logarithmic axis from decade to decade, or the smallest part of one that holds all values.
struct Logarithmic {
    low: f64,
    high: f64,
    from: f64,
    to: f64,
}

impl Logarithmic {
    fn over(values: impl Iterator<Item = f64>, from: f64, to: f64) -> Option<Self> {
        let usable = values
            .filter(|value| value.is_finite() && *value > 0.0)
            .map(f64::log10);
        let (low, high) = usable.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(value), high.max(value))
        });
        (low <= high).then(|| Self {
            low: (low - 0.12).floor(),
            high: (high + 0.12).ceil(),
            from,
            to,
        })
    }

    fn at(&self, value: f64) -> f64 {
        let share = (value.log10() - self.low) / (self.high - self.low);
        self.from + share.clamp(0.0, 1.0) * (self.to - self.from)
    }

    fn decades(&self) -> impl Iterator<Item = f64> {
        (self.low as i32..=self.high as i32).map(|exponent| 10_f64.powi(exponent))
    }
}

/// The error of prediction by model, one row per angle, on a logarithmic axis down to the noise floor.
pub(super) fn ladder(gap: &Gap) -> String {
    let models = [
        ("nominal", gap.nominal),
        ("before", gap.recalibrated),
        ("after", gap.augmented),
        ("floor", gap.noise_floor),
    ];
    let Some(axis) = Logarithmic::over(
        models
            .iter()
            .flat_map(|(_, errors)| [errors.theta, errors.alpha]),
        84.0,
        HALF - 24.0,
    ) else {
        return String::new();
    };
    let mut svg = String::new();
    let (top, bottom) = (14.0, 128.0);
    for decade in axis.decades() {
        let x = axis.at(decade);
        let _ = write!(
            svg,
            "<line class=\"grid\" x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"{top}\" y2=\"{bottom}\"/><text class=\"soft small\" \
             x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{} rad</text>",
            bottom + 17.0,
            power_of_ten(decade)
        );
    }
    for (channel, y) in Channel::ALL.into_iter().zip([44.0, 98.0]) {
        let _ = write!(
            svg,
            r#"<text x="0" y="{:.1}" class="strong">{}</text>"#,
            y + 4.5,
            channel.part()
        );
        let floor = gap.noise_floor.get(channel);
        if floor > 0.0 {
            let x = axis.at(floor);
            let _ = write!(
                svg,
                r#"<line class="floorline" x1="{x:.1}" x2="{x:.1}" y1="{:.1}" y2="{:.1}"/>"#,
                y - 18.0,
                y + 18.0
            );
        }
        let known: Vec<(&str, f64)> = models
            .iter()
            .take(3)
            .map(|(class, errors)| (*class, errors.get(channel)))
            .filter(|(_, error)| *error > 0.0 && error.is_finite())
            .collect();
        if let [(_, first), .., (_, last)] = known.as_slice() {
            let _ = write!(
                svg,
                r#"<line class="axis" x1="{:.1}" x2="{:.1}" y1="{y}" y2="{y}" stroke-width="2"/>"#,
                axis.at(*first),
                axis.at(*last)
            );
        }
        for (class, error) in known {
            let _ = write!(
                svg,
                r#"<circle class="{class}" cx="{:.1}" cy="{y}" r="6.5"><title>{} rad</title></circle>"#,
                axis.at(error),
                significant(error, 3)
            );
        }
    }
    figure(
        "RMS error of prediction by model, logarithmic",
        [HALF, 152.0],
        &svg,
    )
}

/// Bars by condition, before and after, as multiples of the noise floor.
pub(super) fn gap_bars(bars: &[GapBar]) -> String {
    // Errors are mean squares in units of the floor's; a person thinks in amplitudes.
    let times = |share: f64| {
        if share.is_finite() {
            share.max(0.0).sqrt()
        } else {
            0.0
        }
    };
    let largest = bars
        .iter()
        .flat_map(|bar| [times(bar.recalibrated), times(bar.augmented)])
        .fold(1.0, f64::max);
    let (from, to) = (250.0, WIDTH - 92.0);
    let at = |times: f64| from + times / largest * (to - from);
    let mut svg = String::new();
    let mut y = 4.0;
    let mut heading = None;
    for bar in bars {
        if heading != Some((&bar.group, bar.channel)) {
            heading = Some((&bar.group, bar.channel));
            y += 14.0;
            let _ = write!(
                svg,
                r#"<text class="strong" x="0" y="{:.1}">The {}'s error, by {}</text>"#,
                y + 10.0,
                bar.channel.part(),
                escape(&bar.group)
            );
            y += 20.0;
        }
        let (before, after) = (times(bar.recalibrated), times(bar.augmented));
        let samples = if bar.share_of_samples.is_finite() {
            format!("{:.0} % of samples", 100.0 * bar.share_of_samples)
        } else {
            String::new()
        };
        let _ = write!(
            svg,
            r#"<text class="mono" x="0" y="{:.1}">{}<title>{samples}</title></text>"#,
            y + 14.0,
            escape(&bar.condition)
        );
        for (class, times, dy) in [("before", before, 2.0), ("after", after, 11.0)] {
            let _ = write!(
                svg,
                "<rect class=\"{class}\" x=\"{from}\" y=\"{:.1}\" width=\"{:.1}\" height=\"8\" rx=\"2\"><title>{} \
                 times the noise floor; {samples}</title></rect>",
                y + dy,
                (at(times) - from).max(1.0),
                significant(times, 3)
            );
        }
        let _ = write!(
            svg,
            r#"<text class="soft small" x="{:.1}" y="{:.1}">{} → {}</text>"#,
            at(before.max(after)) + 8.0,
            y + 14.5,
            significant(before, 2),
            significant(after, 2)
        );
        y += 25.0;
    }
    let x = at(1.0);
    let floor = format!(r#"<line class="floorline" x1="{x:.1}" x2="{x:.1}" y1="14" y2="{y:.1}"/>"#);
    figure(
        "error by condition, in multiples of the noise floor, before and after",
        [WIDTH, y + 6.0],
        &(floor + &svg),
    )
}

/// All candidates by evidence, on a logarithmic axis; those that make things worse have no bar.
pub(super) fn evidence(candidates: &[CandidateEvidence]) -> String {
    let mut sorted: Vec<&CandidateEvidence> = candidates.iter().collect();
    // What could not be evaluated comes last.
    let order = |bic: f64| if bic.is_nan() { f64::NEG_INFINITY } else { bic };
    sorted.sort_by(|a, b| order(b.delta_bic).total_cmp(&order(a.delta_bic)));
    let (from, to) = (196.0, WIDTH - 84.0);
    let largest = sorted
        .iter()
        .map(|candidate| candidate.delta_bic)
        .filter(|bic| bic.is_finite())
        .fold(10.0, f64::max);
    let decades = largest.log10().ceil();
    let at = |bic: f64| from + (bic.max(1.0).log10() / decades).min(1.0) * (to - from);
    let rows = sorted.len() as f64;
    let (top, row_height) = (28.0, 24.0);
    let bottom = top + row_height * rows;
    let mut svg = String::new();
    for exponent in 0..=decades as i32 {
        let (x, tick) = (
            at(10_f64.powi(exponent)),
            power_of_ten(10_f64.powi(exponent)),
        );
        let _ = write!(
            svg,
            "<line class=\"grid\" x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"{top}\" y2=\"{bottom:.1}\"/><text class=\"soft \
             small\" x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{tick}</text>",
            bottom + 16.0
        );
    }
    for (row, candidate) in sorted.iter().enumerate() {
        let y = top + row_height * row as f64;
        let (class, weight) = if candidate.named {
            ("after", " strong")
        } else {
            ("other", "")
        };
        let bic = if candidate.delta_bic.is_finite() {
            format!("{:.0}", candidate.delta_bic)
        } else {
            "–".into()
        };
        let _ = write!(
            svg,
            "<text class=\"mono{weight}\" x=\"0\" y=\"{:.1}\">{}</text><rect class=\"{class}\" x=\"{from}\" \
             y=\"{:.1}\" width=\"{:.1}\" height=\"13\" rx=\"3\"/><text class=\"small{weight}\" x=\"{WIDTH}\" \
             y=\"{:.1}\" text-anchor=\"end\">{bic}</text>",
            y + 13.0,
            escape(&candidate.id),
            y + 3.0,
            if candidate.delta_bic > 1.0 {
                (at(candidate.delta_bic) - from).max(1.0)
            } else {
                1.0
            },
            y + 13.0
        );
    }
    let heading = format!(
        r#"<text class="soft small" x="{WIDTH}" y="{:.1}" text-anchor="end">evidence</text>"#,
        top - 12.0
    );
    figure(
        "evidence for each candidate, logarithmic",
        [WIDTH, bottom + 24.0],
        &(svg + &heading),
    )
}

/// The rise of the cost along one parameter, with the line that bounds the 95 % interval.
pub(super) fn profile(profile: &Profile) -> String {
    /// Of chi² with one degree of freedom.
    const BOUND: f64 = 3.841;
    const HIGHEST: f64 = 10.0;
    let (Some(&low), Some(&high)) = (profile.values.first(), profile.values.last()) else {
        return String::new();
    };
    let (top, bottom, from, to) = (10.0, 200.0, 40.0, HALF - 14.0);
    let x = |v: f64| from + (v - low) / (high - low).max(1e-300) * (to - from);
    let y = |r: f64| bottom - r.clamp(0.0, HIGHEST) / HIGHEST * (bottom - top);
    let mut svg = format!(
        "<line class=\"floorline\" x1=\"{from}\" x2=\"{to}\" y1=\"{0:.1}\" y2=\"{0:.1}\"/><text class=\"soft small\" \
         x=\"0\" y=\"{1:.1}\">95 %</text><line class=\"axis\" x1=\"{from}\" x2=\"{to}\" y1=\"{bottom}\" \
         y2=\"{bottom}\"/>",
        y(BOUND),
        y(BOUND) + 4.0
    );
    let mut path = String::new();
    for (v, r) in profile.values.iter().zip(&profile.rise) {
        let _ = write!(path, "{:.1},{:.1} ", x(*v), y(*r));
        let _ = write!(
            svg,
            r#"<circle class="after" cx="{:.1}" cy="{:.1}" r="3.5"><title>{} {}: +{}</title></circle>"#,
            x(*v),
            y(*r),
            significant(*v, 4),
            escape(&profile.unit),
            significant(*r, 3)
        );
    }
    let _ = write!(svg, r#"<polyline class="after" points="{path}"/>"#);
    for (v, anchor) in [(low, "start"), (high, "end")] {
        let _ = write!(
            svg,
            r#"<text class="soft small" x="{:.1}" y="{:.1}" text-anchor="{anchor}">{}</text>"#,
            x(v),
            bottom + 17.0,
            significant(v, 3)
        );
    }
    figure(
        "rise of the cost along the parameter, all others fitted anew",
        [HALF, bottom + 24.0],
        &svg,
    )
}

fn power_of_ten(value: f64) -> String {
    match value.log10().round() as i32 {
        exponent @ -3..=-1 => format!("{value:.*}", exponent.unsigned_abs() as usize),
        exponent @ 0..=4 => format!("{}", 10_u32.pow(exponent.unsigned_abs())),
        exponent => format!("1e{exponent}"),
    }
}

pub(super) fn figure(label: &str, [width, height]: [f64; 2], content: &str) -> String {
    format!(
        "<svg viewBox=\"0 0 {width:.0} {height:.0}\" style=\"max-width:{width:.0}px\" role=\"img\" \
         aria-label=\"{label}\">{content}</svg>"
    )
}
