//! Scaling of states by powers of two, which leaves every digit as it is (Osborne 1960).

use super::Float;

/// Sweeps over the states at most; two or three are usual.
pub(crate) const SWEEPS: u32 = 10;
/// Doublings or halvings of one scale in one sweep at most.
const STEPS: u32 = 120;

/// How the sizes of a matrix change with the scale `f` of one state:
/// `(falls + falls_twice / f) / f + (grows + grows_twice f) f`.
#[derive(Copy, Clone)]
pub(crate) struct Sizes<T> {
    pub(crate) falls: T,
    pub(crate) falls_twice: T,
    pub(crate) grows: T,
    pub(crate) grows_twice: T,
}

impl<T: Float> Sizes<T> {
    /// Nothing yet.
    pub(crate) fn zero() -> Self {
        Self {
            falls: T::zero(),
            falls_twice: T::zero(),
            grows: T::zero(),
            grows_twice: T::zero(),
        }
    }

    fn at(&self, f: T) -> T {
        (self.falls + self.falls_twice / f) / f + (self.grows + self.grows_twice * f) * f
    }

    /// The power of two that makes the sum smallest, to 5 %; 1 where one side is empty and the sum would fall for ever.
    pub(crate) fn best_factor(&self) -> T {
        let nothing = T::zero();
        let mut f = T::one();
        if self.falls + self.falls_twice == nothing || self.grows + self.grows_twice == nothing {
            return f;
        }
        let [half, two, worth] = [0.5, 2.0, 0.95].map(nalgebra::convert::<f64, T>);
        let mut now = self.at(f);
        for step in [two, half] {
            for _ in 0..STEPS {
                let next = self.at(f * step);
                if !(next < now * worth) {
                    break;
                }
                (f, now) = (f * step, next);
            }
        }
        f
    }
}

#[cfg(test)]
mod tests {
    use super::Sizes;

    #[test]
    fn both_sides_become_alike() {
        let mut sizes = Sizes {
            falls: 1024.0,
            ..Sizes::zero()
        };
        assert_eq!(sizes.best_factor(), 1.0, "nothing grows");
        sizes.grows = 1.0;
        assert_eq!(sizes.best_factor(), 32.0);
        sizes = Sizes {
            falls_twice: 1.0,
            grows_twice: 4096.0 * 16.0,
            ..Sizes::zero()
        };
        assert_eq!(sizes.best_factor(), 1.0 / 16.0);
    }
}
