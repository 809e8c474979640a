//! The loop allocates nothing: whatever it needs, it has from the start.

mod common;

use common::{connect, qube, settings, start};
use furuta_hw::{Emulation, End, Pace, Recorder, Reference, SwingUpBalance, run};
use furuta_log::{LogWriter, Metadata};

#[test]
fn a_logged_run_allocates_nothing() {
    let rig = start(&Emulation::default(), Pace::HostLed);
    let (mut link, hello) = connect(&rig);
    let path =
        std::env::temp_dir().join(format!("furuta-hw-allocation-{}.mcap", std::process::id()));
    let log = LogWriter::create(&path, &Metadata::default()).expect("writable");
    let (mut sender, recorder) = Recorder::start(log).expect("a thread");
    let pilot =
        SwingUpBalance::design(&qube(), 0.002, Reference::Constant(0.0)).expect("stabilisable");
    let mut end = None;
    // Counts this thread's allocations; the log's writer, in its own thread, may allocate.
    let counted = allocation_counter::measure(|| {
        end = Some(run(&mut link, &hello, &pilot, &settings(10.0), &mut sender).end);
    });
    assert!(matches!(end, Some(End::Finished)), "{end:?}");
    assert_eq!(counted.count_total, 0, "{counted:?}");
    drop(sender);
    assert_eq!(recorder.finish().records, 5001);
    std::fs::remove_file(path).expect("written above");
    // The counter is at work.
    assert_eq!(
        allocation_counter::measure(|| drop(std::hint::black_box(Box::new(1)))).count_total,
        1
    );
}
