//! The zeros of recordings that a fit has not seen: an incremental encoder counts from where the arm rested when it was
//! switched on.

use furuta_model::Jet;

use super::data::{Data, Run, Window};
use super::fit::{Effort, Problem};
use super::model::{Layout, Model, Observed, Prior};

/// Zeros of a recording: theta's, alpha's.
pub(crate) const ZEROS: usize = 2;
/// The unit of each, and its standard deviation in it, rad: an arm rests at any angle within half a turn when its
/// encoder is switched on (uniform: `pi / sqrt(3)`); a pendulum hangs within its hinge's friction, a count or two.
const UNIT: [f64; ZEROS] = [1.0, 0.01];
const STD: [f64; ZEROS] = [1.8, 0.5];
/// How far each may be from where it should, in its unit.
const MOST: [f64; ZEROS] = [100.0, 10.0];

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

/// A plant of which nothing but the zeros of the recordings is free.
#[derive(Clone)]
struct OnlyZeros {
    seen: Observed<f64>,
    layout: Layout,
    bounds: Vec<(f64, f64)>,
    priors: Vec<Option<Prior>>,
}

impl OnlyZeros {
    fn of<M: Model>(model: &M, z: &[f64]) -> Self {
        let layout = model.layout();
        Self {
            seen: model.observed::<4>(z).plain(),
            layout: Layout {
                shared: 0,
                lead: 0,
                ..layout
            },
            bounds: model.bounds(z).split_off(layout.shared),
            priors: model.priors().split_off(layout.shared),
        }
    }
}

impl Model for OnlyZeros {
    fn layout(&self) -> Layout {
        self.layout
    }

    fn observed<const N: usize>(&self, z: &[f64]) -> Observed<Jet<f64, N>> {
        let mut seen = self.seen.cast();
        seen.free_zeros(&self.layout, z);
        seen
    }

    fn bounds(&self, _: &[f64]) -> Vec<(f64, f64)> {
        self.bounds.clone()
    }

    fn priors(&self) -> Vec<Option<Prior>> {
        self.priors.clone()
    }
}

/// Zeros are found in the first part of a recording of this length, s, over windows of the second.
const FIRST: f64 = 3.0;
const WINDOW: f64 = 0.5;

/// The vector with the zeros that suit the first seconds of each recording that is `wanted`, everything else held.
pub(crate) fn with_zeros_found<M: Model>(
    data: &Data,
    wanted: impl Fn(&Run) -> bool,
    model: &M,
    z: &[f64],
) -> Vec<f64> {
    let shared = model.layout().shared;
    if model.layout().zeros == 0 {
        return z.to_vec();
    }
    let early = |w: &Window| (w.start as f64) * data.runs[w.run].h < FIRST;
    let mut windows = data.windows(WINDOW, wanted);
    windows.retain(early);
    let problem = Problem::new(data, windows);
    let only = OnlyZeros::of(model, z);
    let solved = problem.solve_states(&only, &z[shared..], None);
    let found = problem.fit(&only, solved.z, &solved.states, Effort::FULL);
    z[..shared].iter().copied().chain(found.z).collect()
}
