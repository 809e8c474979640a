//! Frames against properties that any framing must have, and against bytes worked out by hand.

use furuta_wire::{
    ArmCounts, Command, Decoder, EncodeError, FrameError, Hello, MAX_FRAME, Message,
    PROTOCOL_VERSION, PendulumCounts, Query, RigLimits, RigName, Sample, Status, encode,
};
use proptest::prelude::*;

fn frame(message: &Message) -> Vec<u8> {
    let mut buffer = [0; MAX_FRAME];
    encode(message, &mut buffer)
        .expect("MAX_FRAME holds every message")
        .to_vec()
}

fn receive(decoder: &mut Decoder, bytes: &[u8]) -> Vec<Result<Message, FrameError>> {
    bytes
        .iter()
        .filter_map(|&byte| decoder.push(byte))
        .collect()
}

fn limit() -> impl Strategy<Value = Option<f32>> {
    prop::option::of(any::<f32>())
}

fn hello() -> impl Strategy<Value = Hello> {
    let counts = (any::<f64>(), any::<f64>());
    let limits = (limit(), limit(), limit());
    (
        ("[a-zäß0-9-]{0,16}", any::<u32>(), counts),
        (any::<f32>(), limits, any::<u16>()),
    )
        .prop_map(
            |((rig, period_us, counts), (command_limit, limits, watchdog_periods))| Hello {
                version: PROTOCOL_VERSION,
                rig: RigName::from(&rig).expect("16 characters of at most two bytes"),
                period_us,
                arm_counts_per_rev: counts.0,
                pendulum_counts_per_rev: counts.1,
                command_limit,
                limits: RigLimits {
                    arm_angle: limits.0,
                    arm_speed: limits.1,
                    pendulum_speed: limits.2,
                },
                watchdog_periods,
                actuation: (watchdog_periods % 5) as u8,
            },
        )
}

fn sample() -> impl Strategy<Value = Sample> {
    (
        any::<u32>(),
        any::<u64>(),
        any::<i32>(),
        any::<i32>(),
        any::<f32>(),
        any::<u8>(),
    )
        .prop_map(|(seq, t_us, theta, alpha, volts, status)| Sample {
            seq,
            t_us,
            theta: ArmCounts(theta),
            alpha: PendulumCounts(alpha),
            volts,
            status: Status::from_bits(status),
        })
}

fn message() -> impl Strategy<Value = Message> {
    prop_oneof![
        Just(Message::Query(Query {
            version: PROTOCOL_VERSION
        })),
        hello().prop_map(Message::Hello),
        sample().prop_map(Message::Sample),
        (any::<u32>(), any::<f32>())
            .prop_map(|(seq, volts)| Message::Command(Command { seq, volts })),
    ]
}

/// Bit-exact, so that NaN compares too.
fn same(a: &Message, b: &Message) -> bool {
    frame(a) == frame(b)
}

proptest! {
    #[test]
    fn round_trip(message in message()) {
        let bytes = frame(&message);
        prop_assert!(bytes.len() <= MAX_FRAME);
        prop_assert_eq!(bytes.iter().filter(|&&b| b == 0).count(), 1);
        let received = receive(&mut Decoder::new(), &bytes);
        prop_assert_eq!(received.len(), 1);
        prop_assert!(same(received[0].as_ref().expect("own frame"), &message));
    }

    /// Up to five flipped bits in a frame of this length are always found by CRC-32 where the frame's structure
    /// survives; where COBS moves bytes about, the CRC misses one in 2^32.
    #[test]
    fn mutated_frames_are_not_accepted(message in message(),
        flips in prop::collection::vec((any::<prop::sample::Index>(), 0_u8..8), 1..6)) {
        let good = frame(&message);
        let mut bad = good.clone();
        for (index, bit) in &flips {
            let i = index.index(good.len());
            bad[i] ^= 1 << bit;
        }
        prop_assume!(bad != good);
        let mut decoder = Decoder::new();
        for received in receive(&mut decoder, &bad).into_iter().chain(receive(&mut decoder, &[0])).flatten() {
            prop_assert!(same(&received, &message), "accepted {received:?} in place of {message:?}");
        }
    }

    #[test]
    fn a_lost_or_doubled_byte_is_not_accepted(message in message(), index in any::<prop::sample::Index>(),
        double in any::<bool>()) {
        let mut bytes = frame(&message);
        let i = index.index(bytes.len() - 1); // not the closing zero: losing that one loses no content
        if double { bytes.insert(i, bytes[i]) } else { bytes.remove(i); }
        for received in receive(&mut Decoder::new(), &bytes) {
            prop_assert!(received.is_err(), "accepted {received:?}");
        }
    }

    /// Whatever came before, the second of two whole frames is understood, and the first too after a zero.
    #[test]
    fn in_step_again_within_one_frame(garbage in prop::collection::vec(any::<u8>(), 0..400), message in message()) {
        let bytes = frame(&message);
        let mut decoder = Decoder::new();
        receive(&mut decoder, &garbage);
        receive(&mut decoder, &bytes);
        let second = receive(&mut decoder, &bytes);
        prop_assert!(second.len() == 1 && second[0].is_ok_and(|m| same(&m, &message)));

        let mut decoder = Decoder::new();
        receive(&mut decoder, &garbage);
        receive(&mut decoder, &[0]);
        let first = receive(&mut decoder, &bytes);
        prop_assert!(first.len() == 1 && first[0].is_ok_and(|m| same(&m, &message)));
    }

    #[test]
    fn garbage_is_no_message(garbage in prop::collection::vec(any::<u8>(), 0..2000)) {
        let mut decoder = Decoder::new();
        for received in receive(&mut decoder, &garbage) {
            prop_assert!(received.is_err());
        }
    }

    #[test]
    fn a_short_buffer_is_an_error(message in message(), len in 0..MAX_FRAME) {
        let needed = frame(&message).len();
        let mut buffer = vec![0; len];
        match encode(&message, &mut buffer) {
            Ok(bytes) => prop_assert!(bytes.len() == needed && needed <= len),
            Err(EncodeError::BufferTooShort { len: told }) => prop_assert!(told == len && len < needed),
        }
    }
}

#[test]
fn the_longest_hello_fills_max_frame() {
    let message = Message::Hello(Hello {
        version: PROTOCOL_VERSION,
        rig: RigName::from(&"x".repeat(32)).expect("32 bytes"),
        period_us: u32::MAX,
        arm_counts_per_rev: 4096.0,
        pendulum_counts_per_rev: 4096.0,
        command_limit: 10.0,
        limits: RigLimits {
            arm_angle: Some(2.0),
            arm_speed: Some(30.0),
            pendulum_speed: Some(40.0),
        },
        watchdog_periods: u16::MAX,
        actuation: u8::MAX,
    });
    // Two bytes short: a version below 128 takes one byte of the three reserved for it.
    assert_eq!(frame(&message).len(), MAX_FRAME - 2);
}

/// Worked out by hand from the text in the crate's documentation; the CRC is Python's `zlib.crc32`.
#[test]
fn command_bytes() {
    let bytes = frame(&Message::Command(Command {
        seq: 300,
        volts: -1.5,
    }));
    // 03 | ac 02 | 00 00 c0 bf | crc32 of these, little endian
    let body = [0x03, 0xac, 0x02, 0x00, 0x00, 0xc0, 0xbf];
    let crc = 0x28be_3e45_u32.to_le_bytes();
    assert_eq!(bytes[..4], [4, 0x03, 0xac, 0x02]);
    assert_eq!(bytes[4..8], [1, 7, 0xc0, 0xbf]);
    assert_eq!(bytes[8..12], crc);
    assert_eq!(bytes[12..], [0]);
    assert_eq!(body.len() + crc.len() + 2, bytes.len());
}

#[test]
fn another_protocol_version_is_named() {
    let message = Message::Query(Query {
        version: PROTOCOL_VERSION + 1,
    });
    let received = receive(&mut Decoder::new(), &frame(&message));
    assert_eq!(
        received,
        [Err(FrameError::Version {
            found: PROTOCOL_VERSION + 1
        })]
    );
}

#[test]
fn endless_noise_without_a_zero_is_reported_once() {
    let mut decoder = Decoder::new();
    assert!(receive(&mut decoder, &[0x55; 10 * MAX_FRAME]).is_empty());
    assert_eq!(receive(&mut decoder, &[0]), [Err(FrameError::TooLong)]);
    assert!(receive(&mut decoder, &[0, 0, 0]).is_empty());
}
