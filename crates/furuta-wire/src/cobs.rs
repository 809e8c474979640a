//! Consistent overhead byte stuffing: packets without zeros (S. Cheshire, M. Baker, IEEE/ACM Trans. Networking 7,
//! 1999).
//!
//! Our own, as it runs in every control step of a rig and must not be able to panic; the crate `cobs` checks it in the
//! tests. For packets shorter than 254 bytes, which all of ours are: the special case of longer blocks is left out.

/// Longest run without a zero that a code byte can tell of.
const MAX_BLOCK: usize = 253;

/// Codes a packet into the buffer and returns the bytes used; `None` where the buffer is too short.
pub(crate) fn encode(packet: &[u8], buffer: &mut [u8]) -> Option<usize> {
    let mut end = 0;
    for block in packet.split(|&byte| byte == 0) {
        let code = u8::try_from(block.len() + 1).ok()?;
        *buffer.get_mut(end)? = code;
        end += 1;
        buffer
            .get_mut(end..end + block.len())?
            .copy_from_slice(block);
        end += block.len();
    }
    Some(end)
}

/// Decodes in place and returns the packet; `None` where this is no code.
pub(crate) fn decode(coded: &mut [u8]) -> Option<&[u8]> {
    let (mut from, mut to) = (0, 0);
    while let Some(&code) = coded.get(from) {
        // What is written never overtakes what is read: the packet is shorter by the first code byte.
        let block = usize::from(code).checked_sub(1)?;
        if block > MAX_BLOCK {
            return None;
        }
        from += 1;
        coded.get(from..from + block)?;
        for i in 0..block {
            *coded.get_mut(to + i)? = *coded.get(from + i)?;
        }
        (from, to) = (from + block, to + block);
        if from < coded.len() {
            *coded.get_mut(to)? = 0;
            to += 1;
        }
    }
    coded.get(..to)
}

#[cfg(test)]
mod tests {
    use super::{decode, encode};
    use proptest::prelude::*;

    proptest! {
        /// The crate `cobs`, of which ours is a part.
        #[test]
        fn as_the_crate_of_the_same_name(packet in prop::collection::vec(prop_oneof![Just(0), any::<u8>()], 1..120)) {
            let (mut ours, mut theirs) = ([0; 128], [0; 128]);
            let len = encode(&packet, &mut ours);
            prop_assert_eq!(len, Some(cobs::encode(&packet, &mut theirs)));
            prop_assert_eq!(ours, theirs);
            let decoded = len.and_then(|len| decode(&mut ours[..len]));
            prop_assert_eq!(decoded, Some(packet.as_slice()));
        }

        #[test]
        fn the_same_packets_from_any_bytes(bytes in prop::collection::vec(prop_oneof![1..6_u8, 1..=255_u8], 1..90)) {
            let (mut ours, mut theirs) = (bytes.clone(), bytes.clone());
            let decoded = decode(&mut ours).map(<[u8]>::to_vec);
            let expected = cobs::decode_in_place(&mut theirs).ok();
            // 255 stands for a block of 254 bytes, which is longer than any frame of ours.
            prop_assert_eq!(decoded, expected.map(|len| theirs[..len].to_vec()));
        }

        #[test]
        fn a_short_buffer_is_none(packet in prop::collection::vec(any::<u8>(), 0..60), size in 0..60_usize) {
            let mut buffer = [0; 64];
            let size = size.min(packet.len());
            prop_assert_eq!(encode(&packet, &mut buffer[..size]), None);
        }
    }
}
