//! What a search has found over some windows, for another search over the same.

use std::collections::{BTreeMap, BTreeSet};

use furuta_model::Spec;

use super::super::Fit;
use super::super::additions::Earlier;
use super::super::hypothesis::Hypothesis;

/// A set of effects by their ids, sorted.
pub(super) type Set = Vec<&'static str>;

fn ids(h: &Hypothesis) -> impl Iterator<Item = &'static str> {
    h.effects.iter().map(|e| e.id)
}

pub(super) fn set(h: &Hypothesis) -> Set {
    let mut ids: Set = ids(h).collect();
    ids.sort_unstable();
    ids
}

/// What a search has found over the windows of one problem.
#[derive(Clone, Default)]
pub(in super::super) struct Searched {
    pub(super) fits: BTreeMap<Set, Fit>,
    /// The sets to which one more effect was tried, of which entries.
    pub(super) grown: BTreeSet<Set>,
    pub(super) looked_for: Vec<&'static Spec>,
}

impl Searched {
    /// What it says of an effect added to a fit.
    pub(super) fn of(&self, from: &Fit, spec: &'static Spec) -> Earlier {
        if !self.looked_for.iter().any(|e| e.id == spec.id) {
            return Earlier::New;
        }
        let model = from.model.with(spec);
        match self.fits.get(&set(&model)) {
            // Of the same effects in another order the numbers stand in another one.
            Some(fit) if ids(&fit.model).eq(ids(&model)) => {
                let mut fit = fit.clone();
                fit.model = model;
                Earlier::Fitted(Box::new(fit))
            }
            None if self.grown.contains(&set(&from.model)) => Earlier::Left,
            _ => Earlier::New,
        }
    }
}
