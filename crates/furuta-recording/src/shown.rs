//! What one recording shows of a mistake that the program which recorded it makes in every recording.

use super::{NoticeKind, Recording};

/// What a recording shows of a column's unit or time.
pub(super) enum Shown {
    Wrong(NoticeKind),
    Right,
    /// Neither: it moves too little, or is balanced.
    Neither,
}

/// The recordings that are wrong, and, where none is right, those that show neither: one program wrote them all.
/// `None` is not asked.
pub(super) fn of_all(
    shown: Vec<Option<Shown>>,
    recordings: &[Recording],
) -> Vec<(usize, NoticeKind)> {
    let is_right = |s: &Option<Shown>| matches!(s, Some(Shown::Right));
    let is_any_right = shown.iter().any(is_right);
    let first = shown
        .iter()
        .zip(recordings)
        .find_map(|(s, recording)| match s {
            Some(Shown::Wrong(kind)) => Some((kind.clone(), recording.name.clone())),
            _ => None,
        });
    let Some((what, other)) = first else {
        return Vec::new();
    };
    let what = Box::new(what);
    let kinds = shown.into_iter().enumerate();
    kinds
        .filter_map(|(i, s)| match s? {
            Shown::Wrong(kind) => Some((i, kind)),
            Shown::Neither if !is_any_right => {
                let (what, other) = (what.clone(), other.clone());
                Some((i, NoticeKind::AsInAnother { what, other }))
            }
            _ => None,
        })
        .collect()
}
