//! How punctual a run's loop was.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::{Histogram, LogError};

/// How punctual a run's loop was: histograms of times (ns), filled sample by sample.
///
/// ```
/// use furuta_log::Timing;
/// let mut timing = Timing::new(2_000_000);
/// timing.sample(3e-6, 20e-6);
/// timing.sample(2.5e-3, 20e-6); // later than a period
/// assert_eq!((timing.overruns, timing.total.max()), (1, Some(2_520_000)));
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Timing {
    /// How much later a sample reached the loop than the promptest one of the last 20 to 40 ms, the rig's clock against
    /// the host's: what the line, the system and the scheduler add.
    pub wake_up: Histogram,
    /// From a query's departure to the answer's arrival: there and back, the rig's answering included. Measured now and
    /// then.
    pub round_trip: Histogram,
    /// From a sample's arrival to its command's departure: estimator, supervisor, controller.
    pub compute: Histogram,
    /// Wake-up and compute together, of each sample.
    pub total: Histogram,
    /// Samples whose total is longer than the period.
    pub overruns: u64,
    /// The period (ns).
    pub period: u64,
}

/// Name of the MCAP metadata record.
pub(crate) const RECORD_NAME: &str = "furuta.timing";

const PARTS: [&str; 4] = ["wake_up", "round_trip", "compute", "total"];

impl Timing {
    /// Nothing counted yet, of a loop with this period (ns).
    #[must_use]
    pub const fn new(period: u64) -> Self {
        Self {
            wake_up: Histogram::new(),
            round_trip: Histogram::new(),
            compute: Histogram::new(),
            total: Histogram::new(),
            overruns: 0,
            period,
        }
    }

    /// Counts one sample (s).
    pub fn sample(&mut self, wake_up: f64, compute: f64) {
        self.wake_up.record_seconds(wake_up);
        self.compute.record_seconds(compute);
        let total = wake_up + compute;
        self.total.record_seconds(total);
        self.overruns += u64::from(total * 1e9 > self.period as f64);
    }

    /// The histograms by name: `wake_up`, `round_trip`, `compute`, `total`.
    #[must_use]
    pub fn parts(&self) -> [(&'static str, &Histogram); 4] {
        let [wake_up, round_trip, compute, total] = PARTS;
        [
            (wake_up, &self.wake_up),
            (round_trip, &self.round_trip),
            (compute, &self.compute),
            (total, &self.total),
        ]
    }

    /// As a metadata record: the histograms as JSON.
    pub(crate) fn to_map(&self) -> Result<BTreeMap<String, String>, LogError> {
        let mut map = BTreeMap::from([
            ("overruns".to_owned(), self.overruns.to_string()),
            ("period_ns".to_owned(), self.period.to_string()),
        ]);
        for (name, histogram) in self.parts() {
            let json = serde_json::to_string(histogram).map_err(LogError::Encode)?;
            map.insert(name.to_owned(), json);
        }
        Ok(map)
    }

    pub(crate) fn from_map(map: &BTreeMap<String, String>) -> Result<Self, LogError> {
        fn part<T: serde::de::DeserializeOwned>(
            map: &BTreeMap<String, String>,
            name: &'static str,
        ) -> Result<T, LogError> {
            let text = map.get(name).map_or("", String::as_str);
            serde_json::from_str(text).map_err(|cause| LogError::BadTiming { name, cause })
        }
        let [wake_up, round_trip, compute, total] = PARTS;
        Ok(Self {
            wake_up: part(map, wake_up)?,
            round_trip: part(map, round_trip)?,
            compute: part(map, compute)?,
            total: part(map, total)?,
            overruns: part(map, "overruns")?,
            period: part(map, "period_ns")?,
        })
    }

    /// What a person wants to know of each histogram, in seconds.
    #[must_use]
    pub fn summary(&self) -> TimingSummary {
        TimingSummary {
            unit: "s",
            wake_up: Quantiles::of(&self.wake_up),
            round_trip: Quantiles::of(&self.round_trip),
            compute: Quantiles::of(&self.compute),
            total: Quantiles::of(&self.total),
            overruns: self.overruns,
            period: self.period as f64 * 1e-9,
        }
    }
}

/// [`Timing`] in a few numbers.
#[derive(Copy, Clone, Debug, PartialEq, Serialize)]
pub struct TimingSummary {
    /// Unit of all times: s.
    pub unit: &'static str,
    /// See [`Timing::wake_up`].
    pub wake_up: Quantiles,
    /// See [`Timing::round_trip`].
    pub round_trip: Quantiles,
    /// See [`Timing::compute`].
    pub compute: Quantiles,
    /// See [`Timing::total`].
    pub total: Quantiles,
    /// See [`Timing::overruns`].
    pub overruns: u64,
    /// The period (s).
    pub period: f64,
}

/// A histogram in a few numbers (s); `None` where nothing was counted.
///
/// ```
/// use furuta_log::{Histogram, Quantiles};
/// let mut h = Histogram::new();
/// h.record(2_000);
/// let q = Quantiles::of(&h);
/// assert_eq!((q.count, q.p99, q.max), (1, Some(2e-6), Some(2e-6)));
/// ```
#[derive(Copy, Clone, Debug, PartialEq, Serialize)]
pub struct Quantiles {
    /// How many times were counted.
    pub count: u64,
    /// The shortest.
    pub min: Option<f64>,
    /// Their mean.
    pub mean: Option<f64>,
    /// Half are not longer.
    pub p50: Option<f64>,
    /// 99 of 100 are not longer.
    pub p99: Option<f64>,
    /// 999 of 1000 are not longer.
    #[serde(rename = "p99.9")]
    pub p99_9: Option<f64>,
    /// The longest.
    pub max: Option<f64>,
}

impl Quantiles {
    /// Of a histogram.
    #[must_use]
    pub fn of(h: &Histogram) -> Self {
        let seconds = |ns: u64| ns as f64 / 1e9;
        Self {
            count: h.count(),
            min: h.min().map(seconds),
            mean: h.mean().map(|ns| ns / 1e9),
            p50: h.quantile(0.5).map(seconds),
            p99: h.quantile(0.99).map(seconds),
            p99_9: h.quantile(0.999).map(seconds),
            max: h.max().map(seconds),
        }
    }
}
