//! Test signals: motor commands that make a rig show what it is.

use crate::background::awaited;
use crate::error;
use furuta_model::signals::{
    Chirp, Excitation, FreeDecay, Harmonics, Multisine, Noise, Phases, Prbs, Ramp, Signal,
    SignalError, Step, Steps, Sweep,
};
use numpy::{IntoPyArray, PyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Samples that fit into memory without a second thought.
const MOST_SAMPLES: f64 = 2e7;

/// Samples between two looks at Ctrl-C: some ten milliseconds of work.
const SAMPLES_PER_CHECK: usize = 10_000;

/// Random phases that the search for a low peak begins from, apart from Schroeder's.
const RESTARTS: u32 = 8;

/// A test signal, sampled.
///
/// Parameters
/// ----------
/// kind : str
///     One of the kinds below.
/// duration : float
///     Length in s.
/// dt : float
///     Sample period in s.
/// **parameters
///     What shapes the signal, by the names that the command line has (`--band` is `band`); voltages in V, frequencies
///     in Hz, times in s. Any kind takes `fade` (ramps of half a cosine at both ends, 0; or `fade_in`, `fade_out`) and
///     `limit` (clips, none). The others, and what they are if not given:
///
///     - zero: no command, free decay
///     - step: amplitude (1), start (0)
///     - steps: amplitude (1) of the largest, hold (0.7)
///     - ramp: begin (0), amplitude (1) at the end, over the whole duration
///     - chirp: amplitude (1), band ((0, 8); (0.1, 8) if logarithmic) through which the frequency falls, sweep
///       ("linear" or "logarithmic")
///     - multisine: amplitude (1, the RMS), fundamental (whole periods in the run, of 20 s at most), band ((0.2, 6)),
///       harmonics ("logarithmic",
///       "all", "odd", or "detecting": the odd ones but one of each four, at random), lines (12) of logarithmic
///       harmonics, phases ("optimised" for a low peak, "schroeder", "random"), seed (0) of random phases and of what
///       "detecting" leaves out
///     - prbs: amplitude (1), order (7) for 2^order - 1 bits, hold (0.05), seed (0)
///     - noise: amplitude (1, the RMS), band ((0.2, 6)), seed (0)
///
///     Further names for the same: `rms` for the amplitude of multisine and noise, `low` and `high` for their band,
///     `f0` and `f1` for the frequencies at the start and the end of a chirp (which rises where f1 is the higher one),
///     `end` for the amplitude of a ramp, `clock` for the hold of a prbs.
///
/// Returns
/// -------
/// numpy.ndarray, shape (N,)
///     Voltages at t = 0, dt, 2 dt, ..., N = duration / dt rounded.
///
/// Raises
/// ------
/// SignalError
///     A value out of its range, an unknown kind or parameter, a frequency above half the sample rate.
///
/// Examples
/// --------
/// >>> import numpy as np, furuta
/// >>> u = furuta.signal("multisine", 10, 0.002, amplitude=2, fundamental=0.5, band=(0.5, 8), harmonics="all")
/// >>> u.shape, round(float(np.sqrt(np.mean(u**2))), 6)
/// ((5000,), 2.0)
/// >>> bool(np.abs(u).max() < 1.6 * 2)  # random phases make it about 2.5 times the RMS
/// True
/// >>> x = furuta.simulate(furuta.Rig.load("qube-servo-2"), [0, np.pi, 0, 0], u, dt=0.002)
#[pyfunction]
#[pyo3(signature = (kind, duration, dt, **parameters), text_signature = "(kind, duration, dt, **parameters)")]
pub(crate) fn signal<'py>(
    py: Python<'py>,
    kind: &str,
    duration: f64,
    dt: f64,
    parameters: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let mut given = Parameters {
        kind,
        given: parameters,
        known: Vec::new(),
    };
    let signal = build(py, &mut given, duration)?;
    let fade = given.number("fade", 0.0)?;
    let (fade_in, fade_out) = (
        given.number("fade_in", fade)?,
        given.number("fade_out", fade)?,
    );
    let limit = given.optional("limit")?;
    given.nothing_else()?;
    let excitation = Excitation::new(signal, duration)
        .and_then(|e| e.faded(fade_in, fade_out))
        .and_then(|e| match limit {
            Some(limit) => e.limited(limit),
            None => Ok(e),
        })
        .map_err(|e| given.refused(e))?;
    excitation
        .check_sample_period(dt)
        .map_err(|e| given.refused(e))?;
    let samples = (duration / dt).round();
    if samples > MOST_SAMPLES {
        return Err(error::signal(format!(
            "{kind}: {samples} samples are too many (at most {MOST_SAMPLES}): give a shorter duration or a longer dt"
        )));
    }
    // At most MOST_SAMPLES: the cast keeps the number.
    let samples = samples as usize;
    let mut out = Vec::with_capacity(samples);
    while out.len() < samples {
        let end = samples.min(out.len() + SAMPLES_PER_CHECK);
        py.detach(|| out.extend((out.len()..end).map(|k| excitation.volts(k as f64 * dt))));
        py.check_signals()?;
    }
    Ok(out.into_pyarray(py))
}

const KINDS: [&str; 8] = [
    FreeDecay::NAME,
    Step::NAME,
    Steps::NAME,
    Ramp::NAME,
    Chirp::NAME,
    Multisine::NAME,
    Prbs::NAME,
    Noise::NAME,
];

fn build(py: Python<'_>, p: &mut Parameters<'_, '_>, duration: f64) -> PyResult<Signal> {
    let signal = match p.kind {
        FreeDecay::NAME => Ok(FreeDecay.into()),
        Step::NAME => {
            let (amplitude, start) = (p.number("amplitude", 1.0)?, p.number("start", 0.0)?);
            Step::new(amplitude, start).map(Signal::from)
        }
        Steps::NAME => {
            let (amplitude, hold) = (p.number("amplitude", 1.0)?, p.number("hold", 0.7)?);
            Steps::new(amplitude, hold).map(Signal::from)
        }
        Ramp::NAME => {
            let (begin, end) = (p.number("begin", 0.0)?, p.either("amplitude", "end", 1.0)?);
            Ramp::new(begin, end, duration).map(Signal::from)
        }
        Chirp::NAME => {
            let amplitude = p.number("amplitude", 1.0)?;
            let sweep = p.choice(
                "sweep",
                &[
                    ("linear", Sweep::Linear),
                    ("logarithmic", Sweep::Logarithmic),
                ],
            )?;
            // A logarithmic sweep ends above zero.
            let lowest = if sweep == Sweep::Linear { 0.0 } else { 0.1 };
            let (begin, end) = (p.optional("f0")?, p.optional("f1")?);
            let (f0, f1) = if begin.is_some() || end.is_some() {
                p.without("band", "f0 and f1 say")?;
                (begin.unwrap_or(0.1), end.unwrap_or(8.0))
            } else {
                let (low, high) = p.band()?.unwrap_or((lowest, 8.0));
                (high, low)
            };
            Chirp::new(amplitude, f0, f1, duration, sweep).map(Signal::from)
        }
        Multisine::NAME => return multisine(py, p, duration),
        Prbs::NAME => {
            let (amplitude, order) = (p.number("amplitude", 1.0)?, p.whole("order", 7)?);
            let (clock, seed) = (p.either("hold", "clock", 0.05)?, p.whole("seed", 0)?);
            let order = u32::try_from(order).unwrap_or(u32::MAX); // out of its range either way
            Prbs::new(amplitude, order, clock, seed).map(Signal::from)
        }
        Noise::NAME => {
            let (rms, seed) = (p.either("amplitude", "rms", 1.0)?, p.whole("seed", 0)?);
            let (low, high) = p.low_to_high()?;
            Noise::new(rms, low, high, seed).map(Signal::from)
        }
        kind => {
            return Err(error::signal(format!(
                "no signal {kind:?}: give one of {}",
                KINDS.join(", ")
            )));
        }
    };
    signal.map_err(|e| p.refused(e))
}

fn multisine(py: Python<'_>, p: &mut Parameters<'_, '_>, duration: f64) -> PyResult<Signal> {
    let rms = p.either("amplitude", "rms", 1.0)?;
    let fundamental = p.number("fundamental", Multisine::fundamental_for(duration))?;
    let (low, high) = p.low_to_high()?;
    let lines = p.whole("lines", 12)?;
    let lines = usize::try_from(lines).unwrap_or(usize::MAX); // too many either way
    let seed = p.whole("seed", 0)?;
    let harmonics = p.choice(
        "harmonics",
        &[
            ("logarithmic", Harmonics::Logarithmic(lines)),
            ("all", Harmonics::All),
            ("odd", Harmonics::Odd),
            ("detecting", Harmonics::Detecting(seed)),
        ],
    )?;
    let (phases, restarts) = p.choice(
        "phases",
        &[
            ("optimised", (Phases::Schroeder, Some(RESTARTS))),
            ("schroeder", (Phases::Schroeder, None)),
            ("random", (Phases::Random(seed), None)),
        ],
    )?;
    let signal =
        Multisine::new(rms, fundamental, low, high, harmonics, phases).map_err(|e| p.refused(e))?;
    Ok(match restarts {
        Some(restarts) => awaited(py, move || signal.optimised(restarts).0)?.into(),
        None => signal.into(),
    })
}

/// Keyword arguments, and which ones this kind of signal has asked for.
struct Parameters<'a, 'py> {
    kind: &'a str,
    given: Option<&'a Bound<'py, PyDict>>,
    known: Vec<&'static str>,
}

impl<'py> Parameters<'_, 'py> {
    fn value(&mut self, name: &'static str) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.known.push(name);
        match self.given {
            Some(given) => given.get_item(name),
            None => Ok(None),
        }
    }

    fn wrong(&self, name: &str, value: &Bound<'_, PyAny>, wanted: &str) -> PyErr {
        error::signal(format!("{}: {name} = {value} is not {wanted}", self.kind))
    }

    fn optional(&mut self, name: &'static str) -> PyResult<Option<f64>> {
        match self.value(name)? {
            None => Ok(None),
            Some(value) => match value.extract() {
                Ok(number) => Ok(Some(number)),
                Err(_) => Err(self.wrong(name, &value, "a number")),
            },
        }
    }

    fn number(&mut self, name: &'static str, default: f64) -> PyResult<f64> {
        Ok(self.optional(name)?.unwrap_or(default))
    }

    fn whole(&mut self, name: &'static str, default: u64) -> PyResult<u64> {
        match self.value(name)? {
            None => Ok(default),
            Some(value) => value
                .extract()
                .map_err(|_| self.wrong(name, &value, "a whole number from 0 to 2^64 - 1")),
        }
    }

    /// What is wrong with the signal, a parameter under the keyword that it was given by.
    fn refused(&self, error: SignalError) -> PyErr {
        let given = |name: &str| {
            self.given
                .is_some_and(|g| g.contains(name).unwrap_or(false))
        };
        error::signal(error.renamed(|_, parameter| match (self.kind, parameter) {
            (_, "rms") if given("amplitude") => "amplitude",
            (_, "clock") if given("hold") => "hold",
            (Ramp::NAME, "from") => "begin",
            (Ramp::NAME, "to") if given("end") => "end",
            (Ramp::NAME, "to") => "amplitude",
            (Chirp::NAME, "from" | "to") if given("band") => "band",
            (Chirp::NAME, "from") => "f0",
            (Chirp::NAME, "to") => "f1",
            (_, "fade-in" | "fade-out") if given("fade") => "fade",
            (_, "fade-in") => "fade_in",
            (_, "fade-out") => "fade_out",
            (_, other) => other,
        }))
    }

    /// A number under its name or under another that it has, not both.
    fn either(&mut self, name: &'static str, other: &'static str, default: f64) -> PyResult<f64> {
        let (by_name, by_other) = (self.optional(name)?, self.optional(other)?);
        if by_name.is_some() && by_other.is_some() {
            return Err(error::signal(format!(
                "{}: {name} and {other} are one thing: give one of them",
                self.kind
            )));
        }
        Ok(by_name.or(by_other).unwrap_or(default))
    }

    /// `band=(low, high)`, Hz, if it was given.
    fn band(&mut self) -> PyResult<Option<(f64, f64)>> {
        let Some(band) = self.value("band")? else {
            return Ok(None);
        };
        match band.extract::<(f64, f64)>() {
            Ok((low, high)) if 0.0 <= low && low <= high && high < f64::INFINITY => {
                Ok(Some((low, high)))
            }
            _ => Err(self.wrong(
                "band",
                &band,
                "(low, high), two frequencies in Hz, the lower one first",
            )),
        }
    }

    /// Refuses a name that says again what others `say`.
    fn without(&mut self, name: &'static str, say: &str) -> PyResult<()> {
        match self.value(name)? {
            None => Ok(()),
            Some(_) => Err(error::signal(format!(
                "{}: {name} says what {say}: give one of them",
                self.kind
            ))),
        }
    }

    /// A band, Hz, as `band` or as `low` and `high`.
    fn low_to_high(&mut self) -> PyResult<(f64, f64)> {
        let (low, high) = (self.optional("low")?, self.optional("high")?);
        if low.is_some() || high.is_some() {
            self.without("band", "low and high say")?;
            return Ok((low.unwrap_or(0.2), high.unwrap_or(6.0)));
        }
        Ok(self.band()?.unwrap_or((0.2, 6.0)))
    }

    /// One of these; the first if nothing is said.
    fn choice<T: Copy>(&mut self, name: &'static str, choices: &[(&str, T)]) -> PyResult<T> {
        let Some(value) = self.value(name)? else {
            return Ok(choices[0].1);
        };
        let text: String = value.extract().unwrap_or_default();
        match choices.iter().find(|(choice, _)| *choice == text) {
            Some((_, chosen)) => Ok(*chosen),
            None => {
                let names: Vec<&str> = choices.iter().map(|(choice, _)| *choice).collect();
                let wanted = format!("one of {}", names.join(", "));
                Err(self.wrong(name, &value, &wanted))
            }
        }
    }

    /// Refuses what no one has asked for: a misspelt name must not be overlooked.
    fn nothing_else(&self) -> PyResult<()> {
        for (name, _) in self.given.iter().flat_map(|given| given.iter()) {
            let name: String = name.extract()?;
            if !self.known.contains(&name.as_str()) {
                return Err(error::signal(format!(
                    "{} has no parameter {name:?}: it has {}",
                    self.kind,
                    self.known.join(", ")
                )));
            }
        }
        Ok(())
    }
}
