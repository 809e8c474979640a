//! A command that acts later than the state is known.
//!
//! What was commanded and has not acted yet are states of the controller, and the model's states are carried to the
//! time from which the next command acts:
//!
//! ```text
//! e(t + n h + f) = A^n (Af e(t) + Bf u[-n-1]) + A^(n-1) B u[-n] + ... + B u[-1],    0 <= f < h
//! ```
//!
//! `Af`, `Bf` hold a command over `f`, `A`, `B` over a period: exact for any share of a sample (K. J. Åström, B.
//! Wittenmark, *Computer-Controlled Systems*, 3rd ed. 1997, 2.3). From there on the problem is that without delay, and
//! its solution that of the model with the past commands as states, the cost counted from when a command acts.

use super::PAST;
use super::preview::{plus, times};
use crate::real::{Real, c};
use furuta_model::Linear;
use furuta_model::discretize::zero_order_hold;

/// A sampled model that carries an error forward.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) struct Late<T> {
    /// Whole periods `n`.
    samples: usize,
    /// Whether there is a share `f` of one beyond.
    part: bool,
    /// `Af`, `Bf`.
    over_part: ([[T; 4]; 4], [T; 4]),
    /// `A`, `B`.
    over_period: ([[T; 4]; 4], [T; 4]),
}

impl Late<f64> {
    /// A delay (s) at the sample period `h` (s); `None` where it spans more commands than are remembered.
    pub(super) fn new(model: &Linear, h: f64, delay: f64) -> Option<Self> {
        let held = |time: f64| {
            let (a, b) = zero_order_hold(&model.a, &model.b, time);
            let rows = core::array::from_fn(|i| core::array::from_fn(|j| a[(i, j)]));
            (rows, b.into())
        };
        let periods = delay / h;
        // A share that is rounding is none.
        let near = libm::round(periods);
        let whole = if (periods - near).abs() < 1e-9 {
            near
        } else {
            libm::floor(periods)
        };
        let part = periods - whole > 1e-9;
        #[allow(clippy::cast_precision_loss)]
        let most = (PAST - usize::from(part)) as f64;
        if !(whole >= 0.0 && whole <= most) {
            return None;
        }
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // within `PAST`
        let samples = whole as usize;
        Some(Self {
            samples,
            part,
            over_part: held(if part { delay - whole * h } else { 0.0 }),
            over_period: held(h),
        })
    }

    pub(super) fn cast<T: Real>(&self) -> Late<T> {
        let cast = |(a, b): ([[f64; 4]; 4], [f64; 4])| (a.map(|row| row.map(c)), b.map(c));
        Late {
            samples: self.samples,
            part: self.part,
            over_part: cast(self.over_part),
            over_period: cast(self.over_period),
        }
    }
}

impl<T: Real> Late<T> {
    /// The sample whose reference holds when the command begins to act.
    pub(super) fn acts_in(&self) -> u32 {
        u32::try_from(self.samples).unwrap_or(u32::MAX)
    }

    /// The error when a command given now begins to act; `past` are the commands so far, the last one first.
    pub(super) fn carry(&self, e: [T; 4], past: &[T; PAST]) -> [T; 4] {
        let mut e = e;
        let step = |(a, b): &([[T; 4]; 4], [T; 4]), e: &[T; 4], u: T| {
            plus(&times(a, e), &b.map(|b| b * u))
        };
        if self.part {
            let u = past.get(self.samples).copied().unwrap_or(T::ZERO);
            e = step(&self.over_part, &e, u);
        }
        for u in past.iter().take(self.samples).rev() {
            e = step(&self.over_period, &e, *u);
        }
        e
    }
}
