//! How a response is taken from recordings, as a person asks for it.

use super::error::{FrequencyError, FrequencyNotice};
use super::record::Taken;
use super::response::{Estimator, Frf};
use super::spectra::Settings;
use super::window::Window;
use super::{local, periodic};

/// By what method.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub enum Method {
    /// Response and transient together ([`local`]): no leakage, right intervals from a single record.
    #[default]
    Local,
    /// Windowed segments, averaged (Welch): the numbers of SciPy's `csd`.
    Averaged {
        /// The quotient.
        estimator: Estimator,
        /// Window of a segment.
        window: Window,
        /// Part of a segment that it shares with the next, 0 to 0.95.
        overlap: f64,
    },
    /// Whole periods of a periodic signal ([`periodic`]).
    Periodic {
        /// s.
        period: f64,
        /// Periods left out at the start.
        discard: usize,
    },
}

/// What is asked for.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Measurement {
    /// By what method.
    pub method: Method,
    /// Distance of lines, Hz; ten over the length of the longest stretch if not given. A periodic signal has its own.
    pub resolution: Option<f64>,
    /// Frequencies to give, Hz; all if not given.
    pub band: Option<[f64; 2]>,
}

impl Measurement {
    /// The response, and what should be known about it.
    ///
    /// # Errors
    /// As the methods, and an overlap outside 0 to 0.95.
    pub fn response(
        &self,
        taken: &Taken<'_>,
    ) -> Result<(Frf, Vec<FrequencyNotice>), FrequencyError> {
        let h = taken.sample_period;
        let mut said = taken.notices.clone();
        let frf = match self.method {
            Method::Local => {
                let usual = taken.usual_settings().segment as f64 * h;
                let resolution = self.resolution.unwrap_or(1.0 / usual);
                let (frf, more) = local::response(&taken.stretches, h, resolution, self.band)?;
                said.extend(more);
                if self.band.is_none() {
                    said.extend(frf.few_lines());
                }
                frf
            }
            Method::Averaged {
                estimator,
                window,
                overlap,
            } => {
                if !(0.0..=0.95).contains(&overlap) {
                    return Err(FrequencyError::OutOfRange {
                        name: "overlap",
                        value: overlap,
                        min: 0.0,
                        max: 0.95,
                        unit: "",
                    });
                }
                let mut settings = taken.usual_settings();
                if let Some(resolution) = self.resolution {
                    settings.segment = (1.0 / (resolution * h)).round() as usize;
                }
                settings = Settings {
                    overlap: (overlap * settings.segment as f64) as usize,
                    window,
                    ..settings
                };
                let (frf, more) = Frf::measure(&taken.stretches, h, &settings, estimator)?;
                said.extend(more);
                frf
            }
            Method::Periodic { period, discard } => {
                let (frf, more) = periodic::response(&taken.stretches, h, period, discard)?;
                said.extend(more);
                frf
            }
        };
        let frf = match self.band {
            Some([low, high]) => frf.band(low, high)?,
            None => frf,
        };
        said.extend(frf.low_coherence());
        Ok((frf, said))
    }
}
