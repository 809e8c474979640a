//! An effect whose law is right has one strength everywhere: what imitates another law is stronger here and weaker
//! there.
//!
//! Each window says by itself how strong an effect is, once its initial state follows: `g/h` from the fit's strength,
//! by the reduced gradient `g` and the information `h` of the linearised window. The scatter of the strength about the
//! fit's `s` is `sqrt(sum(g²/h) - n σ²) / sqrt(sum(h) s²)`, without what `n` windows scatter by the noise `σ²`.
//!
//! A window that has more information than all others together is left out: where friction just holds or lets go, a
//! derivative has no bound, and one window would speak for all.

use super::Fit;
use super::criteria::CRITERIA;
use super::result::Suspected;
use crate::shooting::Problem;

/// The effects whose strength scatters too much from window to window. They stay in the model.
pub(super) fn scattered(problem: &Problem<'_>, fit: &Fit) -> Vec<Suspected> {
    let windows = problem.linearise(fit).windows;
    let noise = problem.per_sample(fit);
    (fit.model.effects.iter().enumerate())
        // What acts once is seen by one window or two.
        .filter(|(_, e)| !e.acts_once())
        .map(|(index, e)| {
            let strength = fit.model.offset(index);
            let windows = (windows.iter()).map(|w| (w.score[strength], w.information[strength]));
            (e, scatter(windows, fit.z[strength], noise))
        })
        .filter(|(_, scatter)| *scatter > CRITERIA.scatters)
        .map(|(e, scatter)| Suspected::scattered(e, scatter))
        .collect()
}

/// By which share of its size `s` a strength scatters, from the reduced gradient and the information of each window.
fn scatter(windows: impl Iterator<Item = (f64, f64)>, s: f64, noise: f64) -> f64 {
    let mut known: Vec<(f64, f64)> = windows.filter(|(_, h)| *h > 0.0).collect();
    known.sort_by(|a, b| a.1.total_cmp(&b.1));
    while let [others @ .., (_, most)] = known.as_slice() {
        let information: f64 = others.iter().map(|(_, h)| h).sum();
        if others.is_empty() || *most <= information {
            break;
        }
        known.pop();
    }
    let moved: f64 = known.iter().map(|(g, h)| g * g / h - noise).sum();
    let whole: f64 = known.iter().map(|(_, h)| h * s * s).sum();
    if whole > 0.0 {
        (moved.max(0.0) / whole).sqrt()
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::scatter;

    /// Half of the windows say twice the strength, the others none: it scatters by its size, also where two windows
    /// that agree with the fit have all the information.
    #[test]
    fn one_window_does_not_speak_for_all() {
        let noise = 1.0;
        let (s, h) = (2.0, 1e4_f64);
        // Each window's gradient, with the noise's share of its square.
        let g = (h * s).hypot((h * noise).sqrt());
        let mut windows = vec![(g, h); 10];
        windows.extend([(-g, h); 10]);
        assert!((scatter(windows.iter().copied(), s, noise) - 1.0).abs() < 1e-12);
        // Two windows that agree, each with more information than all that have less.
        windows.extend([(0.0, 1e20), (0.0, 1e12)]);
        assert!((scatter(windows.into_iter(), s, noise) - 1.0).abs() < 1e-12);
    }
}
