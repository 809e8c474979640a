//! Which of the recordings that are given are used: what looks as if a convention were broken is left out where the
//! others suffice.

use furuta_input::InputError;
use furuta_model::Rig;

use crate::insufficient;
use crate::pendulum::Pendulum;
use crate::recording::{
    GivenTwice, Notice, NoticeKind, Recording, RecordingError, each_against_rig, each_once,
};
use crate::shooting::Data;

/// A recording as it was read, with what was noticed on the way.
pub type Read = (Recording, Vec<Notice>);

/// The recordings that are used.
#[derive(Clone, Debug, Default)]
pub struct Selection {
    /// What a search or a fit may see.
    pub recordings: Vec<Recording>,
    /// What it must not see.
    pub verify: Vec<Recording>,
    /// What a person should know about them, and about those that were left out.
    pub notices: Vec<Notice>,
}

/// Why no selection can be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SelectionError {
    /// A recording looks as if a convention were broken, and without it too little is left.
    #[error("{0}")]
    Suspicious(Notice),
    /// A recording is given twice.
    #[error(transparent)]
    Twice(#[from] GivenTwice),
    /// A recording is to be verified that the search sees.
    #[error(
        "{file}: is to verify what is found, but holds the same samples as {as_given}, which the search sees: give a \
         recording that it does not see"
    )]
    Seen {
        /// The recording to verify with.
        file: String,
        /// The one that the search sees.
        as_given: String,
    },
}

/// Chooses among recordings of a rig. One that looks as if a convention were broken, or that most others contradict, is
/// left out with a notice where the others suffice for a diagnosis; one for verification is left out in any case. Where
/// recordings contradict each other and none has most on its side, there is no choice.
///
/// With `accept`, suspicious recordings are used, and what is suspicious about them is a notice. Of a rig whose
/// `pendulum` is off or locked, the arm's angle alone is checked, and not against the rig; alpha is set to hanging.
/// Where the arm moves as measured, nothing is said of the command, and it becomes the arm's acceleration.
///
/// # Errors
/// [`SelectionError`].
///
/// ```
/// use furuta_ident::Pendulum;
/// use furuta_ident::recording::{NoticeKind, Recording};
/// use furuta_ident::selection::select;
/// use furuta_model::{Plant, Rig, State};
/// let rig = Rig::builtin("qube-servo-2").expect("built in");
/// let plant: Plant<f64> = Plant::new(&rig.params, &[]).expect("no effects");
/// let recorded = |name: &str, sign: f64| {
///     let mut x = plant.rest(State::hanging());
///     let mut samples = Vec::new();
///     for k in 0..2000 {
///         let t = 0.002 * f64::from(k);
///         let u = 1.5 * (3.0 * t * (1.0 + t)).sin();
///         let [theta, alpha] = plant.measure(&x);
///         samples.push([t, sign * u, theta, alpha]);
///         plant.step(&mut x, u, 0.002);
///     }
///     Recording::from_samples(name, samples)
/// };
/// let selection = select(vec![recorded("a", 1.0)?, recorded("b", -1.0)?], Vec::new(), &rig, false, Pendulum::Swings)?;
/// assert_eq!(selection.recordings.len(), 1);
/// assert!(matches!(selection.notices[0].kind, NoticeKind::LeftOut { .. }));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn select(
    search: Vec<Read>,
    verify: Vec<Read>,
    rig: &Rig,
    accept: bool,
    pendulum: Pendulum,
) -> Result<Selection, SelectionError> {
    for read in [&search, &verify] {
        each_once(read.iter().map(|(recording, _)| recording))?;
    }
    for (unseen, _) in &verify {
        if let Some((seen, _)) = search.iter().find(|(seen, _)| seen.has_samples_of(unseen)) {
            return Err(SelectionError::Seen {
                file: unseen.name.clone(),
                as_given: seen.name.clone(),
            });
        }
    }
    let searched = search.len();
    let (all, mut found): (Vec<Recording>, Vec<Vec<Notice>>) = (search.into_iter().chain(verify))
        .map(|(recording, notices)| {
            let notices = notices.into_iter().map(|n| n.for_rig(rig)).collect();
            (recording, notices)
        })
        .unzip();
    // Of a part of the rig neither equation holds as it stands in the rig file.
    if pendulum.is_coupled() {
        for (i, notice) in each_against_rig(&all, rig) {
            if let Some(found) = found.get_mut(i) {
                found.push(notice);
            }
        }
    }
    for notices in &mut found {
        notices.retain(|n| pendulum.matters(&n.kind));
    }

    let mut selection = Selection::default();
    let mut suspicions = Vec::new();
    let seen = all
        .iter()
        .map(|recording| pendulum.seen(recording).into_owned());
    for (i, (recording, notices)) in seen.zip(found).enumerate() {
        let suspicion = headline(&notices).filter(|_| !accept);
        let for_search = i < searched;
        match suspicion {
            Some(notice) => {
                selection.notices.push(left_out(notice));
                if for_search {
                    suspicions.push(notice.clone());
                }
            }
            None => {
                selection.notices.extend(notices);
                if for_search {
                    selection.recordings.push(recording);
                } else {
                    selection.verify.push(recording);
                }
            }
        }
    }
    // Where none has most others on its side, there is no choice.
    let contradiction = |n: &&Notice| match &n.kind {
        NoticeKind::OtherRigSuspected { than, .. } => suspicions.iter().any(|s| s.file == *than),
        _ => false,
    };
    if let Some(notice) = suspicions.iter().find(contradiction) {
        return Err(SelectionError::Suspicious(notice.clone()));
    }
    if let Some(notice) = suspicions.into_iter().next() {
        let data = Data::new(&selection.recordings, rig);
        if insufficient::check(&selection.recordings, rig, &data).is_err() {
            return Err(SelectionError::Suspicious(notice));
        }
    }
    Ok(selection)
}

/// What is read for verification: a recording that cannot be used is left out with a notice; a file that cannot be
/// opened is a mistake of the one who
/// named it.
///
/// # Errors
/// [`RecordingError::Io`]; [`RecordingError::Input`] where the name is that of a directory, a pipe or a device.
pub fn read_unseen(
    name: &str,
    read: Result<Read, RecordingError>,
    notices: &mut Vec<Notice>,
) -> Result<Option<Read>, RecordingError> {
    match read {
        Ok(read) => Ok(Some(read)),
        Err(
            error @ (RecordingError::Io { .. } | RecordingError::Input(InputError::Kind { .. })),
        ) => Err(error),
        Err(error) => {
            let why = error.to_string();
            let said = why.strip_prefix(name).and_then(|w| w.strip_prefix(": "));
            let why = said.unwrap_or(&why).to_owned();
            notices.push(Notice {
                file: name.to_owned(),
                kind: NoticeKind::LeftOut { why },
            });
            Ok(None)
        }
    }
}

/// The suspicion that explains the others: an angle that is off by a factor looks like many things.
fn headline(notices: &[Notice]) -> Option<&Notice> {
    let counts = |n: &&Notice| {
        matches!(
            n.kind,
            NoticeKind::CountsSuspected { .. } | NoticeKind::RawCountsSuspected { .. }
        )
    };
    let suspicious = || notices.iter().filter(|n| n.kind.is_suspicion());
    suspicious().find(counts).or_else(|| suspicious().next())
}

fn left_out(notice: &Notice) -> Notice {
    Notice {
        file: notice.file.clone(),
        kind: NoticeKind::LeftOut {
            why: notice.kind.to_string(),
        },
    }
}
