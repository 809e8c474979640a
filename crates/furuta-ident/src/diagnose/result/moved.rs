//! Which numbers of the sheet the recordings moved, and how far.

use super::{Diagnosis, ParameterEstimate, plain, significant};

/// A number has moved where it is further from the sheet than this many of its standard deviations, and than this
/// share of its value: less is of no consequence.
const DEVIATIONS: f64 = 2.0;
const LEAST: f64 = 0.01;
/// Further than this many of the sheet's own deviations, the sheet is wrong, or something else took the number's place.
const SURPRISING: f64 = 3.0;
/// A number of which no tolerance is known surprises by this factor.
const ORDER: f64 = 10.0;

impl ParameterEstimate {
    /// Whether the recordings moved it.
    #[must_use]
    pub fn has_moved(&self) -> bool {
        let way = (self.fitted - self.nominal).abs();
        self.at_bound
            || self.identifiable && way > DEVIATIONS * self.std && way > LEAST * self.nominal.abs()
    }

    /// `6.18e-5 to 1.03e-4 kg m2, +66 %`, and what is to be thought of it where that is surprising.
    ///
    /// ```
    /// use furuta_ident::diagnose::result::ParameterEstimate;
    /// let constant = ParameterEstimate {
    ///     nominal: 0.042, fitted: 0.0105, std: 1e-4, tolerance: 0.1, unit: "N m/A".into(), identifiable: true,
    ///     at_bound: false,
    /// };
    /// assert!(constant.has_moved());
    /// assert_eq!(
    ///     constant.change(),
    ///     "0.0420 to 0.0105 N m/A, -75 %: 7.5 times what the sheet may be off; measure it, for something else may \
    ///      have taken its place"
    /// );
    /// let constant = ParameterEstimate { at_bound: true, ..constant };
    /// assert_eq!(constant.change(), "0.0420 to 0.0105 N m/A, -75 %: at its bound; something else took its place");
    /// ```
    #[must_use]
    pub fn change(&self) -> String {
        let (from, to) = (significant(self.nominal, 3), significant(self.fitted, 3));
        let share = self.fitted / self.nominal - 1.0;
        let far = match share {
            s if !s.is_finite() => String::new(),
            s if s > 1.0 => format!(", {} times", significant(s + 1.0, 2)),
            s => format!(", {:+.0} %", 100.0 * s),
        };
        let deviations = share.abs() / self.tolerance;
        let remark = if self.at_bound {
            ": at its bound; something else took its place".to_owned()
        } else if self.fitted <= 0.0 && self.tolerance.is_finite() {
            ": no body is like that; something else took its place".to_owned()
        } else if deviations > SURPRISING {
            format!(
                ": {} times what the sheet may be off; measure it, for something else may have taken its place",
                significant(deviations, 2)
            )
        } else if !self.tolerance.is_finite()
            && (self.fitted > ORDER * self.nominal || self.fitted < self.nominal / ORDER)
        {
            ": the sheet's is another order of magnitude".to_owned()
        } else {
            String::new()
        };
        let unit = plain(&self.unit);
        let space = if unit.is_empty() { "" } else { " " };
        format!("{from} to {to}{space}{unit}{far}{remark}")
    }
}

impl Diagnosis {
    /// The numbers of the sheet that the recordings moved: key and [`ParameterEstimate::change`].
    pub fn moved(&self) -> impl Iterator<Item = (&str, String)> {
        let moved = self.parameters.iter().filter(|(_, p)| p.has_moved());
        moved.map(|(key, p)| (key.as_str(), p.change()))
    }
}
