//! Frames: postcard, CRC-32, COBS, a zero at the end.

use crc::{CRC_32_ISO_HDLC, Crc, Table};

use crate::{Message, PROTOCOL_VERSION, cobs};

/// ISO-HDLC because it is everywhere (zlib, Python's `zlib.crc32`, Arduino libraries). At the length of our frames it
/// finds every error of up to five bits. The one-table form costs 1 KiB of flash.
const CRC: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISO_HDLC);
const CRC_LEN: usize = 4;

/// Longest postcard encoding of a message: a `Hello` with the longest name and every field at its longest.
const MAX_BODY: usize = 1 + 3 + (1 + crate::RIG_NAME_CAPACITY) + 5 + 8 + 8 + 4 + 3 * 5 + 3 + 1;
/// Body and CRC.
const MAX_PACKET: usize = MAX_BODY + CRC_LEN;

/// Longest frame in bytes, its zero included: what a buffer for [`encode`] must hold.
pub const MAX_FRAME: usize = MAX_PACKET + 1 + 1; // one COBS code byte (packets are shorter than 254 bytes), one zero

/// A message could not be encoded.
#[derive(Copy, Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EncodeError {
    /// The caller's buffer is too short.
    #[error("frame buffer of {len} bytes is too short: give it MAX_FRAME = {MAX_FRAME} bytes")]
    BufferTooShort {
        /// Length of the buffer given.
        len: usize,
    },
}

/// Bytes up to a zero that are not a valid frame. The decoder is ready for the next frame.
#[derive(Copy, Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FrameError {
    /// More than [`MAX_FRAME`] bytes without a zero.
    #[error("no frame is longer than {MAX_FRAME} bytes: noise on the line, or not a furuta rig")]
    TooLong,
    /// Not COBS, or too short to hold a message and its CRC.
    #[error("not a COBS frame: bytes were lost or altered on the line")]
    Framing,
    /// The checksum is wrong.
    #[error(
        "checksum is {found:08x}, the bytes give {computed:08x}: bytes were altered on the line"
    )]
    Checksum {
        /// CRC received.
        found: u32,
        /// CRC of the bytes received.
        computed: u32,
    },
    /// The checksum is right, but the other end speaks another version of the protocol.
    #[error(
        "the other end speaks protocol version {found}, this one {PROTOCOL_VERSION}: update the older of the two"
    )]
    Version {
        /// Version of the other end.
        found: u16,
    },
    /// The checksum is right, but this is no message that we know.
    #[error("well-formed frame, but no message of protocol version {PROTOCOL_VERSION}")]
    Message,
}

/// Writes one message as a frame into the caller's buffer and returns the part used, its zero included.
///
/// # Errors
/// [`EncodeError::BufferTooShort`]; never with a buffer of [`MAX_FRAME`] bytes.
pub fn encode<'a>(message: &Message, buffer: &'a mut [u8]) -> Result<&'a [u8], EncodeError> {
    let too_short = EncodeError::BufferTooShort { len: buffer.len() };
    let mut packet = [0; MAX_PACKET];
    let (body, _) = packet.split_at_mut(MAX_BODY);
    // The packet is as long as the longest message, which a test holds against the messages: postcard cannot run out.
    let body = postcard::to_slice(message, body).map_err(|_| too_short)?;
    // That a command is a voltage goes without saying.
    let body_len = match message {
        Message::Hello(hello) if hello.actuation == 0 => body.len().saturating_sub(1),
        _ => body.len(),
    };
    let (body, _) = body.split_at(body_len);
    let crc = CRC.checksum(body);
    let end = packet.get_mut(body_len..body_len + CRC_LEN);
    end.ok_or(too_short)?.copy_from_slice(&crc.to_le_bytes());
    let packet = packet.get(..body_len + CRC_LEN).ok_or(too_short)?;
    let coded = cobs::encode(packet, buffer).ok_or(too_short)?;
    *buffer.get_mut(coded).ok_or(too_short)? = 0;
    buffer.get(..=coded).ok_or(too_short)
}

/// Decodes frames byte by byte, from a buffer of its own.
///
/// After any garbage it is in step again at the next zero: at most the frame that the garbage ran into is lost.
#[derive(Clone, Debug)]
pub struct Decoder {
    buffer: [u8; MAX_FRAME],
    len: usize,
    overflowed: bool,
}

impl Default for Decoder {
    fn default() -> Self {
        Self::new()
    }
}

impl Decoder {
    /// An empty decoder.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            buffer: [0; MAX_FRAME],
            len: 0,
            overflowed: false,
        }
    }

    /// Takes the next byte from the line; returns something when that byte ends a frame.
    ///
    /// Zeros between frames are ignored, so a sender may send one at any time to separate itself from garbage.
    ///
    /// # Errors
    /// The frame that this byte ends is not a message: see [`FrameError`].
    pub fn push(&mut self, byte: u8) -> Option<Result<Message, FrameError>> {
        if byte != 0 {
            if let Some(slot) = self.buffer.get_mut(self.len) {
                *slot = byte;
                self.len += 1;
            } else {
                self.overflowed = true;
            }
            return None;
        }
        let len = core::mem::take(&mut self.len);
        if core::mem::take(&mut self.overflowed) {
            return Some(Err(FrameError::TooLong));
        }
        if len == 0 {
            return None;
        }
        Some(self.decode(len))
    }

    fn decode(&mut self, len: usize) -> Result<Message, FrameError> {
        let coded = self.buffer.get_mut(..len).ok_or(FrameError::Framing)?;
        let packet = cobs::decode(coded).ok_or(FrameError::Framing)?;
        let (body, crc) = packet
            .split_last_chunk::<CRC_LEN>()
            .ok_or(FrameError::Framing)?;
        let found = u32::from_le_bytes(*crc);
        let computed = CRC.checksum(body);
        if found != computed {
            return Err(FrameError::Checksum { found, computed });
        }
        parse(body)
    }
}

/// Query and Hello begin with their index and a version in every version of the protocol: read these first.
fn parse(body: &[u8]) -> Result<Message, FrameError> {
    match body.split_first() {
        Some((0 | 1, rest)) => {
            let (version, _) =
                postcard::take_from_bytes::<u16>(rest).map_err(|_| FrameError::Message)?;
            if version != PROTOCOL_VERSION {
                return Err(FrameError::Version { found: version });
            }
        }
        // An index in more bytes than it needs (80 00 for 0) is no encoder's, and would get past the version.
        Some((0x80.., _)) => return Err(FrameError::Message),
        _ => {}
    }
    if let Some((1, _)) = body.split_first() {
        return hello(body);
    }
    match postcard::take_from_bytes(body) {
        Ok((message, [])) => Ok(message),
        _ => Err(FrameError::Message),
    }
}

/// A hello that says what its commands are, or ends before: then they are voltages.
fn hello(body: &[u8]) -> Result<Message, FrameError> {
    let mut said = [0; MAX_BODY + 1];
    let whole = said.get_mut(..body.len()).ok_or(FrameError::Message)?;
    whole.copy_from_slice(body);
    let whole = said.get(..=body.len()).ok_or(FrameError::Message)?;
    match postcard::take_from_bytes(whole) {
        // The zero behind it was taken for the kind.
        Ok((message, [])) => Ok(message),
        // A kind was said, and is not the one that goes without saying.
        Ok((Message::Hello(hello), [0])) if hello.actuation != 0 => Ok(Message::Hello(hello)),
        _ => Err(FrameError::Message),
    }
}
