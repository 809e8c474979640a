//! `furuta latency`: how punctual a loop is on this machine, beside cyclictest on the same terms.

use std::io::Write;
use std::path::Path;
use std::time::Duration;

use furuta_chart::{Chart, Line, Panel};
use furuta_hw::{
    EmulatedRig, Emulation, Granted, Link, Metronome, Pace, PtyRig, SerialTransport,
    measure_wake_up,
};
use furuta_log::{Histogram, Quantiles};
use furuta_model::Rig;
use serde_json::{Value, json};

use super::emulate::positive;
use crate::cyclictest;
use crate::failure::Failure;
use crate::interrupt;
use crate::outputs::{self, Output};
use crate::real_time::{RealTimeArgs, table};
use crate::streams;

/// Measure how late a loop wakes up on this machine, beside cyclictest (Debian's rt-tests) where it is installed: in
/// turns, with the same interval, priority and number of loops. With --port or --emulated also the way to a rig and
/// back.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// How long to measure each.
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0, value_parser = positive)]
    seconds: f64,
    /// How often a second to wake up.
    #[arg(long, value_name = "HZ", default_value_t = 500.0, value_parser = rate)]
    rate: f64,
    #[command(flatten)]
    real_time: RealTimeArgs,
    /// Serial port of a rig that stands still: measures the way there and back as well.
    #[arg(long, value_name = "PORT")]
    port: Option<String>,
    /// The same with an emulated rig: built-in rig or rig file.
    #[arg(long, value_name = "RIG", conflicts_with = "port")]
    emulated: Option<String>,
    /// Bits per second of the serial port.
    #[arg(long, default_value_t = SerialTransport::BAUD, requires = "port", conflicts_with = "emulated")]
    baud: u32,
    /// Draw the share of wake-ups later than a time.
    #[arg(long, value_name = "OUT.svg", value_parser = outputs::picture())]
    plot: Option<Output>,
    /// Print JSON in place of text.
    #[arg(long)]
    json: bool,
}

/// Each is measured in this many turns, so that both meet the same other work.
const TURNS: u64 = 5;
/// An answer that takes longer is counted as lost.
const PATIENCE: Duration = Duration::from_millis(500);

fn rate(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(hz) if (1.0..=20_000.0).contains(&hz) => Ok(hz),
        _ => Err("must be a number from 1 to 20000 Hz".to_owned()),
    }
}

/// The way to a rig and back.
struct RoundTrips {
    times: Histogram,
    lost: u64,
}

/// What was measured.
struct Measured {
    granted: Granted,
    interval: Duration,
    ours: Histogram,
    missed: u64,
    cyclictest: Option<cyclictest::Report>,
    round_trips: Option<RoundTrips>,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    // Whole microseconds, as cyclictest has them.
    let interval = Duration::from_micros((1e6 / args.rate).round() as u64);
    let emulated = match &args.emulated {
        Some(rig) => {
            let emulation = Emulation {
                period_us: u32::try_from(interval.as_micros()).unwrap_or(u32::MAX),
                ..Emulation::default()
            };
            let on = EmulatedRig::new(&Rig::load(rig)?, &emulation)?;
            Some(PtyRig::start(on, Pace::Patient)?)
        }
        None => None,
    };
    let port = emulated.as_ref().map(PtyRig::path).or(args.port.as_deref());
    let link = match port {
        Some(port) => {
            let transport = SerialTransport::open(port, args.baud)?;
            Some(Link::connect(transport, furuta_hw::session::HELLO_TIMEOUT)?.0)
        }
        None => None,
    };
    let measured = measure(args, interval, link)?;
    if let Some(path) = &args.plot {
        path.write(chart(&measured).svg());
    }
    if args.json {
        writeln!(
            streams::output(),
            "{}",
            report(&measured, args.plot.as_ref().map(Output::path))
        )?;
    } else {
        writeln!(streams::output(), "{}", text(&measured))?;
    }
    Ok(())
}

fn measure(
    args: &Args,
    interval: Duration,
    link: Option<Link<SerialTransport>>,
) -> Result<Measured, Failure> {
    let asked = args.real_time.asked();
    let stop = Some(interrupt::flag());
    let loops = ((args.seconds / interval.as_secs_f64()).round() as u64).max(1);
    let turns = TURNS.min(loops);
    let (mut ours, mut missed) = (Histogram::new(), 0);
    let mut theirs: Option<cyclictest::Report> = None;
    let mut granted = Granted::default();
    for turn in 0..turns {
        // The last takes what is left.
        let share = loops / turns + if turn + 1 == turns { loops % turns } else { 0 };
        // In a thread of its own, which takes its priority with it: cyclictest, a child of this one, asks for itself.
        let (now_granted, late, now_missed) = std::thread::scope(|scope| {
            let thread = scope.spawn(|| {
                let (granted, _held) = asked.enter();
                let (late, missed) = measure_wake_up(interval, share, stop);
                (granted, late, missed)
            });
            thread
                .join()
                .unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        });
        granted = now_granted;
        ours.add(&late);
        missed += now_missed;
        if interrupt::flag().load(std::sync::atomic::Ordering::Relaxed) {
            break;
        }
        let arguments = cyclictest::arguments(interval, share, asked, &granted);
        match (cyclictest::run(&arguments)?, &mut theirs) {
            (None, _) => {}
            (Some(report), Some(theirs)) => theirs.late.add(&report.late),
            (Some(report), None) => theirs = Some(report),
        }
    }
    // Last of all: the priority stays with this thread.
    let round_trips = match link {
        Some(mut link) => {
            let (_, _held) = asked.enter();
            Some(round_trips(&mut link, interval, loops)?)
        }
        None => None,
    };
    Ok(Measured {
        granted,
        interval,
        ours,
        missed,
        cyclictest: theirs,
        round_trips,
    })
}

fn round_trips(
    link: &mut Link<SerialTransport>,
    interval: Duration,
    loops: u64,
) -> Result<RoundTrips, Failure> {
    let (mut times, mut lost) = (Histogram::new(), 0);
    let mut metronome = Metronome::new(interval);
    for _ in 0..loops {
        if interrupt::flag().load(std::sync::atomic::Ordering::Relaxed) {
            break;
        }
        metronome.wait();
        match link.round_trip(PATIENCE)? {
            Some(time) => times.record(u64::try_from(time.as_nanos()).unwrap_or(u64::MAX)),
            None => lost += 1,
        }
    }
    Ok(RoundTrips { times, lost })
}

/// Ours over cyclictest's, of what both count in microseconds; `None` where theirs is 0.
fn ratio(ours: &Histogram, theirs: &Histogram, of: fn(&Histogram) -> Option<f64>) -> Option<f64> {
    let (ours, theirs) = (of(ours)?, of(theirs)?);
    (theirs > 0.0).then(|| ours / theirs)
}

type Of = fn(&Histogram) -> Option<f64>;
const COMPARED: [(&str, Of); 5] = [
    ("mean", |h| h.mean()),
    ("p50", |h| h.quantile(0.5).map(|ns| ns as f64)),
    ("p99", |h| h.quantile(0.99).map(|ns| ns as f64)),
    ("p99.9", |h| h.quantile(0.999).map(|ns| ns as f64)),
    ("max", |h| h.max().map(|ns| ns as f64)),
];

fn text(m: &Measured) -> String {
    let mut rows = vec![("wake-up", &m.ours)];
    if let Some(report) = &m.cyclictest {
        rows.push(("cyclictest", &report.late));
    }
    if let Some(trips) = &m.round_trips {
        rows.push(("round trip", &trips.times));
    }
    let mut lines = vec![
        format!("real time: {}", m.granted),
        format!(
            "{} wake-ups, one every {} us, {} deadlines missed",
            m.ours.count(),
            m.interval.as_micros(),
            m.missed
        ),
        table(&rows),
    ];
    match &m.cyclictest {
        Some(report) => {
            let ratios = COMPARED.map(|(name, of)| match ratio(&m.ours, &report.late, of) {
                Some(ratio) => format!("{name} {ratio:.2}"),
                None => format!("{name} -"),
            });
            lines.push(format!(
                "ours over cyclictest {}: {}",
                report.version,
                ratios.join(", ")
            ));
        }
        None => lines.push(cyclictest::MISSING.to_owned()),
    }
    if let Some(trips) = m.round_trips.as_ref().filter(|trips| trips.lost > 0) {
        lines.push(format!("{} queries without an answer", trips.lost));
    }
    lines.join("\n")
}

fn report(m: &Measured, plot: Option<&Path>) -> Value {
    let cyclictest = m.cyclictest.as_ref().map(|report| {
        let ratios = COMPARED
            .iter()
            .map(|(name, of)| {
                let ratio = ratio(&m.ours, &report.late, *of);
                ((*name).to_owned(), json!(ratio))
            })
            .collect::<serde_json::Map<_, _>>();
        json!({ "version": report.version, "late": Quantiles::of(&report.late), "ratio": ratios })
    });
    let round_trip = m
        .round_trips
        .as_ref()
        .map(|trips| json!({ "times": Quantiles::of(&trips.times), "lost": trips.lost }));
    json!({
        "unit": "s",
        "interval": m.interval.as_secs_f64(),
        "real_time": m.granted,
        "wake_up": { "late": Quantiles::of(&m.ours), "missed": m.missed },
        "cyclictest": cyclictest,
        "round_trip": round_trip,
        "plot": plot.map(|path| path.display().to_string()),
    })
}

/// The share of the times that are longer than a time, both axes logarithmic.
fn chart(m: &Measured) -> Chart {
    let line = |name: &str, h: &Histogram| {
        let mut longer = h.count();
        let points: Vec<(f64, f64)> = h
            .buckets()
            .map(|bucket| {
                let share = longer as f64 / h.count() as f64;
                longer -= bucket.count;
                (bucket.lowest.max(1) as f64 / 1e3, share.log10())
            })
            .collect();
        Line::new(name, points)
    };
    let mut lines = vec![line("furuta", &m.ours)];
    if let Some(report) = &m.cyclictest {
        lines.push(line("cyclictest", &report.late).dashed());
    }
    if let Some(trips) = &m.round_trips {
        lines.push(line("round trip", &trips.times));
    }
    Chart::new(
        "How late a loop wakes up",
        "time [us]",
        vec![Panel::new("log10 of the share that is later", lines)],
    )
    .logarithmic()
}
