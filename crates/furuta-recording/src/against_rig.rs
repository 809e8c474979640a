//! Whether recordings can be of the rig they are said to be of, and of one rig.
//!
//! The pendulum's equation and the arm's, regressed on second differences, need no fit: they show the pendulum's
//! frequency, the ratio of the angles' scales and the sign of the command, each within some per cent. A data sheet, or
//! an effect to be diagnosed, is not off by as much as is asked for here.

use furuta_model::Rig;

use super::convention::PendulumLaw;
use super::{Notice, NoticeKind, Recording, command, counts, frozen};

/// Standard deviations that a coefficient must be away from zero to be spoken of.
const SIGNIFICANT: f64 = 12.0;
/// The pendulum's equation must explain so much of its motion before its coefficients are compared with anything.
const LEFT_AT_MOST: f64 = 0.5;
/// The same where two recordings are compared, whose noise and motion differ.
const LEFT_BETWEEN: f64 = 0.1;
/// Least squared frequency that is compared, 1/s^2: time stamps may be stretched.
const LEAST_FREQUENCY: f64 = 0.5;
/// A pendulum that swings faster or slower than the sheet's by this factor is another one, or its time stamps are
/// wrong.
const FREQUENCY_FACTOR: f64 = 1.5;
/// By this factor the coupling may differ from the sheet's; degrees for radians make it 57.
const COUPLING_FACTOR: f64 = 5.0;
/// Between two recordings of one rig, frequency and coupling differ by less than these factors.
const FREQUENCY_BETWEEN: f64 = 1.2;
const COUPLING_BETWEEN: f64 = 1.5;

/// What looks as if recordings were not of this rig, or not of one rig: a suspicion for each recording that is.
///
/// ```
/// use furuta_recording::{Recording, NoticeKind, against_rig};
/// use furuta_model::{Plant, Rig, State};
/// let rig = Rig::builtin("qube-servo-2").expect("built in");
/// let plant: Plant<f64> = Plant::new(&rig.params, &[]).expect("no effects");
/// let recorded = |sign: f64| {
///     let mut x = plant.rest(State::hanging());
///     let mut samples = Vec::new();
///     for k in 0..2000 {
///         let t = 0.002 * f64::from(k);
///         let u = 1.5 * (3.0 * t * (1.0 + t)).sin();
///         let [theta, alpha] = plant.measure(&x);
///         samples.push([t, sign * u, theta, alpha]);
///         plant.step(&mut x, u, 0.002);
///     }
///     Recording::from_samples("sweep", samples).map(|(recording, _)| recording)
/// };
/// assert!(against_rig(&[recorded(1.0)?], &rig).is_empty());
/// assert_eq!(against_rig(&[recorded(-1.0)?], &rig)[0].kind, NoticeKind::CommandSignSuspected);
/// # Ok::<(), furuta_recording::RecordingError>(())
/// ```
#[must_use]
pub fn against_rig(recordings: &[Recording], rig: &Rig) -> Vec<Notice> {
    let of_each = each_against_rig(recordings, rig).into_iter();
    of_each.map(|(_, notice)| notice).collect()
}

/// As [`against_rig`], each suspicion with the index of its recording.
#[must_use]
pub fn each_against_rig(recordings: &[Recording], rig: &Rig) -> Vec<(usize, Notice)> {
    let mut notices = Vec::new();
    let mut known: Vec<(usize, &Recording, PendulumLaw)> = Vec::new();
    // Upright, the controller answers every disturbance, and a regression takes the answer for the law: only what hangs
    // is judged, if anything does.
    let judged = |r: &&Recording| r.hangs() || !recordings.iter().any(Recording::hangs);
    for (i, recording) in recordings.iter().enumerate() {
        let notice = |kind| {
            let file = recording.name.clone();
            (i, Notice { file, kind })
        };
        // A command in another unit says nothing of the angles, so both may be named.
        notices.extend(command::unit(recording, rig).map(notice));
        // The checks below difference samples that are evenly spaced.
        if recording.is_uneven() {
            continue;
        }
        let broken = counts::counts(recording, rig).or_else(|| frozen::frozen(recording, rig));
        if let Some(kind) = broken {
            notices.push(notice(kind));
            continue;
        }
        if !judged(&recording) {
            continue;
        }
        let law = PendulumLaw::of(recording, &recording.theta, &recording.alpha)
            .filter(|law| law.left < LEFT_AT_MOST);
        // Arm and pendulum that swing at one frequency, as they do under a sine, leave open which of gravity and arm
        // holds the pendulum to it: then the
        // sheet's coupling decides.
        let sheet = PendulumLaw::with_coupling(recording, coupling(rig));
        let kind = law
            .and_then(|law| scale(&law, sheet.as_ref(), rig))
            .or_else(|| command::sign(recording, rig));
        if let Some(kind) = kind {
            notices.push(notice(kind));
        } else if let Some(law) = law.filter(|law| {
            let of_sheet = |sheet: &PendulumLaw| {
                let ratio = law.gravity.value / sheet.gravity.value;
                (1.0 / FREQUENCY_BETWEEN..FREQUENCY_BETWEEN).contains(&ratio)
            };
            law.left < LEFT_BETWEEN && recording.hangs() && sheet.as_ref().is_some_and(of_sheet)
        }) {
            known.push((i, recording, law));
        }
    }
    notices.extend(two_rigs(&known));
    notices.extend(two_names(recordings));
    notices
}

/// The sheet's coupling `m L c / (I + m c^2)`.
fn coupling(rig: &Rig) -> f64 {
    let c = rig.params.coefficients();
    c.coupling / c.pendulum
}

/// Time stamps or angles that do not fit the rig: `law` with a coupling of its own, `sheet` with the sheet's.
fn scale(law: &PendulumLaw, sheet: Option<&PendulumLaw>, rig: &Rig) -> Option<NoticeKind> {
    let c = rig.params.coefficients();
    if law.gravity.sign(LEAST_FREQUENCY, SIGNIFICANT) != Some(1.0) {
        return None;
    }
    let expected = (c.weight / c.pendulum).sqrt();
    let found = law.gravity.value.sqrt();
    let off =
        |found: f64| !(1.0 / FREQUENCY_FACTOR..FREQUENCY_FACTOR).contains(&(found / expected));
    let too = sheet.is_none_or(|sheet| off(sheet.gravity.value.max(0.0).sqrt()));
    if off(found) && too {
        let hertz = |w: f64| w / core::f64::consts::TAU;
        return Some(NoticeKind::FrequencySuspected {
            found: hertz(found),
            expected: hertz(expected),
        });
    }
    let ratio = law.coupling.value / coupling(rig);
    // Too large is seen in its value, too small in how well it is known all the same.
    let small =
        law.coupling.value.abs() + SIGNIFICANT * law.coupling.std < coupling(rig) / COUPLING_FACTOR;
    (law.signs()[1] == Some(1.0) && ratio > COUPLING_FACTOR || small)
        .then_some(NoticeKind::ScaleSuspected { ratio })
}

/// Recordings whose pendulums are not one.
fn two_rigs(known: &[(usize, &Recording, PendulumLaw)]) -> Option<(usize, Notice)> {
    let ((_, first, law), rest) = known.split_first()?;
    rest.iter().find_map(|(i, other, theirs)| {
        let apart = |a: f64, b: f64, factor: f64| !(1.0 / factor..factor).contains(&(a / b));
        let both =
            |f: fn(&PendulumLaw) -> Option<f64>| f(law) == Some(1.0) && f(theirs) == Some(1.0);
        let frequency = both(|l| l.signs()[0])
            && apart(
                law.gravity.value,
                theirs.gravity.value,
                FREQUENCY_BETWEEN * FREQUENCY_BETWEEN,
            );
        let coupling = both(|l| l.signs()[1])
            && apart(law.coupling.value, theirs.coupling.value, COUPLING_BETWEEN);
        (frequency || coupling).then(|| (*i, Notice {
            file: other.name.clone(),
            kind: NoticeKind::OtherRigSuspected {
                than: first.name.clone(),
                why: if frequency {
                    format!(
                        "its pendulum swings at {:.2} Hz, the other's at {:.2} Hz",
                        theirs.gravity.value.sqrt() / core::f64::consts::TAU,
                        law.gravity.value.sqrt() / core::f64::consts::TAU
                    )
                } else {
                    format!(
                        "arm and pendulum are coupled by {:.2} in it, by {:.2} in the other",
                        theirs.coupling.value, law.coupling.value
                    )
                },
            },
        }))
    })
}

/// Logs that name different rigs.
fn two_names(recordings: &[Recording]) -> Option<(usize, Notice)> {
    let mut named = recordings.iter().enumerate().filter_map(|(i, r)| {
        let rig = Rig::from_toml(r.rig.as_deref()?).ok()?;
        Some((i, r, rig.name))
    });
    let (_, first, name) = named.next()?;
    named
        .find(|(_, _, other)| *other != name)
        .map(|(i, r, other)| {
            (
                i,
                Notice {
                    file: r.name.clone(),
                    kind: NoticeKind::OtherRigSuspected {
                        than: first.name.clone(),
                        why: format!("it was logged on `{other}`, the other on `{name}`"),
                    },
                },
            )
        })
}
