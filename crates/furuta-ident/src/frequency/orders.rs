//! How many poles and zeros a response asks for.

use super::fit::{Delay, Fit, Request, fit};
use super::hold::Hold;
use super::response::Frf;

/// The fits of all orders that are possible, best first by BIC: denominators up to `poles`, numerators below them.
///
/// Orders that could not be fitted are left out, those with more coefficients than the response has lines among them.
///
/// ```
/// use furuta_ident::frequency::{Frf, fit::Delay, hold::Hold, orders::sweep, transfer::Transfer};
/// let truth = Transfer::new(&[3.0], &[1.0, 0.8, 9.0])?;
/// let frequency: Vec<f64> = (1..60).map(|k| 0.05 * f64::from(k)).collect();
/// let mut frf = Frf::exact(&frequency, |f| truth.response(f));
/// frf.std = frf.response.iter().map(|h| 0.01 * h.norm()).collect();
/// let fits = sweep(&frf, 3, Hold::None, Delay::Known(0.0));
/// assert_eq!(fits[0].transfer.orders(), [0, 2]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use]
pub fn sweep(frf: &Frf, poles: usize, hold: Hold, delay: Delay) -> Vec<Fit> {
    let orders = (1..=poles).flat_map(|poles| (0..poles).map(move |zeros| [zeros, poles]));
    let mut fits: Vec<Fit> = orders
        .filter_map(|[zeros, poles]| {
            let request = Request {
                zeros,
                poles,
                hold,
                delay,
            };
            fit(frf, &request).ok()
        })
        .collect();
    fits.sort_by(|a, b| a.bic.total_cmp(&b.bic));
    fits
}
