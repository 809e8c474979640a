//! Maps: panels side by side over the same axes, each a grid of which some fields are filled.

use crate::axis::{Axis, escaped, number_text};
use std::fmt::Write as _;

/// One panel.
#[derive(Clone, Debug)]
pub struct Map {
    /// What stands above it.
    pub title: String,
    /// Fields from left to right.
    pub columns: usize,
    /// Which fields are filled, from the lowest row on; within a row from the left.
    pub filled: Vec<bool>,
    /// Dashed lines over it, in the axes' units.
    pub lines: Vec<Vec<(f64, f64)>>,
}

/// Panels in rows over the same axes.
///
/// ```
/// use furuta_chart::{Map, Maps};
/// let map = Map { title: "a".into(), columns: 2, filled: vec![true, false, false, true], lines: vec![] };
/// let rows = vec![("row".to_owned(), vec![map])];
/// let maps = Maps { title: "A picture", across: ("x", 1.0), up: ("y", 2.0), rows };
/// assert_eq!(maps.svg().matches("<path class=\"field\"").count(), 2);
/// ```
#[derive(Clone, Debug)]
pub struct Maps<'a> {
    /// Above them all.
    pub title: &'a str,
    /// Label of the horizontal axis, and how far it reaches either way.
    pub across: (&'a str, f64),
    /// The same of the vertical one.
    pub up: (&'a str, f64),
    /// Rows of panels, each with a name.
    pub rows: Vec<(String, Vec<Map>)>,
}

const LEFT: f64 = 64.0;
const TOP: f64 = 72.0;
const SIDE: f64 = 176.0;
const GAP: (f64, f64) = (18.0, 54.0);
const BOTTOM: f64 = 50.0;

impl Maps<'_> {
    /// The picture as SVG.
    #[must_use]
    pub fn svg(&self) -> String {
        let columns = self.rows.iter().map(|row| row.1.len()).max();
        let columns = columns.unwrap_or(0).max(1) as f64;
        let rows = self.rows.len().max(1) as f64;
        let width = LEFT + columns * (SIDE + GAP.0);
        let height = TOP + rows * SIDE + (rows - 1.0) * GAP.1 + BOTTOM;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" \
             height=\"{height}\" font-family=\"Helvetica, Arial, sans-serif\" font-size=\"12\" fill=\"#333\"><rect \
             width=\"100%\" height=\"100%\" fill=\"#fff\"/><text x=\"{LEFT}\" y=\"20\" font-size=\"14\" \
             font-weight=\"bold\">{}</text>",
            escaped(self.title)
        );
        for (r, (name, row)) in self.rows.iter().enumerate() {
            let top = TOP + r as f64 * (SIDE + GAP.1);
            let _ = write!(
                svg,
                r#"<text x="{LEFT}" y="{}" font-weight="bold">{}</text>"#,
                top - 24.0,
                escaped(name)
            );
            for (c, map) in row.iter().enumerate() {
                let left = LEFT + c as f64 * (SIDE + GAP.0);
                let lowest = r + 1 == self.rows.len();
                self.panel(&mut svg, map, left, top, c == 0, lowest);
            }
        }
        let _ = writeln!(
            svg,
            r#"<text x="{:.0}" y="{:.0}" text-anchor="middle">{}</text></svg>"#,
            0.5 * (LEFT + width - GAP.0),
            height - 12.0,
            escaped(self.across.0)
        );
        svg
    }

    fn panel(&self, svg: &mut String, map: &Map, left: f64, top: f64, first: bool, lowest: bool) {
        let (right, bottom) = (left + SIDE, top + SIDE);
        let across = Axis::between(-self.across.1, self.across.1, left, right);
        let up = Axis::between(-self.up.1, self.up.1, bottom, top);
        let id = format!("map{left:.0}-{top:.0}");
        let _ = write!(
            svg,
            "<clipPath id=\"{id}\"><rect x=\"{left}\" y=\"{top}\" width=\"{SIDE}\" height=\"{SIDE}\"/></clipPath><text \
             x=\"{left}\" y=\"{}\">{}</text>",
            top - 8.0,
            escaped(&map.title)
        );
        map.fields(svg, left, bottom);
        for line in &map.lines {
            let points: Vec<String> = line
                .iter()
                .map(|(x, y)| format!("{:.1},{:.1}", across.at(*x), up.at(*y)))
                .collect();
            let _ = write!(
                svg,
                "<polyline clip-path=\"url(#{id})\" fill=\"none\" stroke=\"#d55e00\" stroke-dasharray=\"6 4\" \
                 points=\"{}\"/>",
                points.join(" ")
            );
        }
        let _ = write!(
            svg,
            r##"<rect x="{left}" y="{top}" width="{SIDE}" height="{SIDE}" fill="none" stroke="#999"/>"##
        );
        for (value, x) in across.ticks().filter(|_| lowest) {
            let _ = write!(
                svg,
                "<path d=\"M{x:.1} {bottom}v4\" stroke=\"#999\"/><text x=\"{x:.1}\" y=\"{}\" \
                 text-anchor=\"middle\">{}</text>",
                bottom + 17.0,
                number_text(value, across.step)
            );
        }
        if !first {
            return;
        }
        for (value, y) in up.ticks() {
            let _ = write!(
                svg,
                r##"<path d="M{left} {y:.1}h-4" stroke="#999"/><text x="{}" y="{:.1}" text-anchor="end">{}</text>"##,
                left - 7.0,
                y + 4.0,
                number_text(value, up.step)
            );
        }
        let _ = write!(
            svg,
            r#"<text transform="translate(16 {:.0}) rotate(-90)" text-anchor="middle">{}</text>"#,
            0.5 * (top + bottom),
            escaped(self.up.0)
        );
    }
}

impl Map {
    /// The filled fields, those side by side as one.
    fn fields(&self, svg: &mut String, left: f64, bottom: f64) {
        let columns = self.columns.max(1);
        let rows = self.filled.len() / columns;
        let (w, h) = (SIDE / columns as f64, SIDE / rows.max(1) as f64);
        for (j, row) in self.filled.chunks_exact(columns).enumerate() {
            let mut i = 0;
            while i < columns {
                let length = row[i..].iter().take_while(|filled| **filled).count();
                if length > 0 {
                    let (x, y) = (left + i as f64 * w, bottom - (j + 1) as f64 * h);
                    // A little over the edge, or white seams are seen.
                    let _ = write!(
                        svg,
                        r##"<path class="field" d="M{x:.2} {y:.2}h{:.2}v{:.2}h-{:.2}z" fill="#56b4e9"/>"##,
                        length as f64 * w,
                        h + 0.4,
                        length as f64 * w
                    );
                }
                i += length.max(1);
            }
        }
    }
}
