//! How late a sample arrives, although rig and host have no common clock.

/// Length of half the window (s).
const HALF_WINDOW: f64 = 0.02;

/// Measures delays against the promptest sample of the last 20 to 40 ms. The two clocks' offset is unknown and
/// drifts (crystals by some 50 us/s, an emulated rig's clock whenever its computer is busy), hence the window.
#[derive(Copy, Clone, Debug)]
pub(crate) struct DelayMeter {
    window_start: f64,
    previous: f64,
    current: f64,
}

impl DelayMeter {
    pub(crate) fn new() -> Self {
        Self {
            window_start: 0.0,
            previous: f64::INFINITY,
            current: f64::INFINITY,
        }
    }

    /// Delay (s) of a sample that arrived at `host` on the host's clock and was taken at `rig` on the rig's (s).
    pub(crate) fn delay(&mut self, host: f64, rig: f64) -> f64 {
        let offset = host - rig;
        if host - self.window_start > HALF_WINDOW {
            self.window_start = host;
            self.previous = self.current;
            self.current = f64::INFINITY;
        }
        self.current = self.current.min(offset);
        offset - self.current.min(self.previous)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_late_sample_among_prompt_ones() {
        let mut meter = DelayMeter::new();
        for k in 0..3000 {
            let rig = f64::from(k) * 0.002;
            let late = if k == 1700 { 0.015 } else { 0.0 };
            // Clocks that differ by a constant and by 50 us/s.
            let delay = meter.delay(100.0 + rig * (1.0 + 50e-6) + late, rig);
            // The drift over the window at most, and rounding.
            assert!((delay - late).abs() < 6e-6, "{k}: {delay}");
        }
    }

    #[test]
    fn a_clock_that_stopped_for_a_while_is_forgiven_soon() {
        let mut meter = DelayMeter::new();
        let delays: Vec<_> = (0..2000)
            .map(|k| {
                let rig = f64::from(k) * 0.002;
                meter.delay(rig + if k >= 500 { 0.05 } else { 0.0 }, rig)
            })
            .collect();
        assert!((delays[500] - 0.05).abs() < 1e-9);
        assert!(delays[560..].iter().all(|d| d.abs() < 1e-9));
    }
}
