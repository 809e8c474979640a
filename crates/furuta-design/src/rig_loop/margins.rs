//! Gain, phase, delay and disk margins of a loop that is broken at the command.
//!
//! With the loop transfer `L`, the closed loop is on its edge where `L = -1`. The margins say how far it is from there:
//!
//! - gain: the factors on the law between which the loop stays stable, from the real negative values of `L`;
//! - phase: the least angle between `L` and -1 where `|L| = 1`;
//! - delay: by how much the command may be later; sampled loops are taken with the delay itself, held command and all,
//!   not with its phase alone, up to a delay of [`MAX_DELAY_SAMPLES`] samples;
//! - disk: `2 min |1 + L| / |1 - L|`: gain and phase may change at once, at any frequency, by what a disk of this size
//!   holds (P. Seiler, A. Packard, P. Gahinet, *An introduction to disk margins*, IEEE Control Systems 40, 2020; no
//!   skew).

use furuta_model::plant::MAX_DELAY_SAMPLES;
use nalgebra::Complex;
use std::f64::consts::{PI, TAU};

/// How far a loop is from its edge. All are 0 where it is not stable.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Margins {
    /// Whether it is stable.
    pub stable: bool,
    /// The law may be multiplied by more than the first factor (0: by anything above 0) and less than the second
    /// (infinite: there is no limit).
    pub gain: [f64; 2],
    /// rad; infinite where `|L|` is never 1.
    pub phase: f64,
    /// s; infinite where no delay matters.
    pub delay: f64,
    /// 0 to 2.
    pub disk: f64,
    /// Frequencies (rad/s) at which the two gain limits, the phase and the disk margin are reached; not a number where
    /// there is none.
    pub at: [f64; 4],
}

impl Margins {
    const NONE: Self = Self {
        stable: false,
        gain: [1.0, 1.0],
        phase: 0.0,
        delay: 0.0,
        disk: 0.0,
        at: [f64::NAN; 4],
    };

    /// Takes notice that the loop is the real number `l` at `w` (rad/s).
    fn crosses(&mut self, w: f64, l: Complex<f64>) {
        let factor = -1.0 / l.re;
        if l.re < 0.0 && factor <= 1.0 && factor > self.gain[0] {
            (self.gain[0], self.at[0]) = (factor, w);
        } else if l.re < 0.0 && factor > 1.0 && factor < self.gain[1] {
            (self.gain[1], self.at[1]) = (factor, w);
        }
    }

    /// The gain factors that the disk margin guarantees, at any frequency and together with a phase.
    #[must_use]
    pub fn disk_gain(&self) -> [f64; 2] {
        let d = self.disk;
        [(2.0 - d) / (2.0 + d), (2.0 + d) / (2.0 - d)]
    }

    /// The phase (rad) that the disk margin guarantees.
    #[must_use]
    pub fn disk_phase(&self) -> f64 {
        2.0 * (0.5 * self.disk).atan()
    }
}

/// Frequencies per decade of the first look.
const PER_DECADE: f64 = 500.0;

/// A loop that can be broken at the command.
pub(super) trait Broken {
    /// Largest real part of the closed loop's poles, as those of continuous time, 1/s.
    fn growth(&self) -> f64;
    /// The same with the command later by `more` (s).
    fn delayed_growth(&self, more: f64) -> f64;
    /// Sample period, s.
    fn period(&self) -> Option<f64>;
    /// Poles of the closed and the open loop as those of continuous time: where to look.
    fn rates(&self) -> Vec<Complex<f64>>;
    /// `L` at `omega`, rad/s.
    fn response(&self, omega: f64) -> Complex<f64>;
}

/// The margins of a loop.
pub(super) fn margins(of: &impl Broken) -> Margins {
    if !(of.growth() < 0.0) {
        return Margins::NONE;
    }
    let grid = frequencies(of);
    let values: Vec<Complex<f64>> = grid.iter().map(|w| of.response(*w)).collect();
    let mut found = Margins {
        stable: true,
        gain: [0.0, f64::INFINITY],
        phase: f64::INFINITY,
        delay: f64::INFINITY,
        disk: f64::INFINITY,
        at: [f64::NAN; 4],
    };
    // At its ends the response is real.
    let still = of.response(0.0);
    // Not where an integration makes it infinite.
    if still.norm() < 1e9 && still.im.abs() < 1e-6 * still.norm() {
        found.crosses(0.0, still);
    }
    if let (Some(_), Some(w), Some(l)) = (of.period(), grid.last(), values.last()) {
        found.crosses(*w, *l);
    }
    let mut least = f64::INFINITY;
    for k in 1..grid.len() {
        let (ends, l) = ([grid[k - 1], grid[k]], [values[k - 1], values[k]]);
        if l[0].im * l[1].im < 0.0 && l[0].re.min(l[1].re) < 0.0 {
            let w = crossing(ends, |w| of.response(w).im);
            found.crosses(w, of.response(w));
        }
        if (l[0].norm() - 1.0) * (l[1].norm() - 1.0) < 0.0 {
            let w = crossing(ends, |w| of.response(w).norm() - 1.0);
            let angle = of.response(w).arg();
            let phase = (PI - angle.abs()).abs();
            if phase < found.phase {
                (found.phase, found.at[2]) = (phase, w);
            }
            let lag = (angle + PI).rem_euclid(TAU);
            least = least.min(lag / w);
        }
    }
    let near = |l: Complex<f64>| 2.0 * (l + 1.0).norm() / (l - 1.0).norm();
    for k in 0..grid.len() {
        let here = near(values[k]);
        let lowest = (k == 0 || here <= near(values[k - 1]))
            && (k + 1 == grid.len() || here <= near(values[k + 1]));
        if lowest {
            let ends = [grid[k.saturating_sub(1)], grid[(k + 1).min(grid.len() - 1)]];
            let (w, value) = minimum(ends, |w| near(of.response(w)));
            let (w, value) = if value < here {
                (w, value)
            } else {
                (grid[k], here)
            };
            if value < found.disk {
                (found.disk, found.at[3]) = (value, w);
            }
        }
    }
    found.disk = found.disk.min(2.0);
    found.delay = match of.period() {
        // Each sample of a delay is a state. Of that many, a share of one matters no more.
        Some(period) if least <= MAX_DELAY_SAMPLES as f64 * period => exact_delay(of, least),
        Some(_) => least,
        None => least,
    };
    found
}

/// Where to look, rad/s: evenly in the logarithm over all rates of the loop, and closely about each of its resonances.
fn frequencies(of: &impl Broken) -> Vec<f64> {
    let poles = of.rates();
    let nyquist = of.period().map(|h| PI / h);
    let rates: Vec<f64> = poles
        .iter()
        .map(|p| p.norm())
        .filter(|r| *r > 1e-6 && r.is_finite())
        .collect();
    let slowest = rates.iter().copied().fold(f64::INFINITY, f64::min).min(1.0);
    let fastest = rates.iter().copied().fold(1.0, f64::max);
    let (low, high) = (1e-3 * slowest, nyquist.unwrap_or(1e3 * fastest));
    let decades = (high / low).log10();
    let count = (PER_DECADE * decades).ceil().max(2.0);
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let mut grid: Vec<f64> = (0..=count as usize)
        .map(|k| low * 10f64.powf(decades * k as f64 / count))
        .collect();
    for pole in poles.iter().filter(|p| p.im > low && p.im < high) {
        let width = pole.re.abs().max(1e-6 * pole.im);
        grid.extend((-40..=40).map(|k| pole.im + 0.1 * f64::from(k) * width));
    }
    grid.retain(|w| *w >= low && *w < high);
    grid.push(high);
    grid.sort_by(f64::total_cmp);
    grid.dedup();
    grid
}

/// Where `f` changes its sign between two frequencies.
fn crossing([mut low, mut high]: [f64; 2], f: impl Fn(f64) -> f64) -> f64 {
    let positive = f(low) > 0.0;
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if (f(middle) > 0.0) == positive {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// Where `f` is least between two frequencies, by golden section.
fn minimum([mut low, mut high]: [f64; 2], f: impl Fn(f64) -> f64) -> (f64, f64) {
    const SHARE: f64 = 0.618_033_988_749_894_8;
    let mut inner = [high - SHARE * (high - low), low + SHARE * (high - low)];
    let mut values = inner.map(&f);
    for _ in 0..60 {
        if values[0] < values[1] {
            (high, inner[1], values[1]) = (inner[1], inner[0], values[0]);
            inner[0] = high - SHARE * (high - low);
            values[0] = f(inner[0]);
        } else {
            (low, inner[0], values[0]) = (inner[0], inner[1], values[1]);
            inner[1] = low + SHARE * (high - low);
            values[1] = f(inner[1]);
        }
    }
    (inner[0], values[0].min(values[1]))
}

/// The first delay at which a sampled loop is no longer stable, near what its phase says.
fn exact_delay(of: &impl Broken, by_phase: f64) -> f64 {
    if !by_phase.is_finite() {
        return f64::INFINITY;
    }
    let stable = |more: f64| of.delayed_growth(more) < 0.0;
    const LOOKS: u32 = 64;
    let step = 4.0 * by_phase / f64::from(LOOKS);
    let Some(first) = (1..=LOOKS)
        .map(|k| f64::from(k) * step)
        .find(|t| !stable(*t))
    else {
        return f64::INFINITY;
    };
    let (mut low, mut high) = (first - step, first);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if stable(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}
