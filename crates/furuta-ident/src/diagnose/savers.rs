//! The numbers that only save time, apart from those that decide a name (`criteria`). Without them a search follows
//! every candidate from every start to the end; tests compare the two.

use super::request::Options;

/// What a search leaves out to save time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Savers {
    /// Of about this many windows a search begins, where a model is far from the data in most of them.
    pub(super) windows: usize,
    /// Full fits go to this many of the candidates at most, of this many steps.
    pub(super) short_list: usize,
    pub(super) full_steps: usize,
    /// This many candidates are fitted, those with the largest score statistics, each from this many starts.
    pub(super) followed: usize,
    pub(super) starts: usize,
    /// This many are fitted before the others, whose fits are given up when they cannot come near the best of these.
    pub(super) favourites: usize,
    /// A start whose score statistic is below this share of the best, or of what would convince, is not followed.
    pub(super) least_share: f64,
    /// The same for effects whose place (order, frequency, moment) was looked for.
    pub(super) least_share_scanned: f64,
    /// The same beside one that explains everything.
    pub(super) least_share_beside: f64,
    /// The last digits are for those that gain at least this share of what the best gains; the fits of others are given
    /// up.
    pub(super) close: f64,
}

/// The savers of every diagnosis that is not [`super::Options::thorough`].
pub(super) static USUAL: Savers = Savers {
    // Of 12 s of three recordings, a quarter.
    windows: 32,
    short_list: 4,
    full_steps: 20,
    followed: 8,
    starts: 2,
    favourites: 2,
    // Over the catalogue, a fit gains up to four times the score statistic where the effect's form depends on its
    // parameters.
    least_share: 0.1,
    // There the score statistic is what a fit then gains.
    least_share_scanned: 0.7,
    least_share_beside: 0.5,
    close: 0.8,
};

/// Those of a diagnosis.
pub(super) const fn of(options: &Options<'_>) -> &'static Savers {
    if options.thorough { &NONE } else { &USUAL }
}

/// Nothing is left out.
pub(super) static NONE: Savers = Savers {
    windows: usize::MAX,
    short_list: usize::MAX,
    full_steps: 40,
    followed: usize::MAX,
    starts: usize::MAX,
    favourites: usize::MAX,
    least_share: 0.0,
    least_share_scanned: 0.0,
    least_share_beside: 0.0,
    close: 0.0,
};
