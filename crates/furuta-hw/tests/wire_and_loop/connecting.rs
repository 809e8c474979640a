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
