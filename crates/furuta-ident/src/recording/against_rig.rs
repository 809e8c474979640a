//! Whether recordings can be of the rig they are said to be of, and of one rig.
//!
//! The pendulum's equation and the arm's, regressed on second differences, need no fit: they show the pendulum's frequency, the ratio of the
//! angles' scales and the sign of the command, each within some per cent. A data sheet, or an effect that is worth a diagnosis, is not off by as much as is asked
//! for here.

use furuta_model::dynamics::{Angle, bias, gravity, mass_matrix};
use furuta_model::{Rig, State};

use super::convention::{DIFFERENCE, PendulumLaw, differences};
use super::regression::Regression;
use super::{Notice, NoticeKind, Recording};

/// Standard deviations that a coefficient must be away from zero to be spoken of.
const SIGNIFICANT: f64 = 12.0;
/// The pendulum's equation must explain so much of its motion before its coefficients are compared with anything.
const LEFT_AT_MOST: f64 = 0.5;
/// The same where two recordings are compared, whose noise and motion differ.
const LEFT_BETWEEN: f64 = 0.1;
/// Least squared frequency worth comparing, 1/s^2: time stamps may be stretched.
const LEAST_FREQUENCY: f64 = 0.5;
/// A pendulum that swings faster or slower than the sheet's by this factor is another one, or its time stamps are wrong.
const FREQUENCY_FACTOR: f64 = 1.5;
/// By this factor the coupling may differ from the sheet's; degrees for radians make it 57.
const COUPLING_FACTOR: f64 = 5.0;
/// Between two recordings of one rig, frequency and coupling differ by less than these factors.
const FREQUENCY_BETWEEN: f64 = 1.2;
const COUPLING_BETWEEN: f64 = 1.5;
/// Least share of the sheet's gain at which the command's sign is looked at.
const LEAST_GAIN: f64 = 0.1;
/// Smooth direction of the arm's motion, for its friction, rad/s.
const SLOW: f64 = 0.1;

/// What looks as if recordings were not of this rig, or not of one rig: a suspicion for each recording that is.
///
/// ```
/// use furuta_ident::recording::{Recording, NoticeKind, against_rig};
/// use furuta_model::{Plant, Rig, State};
/// let rig = Rig::builtin("qube-servo-2").expect("built in");
/// let plant: Plant<f64> = Plant::new(&rig.params, &[]).expect("no effects");
/// let recorded = |sign: f64| {
///     let mut x = plant.rest(State::hanging());
///     let mut csv = String::from("t,u,theta,alpha\n");
///     for k in 0..2000 {
///         let t = 0.002 * f64::from(k);
///         let u = 1.5 * (3.0 * t * (1.0 + t)).sin();
///         let [theta, alpha] = plant.measure(&x);
///         csv += &format!("{t},{},{theta},{alpha}\n", sign * u);
///         plant.step(&mut x, u, 0.002);
///     }
///     Recording::from_csv("sweep.csv", csv.as_bytes()).map(|(recording, _)| recording)
/// };
/// assert!(against_rig(&[recorded(1.0)?], &rig).is_empty());
/// assert_eq!(against_rig(&[recorded(-1.0)?], &rig)[0].kind, NoticeKind::CommandSignSuspected);
/// # Ok::<(), furuta_ident::recording::RecordingError>(())
/// ```
#[must_use]
pub fn against_rig(recordings: &[Recording], rig: &Rig) -> Vec<Notice> {
    let mut notices = Vec::new();
    let mut known: Vec<(&Recording, PendulumLaw)> = Vec::new();
    // Upright, the controller answers every disturbance, and a regression takes the answer for the law: only what hangs is judged, if anything does.
    let judged = |r: &&Recording| r.hangs() || !recordings.iter().any(Recording::hangs);
    for recording in recordings.iter().filter(judged) {
        let law = PendulumLaw::of(recording, &recording.theta, &recording.alpha)
            .filter(|law| law.left < LEFT_AT_MOST);
        let kind = law
            .and_then(|law| scale(&law, rig))
            .or_else(|| command_sign(recording, rig));
        if let Some(kind) = kind {
            notices.push(Notice {
                file: recording.name.clone(),
                kind,
            });
        } else if let Some(law) = law.filter(|law| law.left < LEFT_BETWEEN && recording.hangs()) {
            known.push((recording, law));
        }
    }
    notices.extend(two_rigs(&known));
    notices.extend(two_names(recordings));
    notices
}

/// Time stamps or angles that do not fit the rig.
fn scale(law: &PendulumLaw, rig: &Rig) -> Option<NoticeKind> {
    let c = rig.params.coefficients();
    if law.gravity.sign(LEAST_FREQUENCY, SIGNIFICANT) != Some(1.0) {
        return None;
    }
    let expected = (c.weight / c.pendulum).sqrt();
    let found = law.gravity.value.sqrt();
    if !(1.0 / FREQUENCY_FACTOR..FREQUENCY_FACTOR).contains(&(found / expected)) {
        let hertz = |w: f64| w / core::f64::consts::TAU;
        return Some(NoticeKind::FrequencySuspected {
            found: hertz(found),
            expected: hertz(expected),
        });
    }
    let ratio = law.coupling.value * c.pendulum / c.coupling;
    // Too large is seen in its value, too small in how well it is known all the same.
    let small = law.coupling.value.abs() + SIGNIFICANT * law.coupling.std
        < c.coupling / c.pendulum / COUPLING_FACTOR;
    (law.signs()[1] == Some(1.0) && ratio > COUPLING_FACTOR || small)
        .then_some(NoticeKind::ScaleSuspected { ratio })
}

/// Whether the arm's acceleration answers the command with the wrong sign: `torque = k*u - d*theta_dot - f*direction`, the torque from the
/// sheet's inertias.
fn command_sign(recording: &Recording, rig: &Rig) -> Option<NoticeKind> {
    let c = rig.params.coefficients();
    let mut regression = Regression::default();
    let h = recording.sample_period;
    let lag = ((DIFFERENCE / h).round().max(1.0)) as usize;
    // A second difference weighs the command before and after by a triangle.
    let command = |k: usize| {
        let (mut sum, mut weights) = (0.0, 0.0);
        for i in k.saturating_sub(lag)..(k + lag).min(recording.len()) {
            let weight = lag as f64 - (i as f64 + 0.5 - k as f64).abs();
            sum += weight * recording.u[i];
            weights += weight;
        }
        sum / weights
    };
    differences(
        recording,
        [&recording.theta, &recording.alpha],
        DIFFERENCE,
        |[t, a]| {
            let angle = Angle::of(a.angle);
            let x = State::new(t.angle, a.angle, t.speed, a.speed);
            let inertial = mass_matrix(&c, angle).times([t.acceleration, a.acceleration])[0];
            let torque = inertial + bias(&c, angle, &x)[0] + gravity(&c, angle)[0];
            regression.add([command(t.index), t.speed, (t.speed / SLOW).tanh()], torque);
        },
    )?;
    let [gain, ..] = regression.solve((2 * lag + 1) as f64)?.coefficients;
    (gain.sign(LEAST_GAIN * c.drive, SIGNIFICANT) == Some(-1.0))
        .then_some(NoticeKind::CommandSignSuspected)
}

/// Recordings whose pendulums are not one.
fn two_rigs(known: &[(&Recording, PendulumLaw)]) -> Option<Notice> {
    let ((first, law), rest) = known.split_first()?;
    rest.iter().find_map(|(other, theirs)| {
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
        (frequency || coupling).then(|| Notice {
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
        })
    })
}

/// Logs that name different rigs.
fn two_names(recordings: &[Recording]) -> Option<Notice> {
    let mut named = recordings.iter().filter_map(|r| {
        let rig = Rig::from_toml(r.rig.as_deref()?).ok()?;
        Some((r, rig.name))
    });
    let (first, name) = named.next()?;
    named
        .find(|(_, other)| *other != name)
        .map(|(r, other)| Notice {
            file: r.name.clone(),
            kind: NoticeKind::OtherRigSuspected {
                than: first.name.clone(),
                why: format!("it was logged on `{other}`, the other on `{name}`"),
            },
        })
}
