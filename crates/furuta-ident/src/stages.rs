//! The stages of a long computation.

/// Stages in their order, with the per cent that a progress bar shows when each begins.
#[derive(Debug)]
pub(crate) struct Stages<const N: usize>(pub(crate) [(&'static str, f64); N]);

impl<const N: usize> Stages<N> {
    /// Their names.
    pub(crate) const fn names(&self) -> [&'static str; N] {
        let mut names = [""; N];
        let mut i = 0;
        while i < N {
            names[i] = self.0[i].0;
            i += 1;
        }
        names
    }

    /// The per cent when this stage begins and when the next does.
    pub(crate) fn span(&self, name: &str) -> [f64; 2] {
        let i = self.0.iter().position(|s| s.0 == name).unwrap_or(0);
        [self.0[i].1, self.0.get(i + 1).map_or(100.0, |s| s.1)]
    }
}
