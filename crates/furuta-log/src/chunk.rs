//! Chunks: unpacked as far as they say they are, and never further.

use std::io::Read;

use mcap::records::ChunkHeader;

/// Opcode and length of a record.
const HEAD: usize = 9;

/// Unpacks a chunk into `into`, whose old content is dropped.
///
/// # Errors
/// In words: what is wrong with it.
pub(crate) fn unpack(
    header: &ChunkHeader,
    data: &[u8],
    limit: usize,
    into: &mut Vec<u8>,
) -> Result<(), String> {
    into.clear();
    let size = header.uncompressed_size;
    if size > limit as u64 {
        return Err(format!(
            "a chunk of {size} bytes; at most {limit} are unpacked"
        ));
    }
    match header.compression.as_str() {
        "" => into.extend_from_slice(data),
        "lz4" => {
            let unpacked = lz4::Decoder::new(data)
                .and_then(|decoder| decoder.take(size + 1).read_to_end(into));
            unpacked.map_err(|e| format!("a chunk cannot be unpacked: {e}"))?;
        }
        other => {
            let other = furuta_input::quoted(other);
            return Err(format!(
                "a chunk is compressed by `{other}`; lz4 or nothing is understood"
            ));
        }
    }
    if into.len() as u64 != size {
        return Err(format!(
            "a chunk is not of the {size} bytes that it declares"
        ));
    }
    let saved = header.uncompressed_crc;
    if saved != 0 && crc32fast::hash(into) != saved {
        return Err("the checksum of a chunk is wrong".to_owned());
    }
    Ok(())
}

/// The records of an unpacked chunk, opcode and content; `None` where one is longer than the chunk.
pub(crate) fn records(mut chunk: &[u8]) -> impl Iterator<Item = Option<(u8, &[u8])>> {
    core::iter::from_fn(move || {
        if chunk.is_empty() {
            return None;
        }
        let record = chunk.split_first_chunk::<HEAD>().and_then(|(head, rest)| {
            let [opcode, length @ ..] = *head;
            let length = usize::try_from(u64::from_le_bytes(length)).ok()?;
            let (data, rest) = rest.split_at_checked(length)?;
            chunk = rest;
            Some((opcode, data))
        });
        if record.is_none() {
            chunk = &[];
        }
        Some(record)
    })
}
