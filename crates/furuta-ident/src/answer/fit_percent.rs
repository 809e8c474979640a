//! The fit in per cent, as users of system identification know it.

/// `100 (1 - |y - ŷ| / |y - mean y|)` over the samples that were predicted.
pub(crate) fn fit_percent(pairs: &[(f64, f64)]) -> f64 {
    let n = pairs.len() as f64;
    let mean = pairs.iter().map(|p| p.0).sum::<f64>() / n;
    let left: f64 = pairs.iter().map(|(y, p)| (y - p).powi(2)).sum();
    let spread: f64 = pairs.iter().map(|(y, _)| (y - mean).powi(2)).sum();
    100.0 * (1.0 - (left / spread).sqrt())
}
