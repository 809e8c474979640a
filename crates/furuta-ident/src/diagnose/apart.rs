//! What models leave on data kept apart, worked out once for each.

use std::sync::{Arc, Mutex, PoisonError};

use furuta_model::Spec;

use super::Fit;
use super::held_out::{self, Asked, Folds, Unseen};
use crate::shooting::Data;
use crate::stop::Stop;

/// The data, how they are kept apart, and what is known of models on them.
pub(super) struct Apart<'a> {
    data: &'a Data,
    pub(super) folds: Folds,
    /// When it is wanted, fits end where they are: what is left then is not remembered.
    stop: Stop<'a>,
    known: Mutex<Vec<Known>>,
}

/// What one model leaves.
struct Known {
    effects: Vec<&'static Spec>,
    z: Vec<f64>,
    asked: Asked,
    unseen: Arc<Unseen>,
}

impl Known {
    fn is_of(&self, fit: &Fit) -> bool {
        let effects = &fit.model.effects;
        self.z == fit.z
            && self.effects.len() == effects.len()
            && self.effects.iter().zip(effects).all(|(a, b)| a.is_same(b))
    }
}

impl<'a> Apart<'a> {
    pub(super) fn new(data: &'a Data, stop: Stop<'a>) -> Self {
        Self {
            data,
            folds: held_out::folds(data),
            stop,
            known: Mutex::default(),
        }
    }

    /// What a fit leaves over all horizons, its parameters fitted to the other parts.
    pub(super) fn unseen(&self, fit: &Fit) -> Arc<Unseen> {
        self.of(fit, Asked::ALL)
    }

    /// The errors of the same over windows of [`super::REPORT`]; the horizons may be left out.
    pub(super) fn errors(&self, fit: &Fit) -> Arc<Unseen> {
        self.of(fit, Asked::ERRORS)
    }

    /// What a model leaves over all horizons, its parameters taken as they are.
    pub(super) fn as_it_is(&self, fit: &Fit) -> Arc<Unseen> {
        self.of(fit, Asked::AS_IT_IS)
    }

    fn of(&self, fit: &Fit, asked: Asked) -> Arc<Unseen> {
        let known = || self.known.lock().unwrap_or_else(PoisonError::into_inner);
        let answers = |k: &Known| k.asked.includes(asked) && k.is_of(fit);
        if let Some(k) = known().iter().find(|k| answers(k)) {
            return Arc::clone(&k.unseen);
        }
        let unseen = held_out::unseen(self.data, &self.folds, fit, asked, self.stop);
        let unseen = Arc::new(unseen);
        if !self.stop.wanted() {
            known().push(Known {
                effects: fit.model.effects.clone(),
                z: fit.z.clone(),
                asked,
                unseen: Arc::clone(&unseen),
            });
        }
        unseen
    }
}
