//! Finds where model and data disagree, and names what is missing.
//!
//! 1. The noise floor is estimated from the encoders themselves (`crate::shooting`), so that "explained" is an absolute
//!    statement.
//! 2. The model is fitted by multiple shooting over short windows (`crate::shooting`): first its parameters alone, in
//!    the combinations that data can show (`hypothesis`), then with each effect of the catalogue added, the most
//!    convincing one kept, until none is left (`search`).
//! 3. What short windows leave unexplained is looked at again over long ones: a name must help at both.
//! 4. Where something is left, the named effects are judged (`judge`): on data they were not fitted to (`held_out`),
//!    against what is looked for on request alone (`contested`), as transients (`transients`), by whether their
//!    strength is the same everywhere (`constancy`). Their rivals are listed.
//! 5. The repaired model goes back into a rig file (`repair`), and whole recordings are predicted with it (`predict`).

mod additions;
mod asked;
mod compare;
mod constancy;
mod contested;
mod criteria;
mod custom;
mod evidence;
mod expression;
mod held_out;
mod horizons;
mod hypothesis;
mod jitter;
mod judge;
mod limits;
mod location;
mod naming;
mod parts;
mod plan;
mod predict;
mod progress;
mod repair;
pub mod result;
mod savers;
mod screen;
mod search;
mod thinned;
mod torque;
mod transients;
mod verify;

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use furuta_model::{Rig, Spec};

pub use additions::candidates;
pub use parts::Parts;
pub use progress::{Progress, STAGES};
pub use result::{Channel, Channels, Curves, Diagnosis, Part, Verdict};

use crate::insufficient::{self, Insufficient};
use crate::pendulum::Pendulum;
use crate::recording::Recording;
use crate::shooting::{self, Data, Effort, Problem};
use crate::stop::Stop;
use hypothesis::{Hypothesis, Sheet};
use judge::Judge;
use location::Residual;
use predict::{Predictor, rms};
use progress::Teller;
use result::{Best, CandidateEvidence, RunCurves, Suspected};
use search::Search;

/// A fitted hypothesis.
type Fit = shooting::Fit<Hypothesis>;

/// Length of the windows of the search, s.
const SEARCH: f64 = 0.25;
/// Length of the windows whose prediction errors are reported, s.
const REPORT: f64 = 0.5;
/// Length of the windows on which a name must hold as well, where the plant is stable, s.
const LONG: f64 = 2.0;
/// Share of the time limit that the search may take.
const FOR_SEARCH: f64 = 0.6;
/// Of each worker thread, bytes.
const STACK: usize = 16 << 20;

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
    pub time_limit: Option<Duration>,
    /// Follow every candidate from every start to the end, however small its score statistic: several times as slow,
    /// and to the same names where what saves time is sound.
    pub thorough: bool,
    /// Entries that are looked for on request ([`furuta_model::effects::Offered`]), to be looked for here: of the
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
    fn data(&self, recordings: &[Recording], rig: &Rig) -> Data {
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

/// Names what the model of a rig is missing.
///
/// The same input gives the same output, whatever the number of threads. `progress` is called from several threads.
///
/// ```
/// use furuta_ident::diagnose::{Request, Verdict, diagnose};
/// use furuta_ident::recording::Recording;
/// use furuta_model::{Effect, Plant, Rig, State};
///
/// // A rig with a hidden cable, recorded for six seconds by its encoders.
/// let rig = Rig::builtin("qube-servo-2").expect("built in");
/// let cable = Effect::new("arm.spring", &[2e-3, 0.2]).expect("valid");
/// let plant: Plant<f64> = Plant::new(&rig.params, &[cable]).expect("one effect");
/// let mut x = plant.rest(State::hanging());
/// let mut samples = Vec::new();
/// for k in 0..3000 {
///     let t = f64::from(k) * 0.002;
///     let u = 1.5 * (3.0 * t * (1.0 + t)).sin();
///     let [theta, alpha] = rig.sensors.quantised(plant.measure(&x));
///     samples.push([t, u, theta, alpha]);
///     plant.step(&mut x, u, 0.002);
/// }
/// let (recording, _) = Recording::from_samples("sweep", samples)?;
/// let outcome = diagnose(&Request { recordings: &[recording], rig: &rig, verify: &[] }, &|_| ())?;
/// assert_eq!(outcome.diagnosis.verdict, Verdict::MissingEffects);
/// assert_eq!(outcome.diagnosis.effects[0].id, "arm.spring");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`Insufficient`] where the recordings cannot carry a diagnosis: none, too short, nothing moves.
pub fn diagnose(
    request: &Request<'_>,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Outcome, Insufficient> {
    diagnose_with(request, Options::default(), progress)
}

/// As [`diagnose`], with [`Options`].
///
/// # Errors
/// As [`diagnose`].
pub fn diagnose_with(
    request: &Request<'_>,
    options: Options<'_>,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Outcome, Insufficient> {
    // Workers that wait for others take up further jobs on the same stack.
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(rayon::current_num_threads())
        .stack_size(STACK)
        .build();
    let work = || {
        let here = search(request, options, progress)?;
        if options.compare.is_empty() || here.diagnosis.interrupted {
            return Ok(here);
        }
        compare::with_another_state(request, here, options, progress)
    };
    match pool {
        Ok(pool) => pool.install(work),
        Err(_) => work(),
    }
}

fn search(
    request: &Request<'_>,
    options: Options<'_>,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Outcome, Insufficient> {
    let begin = Instant::now();
    let by = |share: f64| {
        options
            .time_limit
            .and_then(|t| begin.checked_add(t.mul_f64(share)))
    };
    let stop = Stop::when(options.stop).or_at(by(1.0));
    // The rest of the time is for judging what was found.
    let hurry = Stop::when(options.stop).or_at(by(FOR_SEARCH));
    let savers = if options.thorough {
        &savers::NONE
    } else {
        &savers::USUAL
    };
    let mut unfinished: Vec<Part> = Vec::new();
    let data = options.data(request.recordings, request.rig);
    insufficient::check(request.recordings, request.rig, &data)?;
    let mut sheet = Sheet::new(request.rig, &data, !options.same_zero, options.pendulum);
    let base = Hypothesis::base(&Arc::new(sheet.clone()));
    let (asked, mut notices) = asked::asked(&base, options.candidates);
    sheet.asked = asked;
    let sheet = Arc::new(sheet);
    let teller = Teller::new(progress);
    let stage = |stage| teller.stage(stage);

    stage("recalibrating");
    let short = Problem::new(&data, data.windows(SEARCH, |_| true)).until(hurry);
    let out_of_time = Stop::NEVER.or_at(by(1.0));
    let calm = Problem::new(&data, short.windows.clone()).until(out_of_time);
    let base = Hypothesis::base(&sheet);
    let as_given = short.solve_states(&base, &vec![0.0; base.len()], None);
    let refitted = short.fit(&base, as_given.z.clone(), &as_given.states, Effort::FULL);

    if hurry.wanted() {
        unfinished.push(Part::Parameters);
    }

    stage("searching");
    let searching = teller.candidates("searching");
    let part = short.thinned(&refitted, savers.windows);
    let from = |problem, start| Search::new(problem, start, &|_| true, savers, &searching);
    let mut search = match &part {
        Some(part) => {
            let mut search = from(&part.problem, part.start.clone());
            search.run_while(|f| part.problem.is_far(f));
            search.onto(&short, refitted.clone())
        }
        None => from(&short, refitted.clone()),
    };
    let mut named = search.run();
    let cut = !search.is_through();
    let first = std::mem::take(&mut search.first);
    let mut rivals = search.rivals(&named);
    let explains = |f: &Fit| short.explains(f);
    // Where even short windows are far from what was measured, long ones say no more.
    if !explains(&named) && !short.is_far(&named) && !hurry.wanted() {
        stage("searching over long windows");
        let further = horizons::search(
            &short,
            &data,
            named.clone(),
            savers,
            &teller.candidates("searching over long windows"),
        );
        if further.model.effects.len() > named.model.effects.len() {
            named = further;
            rivals = search.rivals(&named);
        }
    }

    // From here on every fit is made to its end, as long as there is time at all.
    search.calmly(&calm);
    let mut suspected = Vec::new();
    if cut || (!explains(&named) && hurry.wanted()) {
        // Names of finished rounds stay if they stand up to a fit to the end; who else might stand in their place was
        // not looked at.
        unfinished.extend([Part::Search, Part::Rivals]);
        if !named.model.effects.is_empty() {
            let (model, z) = (named.model.clone(), named.z.clone());
            named = calm.simplified(calm.fit(&model, z, &named.states, Effort::FULL));
        }
        rivals = search.rivals(&named);
        if out_of_time.wanted() {
            // Even that was not made to its end.
            suspected.extend(named.model.effects.iter().map(|e| Suspected::unjudged(e)));
            (named, rivals) = (refitted.clone(), Vec::new());
        }
    }

    let folds = held_out::folds(&data);
    let apart = |fit: &Fit, refit, horizons| {
        let asked = held_out::Asked { refit, horizons };
        held_out::unseen(&data, &folds, fit, asked, out_of_time)
    };
    let unseen = |fit: &Fit| apart(fit, true, true);
    let mut after = None;
    // A model that leaves no more than the noise has nothing that a name could stand in for.
    if !explains(&named) {
        stage("judging");
        let judge = Judge {
            problem: &calm,
            unseen: &unseen,
            base: &refitted,
            search: &search,
            stop,
        };
        let judged = judge.judge(named, rivals);
        (named, rivals) = (judged.named, judged.rivals);
        suspected.extend(judged.suspected);
        after = judged.unseen;
    } else if named.model.has_blows() {
        // Blows are not quite the law's, and what they leave is imitated like any other rest.
        suspected.extend(constancy::scattered(&calm, &named));
    }
    let explained = explains(&named);
    let mut custom = None;
    if !explained && stop.wanted() {
        unfinished.push(Part::Expression);
    } else if !explained && options.pendulum.is_whole() {
        stage("looking for an expression");
        let without = after.get_or_insert_with(|| unseen(&named));
        custom = custom::propose(&calm, &folds, &refitted, (&named, &without.errors));
        if out_of_time.wanted() {
            unfinished.push(Part::Expression);
        }
    }
    let whole = custom.as_ref().map_or(&named, |c| &c.fit);
    for rival in rivals.iter().filter(|r| !whole.model.has(r.spec.id)) {
        suspected.retain(|s| s.id != rival.spec.id);
        suspected.push(Suspected::expressed(rival.spec));
    }
    rivals.retain(|r| whole.model.has(r.spec.id));

    stage("fitting");
    let (base_fit, named_fit) = rayon::join(
        || horizons::finish(&data, &refitted, explained, stop),
        || horizons::finish(&data, whole, explains(whole), stop),
    );
    if stop.wanted() && !explained {
        unfinished.push(Part::LongHorizons);
    }

    let mut diagnosis = Diagnosis::new(if explained {
        match (named.model.effects.is_empty(), explains(&as_given)) {
            (false, _) => Verdict::MissingEffects,
            (true, true) => Verdict::NoGap,
            (true, false) => Verdict::ParametersOnly,
        }
    } else {
        Verdict::Unexplained
    });
    if options.plan && options.pendulum.is_whole() {
        stage("planning");
        diagnosis.plan = plan::plan(request.rig, &data, &named, &rivals, stop);
        if stop.wanted() {
            unfinished.push(Part::Plan);
        }
    }
    let judged = (!stop.wanted()).then(|| {
        let before = unseen(&refitted);
        let after = match after {
            Some(after) => after,
            None if named.model.effects.is_empty() => before.clone(),
            None => unseen(&named),
        };
        let whole = custom.as_ref().map_or(&after.errors, |c| &c.errors);
        let held_out = held_out::compared(&data, &before.errors, whole);
        let gain = |without: &Fit| {
            let without = if without.model.effects.is_empty() {
                before.clone()
            } else {
                apart(without, true, false)
            };
            held_out::removed(&data, &without.errors, &after.errors)
        };
        let gains: Vec<f64> = rivals.iter().map(|r| gain(&r.without)).collect();
        let repaired = custom.as_ref().map(|c| unseen(&c.fit));
        let given = apart(&as_given, false, true);
        let best = held_out::best(&given, &before, repaired.as_ref().unwrap_or(&after));
        (held_out, gains, best)
    });
    // What ran out of time says nothing.
    let gains = match judged.filter(|_| !out_of_time.wanted()) {
        Some((held_out, gains, best)) => {
            (diagnosis.held_out, diagnosis.best) = (held_out, best);
            gains
        }
        None => {
            unfinished.push(Part::HeldOut);
            vec![f64::NAN; rivals.len()]
        }
    };
    diagnosis.effects = naming::effects(&calm, &named, &named_fit, rivals, &gains);
    let is_kept = |id: &str| suspected.iter().any(|s| s.kept && s.id == id);
    diagnosis.effects.retain(|e| !is_kept(&e.id));
    diagnosis.suspected = suspected;
    diagnosis.custom = custom.as_ref().map(|c| c.refitted(&named_fit));
    if unfinished.contains(&Part::Rivals) {
        for effect in &mut diagnosis.effects {
            effect.confusable_with = naming::not_ruled_out(&effect.id, &named);
        }
    }
    diagnosis.next_experiment = naming::next_experiment(&diagnosis.effects);
    if stop.wanted() {
        unfinished.push(Part::Limits);
    } else {
        diagnosis.limits = limits::limits(&calm, whole);
    }
    diagnosis.interrupted = stop.asked() && !unfinished.is_empty();
    diagnosis.unfinished = unfinished;

    diagnosis.jitter = jitter::jitter(&data, request.rig.sensors.resolution());
    let repaired = repair::repaired(request.rig, &named_fit);
    let best = match diagnosis.best {
        Best::Given => request.rig.clone(),
        Best::Refitted => repair::repaired(request.rig, &base_fit),
        Best::Repaired => repaired.clone(),
    };
    diagnosis.parameters = repair::parameters(request.rig, &repaired, &named_fit);
    diagnosis.zeros = naming::zeros(request.recordings, &named_fit);
    let mut curves = Curves {
        rig: request.rig.name.clone(),
        repaired_rig: Some(best.to_toml()),
        ..Curves::default()
    };
    curves.evidence = first
        .iter()
        .map(|t| CandidateEvidence {
            id: t.spec.id.into(),
            delta_bic: t.evidence.delta_bic,
            named: whole.model.has(t.spec.id),
        })
        .collect();
    let models = &[&as_given, &base_fit, &named_fit].map(Predictor::from);
    gap(&data, models, &mut diagnosis, &mut curves);
    if !request.verify.is_empty() {
        stage("verifying");
        let unseen = options.data(request.verify, request.rig);
        verify::verify(&unseen, models, &mut diagnosis, &mut curves);
    }
    diagnosis.notices.append(&mut notices);
    if let Some(notice) = options.pendulum.notice() {
        diagnosis.notices.push(notice.to_owned());
        diagnosis.forget(options.pendulum);
    }
    diagnosis.seconds = begin.elapsed().as_secs_f64();
    Ok(Outcome {
        diagnosis,
        curves,
        repaired: best,
    })
}

/// Prediction errors over the reported horizon by model, where they sit, and the curves.
fn gap(data: &Data, models: &[Predictor; 3], diagnosis: &mut Diagnosis, curves: &mut Curves) {
    let problem = Problem::new(data, data.windows(REPORT, |_| true));
    let predictions = predict::of_each(models, |m| predict::windowed(&problem, m));
    let errors = predictions.each_ref().map(|p| predict::errors(&problem, p));
    let [as_given, refitted, repaired] = errors.each_ref().map(|e| rms(e.iter().flatten()).into());
    let gap = &mut diagnosis.gap;
    gap.horizon = REPORT;
    (gap.nominal, gap.recalibrated, gap.augmented) = (as_given, refitted, repaired);
    gap.noise_floor = data.noise.into();
    let mut residuals = Vec::new();
    for (i, w) in problem.windows.iter().enumerate() {
        for (k, (before, after)) in errors[1][i].iter().zip(&errors[2][i]).enumerate() {
            let squared = |e: &[f64; 2]| std::array::from_fn(|c| (e[c] / data.noise[c]).powi(2));
            residuals.push(Residual {
                run: w.run,
                sample: w.start + 1 + k,
                refitted: squared(before),
                repaired: squared(after),
            });
        }
    }
    let unit = models[0].hypothesis.sheet.params.motor.actuation.unit();
    (curves.bars, diagnosis.location) = location::locate(data, &residuals, unit);
    let [_, before, after] = models;
    let (before, after) = rayon::join(
        || torque::Responses::new(&problem, before),
        || torque::Responses::new(&problem, after),
    );
    (curves.torque_by_state, diagnosis.missing_torque) = torque::by_state(&before, &after);
    if matches!(diagnosis.verdict, Verdict::NoGap | Verdict::ParametersOnly) {
        diagnosis.missing_torque.clear();
    }
    curves.torque_in_time = torque::in_time(&problem, &before, &after);
    for (i, run) in data.runs.iter().enumerate() {
        let series = predictions
            .each_ref()
            .map(|p| predict::joined(&problem, i, p));
        let windows = problem.windows.iter().filter(|w| w.run == i);
        curves.runs.push(RunCurves {
            restarts: windows.map(|w| w.start).collect(),
            ..predict::curves(run, series)
        });
    }
}
