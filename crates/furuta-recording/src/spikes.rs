//! Single samples of an angle that no motion explains: a glitch of an encoder's counter, a bit that flipped on the
//! wire.

use core::f64::consts::TAU;

/// How far a sample is from the middle of its neighbours is compared with what this share of all samples is within,
const USUAL: f64 = 0.75;
/// of which it must be this many times: seventeen standard deviations of noise.
const TIMES: f64 = 15.0;
/// Half a count of the finest encoders is 5e-5 rad; what is smaller than this is rounding of the numbers.
const NO_STEP: f64 = 1e-5;
/// The neighbours are off by half as much the other way; rounding and motion may make it this share. A blow leaves its
/// neighbours where they are.
const HALF: core::ops::Range<f64> = 0.3..0.7;

/// The places of such samples, and how far the first is off. A whole turn is no such step: an angle may be recorded
/// modulo a turn.
pub(super) fn spikes(values: &[f64]) -> Option<(Vec<usize>, f64)> {
    let from_middle = |k: usize| -> Option<f64> {
        let [before, here, behind] = [k.checked_sub(1)?, k, k + 1].map(|k| values.get(k));
        let (before, here, behind) = (before?, here?, behind?);
        let turn = |x: f64| x - (x / TAU).round() * TAU;
        Some(0.5 * (turn(here - before) - turn(behind - here)))
    };
    let off: Vec<f64> = (0..values.len())
        .filter_map(|k| from_middle(k + 1))
        .collect();
    let mut sizes: Vec<f64> = off.iter().map(|d| d.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    // The smallest step there is: an angle that rests most of the time has no usual size.
    let count = sizes.iter().copied().find(|d| *d > NO_STEP)?;
    let usual = sizes.get((USUAL * sizes.len() as f64) as usize)?.max(count);
    let is_spike = |d: &[f64]| {
        let &[before, here, behind] = d else {
            return false;
        };
        here.abs() > TIMES * usual && [before, behind].iter().all(|d| HALF.contains(&(-d / here)))
    };
    let places: Vec<usize> = off
        .windows(3)
        .enumerate()
        .filter_map(|(k, d)| is_spike(d).then_some(k + 2))
        .collect();
    let &first = places.first()?;
    Some((places, off.get(first - 1).copied()?))
}

#[cfg(test)]
mod tests {
    use super::spikes;
    use core::f64::consts::{PI, TAU};

    const COUNT: f64 = TAU / 2048.0;

    fn swing() -> Vec<f64> {
        let angle = |k: usize| (PI + 1.2 * (0.012 * k as f64).sin()) / COUNT;
        (0..2000).map(|k| angle(k).round() * COUNT).collect()
    }

    #[test]
    fn only_a_sample_that_no_motion_explains_stands_out() {
        assert_eq!(spikes(&swing()), None);
        let mut glitch = swing();
        glitch[700] += 0.2;
        glitch[1500] -= 0.1;
        let (places, by) = spikes(&glitch).unwrap_or_default();
        assert_eq!(places, [700, 1500]);
        assert!((by - 0.2).abs() < 2.0 * COUNT);
        // A blow: the speed turns round between two samples.
        let blow: Vec<f64> = (0..2000_i32)
            .map(|k| (f64::from((k - 1000).abs()) * 0.03 / COUNT).round() * COUNT)
            .collect();
        assert_eq!(spikes(&blow), None);
        // Lost counts: a step that stays.
        let lost: Vec<f64> = swing()
            .iter()
            .enumerate()
            .map(|(k, x)| if k < 900 { *x } else { x + 0.15 })
            .collect();
        assert_eq!(spikes(&lost), None);
        // Modulo a turn, flickering about the seam.
        let turned: Vec<f64> = swing()
            .iter()
            .map(|x| (x + PI).rem_euclid(TAU) - PI)
            .collect();
        assert_eq!(spikes(&turned), None);
        // At rest but for one count.
        let mut rest = vec![PI; 500];
        rest[250] += COUNT;
        assert_eq!(spikes(&rest), None);
        // The same in numbers that are rounded themselves.
        rest[100] += 1e-15;
        assert_eq!(spikes(&rest), None);
    }
}
