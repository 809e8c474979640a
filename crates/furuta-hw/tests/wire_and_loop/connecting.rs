//! Who is on the port, if anybody.

use std::io::Write;
use std::time::Duration;

use furuta_hw::{Emulation, Link, LinkError, Pace, SerialTransport, TransportError};
use furuta_wire::Message;

use super::common::{connect, start};

#[test]
fn hello_is_the_rig_file() {
    let rig = start(&Emulation::default(), Pace::RealTime);
    let (_, hello) = connect(&rig);
    assert_eq!(
        (hello.rig.as_str(), hello.period_us),
        ("qube-servo-2", 2000)
    );
    assert_eq!(
        (hello.arm_counts_per_rev, hello.pendulum_counts_per_rev),
        (2048.0, 2048.0)
    );
    assert_eq!(hello.command_limit, 10.0);
}

#[test]
fn a_missing_port_is_named() {
    let error =
        SerialTransport::open("/dev/no-such-port", SerialTransport::BAUD).expect_err("not there");
    assert!(
        matches!(error, TransportError::NoSuchPort { .. }),
        "{error:?}"
    );
    assert!(
        error.to_string().contains("/dev/no-such-port")
            && error.to_string().contains("plug the rig in")
    );
    // There, but no serial port.
    let error = SerialTransport::open("/dev/null", SerialTransport::BAUD).expect_err("no port");
    assert!(matches!(error, TransportError::Refused { .. }), "{error:?}");
}

#[test]
fn a_port_in_use_is_refused() {
    let rig = start(&Emulation::default(), Pace::RealTime);
    let _first = connect(&rig);
    let error = SerialTransport::open(rig.path(), SerialTransport::BAUD).expect_err("taken");
    assert!(matches!(error, TransportError::Refused { .. }), "{error:?}");
}

#[test]
fn silence_and_chatter_are_no_hello() {
    for chatter in [&b""[..], b"Arduino ready\r\n\0"] {
        let (mut device, port) = serialport::TTYPort::pair().expect("a pseudo-terminal");
        let name = serialport::SerialPort::name(&port).expect("named");
        let host = SerialTransport::open(&name, SerialTransport::BAUD).expect("there");
        let talker = std::thread::spawn(move || {
            for _ in 0..20 {
                device.write_all(chatter).expect("taken");
                std::thread::sleep(Duration::from_millis(20));
            }
            device
        });
        match Link::connect(host, Duration::from_millis(300)) {
            Err(LinkError::NoHello {
                bytes, bad_frames, ..
            }) => {
                assert_eq!(
                    (bytes > 0, bad_frames > 0),
                    (!chatter.is_empty(), !chatter.is_empty())
                );
            }
            other => panic!("{other:?}"),
        }
        talker.join().expect("no panic");
    }
}

#[test]
fn another_protocol_version_is_named() {
    let (mut device, port) = serialport::TTYPort::pair().expect("a pseudo-terminal");
    let name = serialport::SerialPort::name(&port).expect("named");
    let host = SerialTransport::open(&name, SerialTransport::BAUD).expect("there");
    let talker = std::thread::spawn(move || {
        // Any frame of version 9 whose first field is the version: a Query will do.
        let message = Message::Query(furuta_wire::Query { version: 9 });
        let mut buffer = [0; furuta_wire::MAX_FRAME];
        let frame = furuta_wire::encode(&message, &mut buffer).expect("fits");
        for _ in 0..100 {
            device.write_all(frame).expect("taken");
            std::thread::sleep(Duration::from_millis(20));
        }
    });
    match Link::connect(host, Duration::from_secs(5)) {
        Err(error @ LinkError::Version { found: 9 }) => {
            assert!(error.to_string().contains("version 9"))
        }
        other => panic!("{other:?}"),
    }
    talker.join().expect("no panic");
}

/// A rig with which no run is safe, or that is none: what it says is named, with what is allowed.
#[test]
fn a_hello_that_cannot_be_is_refused() {
    use furuta_wire::{Hello, RigName};
    type Spoil = fn(&mut Hello);
    let good = *furuta_hw::EmulatedRig::new(&super::common::qube(), &Emulation::default())
        .expect("valid")
        .settings();
    let cases: [(Spoil, &str, &str); 14] = [
        (|h| h.watchdog_periods = 0, "watchdog_periods", "0"),
        (|h| h.period_us = 0, "period_us", "0"),
        (|h| h.period_us = 2_000_000, "period_us", "2000000"),
        (|h| h.arm_counts_per_rev = 0.0, "arm_counts_per_rev", "0"),
        (
            |h| h.arm_counts_per_rev = f64::NAN,
            "arm_counts_per_rev",
            "NaN",
        ),
        (
            |h| h.pendulum_counts_per_rev = f64::INFINITY,
            "pendulum_counts_per_rev",
            "inf",
        ),
        (|h| h.command_limit = 0.0, "command_limit", "0"),
        (|h| h.command_limit = -10.0, "command_limit", "-10"),
        (|h| h.command_limit = f32::NAN, "command_limit", "NaN"),
        (
            |h| h.limits.arm_angle = Some(f32::NAN),
            "limit arm_angle",
            "NaN",
        ),
        (|h| h.limits.arm_speed = Some(-1.0), "limit arm_speed", "-1"),
        (
            |h| h.limits.pendulum_speed = Some(f32::INFINITY),
            "limit pendulum_speed",
            "inf",
        ),
        (|h| h.rig = RigName::new(), "name", "\"\""),
        (
            |h| h.rig = RigName::from(" ").expect("fits"),
            "name",
            "\" \"",
        ),
    ];
    for (spoil, field, value) in cases {
        let mut hello = good;
        spoil(&mut hello);
        match Link::connect(Says(Message::Hello(hello)), Duration::from_secs(5)) {
            Err(LinkError::BadHello {
                field: found,
                value: said,
                ..
            }) => assert_eq!((found, said.as_str()), (field, value)),
            other => panic!("{field}: {other:?}"),
        }
    }
    assert!(Link::connect(Says(Message::Hello(good)), Duration::from_secs(5)).is_ok());
}

/// A device that says the same at every read.
#[derive(Debug)]
struct Says(Message);

impl furuta_hw::Transport for Says {
    fn read(&mut self, buffer: &mut [u8], _: Duration) -> Result<usize, TransportError> {
        let mut frame = [0; furuta_wire::MAX_FRAME];
        let frame = furuta_wire::encode(&self.0, &mut frame).expect("fits");
        buffer[..frame.len()].copy_from_slice(frame);
        Ok(frame.len())
    }

    fn write(&mut self, _: &[u8]) -> Result<(), TransportError> {
        Ok(())
    }

    fn discard_input(&mut self) -> Result<(), TransportError> {
        Ok(())
    }

    fn now(&self) -> std::time::Instant {
        std::time::Instant::now()
    }
}

/// Bytes that never end and are no message: the wait is over all the same.
#[test]
fn noise_without_an_end_is_no_hello() {
    #[derive(Debug)]
    struct Noise;
    impl furuta_hw::Transport for Noise {
        fn read(&mut self, buffer: &mut [u8], _: Duration) -> Result<usize, TransportError> {
            buffer.fill(0x55);
            Ok(buffer.len())
        }

        fn write(&mut self, _: &[u8]) -> Result<(), TransportError> {
            Ok(())
        }

        fn discard_input(&mut self) -> Result<(), TransportError> {
            Ok(())
        }

        fn now(&self) -> std::time::Instant {
            std::time::Instant::now()
        }
    }
    let answer = Link::connect(Noise, Duration::from_millis(300));
    assert!(
        matches!(answer, Err(LinkError::NoHello { .. })),
        "{answer:?}"
    );
}

/// A rig may call itself what it likes: what is shown moves no cursor.
#[test]
fn a_name_with_control_characters_is_shown_escaped() {
    use furuta_hw::Session;
    use furuta_wire::RigName;
    let mut hello = *furuta_hw::EmulatedRig::new(&super::common::qube(), &Emulation::default())
        .expect("valid")
        .settings();
    hello.rig = RigName::from("qube\x1b[2J\r\u{202e}").expect("fits");
    let session = Session::connect(Says(Message::Hello(hello))).expect("it answers");
    let refused = session
        .check(&super::common::qube())
        .expect_err("not its name");
    let text = refused.to_string();
    assert!(text.contains(r"name = qube\u{1b}[2J\r\u{202e}"), "{text}");
    assert!(
        !text.chars().any(|c| c.is_control() || c == '\u{202e}'),
        "{text:?}"
    );
}

#[test]
fn a_file_is_no_port() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml");
    for (path, what) in [(file, "a file"), (env!("CARGO_MANIFEST_DIR"), "a folder")] {
        let error = SerialTransport::open(path, SerialTransport::BAUD).expect_err("no port");
        assert!(
            matches!(error, TransportError::NotAPort { .. }),
            "{error:?}"
        );
        let text = error.to_string();
        assert!(
            text.contains(path) && text.contains(what) && text.contains("not a serial port"),
            "{text}"
        );
    }
}
