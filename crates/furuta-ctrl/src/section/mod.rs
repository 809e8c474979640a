//! One section of a controller file: what it takes, the numbers given in it, what is wrong with them. Public as
//! [`settings`](crate::settings).

mod check;
mod error;
mod key;
mod spec;
mod values;

pub use error::{MAX_NUMBERS, SettingsError};
pub use key::{Chosen, Optional, Settled, Several};
pub use spec::{ParameterNames, ParameterSpec, Shape, Spec};
pub use values::Settings;
