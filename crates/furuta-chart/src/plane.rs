//! Curves in a plane with the same scale on both axes: Nyquist plots.

use crate::axis::{Axis, escaped, number_text};
use std::fmt::Write as _;

/// Curves and points in a square about the origin, the unit circle dashed.
///
/// ```
/// use furuta_chart::Plane;
/// let half = (0..=100).map(|k| (f64::from(k) * 0.0314).sin_cos()).collect();
/// let svg = Plane::new("L", ["Re", "Im"], 2.0).curve("half a turn", half).point("-1", (-1.0, 0.0)).svg();
/// assert!(svg.starts_with("<svg") && svg.contains("half a turn") && svg.matches("<circle").count() == 2);
/// ```
#[derive(Clone, Debug)]
pub struct Plane {
    title: String,
    axes: [String; 2],
    reach: f64,
    curves: Vec<(String, Vec<(f64, f64)>)>,
    points: Vec<(String, (f64, f64))>,
}

const COLOURS: [&str; 3] = ["#0072b2", "#56b4e9", "#009e73"];
const LEFT: f64 = 64.0;
const TOP: f64 = 60.0;
const SIDE: f64 = 480.0;
const MARGIN: f64 = 20.0;
const BOTTOM: f64 = 50.0;

impl Plane {
    /// A square that reaches from `-reach` to `reach` on both axes.
    #[must_use]
    pub fn new(title: &str, axes: [&str; 2], reach: f64) -> Self {
        Self {
            title: title.to_owned(),
            axes: axes.map(str::to_owned),
            reach,
            curves: Vec::new(),
            points: Vec::new(),
        }
    }

    /// The same with a curve through these points, in any order; what leaves the square is cut, and a point that is not
    /// finite is a gap.
    #[must_use]
    pub fn curve(mut self, name: &str, points: Vec<(f64, f64)>) -> Self {
        self.curves.push((name.to_owned(), points));
        self
    }

    /// The same with a point.
    #[must_use]
    pub fn point(mut self, name: &str, at: (f64, f64)) -> Self {
        self.points.push((name.to_owned(), at));
        self
    }

    /// The picture as SVG.
    #[must_use]
    pub fn svg(&self) -> String {
        let (width, height) = (LEFT + SIDE + MARGIN, TOP + SIDE + BOTTOM);
        let (right, bottom) = (LEFT + SIDE, TOP + SIDE);
        let across = Axis::between(-self.reach, self.reach, LEFT, right);
        let up = Axis::between(-self.reach, self.reach, bottom, TOP);
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" \
             height=\"{height}\" font-family=\"Helvetica, Arial, sans-serif\" font-size=\"12\" fill=\"#333\"><rect \
             width=\"100%\" height=\"100%\" fill=\"#fff\"/><text x=\"{LEFT}\" y=\"20\" font-size=\"14\" \
             font-weight=\"bold\">{}</text><clipPath id=\"plane\"><rect x=\"{LEFT}\" y=\"{TOP}\" width=\"{SIDE}\" \
             height=\"{SIDE}\"/></clipPath>",
            escaped(&self.title)
        );
        for (value, x) in across.ticks() {
            let _ = write!(
                svg,
                "<path d=\"M{x:.1} {TOP}V{bottom}\" stroke=\"#e4e4e4\"/><text x=\"{x:.1}\" y=\"{}\" \
                 text-anchor=\"middle\">{}</text>",
                bottom + 16.0,
                number_text(value, across.step)
            );
        }
        for (value, y) in up.ticks() {
            let _ = write!(
                svg,
                "<path d=\"M{LEFT} {y:.1}H{right}\" stroke=\"#e4e4e4\"/><text x=\"{}\" y=\"{:.1}\" \
                 text-anchor=\"end\">{}</text>",
                LEFT - 6.0,
                y + 4.0,
                number_text(value, up.step)
            );
        }
        let _ = write!(
            svg,
            "<rect x=\"{LEFT}\" y=\"{TOP}\" width=\"{SIDE}\" height=\"{SIDE}\" fill=\"none\" stroke=\"#999\"/><text \
             x=\"{:.0}\" y=\"{:.0}\" text-anchor=\"middle\">{}</text><text transform=\"translate(16 {:.0}) \
             rotate(-90)\" text-anchor=\"middle\">{}</text><circle clip-path=\"url(#plane)\" cx=\"{:.1}\" cy=\"{:.1}\" \
             r=\"{:.1}\" fill=\"none\" stroke=\"#999\" stroke-dasharray=\"4 4\"/>",
            LEFT + SIDE / 2.0,
            height - 12.0,
            escaped(&self.axes[0]),
            TOP + SIDE / 2.0,
            escaped(&self.axes[1]),
            across.at(0.0),
            up.at(0.0),
            across.at(1.0) - across.at(0.0)
        );
        let mut x = LEFT;
        for (k, (name, points)) in self.curves.iter().enumerate() {
            let colour = COLOURS[k % COLOURS.len()];
            let _ = write!(
                svg,
                r#"<path d="M{x:.1} {:.1}h20" stroke="{colour}" stroke-width="2"/><text x="{:.1}" y="{:.1}">{}</text>"#,
                TOP - 16.0,
                x + 26.0,
                TOP - 12.0,
                escaped(name)
            );
            // 7 px a letter, as in the line charts.
            x += 48.0 + 7.0 * name.chars().count() as f64;
            for stretch in self.visible(points) {
                let corners: Vec<String> = stretch
                    .iter()
                    .map(|(x, y)| format!("{:.1},{:.1}", across.at(*x), up.at(*y)))
                    .collect();
                let _ = write!(
                    svg,
                    "<polyline clip-path=\"url(#plane)\" stroke=\"{colour}\" fill-opacity=\"0\" stroke-width=\"1.4\" \
                     points=\"{}\"/>",
                    corners.join(" ")
                );
            }
        }
        for (name, (re, im)) in &self.points {
            let (x, y) = (across.at(*re), up.at(*im));
            let _ = write!(
                svg,
                r##"<circle cx="{x:.1}" cy="{y:.1}" r="3.5" fill="#d55e00"/><text x="{:.1}" y="{:.1}">{}</text>"##,
                x + 7.0,
                y - 7.0,
                escaped(name)
            );
        }
        svg.push_str("</svg>\n");
        svg
    }

    /// Stretches of a curve that are near enough to be seen.
    fn visible(&self, points: &[(f64, f64)]) -> Vec<Vec<(f64, f64)>> {
        let near = |(x, y): &(f64, f64)| x.abs() <= 2.0 * self.reach && y.abs() <= 2.0 * self.reach;
        points
            .split(|p| !near(p))
            .filter(|stretch| !stretch.is_empty())
            .map(<[(f64, f64)]>::to_vec)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::Plane;

    #[test]
    fn what_is_far_away_or_no_number_is_a_gap() {
        let curve = vec![
            (0.0, 0.0),
            (0.5, 0.5),
            (1e9, 0.0),
            (f64::NAN, 1.0),
            (1.0, 0.0),
            (0.9, 0.1),
        ];
        let svg = Plane::new("a < b", ["x", "y"], 1.0).curve("c", curve).svg();
        assert_eq!(svg.matches("<polyline").count(), 2);
        assert!(svg.contains("a &lt; b") && !svg.contains("NaN") && !svg.contains("inf"));
    }
}
