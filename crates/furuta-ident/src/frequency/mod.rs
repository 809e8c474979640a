//! Identification in the frequency domain: what a rig does to sines, measured from recordings.
//!
//! | Module | What it holds |
//! |---|---|
//! | [`window`] | windows against leakage, under SciPy's names |
//! | [`spectra`] | averaged spectra and cross spectra (Welch), with SciPy's conventions |
//! | [`response`] | frequency responses: H1, H2, the joint input-output method for recordings in closed loop, coherence, confidence |
//! | [`local`] | response and transient together, by the local rational method: what a fit begins from |
//! | [`periodic`] | the response to a periodic signal, without leakage; noise and nonlinear distortion apart |
//! | [`transfer`], [`polynomial`] | continuous transfer functions with a delay, their poles and zeros |
//! | [`mod@fit`], [`orders`] | transfer functions fitted to a response, with standard deviations; the choice of orders |
//! | [`first_principles`] | the linear model that a rig file gives, to lay over it |
//! | [`bands`] | how far a model is from a response, band by band |
//! | [`measurement`] | how a response is taken, as it is asked for |
//! | [`coverage`] | how often intervals hold the truth on emulated rigs, and from which swing on the rig is nonlinear |
//! | [`fong2014`] | the experiment of a paper, from noise to transfer function |
//! | [`mod@compare`] | which effects explain what a measured response has and a rig file has not |
//! | [`hold`] | the hold before a sampled plant, and the images that sampling folds down |
//! | [`bode`], [`words`] | responses, fits and comparisons as pictures, tables and words |
//! | [`record`] | which columns of which recordings, cut at their gaps |
//!
//! A response measured at samples is that of the sampled plant, with the hold in front of it: `u` is held from one
//! sample to the next, and `y` is read where `u` is about to change. It is `G(j w)` times `(1 - e^(-j w h)) / (j w h)`,
//! half a sample of delay and a little less gain, plus images from beyond half the sampling rate: [`hold::Hold`].

pub mod bands;
pub mod bode;
pub mod compare;
pub mod coverage;
pub mod error;
pub mod first_principles;
pub mod fit;
pub mod fong2014;
pub mod hold;
mod least_squares;
pub mod local;
pub mod measurement;
pub mod orders;
pub mod periodic;
pub mod polynomial;
pub mod record;
pub mod response;
pub mod spectra;
mod start;
pub mod transfer;
pub mod window;
pub mod words;

pub use error::{FrequencyError, FrequencyNotice};
pub use fit::{Delay, Fit, FitError, FitNotice, Request, fit};
pub use hold::Hold;
pub use measurement::{Measurement, Method};
pub use response::{Estimator, Frf};
pub use spectra::{Settings, Spectra, Stretch};
pub use transfer::Transfer;
pub use window::Window;
