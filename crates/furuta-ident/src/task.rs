//! How long it takes to look through recordings.

/// What is done with recordings.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Task {
    /// [`diagnose`](crate::diagnose).
    Diagnose,
    /// [`calibrate`](crate::calibrate).
    Calibrate,
    /// [`validate`](crate::validate).
    Validate,
}

impl Task {
    /// Roughly how long it takes for this number of samples, s. All three simulate every sample again and again, so the
    /// time grows with the
    /// samples. Measured on two cores, on chirps of 10,000 and 30,000 samples with one effect; effects that are hard to
    /// tell apart take
    /// several times as long.
    ///
    /// ```
    /// use furuta_ident::Task;
    /// assert!(Task::Diagnose.seconds(10_000_000) > 60.0 * Task::Diagnose.seconds(100_000));
    /// ```
    #[must_use]
    pub fn seconds(self, samples: usize) -> f64 {
        let per_sample = match self {
            Self::Diagnose => 400e-6,
            Self::Calibrate => 40e-6,
            Self::Validate => 13e-6,
        };
        per_sample * samples as f64
    }
}
