//! The encoders' noise, measured from the recordings themselves.

use nalgebra::{SMatrix, SVector};

/// A stretch of samples without a gap.
#[derive(Clone, Copy)]
pub(super) struct Stretch<'a> {
    /// The angles, rad.
    pub(super) y: &'a [[f64; 2]],
    /// Their times, s; empty where they are `h` apart.
    pub(super) times: &'a [f64],
    /// Sample period, s.
    pub(super) h: f64,
}

/// Samples on either side of the middle one over which a polynomial is fitted.
const HALF: usize = 6;
/// Of fewer stretches a variance says little.
const ENOUGH: usize = 20;
/// A balanced rig follows a quintic for so long, s: of a twentieth of a radian at 5 Hz, 0.03 mrad are left.
const QUINTIC: f64 = 0.1;
/// Standard deviation of one encoder's noise: residuals of local quintics over stretches in which the encoder moves at
/// least a count per sample, where rounding is white. Stretches far above the median (transients, impacts) are left
/// out.
pub(super) fn noise_floor(runs: &[Stretch<'_>], channel: usize, resolution: f64) -> f64 {
    const SPAN: usize = 2 * HALF + 1;
    const ORDER: usize = 6;
    let rounding = resolution / 12.0_f64.sqrt();
    let basis = SMatrix::<f64, SPAN, ORDER>::from_fn(|r, c| {
        ((r as f64 - HALF as f64) / HALF as f64).powi(c as i32)
    });
    let projection = |basis: SMatrix<f64, SPAN, ORDER>| {
        let inverse = (basis.transpose() * basis).try_inverse()?;
        Some(basis * inverse * basis.transpose())
    };
    let Some(even) = projection(basis) else {
        return rounding;
    };
    let freedom = (SPAN - ORDER) as f64;
    // Of every sample; of every second one, and so on, where the encoder moves less than a count from one to the next.
    let variances_of = |stride: usize, least: f64| {
        let mut variances = Vec::new();
        for run in runs {
            let first = (0..run.y.len()).step_by(SPAN * stride);
            for start in first.flat_map(|block| block..block + stride) {
                let at = |i: usize| start + i * stride;
                if at(SPAN - 1) >= run.y.len() {
                    break;
                }
                let angle = |i: usize| run.y[at(i)][channel];
                let path: f64 = (1..SPAN).map(|i| (angle(i) - angle(i - 1)).abs()).sum();
                if path < least {
                    continue;
                }
                let hat = if !run.times.is_empty() {
                    let span = (HALF * stride) as f64 * run.h;
                    let uneven = SMatrix::<f64, SPAN, ORDER>::from_fn(|r, c| {
                        ((run.times[at(r)] - run.times[at(HALF)]) / span).powi(c as i32)
                    });
                    match projection(uneven) {
                        Some(hat) => hat,
                        None => continue,
                    }
                } else {
                    even
                };
                let y = SVector::<f64, SPAN>::from_fn(|i, _| angle(i));
                let residual = y - hat * y;
                variances.push(residual.norm_squared() / freedom);
            }
        }
        variances
    };
    let Some(longest) = runs.iter().map(|run| run.h * SPAN as f64).reduce(f64::max) else {
        return rounding;
    };
    let strides = std::iter::successors(Some(1_usize), |stride| stride.checked_mul(2));
    let moving = strides
        .take_while(|stride| *stride == 1 || *stride as f64 * longest <= QUINTIC)
        .map(|stride| variances_of(stride, SPAN as f64 * resolution))
        .find(|variances| variances.len() >= ENOUGH);
    // An encoder that is never fast enough shows less than its rounding, unless its noise is more than that.
    let (mut variances, least) = match moving {
        Some(variances) => (variances, 0.7 * rounding),
        None => (variances_of(1, 0.0), rounding),
    };
    if variances.len() < ENOUGH {
        return rounding;
    }
    variances.sort_by(f64::total_cmp);
    let bound = 4.0 * variances[variances.len() / 2];
    let kept = variances.partition_point(|v| *v <= bound);
    let mean = variances[..kept].iter().sum::<f64>() / kept as f64;
    mean.sqrt().max(least)
}
