//! Line charts and maps as SVG: small files that a browser, a README and a printer show alike.
#![forbid(unsafe_code)]

mod axis;
mod lines;
mod map;

pub use lines::{Chart, Line, Panel};
pub use map::{Map, Maps};
