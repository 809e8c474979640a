//! Which torque is missing where: a line through some points over a state, for one state after the other.

use std::f64::consts::{PI, TAU};

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::super::hypothesis::{ARM_DAMPING, DRIVE, PENDULUM_DAMPING};
use super::super::result::{MissingTorque, Shape, TorqueByState};
use super::{Block, Responses, TorqueNormal, solver};
use crate::answer::Channel;

/// This many stretches between points, each with as many blocks as any other.
const STRETCHES: usize = 14;
/// This share of the blocks lies beyond the first and the last point.
const BEYOND: f64 = 0.003;
/// A state is told where its torques explain at least this share of what is left above the noise, and have this much
/// evidence.
const LEAST_SHARE: f64 = 0.1;
const EVIDENCE: f64 = 60.0;
/// A curve has a shape where that explains this share of what the curve does.
const ALIKE: f64 = 0.9;

/// A state, as a torque may depend on it.
struct Axis {
    state: &'static str,
    unit: &'static str,
    value: fn(&Block) -> f64,
    /// The base parameter that acts in proportion to it: held, since no curve can be told from it.
    held: Option<usize>,
}

const AXES: [Axis; 5] = [
    Axis {
        state: "theta",
        unit: "rad",
        value: |b| b.x.theta,
        held: None,
    },
    Axis {
        state: "theta_dot",
        unit: "rad/s",
        value: |b| b.x.theta_dot,
        held: Some(ARM_DAMPING),
    },
    Axis {
        state: "alpha",
        unit: "rad",
        value: |b| b.x.alpha,
        held: None,
    },
    Axis {
        state: "alpha_dot",
        unit: "rad/s",
        value: |b| b.x.alpha_dot,
        held: Some(PENDULUM_DAMPING),
    },
    Axis {
        state: "u",
        unit: "V",
        value: |b| b.volts,
        held: Some(DRIVE),
    },
];

/// Torques at the points of one state, the arm's before the pendulum's, the base parameters' steps behind them.
struct Curve {
    torque: DVector<f64>,
    covariance: DMatrix<f64>,
    /// Standard deviations that do not trust the rest to be noise: from how much the windows differ, and no smaller
    /// than `covariance` says.
    std: Vec<f64>,
    /// Factor of the covariance for what is left above the noise.
    left: f64,
    normal: TorqueNormal,
}

impl Curve {
    /// One axis' torques and their standard deviations.
    fn of(&self, axis: usize) -> (Vec<f64>, Vec<f64>) {
        let n = self.std.len() / 2;
        let own = axis * n..(axis + 1) * n;
        (
            self.torque.as_slice()[own.clone()].to_vec(),
            self.std[own].to_vec(),
        )
    }
}

/// The missing torque against every state, before and after the effects, and what is most telling about it.
pub(in super::super) fn by_state(
    before: &Responses,
    after: &Responses,
) -> (Vec<TorqueByState>, Vec<MissingTorque>) {
    let actuation = before.actuation;
    let (mut curves, mut told) = (Vec::new(), Vec::new());
    for axis in &AXES {
        let value = unwrapped(axis, before);
        let Some(at) = points(&value, before) else {
            continue;
        };
        let (left, right) = rayon::join(
            || curve(before, &value, &at, axis.held),
            || curve(after, &value, &at, axis.held),
        );
        let Some(left) = left else {
            continue;
        };
        for (c, channel) in Channel::ALL.into_iter().enumerate() {
            if !before.moved[c] {
                continue;
            }
            let (refitted, refitted_std) = left.of(c);
            let later = right.as_ref().map(|right| right.of(c));
            let (repaired, repaired_std) = later.unwrap_or_default();
            curves.push(TorqueByState {
                axis: channel,
                state: axis.state.into(),
                unit: actuation.unit_of(axis.unit).into(),
                at: at.clone(),
                recalibrated: refitted,
                recalibrated_std: refitted_std,
                augmented: repaired,
                augmented_std: repaired_std,
            });
            told.extend(tell(before, &left, axis, channel, &at));
        }
    }
    // The state that says most about each axis; the sort is stable.
    told.sort_by(|a, b| b.share_of_gap.total_cmp(&a.share_of_gap));
    let mut best: Vec<MissingTorque> = Vec::new();
    for t in told {
        if best.iter().all(|b| b.axis != t.axis) {
            best.push(t);
        }
    }
    (curves, best)
}

/// The state's value, a pendulum angle counted from where its recordings do not wrap.
fn unwrapped(axis: &Axis, responses: &Responses) -> impl Fn(&Block) -> f64 + Sync + use<> {
    let value = axis.value;
    let angle = axis.state == "alpha";
    let blocks = responses.by_window.iter().flat_map(|e| &e.blocks);
    let (up, down) = blocks.fold((0, 0), |(up, down), b| {
        if b.x.alpha.cos() > 0.0 {
            (up + 1, down)
        } else {
            (up, down + 1)
        }
    });
    let from = if up > down { -PI } else { 0.0 };
    move |b| {
        let x = value(b);
        if angle {
            (x - from).rem_euclid(TAU) + from
        } else {
            x
        }
    }
}

/// The points, in their order.
fn points(value: &impl Fn(&Block) -> f64, responses: &Responses) -> Option<Vec<f64>> {
    let blocks = responses.by_window.iter().flat_map(|e| &e.blocks);
    let mut all: Vec<f64> = blocks.map(value).collect();
    all.sort_by(f64::total_cmp);
    let last = all.len().checked_sub(1)? as f64;
    let mut points: Vec<f64> = (0..=STRETCHES)
        .map(|i| {
            let share = (i as f64 / STRETCHES as f64).clamp(BEYOND, 1.0 - BEYOND);
            all[(share * last).round() as usize]
        })
        .collect();
    points.dedup();
    (points.len() > 1 && points.iter().all(|p| p.is_finite())).then_some(points)
}

/// The two points around `x` and how much of each is there: a line between them, level beyond the last.
fn between(points: &[f64], x: f64) -> [(usize, f64); 2] {
    let right = points
        .partition_point(|p| *p <= x)
        .clamp(1, points.len() - 1);
    let (a, b) = (points[right - 1], points[right]);
    let share = ((x - a) / (b - a)).clamp(0.0, 1.0);
    [(right - 1, 1.0 - share), (right, share)]
}

fn curve(
    responses: &Responses,
    value: &(impl Fn(&Block) -> f64 + Sync),
    points: &[f64],
    held: Option<usize>,
) -> Option<Curve> {
    let n = points.len();
    let parts: Vec<TorqueNormal> = responses
        .by_window
        .par_iter()
        .map(|e| {
            let all = TorqueNormal::of(e, n, |_, block| between(points, value(block)));
            match held {
                Some(parameter) => all.holding(&[2 * n + parameter]),
                None => all,
            }
        })
        .collect();
    let mut known = parts.iter().filter(|p| p.is_finite());
    let mut all = known.next()?.clone();
    for part in known {
        all.matrix += &part.matrix;
        all.gradient += &part.gradient;
    }
    let solver = solver(all.matrix.clone())?;
    let torque = solver.solve(&all.gradient);
    // What is left is not only noise: the deviations are no smaller than it says.
    let left = (responses.chi2 - torque.dot(&all.gradient) / responses.samples).max(1.0);
    let covariance = solver.inverse() * left;
    let mut spread = DMatrix::zeros(torque.len(), torque.len());
    for part in parts.iter().filter(|p| p.is_finite()) {
        let own = solver.solve(&(&part.gradient - &part.matrix * &torque));
        spread.ger(1.0, &own, &own, 1.0);
    }
    let std = (0..2 * n)
        .map(|i| covariance[(i, i)].max(spread[(i, i)]).sqrt())
        .collect();
    (torque.iter().all(|v| v.is_finite())).then_some(Curve {
        torque,
        covariance,
        std,
        left,
        normal: all,
    })
}

impl Curve {
    /// The share of the gap that goes when one axis' torques are left out, the other's free to imitate them.
    fn own_share(&self, responses: &Responses, first: usize, n: usize) -> Option<f64> {
        let torque = self.torque.rows(first, n).into_owned();
        let own = self.covariance.view((first, first), (n, n)).into_owned();
        let fall = torque.dot(&solver(own)?.solve(&torque)) * self.left;
        Some(fall / responses.gap())
    }

    /// One axis' torques by themselves, beside the base parameters: their precision, what it makes of them, and the
    /// share of the gap that they explain.
    fn alone(
        &self,
        responses: &Responses,
        first: usize,
    ) -> Option<(DMatrix<f64>, DVector<f64>, f64)> {
        let n = self.std.len() / 2;
        let other: Vec<usize> = (n - first..2 * n - first).collect();
        let here = self.normal.clone().holding(&other);
        let base: Vec<usize> = (0..n).collect();
        let base = here.clone().holding(&base);
        let all = solver(here.matrix.clone())?;
        let step = all.solve(&here.gradient);
        let before = base
            .gradient
            .dot(&solver(base.matrix)?.solve(&base.gradient));
        let fall = here.gradient.dot(&step) - before;
        let left = (responses.chi2 - here.gradient.dot(&step) / responses.samples).max(1.0);
        let covariance = all.inverse().view((0, 0), (n, n)).into_owned() * left;
        let certain = solver(covariance)?.inverse();
        let weighed = &certain * step.rows(0, n);
        Some((certain, weighed, fall / responses.gap()))
    }
}

/// What one curve says, if it says enough.
fn tell(
    responses: &Responses,
    curve: &Curve,
    axis: &Axis,
    channel: Channel,
    at: &[f64],
) -> Option<MissingTorque> {
    let n = at.len();
    let first = if channel == Channel::Theta { 0 } else { n };
    if curve.own_share(responses, first, n)? < LEAST_SHARE {
        return None;
    }
    let (certain, weighed, share) = curve.alone(responses, first)?;
    let torque = solver(certain.clone())?.solve(&weighed);
    let evidence = torque.dot(&weighed);
    if evidence.is_nan() || evidence < EVIDENCE {
        return None;
    }
    // A refitted parameter has followed the effect as far as it can, and left the opposite behind.
    let follows: &[Shape] = match axis.state {
        "theta_dot" | "alpha_dot" | "u" => &[Shape::Constant, Shape::Proportional],
        _ => &[Shape::Constant],
    };
    let explained = |shape: Shape| {
        let others = follows.iter().copied().filter(|f| *f != shape);
        // Beside a constant torque nothing is needed for it to be one.
        let others = others.filter(|_| shape != Shape::Constant);
        let basis: Vec<Shape> = std::iter::once(shape).chain(others).collect();
        let basis = DMatrix::from_fn(at.len(), basis.len(), |i, k| basis[k].value(at[i]));
        let product = basis.tr_mul(&weighed);
        let size = solver(basis.tr_mul(&(&certain * &basis)))?.solve(&product);
        let explained = size.dot(&product);
        (explained > ALIKE * evidence).then_some((shape, size[0], explained))
    };
    let shape = explained(Shape::Constant).or_else(|| {
        let others = Shape::ALL.into_iter().filter_map(explained);
        others.max_by(|a, b| a.2.total_cmp(&b.2))
    });
    Some(MissingTorque {
        axis: channel,
        state: axis.state.into(),
        shape: shape.map(|s| s.0),
        size: shape.map_or_else(|| torque.amax(), |s| s.1),
        unit: shape.map_or_else(
            || "N m".into(),
            |s| s.0.unit(responses.actuation.unit_of(axis.unit)),
        ),
        share_of_gap: share.clamp(0.0, 1.0),
    })
}
