//! The cost along one parameter, all others fitted anew at each point: where the quadratic approximation behind a
//! standard deviation fails, this does not.

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::fit::{CalibrationProblem, Fit};
use super::result::Profile;

/// Points either side of the optimum, and how far they reach, in standard deviations.
const SIDE: i32 = 8;
const REACH: f64 = 4.0;
/// A parameter that the data do not determine is looked at so far either side, as a share of its size.
const BLIND: f64 = 0.5;
/// Of chi² with one degree of freedom: bounds the 95 % interval.
const BOUND: f64 = 3.841;

/// The profile of parameter `i`, which may be one that was held.
pub(super) fn profile(
    problem: &CalibrationProblem<'_>,
    fitted: &Fit,
    free: &[usize],
    covariance: Option<&DMatrix<f64>>,
    i: usize,
) -> Profile {
    let p = &problem.space.parameters[i];
    let std = free
        .iter()
        .position(|&f| f == i)
        .and_then(|k| covariance.map(|c| c[(k, k)].sqrt() * p.scale))
        .filter(|s| s.is_finite() && *s > 0.0);
    let step = std.map_or(BLIND * p.scale, |s| REACH * s) / f64::from(SIDE);
    let (low, high) = problem.space.bounds(&fitted.values, &[i])[0];
    let others: Vec<usize> = free.iter().copied().filter(|&f| f != i).collect();
    // Both sides from the optimum outwards, each point from its neighbour.
    let walk = |sign: f64| -> Vec<(f64, f64)> {
        let mut here = fitted.clone();
        let mut out = Vec::new();
        for k in 1..=SIDE {
            let value = fitted.values[i] + sign * f64::from(k) * step;
            if value < low || value > high {
                break;
            }
            here.values[i] = value;
            here = problem.fit(&problem.again(&here), &others);
            out.push((value, here.cost));
        }
        out
    };
    let sides: Vec<Vec<(f64, f64)>> = [-1.0, 1.0].into_par_iter().map(walk).collect();
    let per_sample = (fitted.cost / problem.floor()).max(1.0);
    let rise = |cost: f64| (cost - fitted.cost) / per_sample;
    let mut points: Vec<(f64, f64)> = sides[0].iter().rev().copied().collect();
    points.push((fitted.values[i], fitted.cost));
    points.extend(&sides[1]);
    let points: Vec<(f64, f64)> = points.into_iter().map(|(v, c)| (v, rise(c))).collect();
    let centre = sides[0].len();
    // The root of the rise is nearly straight: interpolated there.
    let crossing = |outward: &mut dyn Iterator<Item = &(f64, f64)>| {
        let mut before = points[centre];
        for &(v, r) in outward {
            if r >= BOUND {
                let (a, b) = (before.1.max(0.0).sqrt(), r.sqrt());
                let share = (BOUND.sqrt() - a) / (b - a).max(1e-12);
                return Some(before.0 + share * (v - before.0));
            }
            before = (v, r);
        }
        None
    };
    Profile {
        key: p.key.clone(),
        unit: p.unit.clone(),
        interval: [
            crossing(&mut points[..centre].iter().rev()),
            crossing(&mut points[centre + 1..].iter()),
        ],
        values: points.iter().map(|p| p.0).collect(),
        rise: points.iter().map(|p| p.1).collect(),
    }
}
