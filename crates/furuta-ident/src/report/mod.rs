//! Reports: one self-contained HTML page each, readable without a network, in light and dark; the same at a glance, and
//! in plain text.

mod calibration;
mod card;
mod charts;
mod comparison;
mod encode;
mod frequency;
mod sections;
mod text;
mod torque;

pub use calibration::{calibration, calibration_card};
pub use card::card;
pub use frequency::{figures, frequency};
pub use text::text;

use crate::diagnose::result::{Curves, Diagnosis};

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// The report of a diagnosis as one HTML page: verdict, what is missing, measured against predicted (zoomable), where
/// the gap sits, evidence, what was ruled out, parameters, held-out and verified predictions, the same of another state
/// of the rig, what to measure next. Sections for which there is nothing are left out.
///
/// The page stays below some 3 MB: longer recordings are shown at every second, third, ... sample, which it says.
///
/// ```
/// use furuta_ident::diagnose::result::{Curves, Diagnosis, Verdict};
/// let page = furuta_ident::report::html(&Diagnosis::new(Verdict::NoGap), &Curves::default());
/// assert!(page.starts_with("<!doctype html>") && page.contains("nothing is missing"));
/// ```
#[must_use]
pub fn html(diagnosis: &Diagnosis, curves: &Curves) -> String {
    let title = if curves.rig.is_empty() {
        "Diagnosis".into()
    } else {
        format!("Diagnosis of {}", escape(&curves.rig))
    };
    let body = [
        sections::verdict(diagnosis, curves),
        sections::effects(diagnosis, curves),
        sections::expression(diagnosis),
        sections::runs(diagnosis, curves),
        sections::location(diagnosis, curves),
        torque::section(diagnosis, curves),
        sections::evidence(diagnosis, curves),
        sections::limits(diagnosis),
        sections::parameters(diagnosis),
        sections::verification(diagnosis, curves),
        comparison::section(diagnosis),
        sections::next_experiment(diagnosis),
        sections::notices(diagnosis),
        sections::footer(diagnosis),
    ]
    .concat();
    page(&title, "", &body, SCRIPT)
}

/// A page that stands alone: `style` beside that of all pages, `script` at its end.
fn page(title: &str, style: &str, body: &str, script: &str) -> String {
    let script = if script.is_empty() {
        String::new()
    } else {
        format!("<script>\n{script}</script>\n")
    };
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" \
         content=\"width=device-width, initial-scale=1\">\n\
         <title>{title}</title>\n<style>\n{STYLE}{style}</style>\n</head>\n<body>\n<main>\n{body}</main>\
         \n{script}</body>\n</html>\n"
    )
}

/// Text made safe between tags and in attributes: names of files and rigs come from outside.
fn escape(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            c => safe.push(c),
        }
    }
    safe
}
