//! A linear plant sampled with a held command that is late by any share of a sample.

use furuta_model::discretize::zero_order_hold;
use furuta_model::linear_plant::{LinearPlant, MAX_STATES};
use nalgebra::{RowSVector, SMatrix, SVector};

/// The plant's states and the integral of the arm's angle.
const WITH_INTEGRAL: usize = MAX_STATES + 1;

/// `z[k+1] = A z[k] + newer u[k - whole] + older u[k - whole - 1]`.
#[derive(Clone, Debug)]
pub(super) struct Sampled {
    pub(super) a: SMatrix<f64, MAX_STATES, MAX_STATES>,
    pub(super) newer: SVector<f64, MAX_STATES>,
    pub(super) older: SVector<f64, MAX_STATES>,
    /// Whole samples of the delay.
    pub(super) whole: usize,
    pub(super) period: f64,
    /// The integral of the arm's angle over a sample, in the same terms.
    pub(super) integral: Growth,
}

/// `s[k+1] = s[k] + row z[k] + newer u[k - whole] + older u[k - whole - 1]`.
#[derive(Clone, Debug)]
pub(super) struct Growth {
    pub(super) row: RowSVector<f64, MAX_STATES>,
    pub(super) newer: f64,
    pub(super) older: f64,
}

/// A rest of a sample below this share of it is rounding.
const ROUNDING: f64 = 1e-9;

impl Sampled {
    /// Exact: within a sample the older command acts for the rest of the delay, the newer one after it.
    pub(super) fn new(plant: &LinearPlant, delay: f64, period: f64) -> Self {
        let samples = delay / period;
        let mut whole = samples.floor();
        let mut rest = samples - whole;
        if rest > 1.0 - ROUNDING {
            whole += 1.0;
            rest = 0.0;
        } else if rest < ROUNDING {
            rest = 0.0;
        }
        let (first, second) = (rest * period, (1.0 - rest) * period);
        let (with, drive) = with_integral(plant);
        let (mut a, all) = zero_order_hold(&with, &drive, period);
        for unused in plant.states.len()..MAX_STATES {
            a[(unused, unused)] = 0.0;
        }
        let (newer, older) = if rest == 0.0 {
            (all, SVector::zeros())
        } else {
            let (on, newer) = zero_order_hold(&with, &drive, second);
            let (_, older) = zero_order_hold(&with, &drive, first);
            (newer, on * older)
        };
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // at most a few hundred
        let whole = whole as usize;
        Self {
            a: a.fixed_view::<MAX_STATES, MAX_STATES>(0, 0).into_owned(),
            newer: newer.fixed_rows::<MAX_STATES>(0).into_owned(),
            older: older.fixed_rows::<MAX_STATES>(0).into_owned(),
            whole,
            period,
            integral: Growth {
                row: a.fixed_view::<1, MAX_STATES>(MAX_STATES, 0).into_owned(),
                newer: newer[MAX_STATES],
                older: older[MAX_STATES],
            },
        }
    }

    /// How many commands the future depends on.
    pub(super) fn remembered(&self) -> usize {
        self.whole + usize::from(self.older.iter().any(|b| *b != 0.0))
    }
}

/// The plant with the integral of the arm's angle behind its states.
fn with_integral(
    plant: &LinearPlant,
) -> (
    SMatrix<f64, WITH_INTEGRAL, WITH_INTEGRAL>,
    SVector<f64, WITH_INTEGRAL>,
) {
    let mut a = SMatrix::<f64, WITH_INTEGRAL, WITH_INTEGRAL>::zeros();
    a.fixed_view_mut::<MAX_STATES, MAX_STATES>(0, 0)
        .copy_from(&plant.a);
    a[(MAX_STATES, 0)] = 1.0;
    let b = SVector::from_fn(|i, _| if i < MAX_STATES { plant.b[i] } else { 0.0 });
    (a, b)
}
