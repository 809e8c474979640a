//! What is fitted: numbers that make a plant, and what stands between that plant and each recording.

use core::ops::Range;

use furuta_model::{Jet, Plant, Scalar};

use super::late::Late;

/// A plant as the recordings see it.
#[derive(Clone, Debug)]
pub(crate) struct Observed<S> {
    pub(crate) plant: Plant<S>,
    /// By how much commands or readings are late.
    late: Late<S>,
    /// For each recording, the true `[theta, alpha]` at which its encoders read zero, rad; those left out are zero.
    pub(crate) zeros: Vec<[S; 2]>,
    /// For each recording of the rig in another state (its pendulum off, its arm held) the plant that it is then, and
    /// by how much it is late; those left out are of `plant`.
    pub(crate) otherwise: Vec<Option<(Plant<S>, Late<S>)>>,
}

impl<S: Scalar<Real = f64>> Observed<S> {
    /// A plant whose encoders count from the true zeros.
    pub(crate) fn from_true_zeros(plant: Plant<S>, late: Late<S>) -> Self {
        Self {
            plant,
            late,
            zeros: Vec::new(),
            otherwise: Vec::new(),
        }
    }

    /// The zeros of a recording's encoders.
    #[inline(always)]
    pub(crate) fn zero(&self, recording: usize) -> [S; 2] {
        self.zeros.get(recording).copied().unwrap_or([S::ZERO; 2])
    }

    /// The plant of a recording.
    #[inline(always)]
    pub(crate) fn plant_in(&self, recording: usize) -> &Plant<S> {
        let otherwise = self.otherwise.get(recording).and_then(Option::as_ref);
        otherwise.map_or(&self.plant, |(plant, _)| plant)
    }

    /// By how much commands or readings of a recording are late.
    #[inline(always)]
    pub(crate) fn late_in(&self, recording: usize) -> &Late<S> {
        let otherwise = self.otherwise.get(recording).and_then(Option::as_ref);
        otherwise.map_or(&self.late, |(_, late)| late)
    }

    /// The same in another scalar, all a constant.
    pub(crate) fn cast<T: Scalar<Real = f64>>(&self) -> Observed<T> {
        let number = |x: S| T::from_f64(x.value());
        Observed {
            plant: self.plant.cast(),
            late: self.late.cast(),
            zeros: self.zeros.iter().map(|z| z.map(number)).collect(),
            otherwise: (self.otherwise.iter())
                .map(|o| o.as_ref().map(|(plant, late)| (plant.cast(), late.cast())))
                .collect(),
        }
    }

    /// The same without derivatives.
    pub(crate) fn plain(&self) -> Observed<f64> {
        self.cast()
    }
}

/// How a vector of numbers is laid out: first those that all recordings share, then the zeros of each recording.
///
/// A window depends on the shared numbers and on the zeros of its own recording, which come behind the `lead` first
/// ones: what every model has stands at the same places, whatever follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Layout {
    /// Numbers that all recordings share.
    pub(crate) shared: usize,
    /// How many of them come before the zeros among those that a window depends on.
    pub(crate) lead: usize,
    /// Zeros of one recording.
    pub(crate) zeros: usize,
    /// Recordings that there are.
    pub(crate) recordings: usize,
}

impl Layout {
    /// Length of the vector.
    pub(crate) const fn len(&self) -> usize {
        self.shared + self.zeros * self.recordings
    }

    /// How many of its numbers one window can depend on.
    pub(crate) const fn local(&self) -> usize {
        self.shared + self.zeros
    }

    /// Where in the vector the `i`-th number that a window of this recording depends on stands.
    pub(crate) const fn place(&self, recording: usize, i: usize) -> usize {
        if i < self.lead {
            i
        } else if i < self.lead + self.zeros {
            self.zero(recording, i - self.lead)
        } else {
            i - self.zeros
        }
    }

    /// Where the `i`-th shared number stands among those that a window depends on.
    pub(crate) const fn local_of(&self, i: usize) -> usize {
        if i < self.lead { i } else { i + self.zeros }
    }

    /// Where the `k`-th zero of a recording stands in the vector.
    pub(crate) const fn zero(&self, recording: usize, k: usize) -> usize {
        self.shared + recording * self.zeros + k
    }
}

/// Which derivatives one simulation of a window finds. Its variables are numbered: the four of the state at its start,
/// then the numbers that it depends on ([`Layout::place`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Pass {
    /// The variable of its first derivative.
    pub(super) first: usize,
}

impl Pass {
    /// The one that begins with the state.
    pub(crate) const FIRST: Self = Self { first: 0 };
    /// The one that begins with the numbers.
    pub(crate) const NUMBERS: Self = Self { first: 4 };

    /// Which of the `N` derivatives is that of the `i`-th number that a window depends on; `None`: it is held.
    pub(crate) fn derivative<const N: usize>(self, i: usize) -> Option<usize> {
        (4 + i).checked_sub(self.first).filter(|k| *k < N)
    }
}

/// What is known of a number before any recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Prior {
    /// Its most likely value, in units of the vector.
    pub(crate) mean: f64,
    /// Its standard deviation, in units of the vector.
    pub(crate) std: f64,
}

/// What a fit varies. Numbers are in units of their natural size.
pub(crate) trait Model: Clone + Send + Sync {
    /// How the vector is laid out.
    fn layout(&self) -> Layout;

    /// The plant for a vector, with the derivatives of a pass with respect to the numbers that a window depends on
    /// ([`Layout::place`]).
    fn observed<const N: usize>(&self, z: &[f64], pass: Pass) -> Observed<Jet<f64, N>>;

    /// Where each number may lie; one that is held has equal bounds.
    fn bounds(&self, z: &[f64]) -> Vec<(f64, f64)>;

    /// What is known of each number beforehand; `None`: nothing.
    fn priors(&self) -> Vec<Option<Prior>>;

    /// The numbers that tell how, where or when a strength acts: they mean nothing where it is none.
    fn shape(&self, _strength: usize) -> Range<usize> {
        0..0
    }
}
