//! Where a fit starts: the equations of motion are linear in what they are made of, so that a convex program finds it
//! from anywhere.
//!
//! Both equations are multiplied by a bump and integrated over its width, which moves the derivative from the momenta
//! to the bump: only speeds are needed, which a difference over two samples gives, its noise averaged by the integral.
//!
//! ```text
//! -∫ b' (arm θ' + swing sin²α θ' - coupling cos α α')  = ∫ b (drive u - arm_damping θ')
//! -∫ b' (pendulum α' - coupling cos α θ') =
//!     ∫ b (swing sin α cos α θ'² + coupling sin α θ' α' + weight sin α - pendulum_damping α')
//! ```
//!
//! From angles and voltage one scale of torque cannot be seen, so `weight` is held at the rig file's value. The seven
//! others minimise the squared residuals under what makes bodies real: none is negative, kinetic energy is positive
//! (`arm pendulum >= coupling²`, a second-order cone), neither axis has less inertia than the point masses on it. The
//! program is solved by clarabel.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettingsBuilder, DefaultSolver, IPSolver, NonnegativeConeT, SecondOrderConeT,
    SolverStatus,
};
use furuta_model::Actuation;
use furuta_model::params::Coefficients;
use nalgebra::{DMatrix, DVector, SMatrix, SVector};

use super::combinations::base;
use super::parameters::Space;
use crate::least_squares::{LeastSquares, Rules, minimise};
use crate::shooting::{Data, MAX_FREE, Pass, Reduced, Run, bounded_step};

/// Base parameters: arm, swing, coupling, pendulum, drive, arm_damping, pendulum_damping.
const BASE: usize = 7;
const ARM: usize = 0;
const COUPLING: usize = 2;
const PENDULUM: usize = 3;
/// Width of a bump, s, and in samples at least.
const WIDTH: f64 = 0.1;
const LEAST_SAMPLES: usize = 10;
/// Passes of the regression: the first weighs both equations alike, the later ones by what they left.
const PASSES: usize = 3;
/// A base parameter is at least this share of the rig file's.
const LEAST: f64 = 0.02;

/// One integrated equation: `columns · base = right`.
struct Row {
    columns: SVector<f64, BASE>,
    right: f64,
    /// The arm's equation is 0, the pendulum's 1.
    axis: usize,
}

/// The start: values of all parameters, those of `free` moved to what the convex program says. `None` for an arm that
/// follows a commanded acceleration, whose equation says nothing, for samples that are not evenly spaced, and where no
/// recording is of the whole rig.
pub(super) fn start(space: &Space, data: &Data, free: &[usize]) -> Option<Vec<f64>> {
    // Both equations are of the whole rig.
    let whole = || data.runs.iter().filter(|run| run.state.is_whole());
    let uneven = whole().any(Run::is_uneven);
    if uneven || space.rig.params.motor.actuation == Actuation::Acceleration {
        return None;
    }
    let sheet = space
        .coefficients::<1>(&space.sheet(), &[], Pass::FIRST)
        .cast::<f64>();
    let rows: Vec<Row> = whole()
        .flat_map(|run| rows(run, sheet.weight, space.late()))
        .collect();
    let found = solve(space, &sheet, &rows)?;
    Some(towards(space, free, &found, sheet.weight))
}

/// The equations of a run.
fn rows(run: &Run, weight: f64, late: f64) -> Vec<Row> {
    let h = run.h;
    let n = ((WIDTH / h).round() as usize).max(LEAST_SAMPLES);
    let late = (late / h).round().max(0.0) as usize;
    let mut out = Vec::new();
    let mut start = 1;
    while start + n + 1 < run.y.len() {
        let (mut arm, mut pendulum) = (SVector::zeros(), SVector::zeros());
        let mut right = 0.0;
        for i in 0..=n {
            let s = i as f64 / n as f64;
            let bump = (s * (1.0 - s)).powi(2);
            let slope = 2.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / (n as f64 * h);
            let k = start + i;
            let v: [f64; 2] =
                std::array::from_fn(|c| (run.y[k + 1][c] - run.y[k - 1][c]) / (2.0 * h));
            // Squares of noisy speeds would be too large: smoothed ones there.
            let smooth = run.speed[k];
            let (sin, cos) = run.y[k][1].sin_cos();
            // The command is held: the mean of the two samples' is what acts about this one.
            let u = 0.5 * (run.command(k - 1, late) + run.command(k, late));
            arm += h * SVector::from([
                -slope * v[0],
                -slope * sin * sin * v[0],
                slope * cos * v[1],
                0.0,
                -bump * u,
                bump * v[0],
                0.0,
            ]);
            pendulum += h * SVector::from([
                0.0,
                -bump * sin * cos * smooth[0] * smooth[0],
                slope * cos * v[0] - bump * sin * smooth[0] * smooth[1],
                -slope * v[1],
                0.0,
                0.0,
                bump * v[1],
            ]);
            right += h * bump * weight * sin;
        }
        out.push(Row {
            columns: arm,
            right: 0.0,
            axis: 0,
        });
        out.push(Row {
            columns: pendulum,
            right,
            axis: 1,
        });
        start += n / 2;
    }
    out
}

/// What the regression says: base parameters in units of the rig file's, and how firmly (the matrix of the normal
/// equations).
struct Found {
    unit: [f64; BASE],
    value: [f64; BASE],
    firmness: SMatrix<f64, BASE, BASE>,
}

fn solve(space: &Space, sheet: &Coefficients<f64>, rows: &[Row]) -> Option<Found> {
    let small = 0.02 * (sheet.weight * sheet.pendulum).sqrt();
    let mut unit = base(sheet);
    for (i, least) in [(1, 0.1 * sheet.pendulum), (5, small), (6, small)] {
        unit[i] = unit[i].max(least);
    }
    let unit = SVector::from(unit);
    let mut weights = [1.0; 2];
    let mut found = None;
    for pass in 0..PASSES {
        let mut square = SMatrix::<f64, BASE, BASE>::zeros();
        let mut linear = SVector::<f64, BASE>::zeros();
        for row in rows {
            let c = row.columns.component_mul(&unit) * weights[row.axis];
            square += c * c.transpose();
            linear += c * row.right * weights[row.axis];
        }
        let size = square.trace() / BASE as f64;
        if size <= 0.0 || !size.is_finite() {
            return None;
        }
        let value = cone_program(space, &unit, &(square / size), &(linear / size))?;
        let mut left = [0.0; 2];
        let mut count = [0.0; 2];
        for row in rows {
            let r = row.columns.component_mul(&unit).dot(&value) - row.right;
            left[row.axis] += r * r;
            count[row.axis] += 1.0;
        }
        found = Some(Found {
            unit: unit.into(),
            value: value.into(),
            firmness: square,
        });
        if pass + 1 < PASSES {
            for axis in 0..2 {
                weights[axis] = 1.0 / (left[axis] / count[axis]).sqrt().max(1e-300);
            }
        }
    }
    found
}

/// Minimises `½ xᵀ P x - qᵀ x` where bodies are real.
fn cone_program(
    space: &Space,
    unit: &SVector<f64, BASE>,
    square: &SMatrix<f64, BASE, BASE>,
    linear: &SVector<f64, BASE>,
) -> Option<SVector<f64, BASE>> {
    let (mut row, mut column, mut value) = (Vec::new(), Vec::new(), Vec::new());
    for b in 0..BASE {
        for a in 0..=b {
            row.push(a);
            column.push(b);
            // A breath of the rig file, for what nothing excites.
            let ridge = if a == b { 1e-9 } else { 0.0 };
            value.push(square[(a, b)] + ridge);
        }
    }
    let square = CscMatrix::new_from_triplets(BASE, BASE, row, column, value);
    let cost: Vec<f64> = linear.iter().map(|q| -q - 1e-9).collect();

    let (points, most) = space.point_masses();
    let mut least = [LEAST; BASE];
    least[1] = 0.0;
    least[5] = 0.0;
    least[6] = 0.0;
    least[ARM] = least[ARM].max(points[0] / unit[ARM]);
    least[PENDULUM] = least[PENDULUM].max(points[1] / unit[PENDULUM]);
    let (mut row, mut column, mut value) = (Vec::new(), Vec::new(), Vec::new());
    let mut right = Vec::new();
    for (i, least) in least.iter().enumerate() {
        row.push(i);
        column.push(i);
        value.push(-1.0);
        right.push(-least);
    }
    let mut linear_rows = BASE;
    if let Some(most) = most {
        row.push(linear_rows);
        column.push(PENDULUM);
        value.push(1.0);
        right.push((most / unit[PENDULUM]).max(least[PENDULUM]));
        linear_rows += 1;
    }
    // arm pendulum >= coupling²: |(arm - pendulum, 2 coupling)| <= arm + pendulum.
    let size = (unit[ARM] * unit[PENDULUM]).sqrt();
    let (a, p, c) = (
        unit[ARM] / size,
        unit[PENDULUM] / size,
        unit[COUPLING] / size,
    );
    for (i, entries) in [
        [(ARM, a), (PENDULUM, p)],
        [(ARM, a), (PENDULUM, -p)],
        [(COUPLING, 2.0 * c), (COUPLING, 0.0)],
    ]
    .into_iter()
    .enumerate()
    {
        for (k, x) in entries {
            if x != 0.0 {
                row.push(linear_rows + i);
                column.push(k);
                value.push(-x);
            }
        }
        right.push(0.0);
    }
    let constraints = CscMatrix::new_from_triplets(linear_rows + 3, BASE, row, column, value);
    let settings = DefaultSettingsBuilder::default()
        .verbose(false)
        .build()
        .ok()?;
    let cones = [NonnegativeConeT(linear_rows), SecondOrderConeT(3)];
    let mut solver =
        DefaultSolver::new(&square, &cost, &constraints, &right, &cones, settings).ok()?;
    solver.solve();
    matches!(
        solver.solution.status,
        SolverStatus::Solved | SolverStatus::AlmostSolved
    )
    .then(|| SVector::from_fn(|i, _| solver.solution.x[i]))
}

/// The free parameters whose base parameters come nearest to those found, in the regression's own metric; what it does
/// not know stays where the rig file has it.
fn towards(space: &Space, free: &[usize], found: &Found, weight: f64) -> Vec<f64> {
    let size = found.firmness.trace() / BASE as f64;
    let nearest = Nearest {
        space,
        free,
        found,
        firmness: found.firmness / size + SMatrix::identity() * 1e-6,
        weight,
    };
    let start = nearest.at(space.sheet());
    minimise(&nearest, start, &RULES).0.values
}

/// Sixty steps bring any start to rest: the problem is small and nearly linear.
const RULES: Rules = Rules {
    iterations: 60,
    damping: 1e-4,
    ease: (0.2, 1e-9),
    stiffen: (10.0, 0.0),
    most: 1e6,
    abandoned: 0.0,
};
/// A step that gains less than this share of the cost is the last.
const SMALL: f64 = 1e-9;
/// How firmly the rig file's values hold, against what the regression knows.
const FAINT: f64 = 1e-7;

/// The values of a rig file whose base parameters are nearest to those found.
struct Nearest<'a> {
    space: &'a Space,
    free: &'a [usize],
    found: &'a Found,
    firmness: SMatrix<f64, BASE, BASE>,
    weight: f64,
}

/// Values of all parameters, and how far off they are.
struct Place {
    values: Vec<f64>,
    left: SVector<f64, BASE>,
    slopes: DMatrix<f64>,
    cost: f64,
}

impl Nearest<'_> {
    fn at(&self, values: Vec<f64>) -> Place {
        let c = self
            .space
            .coefficients::<MAX_FREE>(&values, self.free, Pass::NUMBERS);
        // Only ratios to the weight are known.
        let ratio = base(&c).map(|b| b / c.weight);
        let in_units = |i: usize, x: f64| x * self.weight / self.found.unit[i];
        let left =
            SVector::<f64, BASE>::from_fn(|i, _| in_units(i, ratio[i].v) - self.found.value[i]);
        let slopes = DMatrix::from_fn(BASE, self.free.len(), |i, k| in_units(i, ratio[i].d[k]));
        let moved: f64 = self
            .free
            .iter()
            .map(|&i| self.moved(&values, i).powi(2))
            .sum();
        Place {
            cost: (left.transpose() * self.firmness * left)[0] + FAINT * moved,
            values,
            left,
            slopes,
        }
    }

    /// How far a value is from the rig file's, in its scale.
    fn moved(&self, values: &[f64], i: usize) -> f64 {
        let q = &self.space.parameters[i];
        (values[i] - q.sheet) / q.scale
    }
}

impl LeastSquares<Place> for Nearest<'_> {
    type Linear = Reduced;
    type Step = DVector<f64>;

    fn cost(&self, place: &Place) -> f64 {
        place.cost
    }

    fn linearise(&self, place: &mut Place) -> Reduced {
        let firmness = DMatrix::from_fn(BASE, BASE, |a, b| self.firmness[(a, b)]);
        let weighted = place.slopes.transpose() * firmness;
        let mut gradient = &weighted * DVector::from_iterator(BASE, place.left.iter().copied());
        let mut matrix = &weighted * &place.slopes;
        for (k, &i) in self.free.iter().enumerate() {
            gradient[k] += FAINT * self.moved(&place.values, i);
            matrix[(k, k)] += FAINT;
        }
        Reduced {
            gradient,
            matrix,
            windows: Vec::new(),
        }
    }

    fn step(&self, place: &Place, r: &Reduced, damping: f64) -> Option<(DVector<f64>, f64)> {
        let scale = |i: usize| self.space.parameters[i].scale;
        let z: Vec<f64> = self
            .free
            .iter()
            .map(|&i| place.values[i] / scale(i))
            .collect();
        let bounds: Vec<(f64, f64)> = self
            .space
            .bounds(&place.values, self.free)
            .iter()
            .zip(self.free)
            .map(|((low, high), &i)| (low / scale(i), high / scale(i)))
            .collect();
        let step = bounded_step(&z, r, &bounds, damping)?;
        let predicted = r.gradient.dot(&step);
        Some((step, predicted))
    }

    fn trial(&self, place: &Place, _: &Reduced, step: &DVector<f64>, _: bool) -> Place {
        let mut values = place.values.clone();
        for (k, &i) in self.free.iter().enumerate() {
            values[i] -= step[k] * self.space.parameters[i].scale;
        }
        self.at(values)
    }

    fn reached(&self, place: &mut Place, gain: f64, _: usize) -> bool {
        gain >= SMALL * (place.cost + gain)
    }
}
