//! Sequential quadratic programming with a trust region and an exact penalty of the defects.

use super::course::{Course, Limits};
use super::model::{Model, Step};
use super::subproblem::{Linearised, Objective, solve};
use nalgebra::{SMatrix, SVector};

/// The trust region's radius: at first, at most, and where a search ends.
const RADIUS: [f64; 3] = [0.5, 2.0, 1e-7];
/// A course whose scaled defects are all smaller than this is a motion of the rig.
pub(super) const CLOSED: f64 = 1e-8;
/// A step that promises less than this has arrived.
const ARRIVED: f64 = 1e-7;
/// Scaled difference by which exact first derivatives are differenced to second ones.
const DIFFERENCE: f64 = 1e-5;

/// Where a search ended.
#[derive(Clone, Debug)]
pub(super) struct Found {
    pub(super) course: Course,
    pub(super) cost: f64,
    /// Largest scaled defect.
    pub(super) gap: f64,
    /// Whether no step promises less.
    pub(super) arrived: bool,
}

/// Second derivatives of the equations of motion times `multipliers`, by scaled states, command and time, with no
/// negative eigenvalue.
fn curvature(
    model: &Model,
    course: &Course,
    steps: &[Step],
    objective: &Objective,
    multipliers: &[SVector<f64, 4>],
) -> Vec<SMatrix<f64, 6, 6>> {
    let h = course.interval();
    let share = 1.0 / course.u.len() as f64;
    let s = objective.scale;
    let scale = [
        s[0],
        s[1],
        s[2],
        s[3],
        objective.command,
        objective.unit * share,
    ];
    // The gradient of the multipliers times the equations.
    let gradient = |step: &Step, y: &SVector<f64, 4>| {
        let a = step.a.transpose() * y;
        SVector::from([a[0], a[1], a[2], a[3], step.b.dot(y), step.c.dot(y)])
    };
    let one = |k: usize| {
        let y = multipliers[k].component_div(&s);
        let here = gradient(&steps[k], &y);
        let mut second = SMatrix::<f64, 6, 6>::zeros();
        for j in 0..6 {
            let by = DIFFERENCE * scale[j];
            let (mut x, mut u, mut h) = (course.x[k], course.u[k], h);
            match j {
                4 => u += by,
                5 => h += by,
                i => x[i] += by,
            }
            let column = (gradient(&model.step(&x, u, h), &y) - here) / by;
            for i in 0..6 {
                second[(i, j)] = column[i] * scale[i] * scale[j];
            }
        }
        let symmetric = (second + second.transpose()) * 0.5;
        let eigen = symmetric.symmetric_eigen();
        let positive = SMatrix::from_diagonal(&eigen.eigenvalues.map(|v| v.max(0.0)));
        eigen.eigenvectors * positive * eigen.eigenvectors.transpose()
    };
    (0..course.u.len()).map(one).collect()
}

fn defects(model: &Model, course: &Course) -> Vec<SVector<f64, 4>> {
    let h = course.interval();
    (0..course.u.len())
        .map(|k| model.advance(&course.x[k], course.u[k], h) - course.x[k + 1])
        .collect()
}

/// Follows the best steps from `course` for at most `iterations` steps.
pub(super) fn search(
    model: &Model,
    course: Course,
    limits: &Limits,
    objective: &Objective,
    iterations: u32,
    tick: &(dyn Fn() + Sync),
) -> Found {
    let merit = |course: &Course| {
        objective.cost(course) + objective.price * objective.size(&defects(model, course))
    };
    let mut course = course.within(limits);
    let mut value = merit(&course);
    let mut radius = RADIUS[0];
    let mut made = 0;
    let mut arrived = false;
    let mut multipliers: Vec<SVector<f64, 4>> = Vec::new();
    'outer: while made < iterations {
        let h = course.interval();
        let steps: Vec<Step> = (0..course.u.len())
            .map(|k| model.step(&course.x[k], course.u[k], h))
            .collect();
        let bent = if multipliers.is_empty() {
            Vec::new()
        } else {
            curvature(model, &course, &steps, objective, &multipliers)
        };
        let at = Linearised {
            course: &course,
            steps: &steps,
            curvature: &bent,
        };
        loop {
            made += 1;
            tick();
            let Some(answer) = solve(&at, limits, objective, radius, None) else {
                radius *= 0.5;
                if radius < RADIUS[2] || made >= iterations {
                    break 'outer;
                }
                continue;
            };
            let promised = value - answer.promised;
            if promised < ARRIVED * value.abs().min(1.0) {
                arrived = true;
                break 'outer;
            }
            let mut next = answer.course;
            let mut there = merit(&next);
            if value - there < 0.75 * promised && answer.left < 1e-6 {
                let missed = defects(model, &next);
                let better = solve(&at, limits, objective, radius, Some(&missed));
                if let Some(better) = better.filter(|b| merit(&b.course) < there) {
                    next = better.course;
                    there = merit(&next);
                }
            }
            let ratio = (value - there) / promised;
            if ratio > 0.6 {
                radius = (2.0 * radius).min(RADIUS[1]);
            } else if ratio > 0.3 {
                radius = (1.2 * radius).min(RADIUS[1]);
            } else if !(ratio > 0.1) {
                radius *= 0.5;
            }
            if ratio > 0.01 {
                course = next;
                value = there;
                multipliers = answer.multipliers;
                break;
            }
            if radius < RADIUS[2] || made >= iterations {
                break 'outer;
            }
        }
    }
    let gap = largest(&defects(model, &course), objective);
    Found {
        cost: objective.cost(&course),
        course,
        gap,
        arrived,
    }
}

/// In rad, speeds over the pendulum's frequency.
fn largest(defects: &[SVector<f64, 4>], objective: &Objective) -> f64 {
    let w = std::f64::consts::TAU / objective.unit;
    let unit = SVector::from([1.0, 1.0, w, w]);
    defects
        .iter()
        .map(|d| d.component_div(&unit).amax())
        .fold(0.0, f64::max)
}

impl Found {
    /// By what one is better than another: its cost, or, where its gaps are too large for a motion, these.
    pub(super) fn rank(&self, nearly: f64) -> f64 {
        if self.gap < nearly {
            self.cost
        } else {
            1e6 * (1.0 + self.gap)
        }
    }
}

/// Newton's method on the equations of motion alone, by the shortest steps within the limits: what is left of the gaps
/// goes.
pub(super) fn close(model: &Model, found: Found, limits: &Limits, objective: &Objective) -> Found {
    let mut found = found;
    for _ in 0..8 {
        if found.gap < 0.01 * CLOSED {
            break;
        }
        let course = &found.course;
        let h = course.interval();
        let steps: Vec<Step> = (0..course.u.len())
            .map(|k| model.step(&course.x[k], course.u[k], h))
            .collect();
        let one = SMatrix::<f64, 6, 6>::identity();
        let at = Linearised {
            course,
            steps: &steps,
            curvature: &vec![one; steps.len()],
        };
        // A high price of the gaps, a small one of all else.
        let only = Objective {
            effort: 0.0,
            smooth: 0.0,
            price: 1e3,
            haste: 0.0,
            ..*objective
        };
        let Some(answer) = solve(&at, limits, &only, 0.1, None) else {
            break;
        };
        let gap = largest(&defects(model, &answer.course), objective);
        if !(gap < found.gap) {
            break;
        }
        found = Found {
            cost: objective.cost(&answer.course),
            course: answer.course,
            gap,
            ..found
        };
    }
    found
}
