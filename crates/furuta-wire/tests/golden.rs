//! The implementation against the bytes in docs/protocol.md, which a script made from that text alone.

use furuta_wire::{
    ArmCounts, Command, Decoder, FrameError, Hello, MAX_FRAME, Message, PROTOCOL_VERSION,
    PendulumCounts, Query, RigLimits, RigName, Sample, Status, encode,
};

const PROTOCOL: &str = include_str!("../../../docs/protocol.md");

/// Bytes of a cell such as `` `00 ac 02` ``.
fn bytes(cell: &str) -> Option<Vec<u8>> {
    let hex = cell.trim().strip_prefix('`')?.strip_suffix('`')?;
    hex.split(' ')
        .map(|byte| u8::from_str_radix(byte, 16).ok())
        .collect()
}

/// Rows of the table: name, body, frame.
fn golden() -> Vec<(&'static str, Vec<u8>, Vec<u8>)> {
    let table = PROTOCOL.split("## Golden bytes").nth(1).expect("a section");
    let row = |line: &'static str| {
        let mut cells = line.strip_prefix("| ")?.strip_suffix(" |")?.split(" | ");
        Some((cells.next()?, bytes(cells.next()?)?, bytes(cells.next()?)?))
    };
    table.lines().filter_map(row).collect()
}

fn hello(rig: &str, period_us: u32, counts: [f64; 2], volts: f32, watchdog_periods: u16) -> Hello {
    Hello {
        version: PROTOCOL_VERSION,
        rig: RigName::from(rig).expect("short"),
        period_us,
        arm_counts_per_rev: counts[0],
        pendulum_counts_per_rev: counts[1],
        command_limit: volts,
        limits: RigLimits::default(),
        watchdog_periods,
        actuation: 0,
    }
}

fn sample((seq, t_us): (u32, u64), theta: i32, alpha: i32, volts: f32, status: Status) -> Message {
    Message::Sample(Sample {
        seq,
        t_us,
        theta: ArmCounts(theta),
        alpha: PendulumCounts(alpha),
        volts,
        status,
    })
}

/// The messages that the document describes in words below its table.
fn described() -> Vec<(&'static str, Message)> {
    let query = |version| Message::Query(Query { version });
    let command = |seq, volts| Message::Command(Command { seq, volts });
    let limited = Hello {
        limits: RigLimits {
            arm_angle: Some(2.5),
            arm_speed: None,
            pendulum_speed: Some(40.0),
        },
        ..hello("Drehpendel ä", 4000, [-4096.0, 1200.0], 12.5, 300)
    };
    let off = Status::HELD | Status::WATCHDOG;
    vec![
        ("query", query(1)),
        ("query of version 300", query(300)),
        (
            "hello",
            Message::Hello(hello("qube-servo-2", 2000, [2048.0; 2], 10.0, 10)),
        ),
        ("hello with limits", Message::Hello(limited)),
        (
            "hello of a stepper motor",
            Message::Hello(Hello {
                actuation: 3,
                ..hello("stepper-kit", 20_000, [1600.0, 4096.0], 150.0, 3)
            }),
        ),
        ("first sample", sample((0, 0), 0, 0, 0.0, off)),
        (
            "sample",
            sample((300, 600_000), -37, 1024, -1.5, Status::OK),
        ),
        (
            "last sample",
            sample(
                (u32::MAX, u64::MAX),
                i32::MIN,
                i32::MAX,
                -0.0,
                Status::from_bits(31),
            ),
        ),
        ("command", command(300, -1.5)),
        ("motor off", command(128, 0.0)),
    ]
}

#[test]
fn messages_have_the_documents_bytes() {
    let golden = golden();
    let described = described();
    assert_eq!(golden.len(), described.len());
    for ((name, body, frame), (described, message)) in golden.iter().zip(&described) {
        assert_eq!(name, described);
        let mut buffer = [0; MAX_FRAME];
        assert_eq!(encode(message, &mut buffer), Ok(frame.as_slice()), "{name}");
        let mut decoder = Decoder::new();
        let received: Vec<_> = frame.iter().filter_map(|&b| decoder.push(b)).collect();
        let expected = match *message {
            Message::Query(Query { version: 300 }) => Err(FrameError::Version { found: 300 }),
            message => Ok(message),
        };
        assert_eq!(received, [expected], "{name}");
        // -0 == 0: the bits of all numbers, by encoding what was understood.
        if let [Ok(message)] = received[..] {
            let mut again = [0; MAX_FRAME];
            assert_eq!(encode(&message, &mut again), Ok(frame.as_slice()));
        }
        // The body is what is inside the frame.
        let mut packet = frame[..frame.len() - 1].to_vec();
        let len = cobs::decode_in_place(&mut packet).expect("COBS");
        assert_eq!(&packet[..len - 4], body, "{name}");
    }
}

#[test]
fn the_documents_numbers_are_the_codes() {
    assert!(PROTOCOL.contains(&format!("Version {PROTOCOL_VERSION}. ")));
    assert!(PROTOCOL.contains(&format!("No frame is longer than {MAX_FRAME} bytes")));
    for flag in [
        Status::HELD,
        Status::WATCHDOG,
        Status::CLIPPED,
        Status::LIMIT,
        Status::REFUSED,
    ] {
        let name = format!("{flag:?}")
            .trim_start_matches("Status(")
            .trim_end_matches(')')
            .to_owned();
        let said = format!("{} {name}", flag.bits());
        assert!(PROTOCOL.contains(&said), "{said}");
    }
}
