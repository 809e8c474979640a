//! Whether recordings can be of the rig they are said to be of, and of one rig.
//!
//! The pendulum's equation and the arm's, regressed on second differences, need no fit: they show the pendulum's
//! frequency, the ratio of the angles' scales and the sign of the command, each within some per cent. A data sheet, or
//! an effect to be diagnosed, is not off by as much as is asked for here.

use furuta_model::Rig;

use super::convention::PendulumLaw;
use super::regression::Estimate;
use super::shown::{self, Shown};
use super::weak::pendulum;
use super::{Notice, NoticeKind, Recording, command, counts, frozen, timing};

/// Standard deviations that a coefficient must be away from zero to be spoken of.
const SIGNIFICANT: f64 = 12.0;
/// The pendulum's equation must explain so much of its motion before its coefficients are compared with anything.
const LEFT_AT_MOST: f64 = 0.5;
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
    let mut known: Vec<(usize, &Recording, pendulum::Law)> = Vec::new();
    // Those whose columns and signs are right as far as each alone shows.
    let mut sound: Vec<usize> = Vec::new();
    // Upright, the controller answers every disturbance, and a regression takes the answer for the law: only what hangs
    // is judged, if anything does.
    let judged = |r: &&Recording| r.hangs() || !recordings.iter().any(Recording::hangs);
    for (i, recording) in recordings.iter().enumerate() {
        let notice = |kind| {
            let file = recording.name.clone();
            (i, Notice { file, kind })
        };
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
            sound.push(i);
            continue;
        }
        let law = PendulumLaw::of(recording, &recording.theta, &recording.alpha)
            .filter(|law| law.left < LEFT_AT_MOST);
        // Arm and pendulum that swing at one frequency, as they do under a sine, leave open which of gravity and arm
        // holds the pendulum to it: then the sheet's coupling decides.
        let sheet = PendulumLaw::with_coupling(recording, coupling(rig));
        let kind = law
            .and_then(|law| scale(&law, sheet.as_ref(), rig))
            .or_else(|| command::sign(recording, rig));
        if let Some(kind) = kind {
            notices.push(notice(kind));
            continue;
        }
        sound.push(i);
        let shown = recording.hangs().then(|| pendulum::Law::by(recording));
        known.extend(shown.flatten().map(|shown| (i, recording, shown)));
    }
    let units = recordings.iter().map(|r| Some(command::unit(r, rig)));
    let of_sound = |of: &dyn Fn(&Recording) -> Shown| {
        let recordings = recordings.iter().enumerate();
        let asked = recordings.map(|(i, r)| sound.contains(&i).then(|| of(r)));
        asked.collect()
    };
    let late = of_sound(&|r| timing::late(r, rig));
    // A command in another unit, or late, says nothing of the angles, so both may be named.
    for shown in [units.collect(), of_sound(&timing::skew), late] {
        let kinds = shown::of_all(shown, recordings).into_iter();
        notices.extend(kinds.map(|(i, kind)| {
            let file = recordings
                .get(i)
                .map(|r| r.name.clone())
                .unwrap_or_default();
            (i, Notice { file, kind })
        }));
    }
    notices.extend(two_rigs(&known));
    notices.extend(two_names(recordings));
    notices.sort_by_key(|(i, _)| *i);
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

/// Recordings whose pendulums are not one: they differ by more than what the equation leaves could make of one.
fn two_rigs(known: &[(usize, &Recording, pendulum::Law)]) -> Vec<(usize, Notice)> {
    let differ = |a: Estimate, b: Estimate, factor: f64| {
        let outside = !(1.0 / factor..factor).contains(&(a.value / b.value));
        a.value > 0.0 && b.value > 0.0 && outside && (a.value - b.value).abs() > a.worst + b.worst
    };
    let frequency = |a: &pendulum::Law, b: &pendulum::Law| {
        differ(a.gravity, b.gravity, FREQUENCY_BETWEEN * FREQUENCY_BETWEEN)
    };
    let apart = |i: usize, j: usize| {
        let (law, other) = (&known[i].2, &known[j].2);
        frequency(law, other) || differ(law.coupling, other.coupling, COUPLING_BETWEEN)
    };
    let notice = |(i, j): (usize, usize)| {
        let ((at, this, law), (_, than, other)) = (&known[i], &known[j]);
        let why = if frequency(law, other) {
            format!(
                "its pendulum swings at {:.2} Hz, the other's at {:.2} Hz",
                law.gravity.value.sqrt() / core::f64::consts::TAU,
                other.gravity.value.sqrt() / core::f64::consts::TAU
            )
        } else {
            format!(
                "arm and pendulum are coupled by {:.2} in it, by {:.2} in the other",
                law.coupling.value, other.coupling.value
            )
        };
        (*at, other_rig(this, than, why))
    };
    odd_ones(known.len(), apart)
        .into_iter()
        .map(notice)
        .collect()
}

/// Logs that name different rigs.
fn two_names(recordings: &[Recording]) -> Vec<(usize, Notice)> {
    let named: Vec<(usize, &Recording, String)> = (recordings.iter().enumerate())
        .filter_map(|(i, r)| Some((i, r, Rig::from_toml(r.rig.as_deref()?).ok()?.name)))
        .collect();
    let notice = |(i, j): (usize, usize)| {
        let ((at, this, name), (_, than, other)) = (&named[i], &named[j]);
        let why = format!("it was logged on `{name}`, the other on `{other}`");
        (*at, other_rig(this, than, why))
    };
    let apart = |i: usize, j: usize| named[i].2 != named[j].2;
    odd_ones(named.len(), apart)
        .into_iter()
        .map(notice)
        .collect()
}

fn other_rig(recording: &Recording, than: &Recording, why: String) -> Notice {
    Notice {
        file: recording.name.clone(),
        kind: NoticeKind::OtherRigSuspected {
            than: than.name.clone(),
            why,
        },
    }
}

/// Of `count`, those that do not agree with more than half of all, themselves counted, each with one from which it is
/// apart: one that does agree, if any does.
fn odd_ones(count: usize, apart: impl Fn(usize, usize) -> bool) -> Vec<(usize, usize)> {
    let others = |i: usize| (0..count).filter(move |&j| j != i);
    let sound: Vec<bool> = (0..count)
        .map(|i| 2 * (count - others(i).filter(|&j| apart(i, j)).count()) > count)
        .collect();
    let is_any = sound.contains(&true);
    (0..count)
        .filter(|&i| !sound[i])
        .filter_map(|i| {
            let than = others(i).find(|&j| apart(i, j) && (sound[j] || !is_any))?;
            Some((i, than))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::odd_ones;

    #[test]
    fn most_agree() {
        let apart = |kinds: &'static [u8]| move |i: usize, j: usize| kinds[i] != kinds[j];
        assert_eq!(odd_ones(3, apart(b"aab")), [(2, 0)]);
        assert_eq!(odd_ones(3, apart(b"baa")), [(0, 1)]);
        assert_eq!(odd_ones(2, apart(b"ab")), [(0, 1), (1, 0)]);
        assert_eq!(
            odd_ones(4, apart(b"aabb")),
            [(0, 2), (1, 2), (2, 0), (3, 0)]
        );
        assert_eq!(odd_ones(2, apart(b"aa")), []);
        assert_eq!(odd_ones(0, apart(b"")), []);
    }
}
