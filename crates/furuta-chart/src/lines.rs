//! Line charts: panels one below the other over one horizontal axis.

use std::fmt::Write as _;

use crate::axis::{Axis, escaped, number_text};

/// A picture: panels over one another.
///
/// ```
/// use furuta_chart::{Chart, Line, Panel};
/// let line = Line::new("sine", (0..100).map(|k| (f64::from(k), (f64::from(k) * 0.1).sin())));
/// let svg = Chart::new("A sine", "t [s]", vec![Panel::new("y [rad]", vec![line])]).svg();
/// assert!(svg.starts_with("<svg") && svg.contains("A sine") && svg.contains("<polyline"));
/// ```
#[derive(Clone, Debug)]
pub struct Chart {
    title: String,
    horizontal: String,
    panels: Vec<Panel>,
    logarithmic: bool,
}

/// Lines over one vertical axis.
#[derive(Clone, Debug)]
pub struct Panel {
    vertical: String,
    lines: Vec<Line>,
    shown: Option<(f64, f64)>,
}

/// A line, or the area between two.
#[derive(Clone, Debug)]
pub struct Line {
    name: String,
    points: Vec<(f64, f64)>,
    /// Back along the other side of an area.
    back: Option<Vec<(f64, f64)>>,
    dashed: bool,
    colour: Option<usize>,
}

/// Colours that the colour-blind can tell apart (Okabe, Ito), by number.
const COLOURS: [&str; 7] = [
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#555555",
];

impl Line {
    /// A line through these points, x ascending; what is not finite is a gap at the end.
    pub fn new(name: &str, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self {
            name: name.to_owned(),
            points: thinned(points),
            back: None,
            dashed: false,
            colour: None,
        }
    }

    /// The area between two lines.
    pub fn between(
        name: &str,
        low: impl IntoIterator<Item = (f64, f64)>,
        high: impl IntoIterator<Item = (f64, f64)>,
    ) -> Self {
        let mut back = thinned(high);
        back.reverse();
        Self {
            back: Some(back),
            ..Self::new(name, low)
        }
    }

    /// Dashed.
    #[must_use]
    pub fn dashed(mut self) -> Self {
        self.dashed = true;
        self
    }

    /// In this colour, by number; the lines' own numbers are taken otherwise.
    #[must_use]
    pub fn colour(mut self, number: usize) -> Self {
        self.colour = Some(number);
        self
    }
}

impl Panel {
    /// Lines over one vertical axis with this label.
    #[must_use]
    pub fn new(vertical: &str, lines: Vec<Line>) -> Self {
        Self {
            vertical: vertical.to_owned(),
            lines,
            shown: None,
        }
    }

    /// Shows this range alone; lines are cut at its ends.
    #[must_use]
    pub fn showing(mut self, low: f64, high: f64) -> Self {
        self.shown = Some((low, high));
        self
    }
}

const WIDTH: f64 = 860.0;
const LEFT: f64 = 74.0;
const RIGHT: f64 = 16.0;
const TOP: f64 = 52.0;
const PANEL: f64 = 190.0;
const GAP: f64 = 30.0;
const BOTTOM: f64 = 46.0;

impl Chart {
    /// A picture of these panels.
    #[must_use]
    pub fn new(title: &str, horizontal: &str, panels: Vec<Panel>) -> Self {
        Self {
            title: title.to_owned(),
            horizontal: horizontal.to_owned(),
            panels,
            logarithmic: false,
        }
    }

    /// With a logarithmic horizontal axis, as a Bode plot has; points at or below 0 are not shown.
    #[must_use]
    pub fn logarithmic(mut self) -> Self {
        self.logarithmic = true;
        self
    }

    /// The picture as SVG.
    #[must_use]
    pub fn svg(&self) -> String {
        let count = self.panels.len().max(1) as f64;
        let height = TOP + count * PANEL + (count - 1.0) * GAP + BOTTOM;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" width=\"{WIDTH}\" \
             height=\"{height}\" font-family=\"Helvetica, Arial, sans-serif\" font-size=\"12\" fill=\"#333\"><rect \
             width=\"100%\" height=\"100%\" fill=\"#fff\"/><text x=\"{LEFT}\" y=\"20\" font-size=\"14\" \
             font-weight=\"bold\">{}</text>",
            escaped(&self.title)
        );
        let all = || self.panels.iter().flat_map(|p| &p.lines);
        let values = all().flat_map(|l| l.points.iter().map(|p| p.0));
        let across = if self.logarithmic {
            Axis::logarithmic(values, LEFT, WIDTH - RIGHT)
        } else {
            Axis::over(values, LEFT, WIDTH - RIGHT, false)
        };
        for (k, panel) in self.panels.iter().enumerate() {
            let top = TOP + k as f64 * (PANEL + GAP);
            let last = k + 1 == self.panels.len();
            panel.draw(&mut svg, k, &across, top, last);
        }
        let _ = write!(
            svg,
            r#"<text x="{:.0}" y="{:.0}" text-anchor="middle">{}</text></svg>"#,
            0.5 * (LEFT + WIDTH - RIGHT),
            height - 10.0,
            escaped(&self.horizontal)
        );
        svg.push('\n');
        svg
    }
}

impl Panel {
    fn draw(&self, svg: &mut String, number: usize, across: &Axis, top: f64, last: bool) {
        let bottom = top + PANEL;
        let values = self
            .lines
            .iter()
            .flat_map(|l| l.points.iter().chain(l.back.iter().flatten()).map(|p| p.1));
        let up = match self.shown {
            Some((low, high)) => Axis::between(low, high, bottom, top),
            None => Axis::over(values, bottom, top, true),
        };
        let _ = write!(
            svg,
            r#"<clipPath id="panel{number}"><rect x="{LEFT}" y="{top}" width="{}" height="{PANEL}"/></clipPath>"#,
            WIDTH - RIGHT - LEFT
        );
        for (value, y) in up.ticks() {
            let _ = write!(
                svg,
                r##"<path d="M{LEFT} {y:.1}H{}" stroke="#e4e4e4"/><text x="{}" y="{:.1}" text-anchor="end">{}</text>"##,
                WIDTH - RIGHT,
                LEFT - 6.0,
                y + 4.0,
                number_text(value, up.step)
            );
        }
        for (value, x) in across.ticks() {
            let _ = write!(
                svg,
                r##"<path d="M{x:.1} {top}V{bottom}" stroke="#e4e4e4"/>"##
            );
            if last {
                let _ = write!(
                    svg,
                    r#"<text x="{x:.1}" y="{}" text-anchor="middle">{}</text>"#,
                    bottom + 16.0,
                    number_text(value, across.step_at(value))
                );
            }
        }
        let _ = write!(
            svg,
            "<rect x=\"{LEFT}\" y=\"{top}\" width=\"{}\" height=\"{PANEL}\" fill=\"none\" stroke=\"#999\"/><text \
             transform=\"translate(16 {:.0}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
            WIDTH - RIGHT - LEFT,
            top + PANEL / 2.0,
            escaped(&self.vertical)
        );
        let colour = |k: usize, line: &Line| COLOURS[line.colour.unwrap_or(k) % COLOURS.len()];
        for (k, line) in self.lines.iter().enumerate() {
            let corners: Vec<String> = line
                .points
                .iter()
                .chain(line.back.iter().flatten())
                .map(|(x, y)| format!("{:.1},{:.1}", across.at(*x), up.at(*y)))
                .collect();
            let (tag, style) = match (&line.back, line.dashed) {
                (Some(_), _) => ("polygon", r#"fill-opacity="0.25" stroke="none""#),
                (None, true) => (
                    "polyline",
                    r#"fill-opacity="0" stroke-width="1.4" stroke-dasharray="6 4""#,
                ),
                (None, false) => ("polyline", r#"fill-opacity="0" stroke-width="1.4""#),
            };
            let colour = colour(k, line);
            let paint = if line.back.is_some() {
                format!(r#"fill="{colour}""#)
            } else {
                format!(r#"stroke="{colour}""#)
            };
            let _ = write!(
                svg,
                r#"<{tag} clip-path="url(#panel{number})" {paint} {style} points="{}"/>"#,
                corners.join(" ")
            );
        }
        self.legend(svg, top, colour);
    }

    /// The lines' names above the panel's upper edge, from the right.
    fn legend(&self, svg: &mut String, top: f64, colour: impl Fn(usize, &Line) -> &'static str) {
        let mut x = WIDTH - RIGHT;
        for (k, line) in self.lines.iter().enumerate().rev() {
            if line.name.is_empty() {
                continue;
            }
            let y = top - 7.0;
            // 7 px a letter at 12 px: wide enough for any of these fonts; a narrower one leaves room before the next
            // name.
            x -= 7.0 * line.name.chars().count() as f64;
            let _ = write!(
                svg,
                r#"<text x="{x:.1}" y="{y:.1}">{}</text>"#,
                escaped(&line.name)
            );
            x -= 6.0;
            let (width, dashes) = match (&line.back, line.dashed) {
                (Some(_), _) => (8, ""),
                (None, true) => (2, r#" stroke-dasharray="6 4""#),
                (None, false) => (2, ""),
            };
            let opacity = if line.back.is_some() { 0.25 } else { 1.0 };
            let _ = write!(
                svg,
                r#"<path d="M{:.1} {:.1}h20" stroke="{}" stroke-width="{width}" stroke-opacity="{opacity}"{dashes}/>"#,
                x - 20.0,
                y - 4.0,
                colour(k, line)
            );
            x -= 32.0;
        }
    }
}

/// Most stretches of a line; each keeps its lowest and highest point, so chatter stays visible.
const STRETCHES: usize = 280;

/// The line up to the first point that is not finite, thinned to what a picture can show.
fn thinned(points: impl IntoIterator<Item = (f64, f64)>) -> Vec<(f64, f64)> {
    let points: Vec<_> = points
        .into_iter()
        .take_while(|(x, y)| x.is_finite() && y.is_finite())
        .collect();
    if points.len() <= 2 * STRETCHES {
        return points;
    }
    let mut out = Vec::with_capacity(2 * STRETCHES + 2);
    out.push(points[0]);
    for stretch in points.chunks(points.len().div_ceil(STRETCHES)) {
        let by_value = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
        if let (Some(low), Some(high)) = (
            stretch.iter().min_by(by_value),
            stretch.iter().max_by(by_value),
        ) {
            let (first, second) = if low.0 <= high.0 {
                (low, high)
            } else {
                (high, low)
            };
            out.push(*first);
            if second != first {
                out.push(*second);
            }
        }
    }
    out.extend(points.last());
    out
}

#[cfg(test)]
mod tests {
    use super::{Chart, Line, Panel, thinned};

    #[test]
    fn thinning_keeps_the_peaks() {
        let mut points: Vec<_> = (0..100_000).map(|k| (f64::from(k), 0.0)).collect();
        points[54_321].1 = 7.0;
        points[12_345].1 = -3.0;
        let few = thinned(points);
        assert!(few.len() < 600);
        let found = |v: f64| few.iter().any(|p| p.1 == v);
        assert!(found(7.0) && found(-3.0));
        assert!(few.windows(2).all(|p| p[0].0 <= p[1].0), "x ascends");
    }

    #[test]
    fn nothing_to_draw_is_drawn() {
        for lines in [
            vec![],
            vec![Line::new("", [(f64::NAN, 1.0)])],
            vec![Line::new("one", [(1.0, 1.0)])],
        ] {
            let svg = Chart::new("a < b", "t", vec![Panel::new("y", lines)]).svg();
            assert!(svg.contains("a &lt; b") && svg.ends_with("</svg>\n"));
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        }
    }
}
