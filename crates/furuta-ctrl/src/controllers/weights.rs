//! The settings `q` and `r` of every controller that is designed by weights.

use crate::design::Weights;
use crate::error::ConfigError;
use crate::section::{Optional, ParameterSpec, Settings};

/// `q`, `n` numbers; `otherwise` says what follows where it is left out.
pub(super) const fn q(n: usize, otherwise: &'static str) -> ParameterSpec {
    ParameterSpec::numbers("q", n, "", 0.0, 1e12, otherwise)
}

/// `r`.
pub(super) const fn r(otherwise: &'static str) -> ParameterSpec {
    ParameterSpec::number("r", "", 1e-12, 1e12, otherwise)
}

/// The setting `r`.
const R: Optional = r("").optional();

/// Whether either is given; `q` has `N` numbers.
pub(super) fn any<const N: usize>(settings: &Settings) -> bool {
    settings.vector(const { q(N, "").several::<N>() }).is_some() || settings.has(R)
}

/// What `q` and `r` give, the standard weights if there is neither.
pub(super) fn given<const N: usize>(
    settings: &Settings,
    standard: impl FnOnce() -> Weights<f64, N, 1>,
) -> Result<Weights<f64, N, 1>, ConfigError> {
    match (
        settings.vector(const { q(N, "").several::<N>() }),
        settings.number(R),
    ) {
        (Some(q), Some(r)) => Ok(Weights::diagonal(q, [r])),
        (None, None) => Ok(standard()),
        _ => Err(ConfigError::Contradiction {
            section: settings.spec().id,
            problem: "give both q and r, or neither",
        }),
    }
}
