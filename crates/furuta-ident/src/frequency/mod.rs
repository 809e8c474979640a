//! Identification in the frequency domain: what a rig does to sines, measured from recordings.
//!
//! | Module | What it holds |
//! |---|---|
//! | [`window`] | windows against leakage, under SciPy's names |
//! | [`spectra`] | averaged spectra and cross spectra (Welch), with SciPy's conventions |
//! | [`response`] | frequency responses: H1, H2, the joint input-output method for recordings in closed loop, coherence, confidence |
//! | [`periodic`] | the response to a periodic signal, without leakage |
//! | [`record`] | which columns of which recordings, cut at their gaps |
//!
//! A response measured at samples is that of the sampled plant, with the hold in front of it: `u` is held from one sample to the next, and
//! `y` is read where `u` is about to change. It is `G(j w)` times `(1 - e^(-j w h)) / (j w h)`, half a sample of delay and a little less gain, plus
//! images from beyond half the sampling rate.

pub mod error;
pub mod periodic;
pub mod record;
pub mod response;
pub mod spectra;
pub mod window;

pub use error::{FrequencyError, FrequencyNotice};
pub use response::{Estimator, Frf};
pub use spectra::{Settings, Spectra, Stretch};
pub use window::Window;
