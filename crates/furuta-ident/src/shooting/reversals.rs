//! Where an arm turned back, for the friction that remembers its way.
//!
//! Presliding friction knows nothing of speed, only of the ways between reversals. Read off an encoder, a resting arm
//! seems to go a long way in steps of a count, in which the friction would forget how it is bent. So angles are
//! smoothed, and the arm has turned back only where it then went farther than the noise.

/// An arm that has turned back goes farther than this many times the encoder's noise.
const WIDE: f64 = 2.0;
/// How many reversals are remembered: behind them, next to nothing is left of what was before.
const REVERSALS: usize = 64;

/// Where an angle turned back.
#[derive(Clone, Debug, Default)]
pub(crate) struct Reversals {
    /// The angle, rad.
    angles: Vec<f64>,
    /// The samples at which it began and turned back, in order.
    turns: Vec<usize>,
}

impl Reversals {
    /// From smoothed angles (rad) and the noise of their encoder (rad).
    pub(crate) fn new(angles: Vec<f64>, noise: f64) -> Self {
        let (mut turns, mut forward, mut farthest) = (vec![0], None, 0);
        for (sample, angle) in angles.iter().enumerate() {
            let gone = angle - angles[farthest];
            if forward != Some(gone > 0.0) {
                if gone.abs() <= WIDE * noise {
                    continue;
                }
                if forward.is_some() {
                    turns.push(farthest);
                }
                forward = Some(gone > 0.0);
            }
            farthest = sample;
        }
        Self { angles, turns }
    }

    /// The angles at the start and the reversals on the way to a sample, and there, rad.
    pub(crate) fn to(&self, sample: usize) -> impl Iterator<Item = f64> {
        let past = self.turns.partition_point(|turn| *turn < sample);
        let known = &self.turns[past.saturating_sub(REVERSALS)..past];
        let way = known.iter().copied().chain(std::iter::once(sample));
        way.map(|k| self.angles[k])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bristles that bend over 0.05 rad, after a way.
    fn bend(way: impl Iterator<Item = f64>) -> f64 {
        let (mut z, mut last) = (0.0, None);
        for angle in way {
            let travel: f64 = angle - last.replace(angle).unwrap_or(angle);
            let end = 0.05 * travel.signum();
            z = end + (z - end) * (-travel.abs() / 0.05).exp();
        }
        z
    }

    /// However much of a retreat is taken for noise.
    #[test]
    fn a_way_is_its_reversals() {
        let angles: Vec<f64> = (0..4000).map(|k| (0.01 * f64::from(k)).sin()).collect();
        for noise in [0.0, 0.01, 0.1] {
            let way = Reversals::new(angles.clone(), noise);
            for sample in [0, 1, 100, 157, 158, 2000, 3999] {
                let (by_reversals, by_samples) = (
                    bend(way.to(sample)),
                    bend(angles[..=sample].iter().copied()),
                );
                assert!(
                    (by_reversals - by_samples).abs() < 1e-12,
                    "{noise}, {sample}: {by_reversals} {by_samples}"
                );
            }
            assert!(way.to(3999).count() < 20);
        }
    }

    #[test]
    fn a_resting_arm_goes_no_way_however_its_encoder_flickers() {
        let moved = (0..200).map(|k| 0.001 * f64::from(k));
        let flickering = (0..2000).map(|k| 0.2 + 0.0015 * f64::from(k % 2));
        let angles: Vec<f64> = moved.chain(flickering).collect();
        let way = Reversals::new(angles.clone(), 0.0015);
        let held = bend(way.to(2199));
        assert!(held > 0.045, "{held}");
        let forgotten = bend(angles.iter().copied());
        assert!(forgotten < 0.01, "{forgotten}");
    }
}
