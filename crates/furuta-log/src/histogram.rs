//! A histogram of times, of fixed size: filled in a control loop, read afterwards.

use serde::{Deserialize, Serialize};

/// Buckets to a doubling, as a power of two: 32, so that a bucket is 3 % wide.
const SUB_BITS: u32 = 5;
const SUB: usize = 1 << SUB_BITS;
/// Times from 2^40 ns (18 minutes) on are counted in the last bucket.
const TOP_BIT: u32 = 40;
const BUCKETS: usize = (TOP_BIT - SUB_BITS + 1) as usize * SUB;

/// A histogram of times with buckets that grow with the time (as those of HDR histograms do): every time from 0 to 18
/// minutes lands in a bucket at most 1/32 of its value wide, below 64 ns in one of its own. Extremes and mean are
/// exact. Recording takes a few instructions and no memory.
///
/// ```
/// use furuta_log::Histogram;
/// let mut h = Histogram::new();
/// for us in 1..=1000 {
///     h.record(us * 1000);
/// }
/// assert_eq!((h.count(), h.min(), h.max()), (1000, Some(1_000), Some(1_000_000)));
/// assert_eq!(h.mean(), Some(500_500.0));
/// // Nearest rank, the bucket's upper end: at most 1/32 above the 990th of 1000.
/// let p99 = h.quantile(0.99).ok_or("empty")?;
/// assert!((990_000..=990_000 * 33 / 32).contains(&p99));
/// # Ok::<(), &str>(())
/// ```
#[derive(Clone, PartialEq, Eq)]
pub struct Histogram {
    counts: [u64; BUCKETS],
    count: u64,
    min: u64,
    max: u64,
    sum: u64,
}

/// In short: a thousand zeros tell nothing.
impl std::fmt::Debug for Histogram {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Histogram")
            .field("count", &self.count)
            .field("min", &self.min())
            .field("p50", &self.quantile(0.5))
            .field("p99", &self.quantile(0.99))
            .field("max", &self.max())
            .finish_non_exhaustive()
    }
}

impl Default for Histogram {
    fn default() -> Self {
        Self::new()
    }
}

impl Histogram {
    /// Nothing counted yet.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            counts: [0; BUCKETS],
            count: 0,
            min: u64::MAX,
            max: 0,
            sum: 0,
        }
    }

    /// Counts a time (ns).
    pub fn record(&mut self, ns: u64) {
        self.record_times(ns, 1);
    }

    /// Counts a time (ns) `times` times.
    pub fn record_times(&mut self, ns: u64, times: u64) {
        if times == 0 {
            return;
        }
        if let Some(count) = self.counts.get_mut(index(ns)) {
            *count = count.saturating_add(times);
        }
        self.count = self.count.saturating_add(times);
        self.min = self.min.min(ns);
        self.max = self.max.max(ns);
        self.sum = self.sum.saturating_add(ns.saturating_mul(times));
    }

    /// Counts a time (s); what is negative, or not a number, counts as 0.
    pub fn record_seconds(&mut self, seconds: f64) {
        self.record((seconds * 1e9).round() as u64); // a cast saturates
    }

    /// How many times were counted.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.count
    }

    /// The shortest (ns); `None` where nothing was counted.
    #[must_use]
    pub fn min(&self) -> Option<u64> {
        (self.count > 0).then_some(self.min)
    }

    /// The longest (ns); `None` where nothing was counted.
    #[must_use]
    pub fn max(&self) -> Option<u64> {
        (self.count > 0).then_some(self.max)
    }

    /// Their mean (ns); `None` where nothing was counted.
    #[must_use]
    pub fn mean(&self) -> Option<f64> {
        (self.count > 0).then(|| self.sum as f64 / self.count as f64)
    }

    /// The time (ns) that the share `q` (0 to 1) of the times do not exceed, by nearest rank; the upper end of its
    /// bucket, so up to 1/32 more than the time itself, and never more than the longest. `None` where nothing was
    /// counted or `q` is outside 0 to 1.
    #[must_use]
    pub fn quantile(&self, q: f64) -> Option<u64> {
        if self.count == 0 || !(0.0..=1.0).contains(&q) {
            return None;
        }
        let rank = ((q * self.count as f64).ceil() as u64).clamp(1, self.count);
        let mut seen = 0;
        self.buckets()
            .find(|bucket| {
                seen += bucket.count;
                seen >= rank
            })
            .map(|bucket| bucket.highest.clamp(self.min, self.max))
    }

    /// How many times were longer than this (ns), to within a bucket: a bucket counts where it begins above.
    #[must_use]
    pub fn longer_than(&self, ns: u64) -> u64 {
        self.buckets()
            .filter(|bucket| bucket.lowest > ns)
            .map(|bucket| bucket.count)
            .sum()
    }

    /// The buckets in which something was counted, from short to long.
    pub fn buckets(&self) -> impl Iterator<Item = Bucket> + '_ {
        self.counts
            .iter()
            .enumerate()
            .filter(|&(_, &count)| count > 0)
            .map(|(i, &count)| {
                let (lowest, highest) = range(i);
                Bucket {
                    lowest,
                    highest,
                    count,
                }
            })
    }

    /// Adds what another has counted.
    pub fn add(&mut self, other: &Self) {
        for (mine, theirs) in self.counts.iter_mut().zip(&other.counts) {
            *mine += theirs;
        }
        self.count += other.count;
        self.min = self.min.min(other.min);
        self.max = self.max.max(other.max);
        self.sum = self.sum.saturating_add(other.sum);
    }
}

/// One bucket of a [`Histogram`].
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Bucket {
    /// The shortest time that it counts (ns).
    pub lowest: u64,
    /// The longest (ns).
    pub highest: u64,
    /// How many were counted.
    pub count: u64,
}

/// The bucket of a time: its highest set bit says which doubling, the five bits below which part of it.
fn index(ns: u64) -> usize {
    let ns = ns.min((1 << TOP_BIT) - 1);
    let shift = (u64::BITS - ns.leading_zeros()).saturating_sub(SUB_BITS + 1);
    // Below 2^6 the shift is 0 and each time has a bucket. The mantissa keeps its highest bit: one doubling less in the
    // first term.
    shift as usize * SUB + (ns >> shift) as usize
}

/// First and last time of a bucket.
fn range(i: usize) -> (u64, u64) {
    if i < 2 * SUB {
        return (i as u64, i as u64);
    }
    let shift = i / SUB - 1;
    let lowest = ((SUB + i % SUB) as u64) << shift;
    (lowest, lowest + (1 << shift) - 1)
}

/// As in a log: times in nanoseconds, `buckets` as pairs of a bucket's shortest time and its count.
#[derive(Serialize, Deserialize)]
struct Sparse {
    unit: String,
    count: u64,
    min: Option<u64>,
    max: Option<u64>,
    sum: u64,
    buckets: Vec<(u64, u64)>,
}

impl Serialize for Histogram {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Sparse {
            unit: "ns".to_owned(),
            count: self.count,
            min: self.min(),
            max: self.max(),
            sum: self.sum,
            buckets: self.buckets().map(|b| (b.lowest, b.count)).collect(),
        }
        .serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Histogram {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let sparse = Sparse::deserialize(deserializer)?;
        let mut histogram = Self::new();
        for (lowest, count) in sparse.buckets {
            if let Some(slot) = histogram.counts.get_mut(index(lowest)) {
                *slot = slot.saturating_add(count);
            }
            histogram.count = histogram.count.saturating_add(count);
        }
        if histogram.count != sparse.count || sparse.min.is_some() != (sparse.count > 0) {
            return Err(serde::de::Error::custom(
                "the buckets of a histogram do not add up to its count",
            ));
        }
        histogram.min = sparse.min.unwrap_or(u64::MAX);
        histogram.max = sparse.max.unwrap_or(0);
        histogram.sum = sparse.sum;
        Ok(histogram)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn buckets_join_without_gap_and_are_narrow() {
        let mut next = 0;
        for i in 0..BUCKETS {
            let (lowest, highest) = range(i);
            assert_eq!(lowest, next, "bucket {i}");
            assert_eq!((index(lowest), index(highest)), (i, i));
            assert!(
                (highest - lowest) * SUB as u64 <= lowest.max(1),
                "bucket {i}"
            );
            next = highest + 1;
        }
        assert_eq!(next, 1 << TOP_BIT);
        assert_eq!(index(u64::MAX), BUCKETS - 1);
    }

    #[test]
    fn nothing_counted_says_nothing() {
        let h = Histogram::new();
        assert_eq!(
            (h.min(), h.max(), h.mean(), h.quantile(0.5)),
            (None, None, None, None)
        );
    }

    #[test]
    fn odd_times_are_counted_somewhere() {
        let mut h = Histogram::new();
        for s in [-1.0, f64::NAN, f64::INFINITY, 1e-9] {
            h.record_seconds(s);
        }
        assert_eq!((h.count(), h.min(), h.max()), (4, Some(0), Some(u64::MAX)));
        assert_eq!(h.buckets().map(|b| b.count).sum::<u64>(), 4);
    }

    proptest! {
        /// Against sorting.
        #[test]
        fn quantiles_are_those_of_the_sorted_times(
            mut times in prop::collection::vec((0u32..36).prop_flat_map(|bit| 0u64..(2 << bit)), 1..300),
            q in 0.0f64..=1.0,
        ) {
            let mut h = Histogram::new();
            times.iter().for_each(|&t| h.record(t));
            times.sort_unstable();
            let rank = ((q * times.len() as f64).ceil() as usize).clamp(1, times.len());
            let exact = times[rank - 1];
            let found = h.quantile(q).expect("not empty");
            prop_assert!(exact <= found && found <= exact + exact / 32, "{found} for {exact}");
            prop_assert_eq!(h.quantile(1.0), times.last().copied());
            // Where a bucket's edge divides.
            prop_assert_eq!(h.longer_than(63), times.iter().filter(|&&t| t > 63).count() as u64);
            let text = serde_json::to_string(&h).expect("plain numbers");
            prop_assert_eq!(serde_json::from_str::<Histogram>(&text).expect("own text"), h);
        }

        #[test]
        fn two_added_are_one(a in prop::collection::vec(any::<u32>(), 0..50),
            b in prop::collection::vec(any::<u32>(), 0..50)) {
            let of = |times: &[u32]| {
                let mut h = Histogram::new();
                times.iter().for_each(|&t| h.record(u64::from(t)));
                h
            };
            let mut sum = of(&a);
            sum.add(&of(&b));
            prop_assert_eq!(sum, of(&[a, b].concat()));
        }
    }
}
