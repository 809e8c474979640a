//! The zeros of each recording among the numbers of a fit: an incremental encoder counts from where the arm rested when
//! it was switched on.

use furuta_model::Jet;

use super::model::{Layout, Observed, Prior};

/// Zeros of a recording: theta's, alpha's.
pub(crate) const ZEROS: usize = 2;
/// The unit of each, and its standard deviation in it, rad: an arm rests at any angle within half a turn when its
/// encoder is switched on (uniform: `pi / sqrt(3)`); a pendulum hangs within its hinge's friction, a count or two.
pub(super) const UNIT: [f64; ZEROS] = [1.0, 0.01];
const STD: [f64; ZEROS] = [1.8, 0.5];
/// How far each may be from where it should, in its unit.
const MOST: [f64; ZEROS] = [100.0, 10.0];

/// How many zeros of its own each recording has.
pub(crate) const fn zeros_each(own: bool) -> usize {
    if own { ZEROS } else { 0 }
}

/// Bounds of the zeros of all recordings. Theta's rest where nothing depends on the arm's absolute angle, and in the
/// `reference`, from whose zero angles of rest are counted.
pub(crate) fn zero_bounds(
    layout: &Layout,
    sees_angle: bool,
    reference: Option<usize>,
) -> Vec<(f64, f64)> {
    let zeros = layout.len() - layout.shared;
    let bound = |i: usize| match i % ZEROS {
        0 if !sees_angle || Some(i / ZEROS) == reference => (0.0, 0.0),
        k => (-MOST[k], MOST[k]),
    };
    (0..zeros).map(bound).collect()
}

/// What is known of the zeros of all recordings.
pub(crate) fn zero_priors(layout: &Layout) -> Vec<Option<Prior>> {
    let zeros = layout.len() - layout.shared;
    let prior = |i: usize| Prior {
        mean: 0.0,
        std: STD[i % ZEROS],
    };
    (0..zeros).map(prior).map(Some).collect()
}

/// The vector with each zero of theta within half a turn.
pub(super) fn turned_back(layout: &Layout, z: &[f64]) -> Vec<f64> {
    const TURN: f64 = std::f64::consts::TAU / UNIT[0];
    let mut z = z.to_vec();
    for zeros in z[layout.shared..].chunks_mut(layout.zeros.max(1)) {
        zeros[0] -= TURN * (zeros[0] / TURN).round();
    }
    z
}

/// The units of the zeros of all recordings, rad.
pub(crate) fn zero_units(layout: &Layout) -> Vec<f64> {
    let zeros = layout.len() - layout.shared;
    (0..zeros).map(|i| UNIT[i % ZEROS]).collect()
}

impl<const N: usize> Observed<Jet<f64, N>> {
    /// Reads the zeros of each recording from a vector; they are the last numbers that a window depends on.
    pub(crate) fn free_zeros(&mut self, layout: &Layout, z: &[f64]) {
        if layout.zeros == 0 {
            return;
        }
        let zero = |r: usize, k: usize| {
            let mut x = Jet::constant(z[layout.zero(r, k)] * UNIT[k]);
            let local = 4 + layout.lead + k;
            if local < N {
                x.d[local] = UNIT[k];
            }
            x
        };
        self.zeros = (0..layout.recordings)
            .map(|r| std::array::from_fn(|k| zero(r, k)))
            .collect();
    }
}
