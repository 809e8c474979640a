//! Pages of figures, that of a frequency response among them: what should be known, the figures, the numbers.

use super::{escape, page};
use crate::frequency::bode::Bode;

/// The page of a frequency response, of a function fitted to it or of what explains it, one self-contained HTML file:
/// the plot, what should be known, and the answer in numbers as the terminal has it.
///
/// ```
/// use furuta_ident::frequency::{Frf, Transfer, bode::Bode, words::response_text};
/// let g = Transfer::new(&[1.0], &[1.0, 1.0])?;
/// let frf = Frf::exact(&[0.5, 1.0, 2.0], |f| g.response(f));
/// let curve: Vec<_> = frf.frequency.iter().copied().zip(frf.response.iter().copied()).collect();
/// let bode = Bode::new("").model("model", &curve, false);
/// let notes = ["a note <b>".to_owned()];
/// let page = furuta_ident::report::frequency("theta / u", bode, "G(s) = 1 / (s + 1)", &notes);
/// assert!(page.starts_with("<!doctype html>") && page.contains("<svg") && page.contains("a note &lt;b&gt;"));
/// # Ok::<(), furuta_ident::frequency::transfer::TransferError>(())
/// ```
#[must_use]
pub fn frequency(title: &str, plot: Bode, text: &str, notices: &[String]) -> String {
    figures(title, &[("Response", plot.chart().svg())], text, notices)
}

/// A page of figures, one self-contained HTML file: what should be known, each figure (SVG) under its heading, and the
/// answer in numbers as the terminal has it.
///
/// ```
/// let figures = [("The loop", "<svg></svg>".to_owned())];
/// let page = furuta_ident::report::figures("lqr", &figures, "gain < 2", &[]);
/// assert!(page.contains("<h2>The loop</h2>\n<figure><svg></svg>") && page.contains("gain &lt; 2"));
/// ```
#[must_use]
pub fn figures(title: &str, figures: &[(&str, String)], text: &str, notices: &[String]) -> String {
    let title = escape(title);
    let mut body = format!("<h1>{title}</h1>\n");
    if !notices.is_empty() {
        body += "<section><h2>To know</h2><ul>";
        for notice in notices {
            body += &format!("<li>{}</li>", escape(notice));
        }
        body += "</ul></section>\n";
    }
    for (heading, svg) in figures {
        let heading = escape(heading);
        body += &format!("<section><h2>{heading}</h2>\n<figure>{svg}</figure></section>\n");
    }
    body += &format!(
        "<section><h2>In numbers</h2><pre>{}</pre></section>\n",
        escape(text)
    );
    page(&title, FIGURE, &body, "")
}

/// The plot has a ground of its own, light in the dark as well.
const FIGURE: &str = "figure { margin: 1rem 0; } figure svg \
                      { display: block; width: 100%; height: auto; border-radius: 8px; }\n\
    pre { overflow-x: auto; font-size: .82rem; line-height: 1.35; }\n";
