//! Test signals and the arm's reference as asked for on a command line: what `furuta simulate` and `furuta run` share.
//!
//! A run follows a test signal, or a controller, or neither; what shapes the one is refused with the other.

use furuta_hw::Reference;
use furuta_model::Rig;
use furuta_model::signals::{
    Centring, Chirp, CrestFactors, Excitation, FreeDecay, Harmonics, Multisine, Noise, Phases,
    Prbs, Ramp, Signal, SignalError, Step, Steps, Sweep,
};

use crate::failure::Failure;

/// A test signal.
#[derive(clap::ValueEnum, Copy, Clone, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// No command: the pendulum swings freely.
    Zero,
    /// A step at the start.
    Step,
    /// Steps of changing height and both signs.
    Steps,
    /// From 0 V to the amplitude in a straight line over the whole run.
    Ramp,
    /// A sine whose frequency falls through the band.
    Chirp,
    /// A sum of sines in the band, phases chosen for a low peak.
    Multisine,
    /// A pseudo-random binary sequence.
    Prbs,
    /// Band-limited white noise.
    Noise,
}

/// What shapes a test signal. What a signal has no use for is refused.
#[derive(clap::Args, Clone, Debug)]
pub(crate) struct SignalArgs {
    /// Size of a test signal: height of a step, largest of the steps, end of the ramp, amplitude of chirp and PRBS, RMS
    /// of multisine and noise. A part of the rig's command limit if not given.
    #[arg(long, value_name = "VOLTS", allow_hyphen_values = true)]
    amplitude: Option<f64>,
    /// Frequencies of chirp (which falls; 0,8 if not given), multisine and noise (0.2,6), Hz.
    #[arg(long, value_name = "LOW,HIGH", value_parser = band, allow_hyphen_values = true)]
    band: Option<[f64; 2]>,
    /// How long `steps` (0.7) and `prbs` (0.05) hold a voltage.
    #[arg(long, value_name = "SECONDS")]
    hold: Option<f64>,
    /// How the chirp's frequency falls; `linear` if not given.
    #[arg(long, value_enum)]
    sweep: Option<By>,
    /// Number of sines in the multisine, at least 1, spaced evenly in their logarithm; 12 if not given.
    #[arg(long, value_name = "N")]
    lines: Option<usize>,
    /// Which harmonics the multisine has; `logarithmic` if not given.
    #[arg(long, value_enum)]
    harmonics: Option<Grid>,
    /// The PRBS repeats after 2^N - 1 holds, N from 2 to 20; 7 if not given.
    #[arg(long, value_name = "N")]
    order: Option<u32>,
    /// Another noise, another place in the PRBS, other detection lines and phases; 0 if not given.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Ramp a test signal in and out over so long; 0 if not given.
    #[arg(long, value_name = "SECONDS")]
    fade: Option<f64>,
    /// Beside a test signal, pull the arm back to its middle with this time constant, so that a long run does not drift
    /// into the stop; the column `reference` then holds what `furuta identify frf --reference reference` needs.
    #[arg(long, alias = "center", value_name = "SECONDS")]
    centre: Option<f64>,
}

/// How the chirp's frequency falls.
#[derive(clap::ValueEnum, Copy, Clone, Debug, PartialEq, Eq)]
enum By {
    /// By the same number of hertz each second.
    Linear,
    /// By the same factor each second.
    Logarithmic,
}

/// Harmonics of a multisine.
#[derive(clap::ValueEnum, Copy, Clone, Debug, PartialEq, Eq)]
enum Grid {
    /// --lines of them, spaced evenly in their logarithm, phases chosen for a low peak.
    Logarithmic,
    /// All odd ones in the band but one of each four, at random, with random phases (--seed): what the response has at
    /// those left out is nonlinear distortion.
    Detecting,
}

/// Frequencies of multisine and noise where none are given, Hz.
const BAND: [f64; 2] = [0.2, 6.0];

/// Random phases that the search for a low peak begins from, apart from Schroeder's.
pub(crate) const RESTARTS: u32 = 8;

/// A test signal, and what there is to say about it.
#[derive(Debug)]
pub(crate) struct Built {
    pub(crate) excitation: Excitation,
    /// A pull of the arm towards its middle, if one was asked for.
    pub(crate) centring: Option<Centring>,
    /// Worth knowing; one line each.
    pub(crate) notes: Vec<String>,
}

impl SignalArgs {
    /// Refuses what shapes a test signal where there is none, but for what is in `used`. `choice` is the option that
    /// asks for one.
    pub(crate) fn not_without_signal(&self, used: &[&str], choice: &str) -> Result<(), Failure> {
        let idle = self.given().find(|name| !used.contains(name));
        refuse(
            idle,
            "shapes a test signal",
            &format!("{choice} chirp, steps, multisine, ..."),
        )
    }

    /// What was given of what only some signals have.
    fn given(&self) -> impl Iterator<Item = &'static str> {
        names([
            ("--amplitude", self.amplitude.is_some()),
            ("--band", self.band.is_some()),
            ("--hold", self.hold.is_some()),
            ("--sweep", self.sweep.is_some()),
            ("--lines", self.lines.is_some()),
            ("--harmonics", self.harmonics.is_some()),
            ("--order", self.order.is_some()),
            ("--seed", self.seed.is_some()),
            ("--fade", self.fade.is_some()),
            ("--centre", self.centre.is_some()),
        ])
    }

    /// Noise of this RMS in the band asked for, whatever its unit is.
    fn noise(&self, rms: f64) -> Result<Noise, SignalError> {
        let [low, high] = self.band.unwrap_or(BAND);
        Noise::new(rms, low, high, self.seed.unwrap_or_default()).map_err(by_option)
    }

    /// The signal for a run of `duration` seconds on this rig, clipped at its command limit. Its amplitude is `part` of
    /// that limit if none was asked for.
    pub(crate) fn build(
        &self,
        kind: Kind,
        duration: f64,
        rig: &Rig,
        part: f64,
    ) -> Result<Built, Failure> {
        // What is of use to the signal is taken out; what is left then is refused.
        let mut left = self.clone();
        let limit = rig.params.motor.command_limit;
        let unit = rig.params.motor.actuation.unit();
        let (amplitude, fade) = match kind {
            Kind::Zero => (0.0, 0.0),
            _ => (
                left.amplitude.take().unwrap_or(part * limit),
                left.fade.take().unwrap_or(0.0),
            ),
        };
        let centre = left.centre.take();
        if amplitude.is_nan() || amplitude.abs() > limit {
            return Err(Failure::new(format!(
                "--amplitude {amplitude} {unit} is beyond the rig's command limit of {limit} {unit}"
            )));
        }
        let mut notes = Vec::new();
        let signal: Signal = match kind {
            Kind::Zero => FreeDecay.into(),
            Kind::Step => Step::new(amplitude, 0.0).map_err(by_option)?.into(),
            Kind::Steps => Steps::new(amplitude, left.hold.take().unwrap_or(0.7))
                .map_err(by_option)?
                .into(),
            Kind::Ramp => Ramp::new(0.0, amplitude, duration)
                .map_err(by_option)?
                .into(),
            Kind::Chirp => {
                let (sweep, lowest) = match left.sweep.take().unwrap_or(By::Linear) {
                    By::Linear => (Sweep::Linear, 0.0),
                    By::Logarithmic => (Sweep::Logarithmic, 0.1),
                };
                let [low, high] = left.band.take().unwrap_or([lowest, 8.0]);
                Chirp::new(amplitude, high, low, duration, sweep)
                    .map_err(by_option)?
                    .into()
            }
            Kind::Multisine => {
                let [low, high] = left.band.take().unwrap_or(BAND);
                let harmonics = left.harmonics.take().unwrap_or(Grid::Logarithmic);
                let fundamental = Multisine::fundamental_for(duration);
                let (lines, phases) = match harmonics {
                    Grid::Logarithmic => (
                        Harmonics::Logarithmic(left.lines.take().unwrap_or(12)),
                        Phases::Schroeder,
                    ),
                    Grid::Detecting => {
                        let seed = left.seed.take().unwrap_or_default();
                        (Harmonics::Detecting(seed), Phases::Random(seed))
                    }
                };
                let start = Multisine::new(amplitude, fundamental, low, high, lines, phases)
                    .map_err(by_option)?;
                // Random phases are what makes distortion look like noise: they stay.
                let (signal, CrestFactors { before, after }) = match harmonics {
                    Grid::Logarithmic => start.optimised(RESTARTS),
                    Grid::Detecting => {
                        let crest = start.crest_factor();
                        let (before, after) = (crest, crest);
                        (start, CrestFactors { before, after })
                    }
                };
                let words = in_unit(&signal, unit);
                notes.push(format!(
                    "{words}, repeating after {:.6} s: crest factor {after:.2} (with Schroeder's phases {before:.2})",
                    signal.period()
                ));
                let peak = after * amplitude;
                if peak > limit {
                    notes.push(format!(
                        "note: its peak of {peak:.2} {unit} is clipped at the rig's {limit} {unit}: give a lower --amplitude"
                    ));
                }
                signal.into()
            }
            Kind::Prbs => Prbs::new(
                amplitude,
                left.order.take().unwrap_or(7),
                left.hold.take().unwrap_or(0.05),
                left.seed.take().unwrap_or_default(),
            )
            .map_err(by_option)?
            .into(),
            Kind::Noise => {
                (left.band, left.seed) = (None, None);
                self.noise(amplitude)?.into()
            }
        };
        if let Some(name) = left.given().next() {
            let kind = format!("{kind:?}").to_lowercase();
            return Err(Failure::new(format!(
                "a {kind} as asked for has no {name}: leave it out"
            )));
        }
        let excitation = Excitation::new(signal, duration)?
            .faded(fade, fade)
            .map_err(by_option)?
            .limited(limit)?;
        let centring = centre
            .map(|seconds| Centring::returning(&rig.params.coefficients(), seconds))
            .transpose()?;
        Ok(Built {
            excitation,
            centring,
            notes,
        })
    }
}

/// Where a controller that balances leads the arm.
#[derive(clap::Args, Copy, Clone, Debug)]
pub(crate) struct ArmArgs {
    /// Under a controller: step the arm between plus and minus this angle every 2 s while balancing; 0 keeps it at its
    /// middle. If not given: 0.2 in `furuta run`, 0 in `furuta simulate`.
    #[arg(long, value_name = "RAD", value_parser = angle)]
    arm_steps: Option<f64>,
    /// Under a controller: move the arm after noise of this RMS instead (`--band`, `--seed`); the column `reference`
    /// then holds what `furuta identify frf --reference reference` needs for a response upright.
    #[arg(long, value_name = "RAD", value_parser = angle, conflicts_with = "arm_steps")]
    arm_noise: Option<f64>,
}

/// An angle that the arm is led to.
fn angle(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (0.0..=1.0).contains(&value) => Ok(value),
        _ => Err("must be a number between 0 and 1".to_owned()),
    }
}

impl ArmArgs {
    /// What was given, by name.
    pub(crate) fn given(&self) -> [(&'static str, bool); 2] {
        [
            ("--arm-steps", self.arm_steps.is_some()),
            ("--arm-noise", self.arm_noise.is_some()),
        ]
    }

    /// What the arm's reference uses of what shapes a test signal.
    pub(crate) fn uses(&self) -> &'static [&'static str] {
        match self.arm_noise {
            Some(_) => &["--band", "--seed"],
            None => &[],
        }
    }

    /// The arm's reference while balancing: steps (of `steps` if nothing was asked for), noise, or its middle.
    pub(crate) fn reference(&self, steps: f64, signal: &SignalArgs) -> Result<Reference, Failure> {
        Ok(match (self.arm_noise, self.arm_steps.unwrap_or(steps)) {
            (Some(rms), _) => Reference::Noise(signal.noise(rms)?),
            (None, 0.0) => Reference::Constant(0.0),
            (None, amplitude) => Reference::Steps {
                amplitude,
                hold: 2.0,
            },
        })
    }
}

/// Refuses options that only a run under a controller has. `choice` is what asks for one.
pub(crate) fn not_without_controller(
    options: impl IntoIterator<Item = (&'static str, bool)>,
    choice: &str,
) -> Result<(), Failure> {
    refuse(
        names(options).next(),
        "belongs to a run under a controller",
        choice,
    )
}

/// The names of the options that were given.
fn names(
    options: impl IntoIterator<Item = (&'static str, bool)>,
) -> impl Iterator<Item = &'static str> {
    let given = options.into_iter().filter(|(_, given)| *given);
    given.map(|(name, _)| name)
}

/// Refuses an option that has no use: it `does` something for what only `choice` asks for.
fn refuse(idle: Option<&str>, does: &str, choice: &str) -> Result<(), Failure> {
    match idle {
        None => Ok(()),
        Some(name) => Err(Failure::new(format!(
            "{name} {does}, and none is asked for: give one ({choice}), or leave {name} out"
        ))),
    }
}

/// An error of a test signal that names the option in place of the signal's parameter.
fn by_option(error: SignalError) -> SignalError {
    error.renamed(|signal, parameter| match (signal, parameter) {
        (Ramp::NAME, "to") | (_, "amplitude" | "rms") => "--amplitude",
        (Chirp::NAME, "to") | (_, "low") => "--band low",
        (Chirp::NAME, "from") | (_, "high") => "--band high",
        (_, "hold" | "clock") => "--hold",
        (_, "fade-in" | "fade-out") => "--fade",
        (_, "lines") => "--lines",
        (_, "order") => "--order",
        (_, other) => other,
    })
}

pub(crate) fn band(text: &str) -> Result<[f64; 2], String> {
    let numbers = text
        .split_once(',')
        .and_then(|(low, high)| Some([low.trim().parse().ok()?, high.trim().parse().ok()?]));
    match numbers {
        Some([low, high]) if 0.0 <= low && low <= high && high < f64::INFINITY => Ok([low, high]),
        _ => Err(
            "must be two frequencies, the lower one first, with a comma between them".to_owned(),
        ),
    }
}

/// A signal in words, with the unit of the rig's command: signals by themselves are of V.
pub(crate) fn in_unit(signal: &impl std::fmt::Display, unit: &str) -> String {
    let words = signal.to_string();
    let in_unit = |word: &str| match word.strip_prefix('V') {
        Some(rest) if !rest.starts_with(char::is_alphabetic) => format!("{unit}{rest}"),
        _ => word.to_owned(),
    };
    words.split(' ').map(in_unit).collect::<Vec<_>>().join(" ")
}
