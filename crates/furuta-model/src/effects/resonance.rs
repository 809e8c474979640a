//! A command that is followed by ringing: a mass on a spring whose other end moves as commanded.

use crate::scalar::Scalar;

/// What follows a command by ringing about it. A period of zero: it follows at once.
///
/// With the command `u` the follower is behind by `e`, `e'' = u - 2 damping w e' - w² e`, `w = 2 pi/period`; what acts
/// is `2 damping w e' + w² e`.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Resonance<S> {
    /// Of a free swing without damping, s.
    pub period: S,
    /// Of critical damping, 0 to 1.
    pub damping: S,
}

impl<S: Scalar> Resonance<S> {
    /// Without ringing.
    pub const NONE: Self = Self {
        period: S::ZERO,
        damping: S::ZERO,
    };

    /// Its rate without damping, rad/s.
    #[inline(always)]
    #[must_use]
    pub fn rate(&self) -> S {
        S::from_f64(core::f64::consts::TAU) / self.period
    }

    /// Twice the damping times the rate, 1/s.
    #[inline(always)]
    #[must_use]
    pub fn decay(&self) -> S {
        let w = self.rate() * self.damping;
        w + w
    }

    /// How far the follower is behind a command that does not change, and that it is not getting on: `[e, e']`.
    #[inline(always)]
    pub(crate) fn settled(&self, command: S) -> [S; 2] {
        let w = self.rate();
        [command / (w * w), S::ZERO]
    }

    /// What acts where it is behind by `[e, e']`.
    #[inline(always)]
    pub(crate) fn output(&self, [e, rate]: [S; 2]) -> S {
        let w = self.rate();
        w * w * e + self.decay() * rate
    }

    /// `[e, e']` after `h` seconds under a command that is held: exact.
    #[inline(always)]
    pub(crate) fn after(&self, state: [S; 2], command: S, h: S) -> [S; 2] {
        let w = self.rate();
        let [end, _] = self.settled(command);
        let [away, rate] = [state[0] - end, state[1]];
        let damped = w * self.damping;
        let swing = w * (S::ONE - self.damping * self.damping).sqrt();
        let (sin, cos) = (swing * h).sin_cos();
        let fading = (-(damped * h)).exp();
        [
            end + fading * (away * cos + (rate + damped * away) / swing * sin),
            fading * (rate * cos - (w * w * away + damped * rate) / swing * sin),
        ]
    }
}
