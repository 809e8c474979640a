//! Frequency responses from spectra.

use nalgebra::Complex;

use super::error::{FrequencyError, FrequencyNotice};
use super::spectra::{Settings, Spectra, Stretch};

/// How a response is formed from spectra.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub enum Estimator {
    /// `S_uy / S_uu`: right where the noise is on the output, and the usual one.
    #[default]
    H1,
    /// `S_yy / S_yu`: right where the noise is on the input; too large where it is on the output.
    H2,
    /// `S_ry / S_ru`: the joint input-output method, right in closed loop too, where the input answers the output's
    /// noise.
    Joint,
}

impl Estimator {
    /// Its usual name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::H1 => "H1",
            Self::H2 => "H2",
            Self::Joint => "joint input-output",
        }
    }
}

/// A measured frequency response, of the sampled plant with its hold.
#[derive(Clone, Debug, PartialEq)]
pub struct Frf {
    /// Lines, Hz, above 0.
    pub frequency: Vec<f64>,
    /// The response there, unit of the output over that of the input.
    pub response: Vec<Complex<f64>>,
    /// How much of the output's power the input explains, 0 to 1; in closed loop the external signal.
    pub coherence: Vec<f64>,
    /// Standard deviation of the response: the root of the mean squared distance in the complex plane.
    pub std: Vec<f64>,
    /// The part of it that is odd nonlinear distortion, where detection lines told it from noise
    /// ([`super::periodic`]); empty where nothing is known of it.
    pub distortion: Vec<f64>,
    /// Independent averages behind each line; where the noise is known otherwise, one more than its degrees of freedom.
    pub averages: f64,
    /// How many lines side by side hold the information of one ([`super::Window::lines_for_one`]).
    pub lines_for_one: f64,
    /// Time between samples, s.
    pub sample_period: f64,
    /// How it was formed, in words.
    pub method: String,
}

impl Frf {
    /// The response from averaged spectra.
    ///
    /// Its deviation is `S_ee / S_uu` over the number of independent averages, `S_ee` the density of what the input
    /// does not explain (of `y - H u` in closed loop, and `|S_ru|² / S_rr` in the place of `S_uu`). Line 0, where the
    /// mean was taken away, is left out.
    ///
    /// # Errors
    /// One average alone; [`Estimator::Joint`] without an external signal.
    pub fn of(spectra: &Spectra, estimator: Estimator) -> Result<Self, FrequencyError> {
        if spectra.segments < 2 {
            return Err(FrequencyError::OneSegment {
                seconds: 1.0 / spectra.frequency.get(1).copied().unwrap_or(1.0),
            });
        }
        let external = match estimator {
            Estimator::H1 | Estimator::H2 => None,
            Estimator::Joint => {
                Some(
                    spectra
                        .external
                        .as_ref()
                        .ok_or(FrequencyError::NoColumn {
                            file: "the data".to_owned(),
                            column: "reference".to_owned(),
                            found: "input and output only".to_owned(),
                            hint: "; the joint input-output method needs the signal that the controller did not choose",
                        })?,
                )
            }
        };
        // The residual has lost one degree of freedom to the response.
        let spare = (spectra.averages - 1.0).max(0.1);
        let lines = 1..spectra.frequency.len();
        let mut frf = Self {
            frequency: spectra.frequency[lines.clone()].to_vec(),
            response: Vec::with_capacity(lines.len()),
            coherence: Vec::with_capacity(lines.len()),
            std: Vec::with_capacity(lines.len()),
            distortion: Vec::new(),
            averages: spectra.averages,
            lines_for_one: spectra.window.lines_for_one(),
            sample_period: spectra.sample_period,
            method: format!("{}, {} window", estimator.name(), spectra.window.name()),
        };
        for k in lines {
            let (uu, yy, uy) = (spectra.uu[k], spectra.yy[k], spectra.uy[k]);
            let (h, coherence, variance) = match external {
                None => {
                    let coherence = uy.norm_sqr() / (uu * yy);
                    let h = if estimator == Estimator::H2 {
                        Complex::new(yy, 0.0) / uy.conj()
                    } else {
                        uy / uu
                    };
                    let unexplained = (1.0 - coherence).max(0.0);
                    (h, coherence, unexplained / coherence * h.norm_sqr())
                }
                Some(x) => {
                    let h = x.ry[k] / x.ru[k];
                    // S_ee = S_yy - 2 Re(conj(H) S_uy) + |H|^2 S_uu.
                    let residual = yy - 2.0 * (h.conj() * uy).re + h.norm_sqr() * uu;
                    let coherence = x.ry[k].norm_sqr() / (x.rr[k] * yy);
                    (
                        h,
                        coherence,
                        residual.max(0.0) * x.rr[k] / x.ru[k].norm_sqr(),
                    )
                }
            };
            frf.response.push(h);
            frf.coherence.push(coherence.clamp(0.0, 1.0));
            frf.std.push((variance / spare).sqrt());
        }
        Ok(frf)
    }

    /// A response that is known without noise, at these frequencies (Hz): a table, a model.
    pub fn exact(frequency: &[f64], response: impl Fn(f64) -> Complex<f64>) -> Self {
        Self {
            frequency: frequency.to_vec(),
            response: frequency.iter().map(|f| response(*f)).collect(),
            coherence: vec![1.0; frequency.len()],
            std: vec![0.0; frequency.len()],
            distortion: Vec::new(),
            averages: f64::INFINITY,
            lines_for_one: 1.0,
            sample_period: 0.0,
            method: "exact".to_owned(),
        }
    }

    /// The response of stretches of a recording, and what should be known about it.
    ///
    /// # Errors
    /// As [`Spectra::of`] and [`Self::of`].
    pub fn measure(
        stretches: &[Stretch<'_>],
        sample_period: f64,
        settings: &Settings,
        estimator: Estimator,
    ) -> Result<(Self, Vec<FrequencyNotice>), FrequencyError> {
        let spectra = Spectra::of(stretches, sample_period, settings)?;
        let frf = Self::of(&spectra, estimator)?;
        let mut notices = Vec::new();
        if stretches.len() > 1 && spectra.unused > 0 {
            notices.push(FrequencyNotice::Gaps {
                stretches: stretches.len(),
                unused: spectra.unused,
            });
        }
        notices.extend(few(&frf));
        let power = |from: f64| -> f64 {
            let pairs = spectra.frequency.iter().zip(&spectra.yy).skip(1);
            pairs.filter(|(f, _)| **f >= from).map(|(_, s)| s).sum()
        };
        notices.extend(aliasing(power, sample_period));
        Ok((frf, notices))
    }

    /// The part between two frequencies (Hz), ends included.
    ///
    /// # Errors
    /// [`FrequencyError::EmptyBand`] where no line lies there.
    pub fn band(&self, low: f64, high: f64) -> Result<Self, FrequencyError> {
        // A line at the very end counts, whatever its last bit.
        let inside = |f: f64| f >= low * (1.0 - 1e-9) && f <= high * (1.0 + 1e-9);
        let kept: Vec<usize> = (0..self.frequency.len())
            .filter(|k| inside(self.frequency[*k]))
            .collect();
        if kept.is_empty() {
            return Err(FrequencyError::EmptyBand {
                low,
                high,
                resolution: self.resolution(),
                highest: self.frequency.last().copied().unwrap_or(0.0),
            });
        }
        let cut = |values: &[f64]| {
            kept.iter()
                .filter_map(|k| values.get(*k).copied())
                .collect()
        };
        Ok(Self {
            frequency: cut(&self.frequency),
            response: kept.iter().map(|k| self.response[*k]).collect(),
            coherence: cut(&self.coherence),
            std: cut(&self.std),
            distortion: cut(&self.distortion),
            method: self.method.clone(),
            ..*self
        })
    }

    /// Distance of the first two lines, Hz.
    #[must_use]
    pub fn resolution(&self) -> f64 {
        match self.frequency.as_slice() {
            [first, second, ..] => second - first,
            [only] => *only,
            [] => 0.0,
        }
    }

    /// Magnitude in dB.
    #[must_use]
    pub fn magnitude_db(&self) -> Vec<f64> {
        self.response.iter().map(|h| decibels(h.norm())).collect()
    }

    /// Phase in degrees, continuous from line to line.
    #[must_use]
    pub fn phase_degrees(&self) -> Vec<f64> {
        continuous_phase(self.response.iter().copied())
    }

    /// Radius of the circle about each line's response in which the true one lies with this probability: from the F
    /// distribution of 2 and `2 n - 2` degrees of freedom, whose quantile has a closed form.
    ///
    /// # Errors
    /// A probability that is not between 0 and 1.
    pub fn confidence(&self, probability: f64) -> Result<Vec<f64>, FrequencyError> {
        if !(probability > 0.0 && probability < 1.0) {
            return Err(FrequencyError::OutOfRange {
                name: "probability",
                value: probability,
                min: 0.0,
                max: 1.0,
                unit: "",
            });
        }
        // |H - H0|^2 / std^2 has the distribution F(2, 2 n - 2).
        let spare = self.freedom().clamp(0.1, 1e9);
        let quantile = spare * ((1.0 - probability).powf(-1.0 / spare) - 1.0);
        Ok(self.std.iter().map(|s| s * quantile.sqrt()).collect())
    }

    /// Degrees of freedom, complex ones, behind each line's standard deviation.
    #[must_use]
    pub fn freedom(&self) -> f64 {
        self.averages - 1.0
    }

    /// Says so where a fifth of the lines or more have a coherence below one half.
    #[must_use]
    pub fn low_coherence(&self) -> Option<FrequencyNotice> {
        let low = self.coherence.iter().filter(|c| **c < 0.5).count();
        let share = low as f64 / self.coherence.len().max(1) as f64;
        (share >= 0.2).then_some(FrequencyNotice::LowCoherence { share })
    }

    /// Says so where there are fewer lines than a fit needs.
    #[must_use]
    pub fn few_lines(&self) -> Option<FrequencyNotice> {
        let lines = self.frequency.len();
        (lines < LINES_TO_FIT).then_some(FrequencyNotice::FewLines { lines })
    }

    /// The part up to where the coherence ends, and a notice where that leaves lines out: beyond it the coherence is no
    /// higher than chance makes it, in the median of five lines, and a fit would follow noise. A response whose
    /// coherence is not known, or that has fewer than ten lines before that place, is left as it is.
    ///
    /// ```
    /// use furuta_ident::frequency::Frf;
    /// use nalgebra::Complex;
    /// let lines: Vec<f64> = (1..=100).map(|k| 0.1 * f64::from(k)).collect();
    /// let mut frf = Frf::exact(&lines, |_| Complex::new(1.0, 0.0));
    /// frf.averages = 20.0;
    /// frf.coherence = lines.iter().map(|f| if *f < 5.05 { 0.9 } else { 0.05 }).collect();
    /// let (kept, notice) = frf.coherent();
    /// assert_eq!((kept.frequency.len(), notice.is_some()), (50, true));
    /// ```
    #[must_use]
    pub fn coherent(&self) -> (Self, Option<FrequencyNotice>) {
        let by_chance = self.coherence_by_chance();
        let coherent = |k: &usize| {
            let around = k.saturating_sub(2)..(k + 3).min(self.coherence.len());
            let above = self.coherence[around.clone()].iter();
            2 * above.filter(|c| **c > by_chance).count() > around.len()
        };
        let Some(last) = (0..self.coherence.len()).rev().find(coherent) else {
            return (self.clone(), None);
        };
        // The median reaches beyond the last line that is coherent itself.
        let last = (0..=last).rev().find(|k| self.coherence[*k] > by_chance);
        let ends = last.and_then(|k| self.frequency.get(k).copied());
        let first = self.frequency.first().copied();
        match (first, ends, last) {
            (Some(low), Some(high), Some(last))
                if last + 1 >= LINES_TO_FIT && last + 1 < self.frequency.len() =>
            {
                let left_out = self.frequency.len() - last - 1;
                let notice = FrequencyNotice::CoherenceEnds {
                    at: high,
                    by_chance,
                    left_out,
                };
                self.band(low, high)
                    .map_or_else(|_| (self.clone(), None), |kept| (kept, Some(notice)))
            }
            _ => (self.clone(), None),
        }
    }

    /// The coherence that two unrelated signals reach in one of twenty cases.
    #[must_use]
    pub fn coherence_by_chance(&self) -> f64 {
        1.0 - 0.05_f64.powf(1.0 / (self.averages - 1.0).max(0.1))
    }
}

/// Fewer lines than this are all needed for a fit.
const LINES_TO_FIT: usize = 10;

/// Fewer independent averages than this are said to be few.
const FEW: f64 = 8.0;

/// Above this share of the output's power in the last fifth of the band, faster motion must be feared.
const NEAR_NYQUIST: f64 = 0.01;

/// Says so where few averages stand behind each line.
pub(super) fn few(frf: &Frf) -> Option<FrequencyNotice> {
    (frf.averages < FEW).then(|| FrequencyNotice::FewAverages {
        averages: frf.averages,
        by_chance: frf.coherence_by_chance(),
    })
}

/// Says so where much of the output's power, given from a frequency on, lies near half the sampling rate.
pub(super) fn aliasing(power: impl Fn(f64) -> f64, sample_period: f64) -> Option<FrequencyNotice> {
    let nyquist = 0.5 / sample_period;
    let share = power(0.8 * nyquist) / power(0.0);
    (share > NEAR_NYQUIST).then_some(FrequencyNotice::AliasingSuspected { share, nyquist })
}

/// Magnitude as decibels.
#[must_use]
pub fn decibels(magnitude: f64) -> f64 {
    20.0 * magnitude.log10()
}

/// Phase in degrees without jumps of a turn; the first lies between -180 and 180, but for one a hair above -180, which
/// is shown as 180.
pub fn continuous_phase(response: impl IntoIterator<Item = Complex<f64>>) -> Vec<f64> {
    let mut before: Option<f64> = None;
    let unwrap = |h: Complex<f64>| {
        let mut phase = h.arg().to_degrees();
        if let Some(before) = before.filter(|b| b.is_finite()) {
            phase += 360.0 * ((before - phase) / 360.0).round();
        }
        before = Some(phase);
        phase
    };
    response.into_iter().map(unwrap).collect()
}
