//! The zeros of each recording among the numbers of a fit: an incremental encoder counts from where the arm rested when
//! it was switched on.

use furuta_model::{Jet, Sensors};

use super::model::{Layout, Observed, Pass, Prior};

/// Zeros of a recording: theta's, alpha's.
pub(crate) const ZEROS: usize = 2;
/// The unit of each, rad.
pub(super) const UNIT: [f64; ZEROS] = [1.0, 0.01];
/// One standard deviation of theta's, rad: an arm rests at any angle within half a turn when its encoder is switched on
/// (uniform: `pi / sqrt(3)`).
const STD_THETA: f64 = 1.8;
/// The same of alpha's, counts: a pendulum hangs where its hinge holds it, within a count or two; and, where counts are
/// finer than that, a tenth of a degree, rad (those of the four chirps in examples/qube-servo-2 are 0.0007 to 0.0012).
const STD_ALPHA: (f64, f64) = (1.5, 0.002);
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
pub(crate) fn zero_priors(layout: &Layout, sensors: &Sensors) -> Vec<Option<Prior>> {
    let zeros = layout.len() - layout.shared;
    let [_, count] = sensors.resolution();
    let std = [STD_THETA, (STD_ALPHA.0 * count).max(STD_ALPHA.1)];
    let prior = |i: usize| Prior {
        mean: 0.0,
        std: std[i % ZEROS] / UNIT[i % ZEROS],
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
    pub(crate) fn free_zeros(&mut self, layout: &Layout, z: &[f64], pass: Pass) {
        if layout.zeros == 0 {
            return;
        }
        let zero = |r: usize, k: usize| {
            let mut x = Jet::constant(z[layout.zero(r, k)] * UNIT[k]);
            if let Some(d) = pass.derivative::<N>(layout.lead + k) {
                x.d[d] = UNIT[k];
            }
            x
        };
        self.zeros = (0..layout.recordings)
            .map(|r| std::array::from_fn(|k| zero(r, k)))
            .collect();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of encoders with 2048 counts, and with counts so fine that the hinge tells.
    #[test]
    fn a_pendulum_hangs_within_a_count_or_two() {
        let layout = Layout {
            shared: 0,
            lead: 0,
            zeros: ZEROS,
            recordings: 1,
        };
        for (counts, std) in [(2048.0, 1.5 * std::f64::consts::TAU / 2048.0), (1e5, 0.002)] {
            let sensors = Sensors {
                arm_counts_per_rev: 512.0,
                pendulum_counts_per_rev: counts,
            };
            let priors = zero_priors(&layout, &sensors);
            let alpha = priors[1].expect("known").std * UNIT[1];
            assert!((alpha - std).abs() < 1e-15, "{counts}: {alpha}");
        }
    }
}
