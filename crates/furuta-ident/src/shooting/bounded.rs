//! Steps of parameters that stay within their bounds.

use nalgebra::DVector;

use super::eliminate::Reduced;

/// A step of the parameters that stays within their bounds: components at a bound that would leave it rest.
pub(crate) fn bounded_step(
    z: &[f64],
    r: &Reduced,
    bounds: &[(f64, f64)],
    damping: f64,
) -> Option<DVector<f64>> {
    let (_, step) = resting(z, r, bounds, damping)?;
    Some(DVector::from_fn(z.len(), |i, _| {
        z[i] - (z[i] - step[i]).clamp(bounds[i].0, bounds[i].1)
    }))
}

/// The step where these numbers rest.
fn step_beside(r: &Reduced, resting: &[bool], damping: f64) -> Option<DVector<f64>> {
    let (mut m, mut g) = (r.matrix.clone(), r.gradient.clone());
    for i in 0..resting.len() {
        m[(i, i)] += damping * m[(i, i)] + 1e-9;
        if resting[i] {
            m.row_mut(i).fill(0.0);
            m.column_mut(i).fill(0.0);
            m[(i, i)] = 1.0;
            g[i] = 0.0;
        }
    }
    Some(m.cholesky()?.solve(&g))
}

/// Which numbers rest, held or at a bound that the step would leave, and the step of the others.
fn resting(
    z: &[f64],
    r: &Reduced,
    bounds: &[(f64, f64)],
    damping: f64,
) -> Option<(Vec<bool>, DVector<f64>)> {
    let p = z.len();
    let mut resting: Vec<bool> = bounds.iter().map(|(low, high)| low == high).collect();
    for _ in 0..p {
        let step = step_beside(r, &resting, damping)?;
        let mut left = false;
        for i in 0..p {
            let (low, high) = bounds[i];
            let at = (z[i] <= low && step[i] > 0.0) || (z[i] >= high && step[i] < 0.0);
            if at && !resting[i] {
                resting[i] = true;
                left = true;
            }
        }
        if !left {
            return Some((resting, step));
        }
    }
    None
}

/// How far beyond its bound each number would go, were it free beside those that rest.
pub(super) fn past(z: &[f64], r: &Reduced, bounds: &[(f64, f64)]) -> Vec<f64> {
    let mut out = vec![0.0; z.len()];
    let Some((mut resting, _)) = resting(z, r, bounds, 0.0) else {
        return out;
    };
    for (i, (low, high)) in bounds.iter().enumerate() {
        if low < high && resting[i] {
            resting[i] = false;
            let step = step_beside(r, &resting, 0.0).map_or(0.0, |step| step[i]);
            out[i] = if z[i] <= *low { step } else { -step }.max(0.0);
            resting[i] = true;
        }
    }
    out
}
