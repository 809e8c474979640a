//! How exact the model is: what physics keeps is kept, what rubs takes, steps converge, derivatives are derivatives,
//! and what is off is off.
//!
//! `cargo test -p furuta-model --test model exactness -- --nocapture` prints the tables.

mod actuation;
mod attached;
mod convergence;
mod drive;
mod energy;
mod jacobians;
mod off;
mod plants;
mod power;
