//! The linear matrix inequalities of a robust regulator.

use super::regulator::{BROKEN, Robust, RobustError, Time, Vertex};
use crate::lmi::{Block, Objective, minimise, strictly_inside};
use furuta_ctrl::design::{Weights, is_hurwitz, is_schur};
use nalgebra::{DMatrix, DVector, SMatrix};

/// Relative distance from the least guaranteed cost at which the search ends.
const TOLERANCE: f64 = 1e-8;
/// To how much of the way from the mean to the vertices the reach of a design is found.
const REACH: f64 = 1e-3;
/// Phase I ends with this margin: the rest is for the cost to decide.
const ENOUGH: f64 = 1e-2;
/// How much larger than at the mean `Y` may be in phase I.
const LARGEST: f64 = 1e3;
/// A margin below this is rounding.
const SMALLEST_MARGIN: f64 = 1e-8;
/// The problem in coordinates in which the nominal regulator's cost is `z'z`, and time in units of its closed loop.
pub(super) struct RobustProblem<const N: usize, const M: usize> {
    time: Time,
    pub(super) vertices: Vec<Vertex<N, M>>,
    /// Their mean.
    mean: Vertex<N, M>,
    /// What costs.
    output: CostOutput<N, M>,
    /// Covariance of the starts.
    starts: SMatrix<f64, N, N>,
    /// `z = into x`.
    into: SMatrix<f64, N, N>,
    /// Continuous time: how much faster time runs; discrete: 1.
    speed: f64,
}

/// `x'Qx + u'Ru + 2 x'Nu = |C x|^2 + |E x + D u|^2`: `D'D = R`, `E = D'^-1 N'`, `C'C = Q - E'E`.
#[derive(Copy, Clone)]
struct CostOutput<const N: usize, const M: usize> {
    c: SMatrix<f64, N, N>,
    e: SMatrix<f64, M, N>,
    d: SMatrix<f64, M, M>,
}

impl<const N: usize, const M: usize> RobustProblem<N, M> {
    pub(super) fn new(
        time: Time,
        vertices: &[Vertex<N, M>],
        weights: &Weights<f64, N, M>,
        starts: &SMatrix<f64, N, N>,
    ) -> Result<Self, RobustError> {
        let share = 1.0 / vertices.len() as f64;
        let (a, b) = vertices
            .iter()
            .fold((SMatrix::zeros(), SMatrix::zeros()), |(a, b), v| {
                (a + v.0 * share, b + v.1 * share)
            });
        let nominal = time.solve(&(a, b), weights)?;
        // Not positive definite: a state that costs nothing and decays by itself. A little of the largest makes the
        // coordinates regular.
        let size = dynamic(&nominal.x).symmetric_eigenvalues().max();
        let regular = nominal.x + SMatrix::identity() * (1e-12 * size.max(f64::MIN_POSITIVE));
        let into = regular.cholesky().ok_or(BROKEN)?.l().transpose();
        let back = into.try_inverse().ok_or(BROKEN)?;
        let closed = into * (a - b * nominal.gain) * back;
        let speed = match time {
            Time::Continuous => closed.norm().max(f64::MIN_POSITIVE),
            Time::Discrete => 1.0,
        };
        let d = weights.r.cholesky().ok_or(BROKEN)?.l().transpose();
        let e = d.transpose().try_inverse().ok_or(BROKEN)? * weights.n.transpose();
        let eigen = dynamic(&(weights.q - e.transpose() * e)).symmetric_eigen();
        let c = SMatrix::<f64, N, N>::from_fn(|i, j| {
            eigen.eigenvalues[i].max(0.0).sqrt() * eigen.eigenvectors[(j, i)]
        });
        let per_time = speed.sqrt();
        let scaled = |(a, b): &Vertex<N, M>| (into * a * back / speed, into * b / speed);
        Ok(Self {
            time,
            vertices: vertices.iter().map(scaled).collect(),
            mean: scaled(&(a, b)),
            output: CostOutput {
                c: c * back / per_time,
                e: e * back / per_time,
                d: d / per_time,
            },
            starts: into * starts * into.transpose(),
            into,
            speed,
        })
    }

    const SYMMETRIC: usize = N * (N + 1) / 2;
    const UNKNOWNS: usize = Self::SYMMETRIC + M * N;

    fn symmetric(x: &[f64]) -> SMatrix<f64, N, N> {
        let mut entries = x.iter().copied();
        let mut s = SMatrix::zeros();
        for i in 0..N {
            for j in 0..=i {
                let v = entries.next().unwrap_or(0.0);
                (s[(i, j)], s[(j, i)]) = (v, v);
            }
        }
        s
    }

    fn entries(s: &SMatrix<f64, N, N>) -> impl Iterator<Item = f64> + '_ {
        (0..N).flat_map(move |i| (0..=i).map(move |j| s[(i, j)]))
    }

    /// `S` and `Y` of the unknowns.
    fn unknowns(x: &[f64]) -> (SMatrix<f64, N, N>, SMatrix<f64, M, N>) {
        (
            Self::symmetric(x),
            SMatrix::from_column_slice(&x[Self::SYMMETRIC..Self::SYMMETRIC + M * N]),
        )
    }

    /// The decay at a vertex, positive definite where `Y S^-1` stabilises it with `S^-1`; without the cost.
    fn decay(
        &self,
        vertex: &Vertex<N, M>,
        s: &SMatrix<f64, N, N>,
        y: &SMatrix<f64, M, N>,
    ) -> DMatrix<f64> {
        let (a, b) = vertex;
        let moved = a * s - b * y;
        match self.time {
            Time::Continuous => dynamic(&-(moved + moved.transpose())),
            Time::Discrete => {
                let mut block = DMatrix::zeros(2 * N, 2 * N);
                put(&mut block, 0, 0, s);
                put(&mut block, N, 0, &moved);
                put(&mut block, 0, N, &moved.transpose());
                put(&mut block, N, N, s);
                block
            }
        }
    }

    /// The decay less the cost, as a Schur complement: positive definite where `x'S^-1 x` bounds the cost.
    fn bound(
        &self,
        vertex: &Vertex<N, M>,
        s: &SMatrix<f64, N, N>,
        y: &SMatrix<f64, M, N>,
    ) -> DMatrix<f64> {
        let decay = self.decay(vertex, s, y);
        let size = decay.nrows();
        let mut block = DMatrix::identity(size + N + M, size + N + M);
        block.view_mut((0, 0), (size, size)).copy_from(&decay);
        let state = self.output.c * s;
        let input = self.output.e * s - self.output.d * y;
        put(&mut block, size, 0, &state);
        put(&mut block, 0, size, &state.transpose());
        put(&mut block, size + N, 0, &input);
        put(&mut block, 0, size + N, &input.transpose());
        block
    }

    /// Between the mean of the vertices (`way` 0) and the vertices themselves (1).
    fn part_of_the_way(&self, way: f64) -> Vec<Vertex<N, M>> {
        let (a, b) = self.mean;
        let between = |v: &Vertex<N, M>| (a + (v.0 - a) * way, b + (v.1 - b) * way);
        self.vertices.iter().map(between).collect()
    }

    /// The conditions on the unknowns: the bound at each of these vertices, and `S` itself.
    fn blocks(&self, vertices: &[Vertex<N, M>]) -> Vec<Block> {
        let bounds = vertices.iter().map(|vertex| {
            Block::of_affine(Self::UNKNOWNS, |x| {
                let (s, y) = Self::unknowns(x);
                self.bound(vertex, &s, &y)
            })
        });
        let s = Block::of_affine(Self::UNKNOWNS, |x| dynamic(&Self::symmetric(x)));
        bounds.chain([s]).collect()
    }

    /// `S` and `Y` strictly within the conditions, with the margin that is left: phase I maximises `s` such that the
    /// decay at each of these vertices is at least `s I` and `0 <= S <= I`. Homogeneous in `S` and `Y`: made small
    /// enough, the cost fits in, too.
    pub(super) fn feasible(
        &self,
        vertices: &[Vertex<N, M>],
    ) -> Result<Option<DVector<f64>>, RobustError> {
        let margin = Self::UNKNOWNS;
        let with_margin = |x: &[f64], block: DMatrix<f64>| {
            let size = block.nrows();
            block - DMatrix::identity(size, size) * x[margin]
        };
        let decays = vertices.iter().map(|vertex| {
            Block::of_affine(margin + 1, |x| {
                let (s, y) = Self::unknowns(x);
                with_margin(x, self.decay(vertex, &s, &y))
            })
        });
        let below_one = Block::of_affine(margin + 1, |x| {
            DMatrix::identity(N, N) - dynamic(&Self::symmetric(x))
        });
        let above_zero = Block::of_affine(margin + 1, |x| dynamic(&Self::symmetric(x)));
        // From the regulator of the mean, with as little margin as it has.
        let nominal = self.nominal()?;
        let (s, y) = Self::unknowns(nominal.as_slice());
        // Without a bound the barrier has no centre: ever larger gains stabilise better where they stabilise at all.
        let largest = LARGEST * y.norm().max(1.0);
        let bounded = Block::of_affine(margin + 1, |x| {
            let (_, y) = Self::unknowns(x);
            let mut block = DMatrix::identity(N + M, N + M) * largest;
            put(&mut block, N, 0, &y);
            put(&mut block, 0, N, &y.transpose());
            block
        });
        let blocks: Vec<_> = decays.chain([below_one, above_zero, bounded]).collect();
        let worst = vertices
            .iter()
            .map(|vertex| self.decay(vertex, &s, &y).symmetric_eigenvalues().min())
            .fold(f64::INFINITY, f64::min);
        let mut start = nominal.insert_row(margin, 0.0);
        start[margin] = worst - 0.1 - 0.1 * worst.abs();
        let mut cost = DVector::zeros(margin + 1);
        cost[margin] = -1.0;
        let objective = Objective::Linear(cost);
        let found = minimise(&objective, &blocks, start, 1e-9, |x| x[margin] > ENOUGH);
        let Some(found) = found else { return Ok(None) };
        if !(found.x[margin] > SMALLEST_MARGIN) {
            return Ok(None);
        }
        let bounds = self.blocks(vertices);
        let x = found.x.remove_row(margin);
        // Halved until the cost fits in: its part falls with the square.
        Ok((0..60)
            .map(|k| &x * 0.5f64.powi(k))
            .find(|x| strictly_inside(&bounds, x)))
    }

    /// `S` and `Y` of the regulator at the mean, `S` of at most a half.
    fn nominal(&self) -> Result<DVector<f64>, RobustError> {
        let CostOutput { c, e, d } = self.output;
        let q = c.transpose() * c + e.transpose() * e + SMatrix::identity() * 0.1;
        let more = Weights::new(q, d.transpose() * d).with_cross(e.transpose() * d);
        let solution = self.time.solve(&self.mean, &more)?;
        let s = solution.x.try_inverse().ok_or(BROKEN)?;
        let largest = dynamic(&(s + s.transpose())).symmetric_eigenvalues().max();
        let s = (s + s.transpose()) * (0.5 / largest);
        let y = solution.gain * s;
        let entries = Self::entries(&s).chain(y.iter().copied());
        Ok(DVector::from_iterator(Self::UNKNOWNS, entries))
    }

    /// The least mean guaranteed cost, from a point that phase I finds.
    pub(super) fn least_cost(
        &self,
    ) -> Result<(SMatrix<f64, N, N>, SMatrix<f64, M, N>, f64), RobustError> {
        let Some(x) = self.feasible(&self.vertices)? else {
            return Err(RobustError::NotQuadraticallyStabilisable {
                vertices: self.vertices.len(),
                reached: self.reach()?,
            });
        };
        let size = self.starts.norm();
        let objective = Objective::InverseTrace {
            weight: dynamic(&self.starts) / size,
            of: self.vertices.len(),
        };
        let blocks = self.blocks(&self.vertices);
        let found = minimise(&objective, &blocks, x, TOLERANCE, |_| false).ok_or(BROKEN)?;
        let (s, y) = Self::unknowns(found.x.as_slice());
        Ok((s, y, found.gap * size))
    }

    /// How much of the way from the mean to the vertices can be stabilised, by bisection.
    fn reach(&self) -> Result<f64, RobustError> {
        let (mut low, mut high) = (0.0, 1.0);
        while high - low > REACH {
            let way = 0.5 * (low + high);
            if self.feasible(&self.part_of_the_way(way))?.is_some() {
                low = way;
            } else {
                high = way;
            }
        }
        Ok(low)
    }

    /// Back in the given coordinates, and checked there.
    pub(super) fn as_given(
        &self,
        vertices: &[Vertex<N, M>],
        weights: &Weights<f64, N, M>,
        starts: &SMatrix<f64, N, N>,
        s: &SMatrix<f64, N, N>,
        y: &SMatrix<f64, M, N>,
        gap: f64,
    ) -> Result<Robust<N, M>, RobustError> {
        let failed = RobustError::NotCertified {
            vertex: 0,
            excess: f64::NAN,
        };
        let inverse = s.try_inverse().ok_or(failed)?;
        let gain = y * inverse * self.into;
        let cost = self.into.transpose() * inverse * self.into;
        let cost = (cost + cost.transpose()) * 0.5;
        for (vertex, (a, b)) in vertices.iter().enumerate() {
            let closed = a - b * gain;
            let spent = weights.n * gain;
            let spent = weights.q + gain.transpose() * weights.r * gain - spent - spent.transpose();
            let (change, terms) = match self.time {
                Time::Continuous => {
                    let xa = cost * closed;
                    (xa + xa.transpose() + spent, 2.0 * xa.norm())
                }
                Time::Discrete => {
                    let moved = closed.transpose() * cost * closed;
                    (moved - cost + spent, moved.norm() + cost.norm())
                }
            };
            // In coordinates in which the bound is z'z, so that every direction counts alike.
            let into = self.into.try_inverse().unwrap_or_else(SMatrix::zeros);
            let scaled = into.transpose() * change * into;
            let excess = dynamic(&scaled).symmetric_eigenvalues().max() / self.speed;
            let stable = match self.time {
                Time::Continuous => is_hurwitz(&closed),
                Time::Discrete => is_schur(&closed),
            };
            if !stable || !(excess <= 1e-8) || !terms.is_finite() {
                return Err(RobustError::NotCertified { vertex, excess });
            }
        }
        let guaranteed = (cost * starts).trace();
        Ok(Robust {
            gain,
            cost,
            guaranteed,
            gap: gap / guaranteed,
        })
    }
}

fn dynamic<const R: usize, const C: usize>(m: &SMatrix<f64, R, C>) -> DMatrix<f64> {
    DMatrix::from_column_slice(R, C, m.as_slice())
}

fn put<const R: usize, const C: usize>(
    block: &mut DMatrix<f64>,
    row: usize,
    col: usize,
    m: &SMatrix<f64, R, C>,
) {
    block.view_mut((row, col), (R, C)).copy_from(m);
}
