//! A validation as tables.

use super::Validation;
use crate::answer::significant;

/// Below this probability white residuals would not show such a statistic.
const UNLIKELY: f64 = 0.01;

impl Validation {
    /// The validation for a person.
    #[must_use]
    pub fn summary(&self) -> String {
        let mut out = format!(
            "{:<30} {:>8} {:>11} {:>11}   {:<22} {:<22}\n",
            format!("rig {}", self.rig),
            "fit",
            "RMS [rad]",
            "noise [rad]",
            "autocorrelation",
            "correlation with u"
        );
        for c in &self.channels {
            let whiteness = &c.whiteness;
            let p = if whiteness.p_value < UNLIKELY {
                "p < 0.01".to_owned()
            } else {
                format!("p = {:.2}", whiteness.p_value)
            };
            out += &format!(
                "  {:<20} {:<7} {:>6.1} % {:>11.6} {:>11.6}   {:<22} {:<22}\n",
                c.run,
                c.channel,
                c.fit_percent,
                c.rms,
                c.noise_floor,
                format!(
                    "{} of {} outside, {p}",
                    whiteness.outside,
                    whiteness.values.len()
                ),
                format!(
                    "{} of {} outside",
                    c.cross.outside,
                    c.cross.lags.iter().filter(|l| **l >= 0).count()
                ),
            );
        }
        out += "\nerror after [s], RMS [rad] (fit)\n";
        for c in &self.channels {
            out += &format!("  {:<20} {:<7}", c.run, c.channel);
            for s in &c.steps {
                out += &format!(
                    "  {}: {} ({:.1} %)",
                    s.seconds,
                    significant(s.rms, 2),
                    s.fit_percent
                );
            }
            out.push('\n');
        }
        out += "\nfit: 100 (1 - |y - yhat| / |y - mean y|). Outside: beyond the bound that holds 99 % of the lags of a \
                perfect model; p: Ljung-Box.\n";
        if self.channels.iter().any(|c| c.whiteness.p_value < UNLIKELY) {
            out += "Residuals that are not white: the model lacks something, or the encoder is coarse (its rounding \
                    repeats itself with the motion): compare RMS and noise.\n";
        }
        for notice in &self.notices {
            out += &format!("note: {notice}\n");
        }
        out
    }
}
