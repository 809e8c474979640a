//! Where a value stands in a picture, and which values are written beside it.

/// From values to places in the picture.
pub(crate) struct Axis {
    low: f64,
    high: f64,
    from: f64,
    to: f64,
    pub(crate) step: f64,
    /// `low` and `high` are decades.
    logarithmic: bool,
}

impl Axis {
    pub(crate) fn over(
        values: impl Iterator<Item = f64>,
        from: f64,
        to: f64,
        margin: bool,
    ) -> Self {
        let (low, high) = values
            .filter(|v| v.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
                (low.min(v), high.max(v))
            });
        if low > high {
            return Self::between(0.0, 1.0, from, to);
        }
        let span = if high > low {
            high - low
        } else {
            low.abs().max(1.0)
        };
        let extra = if margin || high <= low {
            0.06 * span
        } else {
            0.0
        };
        Self::between(low - extra, high + extra, from, to)
    }

    pub(crate) fn between(low: f64, high: f64, from: f64, to: f64) -> Self {
        let rough = (high - low) / 5.0;
        let decade = 10_f64.powf(rough.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0]
            .map(|m| m * decade)
            .into_iter()
            .find(|s| *s >= rough * 0.999)
            .unwrap_or(rough);
        Self {
            low,
            high,
            from,
            to,
            step,
            logarithmic: false,
        }
    }

    pub(crate) fn logarithmic(values: impl Iterator<Item = f64>, from: f64, to: f64) -> Self {
        let decades = values.filter(|v| *v > 0.0).map(f64::log10);
        Self {
            logarithmic: true,
            ..Self::over(decades, from, to, false)
        }
    }

    /// The place of a value, kept near the picture whatever the value.
    pub(crate) fn at(&self, value: f64) -> f64 {
        let value = if self.logarithmic {
            value.log10()
        } else {
            value
        };
        let share = ((value - self.low) / (self.high - self.low)).clamp(-2.0, 3.0);
        self.from + share * (self.to - self.from)
    }

    /// Distance of the ticks about a value.
    pub(crate) fn step_at(&self, value: f64) -> f64 {
        if self.logarithmic {
            10_f64.powf(value.log10().floor())
        } else {
            self.step
        }
    }

    pub(crate) fn ticks(&self) -> impl Iterator<Item = (f64, f64)> {
        let values = if self.logarithmic {
            self.decades()
        } else {
            self.even()
        };
        values.into_iter().map(|value| (value, self.at(value)))
    }

    /// 1, 2, 5, 10, 20, ... within the axis; 1, 10, 100, ... where it spans many decades.
    fn decades(&self) -> Vec<f64> {
        let digits: &[f64] = if self.high - self.low > 3.5 {
            &[1.0]
        } else {
            &[1.0, 2.0, 5.0]
        };
        let range = self.low.floor() as i32..=(self.high.ceil() as i32).min(self.low as i32 + 50);
        let all = range.flat_map(|decade| digits.iter().map(move |d| d * 10_f64.powi(decade)));
        let inside = |v: &f64| (self.low - 1e-9..=self.high + 1e-9).contains(&v.log10());
        all.filter(inside).collect()
    }

    fn even(&self) -> Vec<f64> {
        let first = (self.low / self.step - 1e-6).ceil() as i64;
        let last = (self.high / self.step + 1e-6).floor() as i64;
        // Never more than a picture can show.
        (first..=last.min(first + 50))
            .map(|k| k as f64 * self.step)
            .collect()
    }
}

/// As many decimals as the distance of the ticks needs.
pub(crate) fn number_text(value: f64, step: f64) -> String {
    let decimals = (-step.log10().floor()).clamp(0.0, 9.0) as usize;
    // No minus before a zero.
    format!("{:.decimals$}", if value == 0.0 { 0.0 } else { value })
}

pub(crate) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::Axis;

    #[test]
    fn ticks_are_round_and_inside() {
        let axis = Axis::over([0.013, 0.187].into_iter(), 0.0, 100.0, false);
        let values: Vec<_> = axis.ticks().map(|t| t.0).collect();
        assert_eq!(values.len(), 3, "{values:?}");
        assert!((values[0] - 0.05).abs() < 1e-12 && (values[2] - 0.15).abs() < 1e-12);
    }

    #[test]
    fn decades_are_evenly_spaced() {
        let axis = Axis::logarithmic([0.1, 0.0, 10.0].into_iter(), 0.0, 100.0);
        let values: Vec<_> = axis.ticks().map(|t| t.0).collect();
        assert_eq!(values.len(), 7, "{values:?}");
        assert!((axis.at(1.0) - 50.0).abs() < 1e-9);
    }
}
