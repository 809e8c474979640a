//! Windows against leakage.

use std::f64::consts::TAU;

/// A window, under the name that SciPy's `get_window` gives it; periodic, as a spectrum wants it.
///
/// ```
/// use furuta_ident::frequency::Window;
/// let hann = Window::Hann.samples(8);
/// assert_eq!(hann[0], 0.0);
/// assert!((hann[4] - 1.0).abs() < 1e-15 && (hann[2] - 0.5).abs() < 1e-15);
/// assert_eq!("hann".parse(), Ok(Window::Hann));
/// assert!("kaiser".parse::<Window>().is_err());
/// ```
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub enum Window {
    /// All ones (SciPy: `boxcar`): sharpest lines, most leakage; for periodic signals.
    Rectangular,
    /// `0.5 - 0.5 cos`: the usual one for random signals.
    #[default]
    Hann,
    /// `0.54 - 0.46 cos`: the nearest side lobes lower, the far ones not.
    Hamming,
    /// Three terms: side lobes below -58 dB, lines half as wide again.
    Blackman,
    /// Four terms: side lobes below -92 dB.
    BlackmanHarris,
    /// Five terms: the height of a sine between two lines is right to 0.01 dB, lines are widest.
    Flattop,
}

impl Window {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::Rectangular,
        Self::Hann,
        Self::Hamming,
        Self::Blackman,
        Self::BlackmanHarris,
        Self::Flattop,
    ];

    /// The name in one word.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Rectangular => "rectangular",
            Self::Hann => "hann",
            Self::Hamming => "hamming",
            Self::Blackman => "blackman",
            Self::BlackmanHarris => "blackmanharris",
            Self::Flattop => "flattop",
        }
    }

    /// `a_0, a_1, ...` of `sum (-1)^k a_k cos(2 pi k n / N)`.
    const fn terms(self) -> &'static [f64] {
        match self {
            Self::Rectangular => &[1.0],
            Self::Hann => &[0.5, 0.5],
            Self::Hamming => &[0.54, 0.46],
            Self::Blackman => &[0.42, 0.50, 0.08],
            Self::BlackmanHarris => &[0.35875, 0.48829, 0.14128, 0.01168],
            Self::Flattop => &[
                0.215_578_95,
                0.416_631_58,
                0.277_263_158,
                0.083_578_947,
                0.006_947_368,
            ],
        }
    }

    /// The window over `n` samples; sample `n`, which is not among them, would be the first again.
    #[must_use]
    pub fn samples(self, n: usize) -> Vec<f64> {
        let value = |i: usize| {
            let turn = TAU * i as f64 / n as f64;
            let term = |(k, a): (usize, &f64)| {
                let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
                sign * a * (k as f64 * turn).cos()
            };
            self.terms().iter().enumerate().map(term).sum()
        };
        (0..n).map(value).collect()
    }

    /// How many lines side by side hold the information of one: neighbouring lines of a windowed spectrum know of one
    /// another, and a fit that takes them as independent would think itself too sure by the root of this.
    /// `sum over d of |sum w^2 e^(-2 pi j d n / N)|^2 / (sum w^2)^2`; 1 for the rectangular window, 1.94 for Hann's.
    #[must_use]
    pub fn lines_for_one(self) -> f64 {
        // By Parseval, N sum w^4 / (sum w^2)^2; long enough that every term of a window is a whole number of lines.
        let w = self.samples(64);
        let [squares, fourths] = [2, 4].map(|p| w.iter().map(|w| w.powi(p)).sum::<f64>());
        64.0 * fourths / (squares * squares)
    }
}

/// A window that is not known by this name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "there is no window {0:?}: give rectangular (boxcar), hann, hamming, blackman, blackmanharris or flattop"
)]
pub struct UnknownWindow(pub String);

impl std::str::FromStr for Window {
    type Err = UnknownWindow;

    fn from_str(name: &str) -> Result<Self, UnknownWindow> {
        let name = name.to_ascii_lowercase();
        if name == "boxcar" {
            return Ok(Self::Rectangular);
        }
        Self::ALL
            .into_iter()
            .find(|w| w.name() == name)
            .ok_or(UnknownWindow(name))
    }
}
