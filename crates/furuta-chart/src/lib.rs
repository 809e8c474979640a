//! Line charts, maps and curves in a plane as SVG: small files that a browser, a README and a printer show alike.
#![forbid(unsafe_code)]

mod axis;
mod lines;
mod map;
mod plane;

pub use lines::{Chart, Line, Panel};
pub use map::{Map, Maps};
pub use plane::Plane;
