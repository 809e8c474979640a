//! Bode plots: magnitude, phase, coherence over a logarithmic frequency.

use furuta_chart::{Chart, Line, Panel};
use nalgebra::Complex;

use super::Frf;
use super::error::FrequencyError;
use super::response::{continuous_phase, decibels};

/// A Bode plot being put together: what was measured first, models over it.
///
/// ```
/// use furuta_ident::frequency::{Frf, Transfer, bode::Bode};
/// let frequency = [0.1, 1.0, 10.0];
/// let g = Transfer::new(&[1.0], &[1.0, 1.0])?;
/// let curve = frequency.map(|f| (f, g.response(f)));
/// let svg = Bode::new("alpha / u").model("model", &curve, false).chart().svg();
/// assert!(svg.contains("phase [deg]") && !svg.contains("coherence"));
/// # Ok::<(), furuta_ident::frequency::transfer::TransferError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Bode {
    title: String,
    magnitude: Vec<Line>,
    phase: Vec<Line>,
    coherence: Vec<Line>,
    /// Frequency and phase of the first curve, beside which others are drawn, whole turns apart or not.
    beside: Vec<(f64, f64)>,
    colour: usize,
    /// Lowest and highest magnitude of what was measured, dB.
    measured: Option<(f64, f64)>,
}

impl Bode {
    /// An empty plot.
    #[must_use]
    pub fn new(title: &str) -> Self {
        Self {
            title: title.to_owned(),
            magnitude: Vec::new(),
            phase: Vec::new(),
            coherence: Vec::new(),
            beside: Vec::new(),
            colour: 0,
            measured: None,
        }
    }

    /// A measured response with its 95 % confidence and its coherence, where these are known.
    ///
    /// # Errors
    /// As [`Frf::confidence`].
    pub fn measured(mut self, frf: &Frf) -> Result<Self, FrequencyError> {
        if frf.std.iter().all(|s| *s == 0.0) {
            let curve = frf.frequency.iter().copied().zip(frf.response.clone());
            return Ok(self.model("measured", &curve.collect::<Vec<_>>(), false));
        }
        let colour = self.next_colour();
        let radius = frf.confidence(0.95)?;
        let (db, phase) = (frf.magnitude_db(), frf.phase_degrees());
        let over = |values: &[f64]| -> Vec<(f64, f64)> {
            frf.frequency
                .iter()
                .copied()
                .zip(values.iter().copied())
                .collect()
        };
        // Beyond a radius as large as the response nothing is known of it: a band that leaves the picture.
        let share: Vec<f64> = frf
            .response
            .iter()
            .zip(&radius)
            .map(|(h, r)| (r / h.norm()).min(0.999))
            .collect();
        let edge = |side: f64| -> Vec<f64> {
            let shift = |(db, s): (&f64, &f64)| db + decibels(1.0 + side * s);
            db.iter().zip(&share).map(shift).collect()
        };
        self.magnitude
            .push(Line::between("95 %", over(&edge(-1.0)), over(&edge(1.0))).colour(colour));
        self.magnitude
            .push(Line::new("measured", over(&db)).colour(colour));
        let edge = |side: f64| -> Vec<f64> {
            let shift = |(phase, s): (&f64, &f64)| phase + side * s.asin().to_degrees();
            phase.iter().zip(&share).map(shift).collect()
        };
        self.phase
            .push(Line::between("", over(&edge(-1.0)), over(&edge(1.0))).colour(colour));
        self.phase.push(Line::new("", over(&phase)).colour(colour));
        self.coherence
            .push(Line::new("", over(&frf.coherence)).colour(colour));
        self.beside = over(&phase);
        let span = db.iter().filter(|v| v.is_finite());
        self.measured = span.fold(self.measured, |span, v| match span {
            Some((low, high)) => Some((low.min(*v), high.max(*v))),
            None => Some((*v, *v)),
        });
        Ok(self)
    }

    fn next_colour(&mut self) -> usize {
        self.colour += 1;
        self.colour - 1
    }

    /// The picture.
    #[must_use]
    pub fn chart(self) -> Chart {
        let mut magnitude = Panel::new("magnitude [dB]", self.magnitude);
        if let Some((low, high)) = self.measured {
            let margin = 0.08 * (high - low).max(10.0);
            magnitude = magnitude.showing(low - margin, high + margin);
        }
        let mut panels = vec![magnitude, Panel::new("phase [deg]", self.phase)];
        if !self.coherence.is_empty() {
            panels.push(Panel::new("coherence", self.coherence).showing(0.0, 1.02));
        }
        Chart::new(&self.title, "frequency [Hz]", panels).logarithmic()
    }

    /// A model's curve over what was measured: response by frequency (Hz), ascending.
    #[must_use]
    pub fn model(mut self, name: &str, curve: &[(f64, Complex<f64>)], dashed: bool) -> Self {
        let colour = self.next_colour();
        let mut phase = continuous_phase(curve.iter().map(|c| c.1));
        // Of the turns that phase leaves open, those of what was measured.
        let nearest = |f: f64| {
            self.beside
                .iter()
                .min_by(|a, b| (a.0 - f).abs().total_cmp(&(b.0 - f).abs()))
        };
        let middle = curve.len() / 2;
        if let Some((_, beside)) = curve.get(middle).and_then(|c| nearest(c.0)) {
            let turns = 360.0 * ((beside - phase[middle]) / 360.0).round();
            phase.iter_mut().for_each(|p| *p += turns);
        } else {
            self.beside = curve.iter().map(|c| c.0).zip(phase.clone()).collect();
        }
        let style = |line: Line| {
            let line = line.colour(colour);
            if dashed { line.dashed() } else { line }
        };
        let db = curve.iter().map(|c| (c.0, decibels(c.1.norm())));
        self.magnitude.push(style(Line::new(name, db)));
        let phase = curve.iter().map(|c| c.0).zip(phase);
        self.phase.push(style(Line::new("", phase)));
        self
    }
}
