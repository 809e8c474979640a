//! What a log costs: a sample encoded and written, a minute of samples read and replayed.

use std::hint::black_box;
use std::io::Cursor;
use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use furuta_ctrl::ControllerFile;
use furuta_hw::{
    EmulatedRig, EmulatedTransport, Emulation, LoopSettings, Reference, ReplayOptions, Session,
    SwingUpBalance, Task, provenance, replay,
};
use furuta_log::{Log, LogWriter, Metadata};
use furuta_model::Rig;

const MINUTE: Duration = Duration::from_secs(60);

/// A minute of swing-up and balance on the emulated rig, with this controller.
fn minute(controller: &str) -> Log {
    let rig = Rig::builtin("shahzad2022-srv02").expect("built in");
    let file = ControllerFile::from_toml(controller).expect("valid");
    let emulated = EmulatedRig::new(&rig, &Emulation::default()).expect("valid");
    let mut session = Session::connect(EmulatedTransport::new(emulated)).expect("it answers");
    let reference = Reference::Steps {
        amplitude: 0.2,
        hold: 2.0,
    };
    let pilot = SwingUpBalance::from_config(&file.config, &rig, session.period(), reference)
        .expect("has a controller");
    let task = Task::Balance { reference };
    let said = provenance::metadata(&rig, Some(&file), &task, pilot.describe(), session.hello());
    let settings = LoopSettings::new(&rig, session.period(), MINUTE);
    let path = std::env::temp_dir().join(format!("furuta-bench-{}.mcap", std::process::id()));
    session
        .run(&pilot, &settings, Some((&path, &said)))
        .expect("writable");
    let log = furuta_log::read(&path).expect("own log");
    std::fs::remove_file(&path).expect("written above");
    log
}

fn logs(c: &mut Criterion) {
    let log = minute("");
    let metadata: Metadata = log.metadata.clone().expect("metadata");
    c.bench_function("log, write a sample", |bench| {
        let new = || LogWriter::new(Cursor::new(Vec::new()), &metadata).expect("memory");
        let (mut writer, mut k) = (new(), 0);
        bench.iter(|| {
            if k == log.records.len() {
                (writer, k) = (new(), 0);
            }
            k += 1;
            writer.write(black_box(&log.records[k - 1]))
        });
    });

    let mut writer = LogWriter::new(Cursor::new(Vec::new()), &metadata).expect("memory");
    for record in &log.records {
        writer.write(record).expect("memory");
    }
    let bytes = writer.finish().expect("memory").into_inner();
    let mut group = c.benchmark_group("log, a minute at 500 Hz");
    group.sample_size(10);
    group.throughput(Throughput::Elements(log.records.len() as u64));
    group.bench_function("read", |bench| {
        bench.iter(|| furuta_log::read_from(black_box(&bytes[..])).expect("own log"));
    });
    group.bench_function("to CSV", |bench| {
        bench.iter(|| furuta_log::write_csv(black_box(&log), std::io::sink()));
    });
    let same = ReplayOptions::default();
    group.bench_function("replay, LQR", |bench| {
        bench.iter(|| replay(black_box(&log), &same).expect("all is there"));
    });
    let mpc = minute("[controller]\nkind = \"mpc\"\n");
    group.bench_function("replay, MPC", |bench| {
        bench.iter(|| replay(black_box(&mpc), &same).expect("all is there"));
    });
}

criterion_group!(benches, logs);
criterion_main!(benches);
