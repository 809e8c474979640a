//! An effect whose law is right has one strength everywhere: what imitates another law is stronger here and weaker
//! there.
//!
//! Each window says by itself how strong an effect is, once its initial state follows: `g/h` from the fit's strength,
//! by the reduced gradient `g` and the information `h` of the linearised window. The scatter of the strength about the
//! fit's `s` is `sqrt(sum(g²/h) - n σ²) / sqrt(sum(h) s²)`, without what `n` windows scatter by the noise `σ²`.

use super::Fit;
use super::criteria::CRITERIA;
use super::result::Suspected;
use crate::shooting::Problem;

/// The effects whose strength scatters too much from window to window. They stay in the model.
pub(super) fn scattered(problem: &Problem<'_>, fit: &Fit) -> Vec<Suspected> {
    let windows = problem.linearise(fit).windows;
    let noise = problem.per_sample(fit);
    let scatter = |index: usize| {
        let strength = fit.model.offset(index);
        let (mut moved, mut whole) = (0.0, 0.0);
        for window in &windows {
            let (score, information) = (window.score[strength], window.information[strength]);
            if information > 0.0 {
                moved += score * score / information - noise;
                whole += information * fit.z[strength].powi(2);
            }
        }
        if whole > 0.0 {
            (moved.max(0.0) / whole).sqrt()
        } else {
            0.0
        }
    };
    (fit.model.effects.iter().enumerate())
        // What acts once is seen by one window or two.
        .filter(|(_, e)| !e.acts_once())
        .map(|(index, e)| (e, scatter(index)))
        .filter(|(_, scatter)| *scatter > CRITERIA.scatters)
        .map(|(e, scatter)| Suspected::scattered(e, scatter))
        .collect()
}
