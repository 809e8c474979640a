//! What is asked of a diagnosis, and what it gives.

use std::sync::atomic::AtomicBool;
use std::time::Duration;

use furuta_model::{Rig, Spec};

use super::result::{Curves, Diagnosis};
use crate::pendulum::Pendulum;
use crate::recording::Recording;
use crate::shooting::Data;

/// What a diagnosis is about.
#[derive(Clone, Copy, Debug)]
pub struct Request<'a> {
    /// What the search and the fits may see.
    pub recordings: &'a [Recording],
    /// The rig as its data sheet describes it.
    pub rig: &'a Rig,
    /// Recordings to predict with the finished models; the search never sees them.
    pub verify: &'a [Recording],
}

/// What may be asked of a diagnosis beside its [`Request`].
#[derive(Clone, Copy, Debug, Default)]
pub struct Options<'a> {
    /// Set (by Ctrl-C, say), it ends the search within a fraction of a second; what was found by then is fitted and
    /// given as [`Diagnosis::interrupted`], with [`Diagnosis::unfinished`] saying what was left undone.
    pub stop: Option<&'a AtomicBool>,
    /// Look for the experiments that would tell confusable effects apart: [`Diagnosis::plan`].
    pub plan: bool,
    /// All recordings count their angles from the same zeros: no encoder was switched off between them. Otherwise each
    /// recording has zeros of its own.
    pub same_zero: bool,
    /// After this long the search ends with what was found by then: [`Diagnosis::unfinished`] says what was left
    /// undone. What explains the data is named then, and what was judged on data kept apart; other effects found are
    /// [`Diagnosis::suspected`]. With it, the answer may depend on the machine's speed. Recordings to `compare` have as
    /// long again.
    ///
    /// Of more than 1,000 samples for each second of it (60,000 for less than a minute), stretches of 5 s are looked
    /// at, spread evenly over the recordings, and [`Diagnosis::notices`] says so; [`Self::thorough`] looks at all.
    pub time_limit: Option<Duration>,
    /// Follow every candidate from every start to the end, however small its score statistic: several times as slow,
    /// and to the same names where what saves time is sound.
    pub thorough: bool,
    /// Entries on request ([`furuta_model::effects::Offered`]) that are to be looked for from the outset: of the
    /// catalogue, or a user's own laws ([`furuta_model::effects::own`]). They are fitted, compared and judged as any
    /// other. Those that are always looked for change nothing; of several with one id the first counts, and
    /// [`Diagnosis::notices`] says of each that cannot be looked for why.
    ///
    /// ```
    /// use furuta_ident::diagnose::{Options, Request, Verdict, diagnose_with};
    /// use furuta_ident::recording::Recording;
    /// use furuta_model::{Effect, Plant, Rig, State, effects::own};
    ///
    /// let brake = own::read(
    ///     r#"
    ///     [hypothesis."user.eddy-brake"]
    ///     arm = "-k*theta_dot/(1 + (theta_dot/v)^2)"
    ///     parameters.k = { unit = "N m s/rad", min = 0.0, max = 0.1, typical = 1e-3, strength = true }
    ///     parameters.v = { unit = "rad/s", min = 0.3, max = 100.0, typical = 3.0 }
    ///     "#,
    /// )?;
    /// // A rig that has such a brake, recorded by its encoders.
    /// let rig = Rig::builtin("qube-servo-2").ok_or("built in")?;
    /// let plant: Plant<f64> = Plant::new(&rig.params, &[Effect::checked(brake[0], &[2e-3, 2.0])?])?;
    /// let mut x = plant.rest(State::hanging());
    /// let mut samples = Vec::new();
    /// for k in 0..3000 {
    ///     let t = f64::from(k) * 0.002;
    ///     let u = 3.0 * (3.0 * t * (1.0 + t)).sin();
    ///     let [theta, alpha] = rig.sensors.quantised(plant.measure(&x));
    ///     samples.push([t, u, theta, alpha]);
    ///     plant.step(&mut x, u, 0.002);
    /// }
    /// let recordings = [Recording::from_samples("sweep", samples)?.0];
    /// let request = Request { recordings: &recordings, rig: &rig, verify: &[] };
    /// let found = diagnose_with(&request, Options { candidates: &brake, ..Options::default() }, &|_| ())?;
    /// assert_eq!(found.diagnosis.verdict, Verdict::MissingEffects);
    /// assert_eq!(found.diagnosis.effects[0].id, "user.eddy-brake");
    /// assert!(found.repaired.to_toml().contains("[hypothesis.\"user.eddy-brake\"]"));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub candidates: &'a [&'static Spec],
    /// What the pendulum does in the recordings. Where it is off or locked, the arm alone is diagnosed: no experiment
    /// is planned, and no expression looked for.
    pub pendulum: Pendulum,
    /// Recordings of the same rig in another state (the cable taken off, say): they are diagnosed as well, and
    /// [`Diagnosis::comparison`] says of each effect named in either state whether it differs, except those that act
    /// once. Empty: no comparison.
    ///
    /// ```
    /// use furuta_ident::diagnose::{Options, Request, diagnose_with};
    /// use furuta_ident::recording::Recording;
    /// use furuta_model::{Effect, Plant, Rig, State};
    ///
    /// let rig = Rig::builtin("qube-servo-2").expect("built in");
    /// let recorded = |stiffness: f64| {
    ///     let cable = Effect::new("arm.spring", &[stiffness, 0.2]).expect("valid");
    ///     let plant: Plant<f64> = Plant::new(&rig.params, &[cable]).expect("one effect");
    ///     let mut x = plant.rest(State::hanging());
    ///     let samples = (0..3000).map(|k| {
    ///         let t = f64::from(k) * 0.002;
    ///         let u = 1.5 * (3.0 * t * (1.0 + t)).sin();
    ///         let [theta, alpha] = rig.sensors.quantised(plant.measure(&x));
    ///         plant.step(&mut x, u, 0.002);
    ///         [t, u, theta, alpha]
    ///     });
    ///     Recording::from_samples("sweep", samples.collect::<Vec<_>>())
    /// };
    /// let (with, without) = ([recorded(2e-3)?.0], [recorded(0.0)?.0]);
    /// let request = Request { recordings: &with, rig: &rig, verify: &[] };
    /// let options = Options { compare: &without, ..Options::default() };
    /// let found = diagnose_with(&request, options, &|_| ())?.diagnosis;
    /// let stiffness = &found.comparison.expect("asked for").differences[0];
    /// assert_eq!((stiffness.id.as_str(), stiffness.differs), ("arm.spring", true));
    /// assert!((stiffness.here.value - 2e-3).abs() < 1e-4 && stiffness.there.value.abs() < 1e-4);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub compare: &'a [Recording],
}

impl Options<'_> {
    /// Recordings made ready.
    pub(super) fn data(&self, recordings: &[Recording], rig: &Rig) -> Data {
        Data::in_states(recordings, rig, |_| self.pendulum)
    }
}

/// Everything a diagnosis gives.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Outcome {
    /// The answer, as in the JSON contract.
    pub diagnosis: Diagnosis,
    /// Curves and evidence for the report.
    pub curves: Curves,
    /// The rig that predicts data kept apart best ([`Diagnosis::best`]): most often the one with refitted parameters
    /// and the named effects.
    pub repaired: Rig,
}

impl Outcome {
    /// An outcome of parts that were kept: the answer from [`Diagnosis::from_json`], the curves from
    /// [`Curves::from_json`].
    #[must_use]
    pub const fn kept(diagnosis: Diagnosis, curves: Curves, repaired: Rig) -> Self {
        Self {
            diagnosis,
            curves,
            repaired,
        }
    }
}
