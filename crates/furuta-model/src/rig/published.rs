//! What the papers behind the built-in rigs printed, and the same figures recomputed from the rig files.
//!
//! The one place where published numbers stand: `furuta rigs NAME` shows them beside ours, and the tests hold ours
//! against them.

mod fong2014;
mod ramos_velasco;
mod shahzad2022;

use crate::params::RANGES;
use crate::rig::Rig;
use crate::state::State;
use crate::transfer::transfer_function;
use crate::{Linear, linearize};
use nalgebra::RowSVector;

/// What a published figure is a figure of. Indices are those of `x = [theta, alpha, theta_dot, alpha_dot]`, whatever
/// order the paper has.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// A physical parameter by its key in the rig file, in SI.
    Parameter(&'static str),
    /// Counts of the arm's encoder in one turn.
    ArmCounts,
    /// Angle of one count of the arm's encoder, rad.
    ArmResolution,
    /// Entry (row, column) of the state matrix upright.
    StateMatrix(usize, usize),
    /// Entry (row) of the input matrix upright.
    InputMatrix(usize),
    /// Coefficient of this power of `s` in the numerator of `alpha(s) / u(s)` hanging, the denominator monic.
    HangingNumerator(usize),
    /// The same in the denominator.
    HangingDenominator(usize),
    /// Entry of the gain `u = -K x` that minimises the integral of `x'x + u²` upright.
    IdentityGain(usize),
    /// Coefficient of `w1^i w2^j` in the arm's angle while the planar model's pendulum follows `alpha = -w2`;
    /// `w1' = w2`, `w2' = -w1` (a sine of 1 rad/s). Planar: without the `sin²(alpha)` inertia, as the paper has it.
    SteadyArmAngle(usize, usize),
    /// The same of the arm's speed.
    SteadyArmSpeed(usize, usize),
    /// The paper does not say enough to compute it again.
    NotReproducible,
}

/// A number as a paper printed it.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Figure {
    /// Where in the paper: equation, table or section.
    pub place: &'static str,
    /// What it is: the paper's symbol for a parameter, our names for matrix entries.
    pub what: &'static str,
    /// The printed value.
    pub printed: f64,
    /// How to compute it again.
    pub quantity: Quantity,
    /// Largest difference, absolute, that rounding in print explains; `None` where ours differs on purpose, as `remark`
    /// says.
    pub within: Option<f64>,
    /// What there is to say; empty where ours is the printed number.
    pub remark: &'static str,
}

/// A mistake in a paper.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Erratum {
    /// Where in the paper.
    pub place: &'static str,
    /// What is printed.
    pub printed: &'static str,
    /// What it should be; the model uses this.
    pub corrected: &'static str,
    /// How we know.
    pub reason: &'static str,
}

/// All that is recorded of one paper.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Paper {
    /// The built-in rig with its parameters.
    pub rig: &'static str,
    /// How its figures are to be read.
    pub note: &'static str,
    /// Its figures in the paper's order.
    pub figures: &'static [Figure],
    /// Its mistakes in the paper's order.
    pub errata: &'static [Erratum],
}

/// The papers with a built-in rig.
pub const PAPERS: [&Paper; 3] = [&fong2014::PAPER, &shahzad2022::PAPER, &ramos_velasco::PAPER];

impl Paper {
    /// The paper that a rig of this name comes from.
    ///
    /// ```
    /// use furuta_model::published::{Paper, Quantity};
    /// let paper = Paper::of("fong2014-emecs").expect("a paper's rig");
    /// let entry = paper.figure(Quantity::StateMatrix(2, 1)).expect("equation (24)");
    /// assert_eq!((entry.place, entry.printed), ("(24)", 5.9796));
    /// assert!(Paper::of("qube-servo-2").is_none());
    /// ```
    #[must_use]
    pub fn of(rig: &str) -> Option<&'static Self> {
        PAPERS.into_iter().find(|p| p.rig == rig)
    }

    /// The first figure printed of a quantity.
    #[must_use]
    pub fn figure(&self, quantity: Quantity) -> Option<&'static Figure> {
        self.figures.iter().find(|f| f.quantity == quantity)
    }
}

impl Figure {
    /// The figure from `rig`, its effects left out; `None` where it cannot be computed.
    ///
    /// Gains are not this crate's to design: `identity_gain` is to give the gain `K` of `u = -K x` that minimises the
    /// integral of `x'x + u²`. It is called for [`Quantity::IdentityGain`] alone.
    ///
    /// ```
    /// use furuta_model::{Rig, published::Paper};
    /// let rig = Rig::builtin("ramos-velasco").expect("built in");
    /// let paper = Paper::of(&rig.name).expect("a paper's rig");
    /// for figure in paper.figures {
    ///     if let (Some(ours), Some(within)) = (figure.recompute(&rig, |_| None), figure.within) {
    ///         assert!((ours - figure.printed).abs() <= within, "{figure:?}");
    ///     }
    /// }
    /// ```
    #[must_use]
    pub fn recompute(
        &self,
        rig: &Rig,
        identity_gain: impl FnOnce(&Linear) -> Option<[f64; 4]>,
    ) -> Option<f64> {
        let at = |x| linearize(&rig.nominal_plant(), x, 0.0);
        let hanging = || {
            let Linear { a, b } = at(State::hanging());
            transfer_function(&a, &b, &RowSVector::<f64, 4>::new(0.0, 1.0, 0.0, 0.0))
        };
        Some(match self.quantity {
            Quantity::Parameter(key) => {
                let values = rig.params.to_array();
                values[RANGES.iter().position(|r| r.key == key)?]
            }
            Quantity::ArmCounts => rig.sensors.arm_counts_per_rev,
            Quantity::ArmResolution => rig.sensors.resolution()[0],
            Quantity::StateMatrix(row, col) => *at(State::upright()).a.get((row, col))?,
            Quantity::InputMatrix(row) => *at(State::upright()).b.get(row)?,
            Quantity::HangingNumerator(power) => *hanging().numerator.get(power)?,
            Quantity::HangingDenominator(power) => *hanging().denominator.get(power)?,
            Quantity::IdentityGain(i) => *identity_gain(&at(State::upright()))?.get(i)?,
            Quantity::SteadyArmAngle(w1, w2) => SteadyArm::of(rig).angle(w1, w2),
            Quantity::SteadyArmSpeed(w1, w2) => SteadyArm::of(rig).speed(w1, w2),
            Quantity::NotReproducible => return None,
        })
    }
}

/// The arm under a pendulum that follows a sine of 1 rad/s, to third order.
///
/// The zero dynamics of the planar model, `theta'' = p tan(w2) + q w2 / cos(w2)` with `p = weight / coupling`,
/// `q = M22 / coupling`, has one odd solution `theta = a w2 + b w1² w2 + c w2³ + ...`; with `w1' = w2`, `w2' = -w1`,
/// `theta'' = -a w2 + (6 c - 7 b) w1² w2 + (2 b - 3 c) w2³ + ...`. Comparing coefficients gives the three.
struct SteadyArm {
    /// Of `w2`.
    a: f64,
    /// Of `w1² w2`.
    b: f64,
    /// Of `w2³`.
    c: f64,
}

impl SteadyArm {
    fn of(rig: &Rig) -> Self {
        let c = rig.params.coefficients();
        let (p, q) = (c.weight / c.coupling, c.pendulum / c.coupling);
        let cubic = p / 3.0 + q / 2.0;
        Self {
            a: -(p + q),
            b: -2.0 / 3.0 * cubic,
            c: -7.0 / 9.0 * cubic,
        }
    }

    /// Coefficient of `w1^i w2^j`; 0 for those not listed, which holds up to third order.
    fn angle(&self, w1: usize, w2: usize) -> f64 {
        match (w1, w2) {
            (0, 1) => self.a,
            (2, 1) => self.b,
            (0, 3) => self.c,
            _ => 0.0,
        }
    }

    fn speed(&self, w1: usize, w2: usize) -> f64 {
        match (w1, w2) {
            (1, 0) => -self.a,
            (3, 0) => -self.b,
            (1, 2) => 2.0 * self.b - 3.0 * self.c,
            _ => 0.0,
        }
    }
}

/// A row of a paper's table: the number in the rig file is the printed one.
const fn tabled(
    place: &'static str,
    what: &'static str,
    printed: f64,
    key: &'static str,
) -> Figure {
    Figure {
        place,
        what,
        printed,
        quantity: Quantity::Parameter(key),
        within: Some(0.0),
        remark: "",
    }
}

/// A figure that ours agrees with.
const fn agrees(
    place: &'static str,
    what: &'static str,
    printed: f64,
    quantity: Quantity,
    within: f64,
) -> Figure {
    Figure {
        place,
        what,
        printed,
        quantity,
        within: Some(within),
        remark: "",
    }
}

/// A figure that ours differs from, and why.
const fn differs(
    place: &'static str,
    what: &'static str,
    printed: f64,
    quantity: Quantity,
    remark: &'static str,
) -> Figure {
    Figure {
        place,
        what,
        printed,
        quantity,
        within: None,
        remark,
    }
}

impl Figure {
    const fn remark(mut self, remark: &'static str) -> Self {
        self.remark = remark;
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_paper_has_its_rig_and_every_difference_its_reason() {
        for paper in PAPERS {
            let rig = Rig::builtin(paper.rig).expect("a built-in rig");
            for figure in paper.figures {
                let ours = figure.recompute(&rig, |_| None);
                match (figure.within, ours) {
                    (Some(within), Some(ours)) => {
                        assert!(
                            (ours - figure.printed).abs() <= within,
                            "{figure:?}: {ours}"
                        );
                    }
                    (None, Some(ours)) => {
                        assert!(!figure.remark.is_empty(), "{figure:?}");
                        // Really different, not a tolerance that was too tight.
                        assert!(
                            (ours - figure.printed).abs() > 1e-2 * figure.printed.abs(),
                            "{figure:?}: {ours}"
                        );
                    }
                    (_, None) => assert!(
                        matches!(figure.quantity, Quantity::IdentityGain(_))
                            || !figure.remark.is_empty(),
                        "{figure:?}"
                    ),
                }
            }
        }
    }
}
