//! What must hold for any bytes: tried by the fuzzer, and on the corpus by `cargo test -p furuta-wire`.

use furuta_wire::{Decoder, FrameError, MAX_FRAME, Message, encode};

/// Bytes as they come from a line: no panic, at most one result for each zero, and in step again after the next zero.
pub(crate) fn decoder(bytes: &[u8]) {
    let mut decoder = Decoder::new();
    for &byte in bytes {
        let result = decoder.push(byte);
        assert!(byte == 0 || result.is_none());
        if let Some(Ok(message)) = result {
            is_sendable(&message);
        }
    }
    // Ends whatever was begun.
    let _ = decoder.push(0);
    let query = Message::Query(furuta_wire::Query {
        version: furuta_wire::PROTOCOL_VERSION,
    });
    let mut buffer = [0; MAX_FRAME];
    let frame = encode(&query, &mut buffer).unwrap_or_default();
    let received: Vec<_> = frame
        .iter()
        .filter_map(|&byte| decoder.push(byte))
        .collect();
    assert_eq!(received, [Ok(query)]);
}

/// Bytes as the body of a frame whose checksum is right: the parser behind the checksum, which chance does not reach.
pub(crate) fn message(body: &[u8]) {
    match framed(body) {
        None => {}
        Some(Ok(message)) => is_sendable(&message),
        Some(Err(FrameError::Version { .. } | FrameError::Message)) => {}
        Some(Err(other)) => panic!("{other:?}"),
    }
}

/// Bytes as a message, its frame, and the message again; then the frame with a byte in another place or altered.
pub(crate) fn round_trip(bytes: &[u8]) {
    let Some((&[at, to], body)) = bytes.split_first_chunk() else {
        return;
    };
    let Some(Ok(message)) = framed(body) else {
        return;
    };
    let mut buffer = [0; MAX_FRAME];
    let Ok(frame) = encode(&message, &mut buffer) else {
        panic!("MAX_FRAME holds every message");
    };
    let frame = frame.to_vec();
    is_sendable(&message);
    let mut damaged = frame.clone();
    let at = usize::from(at) % damaged.len();
    damaged[at] ^= to;
    let mut decoder = Decoder::new();
    for received in damaged
        .iter()
        .filter_map(|&byte| decoder.push(byte))
        .flatten()
    {
        let mut again = [0; MAX_FRAME];
        assert_eq!(encode(&received, &mut again), Ok(frame.as_slice()));
    }
}

/// What a decoder makes of a body in a whole frame; `None` where no frame is that long.
fn framed(body: &[u8]) -> Option<Result<Message, FrameError>> {
    if body.len() + 4 > MAX_FRAME - 2 {
        return None;
    }
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(body);
    let packet = [body, &crc.to_le_bytes()].concat();
    let mut frame = [0; MAX_FRAME];
    let len = cobs::encode(&packet, &mut frame);
    let mut decoder = Decoder::new();
    frame[..=len].iter().find_map(|&byte| decoder.push(byte))
}

/// What was understood can be sent, and is then understood as the same, to the bit.
fn is_sendable(message: &Message) {
    let (mut first, mut second) = ([0; MAX_FRAME], [0; MAX_FRAME]);
    let Ok(frame) = encode(message, &mut first) else {
        panic!("MAX_FRAME holds every message");
    };
    let mut decoder = Decoder::new();
    let again = frame.iter().find_map(|&byte| decoder.push(byte));
    match again {
        Some(Ok(again)) => assert_eq!(encode(&again, &mut second), Ok(frame)),
        // A body can hold the version of another protocol only where the parser refused it before.
        other => panic!("{other:?} in place of {message:?}"),
    }
}
