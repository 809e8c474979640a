//! The attachments of an MCAP file: skipped by who reads the log, copied by who wants one. They may be as large as they
//! like.

use std::io::{self, Read, Write};

const ATTACHMENT: u8 = 0x09;
const FOOTER: u8 = 0x02;
/// Opcode and length of a record.
const HEAD: usize = 9;

/// The records of an MCAP file, from behind its magic bytes on, without the attachments.
pub(crate) struct WithoutAttachments<R> {
    input: R,
    head: [u8; HEAD],
    /// Bytes of `head` that are read, and those of them that are handed on.
    held: usize,
    given: usize,
    /// Bytes of the present record that are still to be handed on.
    left: u64,
}

impl<R: Read> WithoutAttachments<R> {
    pub(crate) const fn new(input: R) -> Self {
        Self {
            input,
            head: [0; HEAD],
            held: 0,
            given: 0,
            left: 0,
        }
    }

    /// Reads the head of the next record that is no attachment.
    fn advance(&mut self) -> io::Result<()> {
        loop {
            self.given = 0;
            self.held = fill(&mut self.input, &mut self.head)?;
            if self.held < HEAD {
                return Ok(());
            }
            let (opcode, length) = parts(self.head);
            match opcode {
                ATTACHMENT => skip(&mut self.input, length)?,
                // Behind the footer come the magic bytes, and no record any more.
                FOOTER => {
                    self.left = u64::MAX;
                    return Ok(());
                }
                _ => {
                    self.left = length;
                    return Ok(());
                }
            }
        }
    }
}

impl<R: Read> Read for WithoutAttachments<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        if self.given == self.held && self.left == 0 {
            self.advance()?;
        }
        let head = self.head.get(self.given..self.held).unwrap_or_default();
        if !head.is_empty() {
            let n = head.len().min(into.len());
            for (to, from) in into.iter_mut().zip(head) {
                *to = *from;
            }
            self.given += n;
            return Ok(n);
        }
        let most = usize::try_from(self.left).unwrap_or(usize::MAX);
        let n = into.len().min(most);
        let got = self.input.read(into.get_mut(..n).unwrap_or_default())?;
        self.left -= got as u64;
        Ok(got)
    }
}

/// Copies the attachment of this name. Whether there is one, whole and undamaged, is known only at its end: `false`
/// says that what was
/// copied is of no use.
///
/// # Errors
/// The reader's and the writer's.
pub fn copy_attachment(mut input: impl Read, name: &str, mut out: impl Write) -> io::Result<bool> {
    skip(&mut input, mcap::MAGIC.len() as u64)?;
    let mut head = [0; HEAD];
    while fill(&mut input, &mut head)? == HEAD {
        let (opcode, length) = parts(head);
        if opcode != ATTACHMENT {
            skip(&mut input, length)?;
            continue;
        }
        let mut record = Checked {
            input: input.by_ref().take(length),
            crc: crc32fast::Hasher::new(),
        };
        // Two times, then the name and the kind of content.
        record.skip(16)?;
        let found = record.text(name.len() as u64)?;
        if found.as_deref() == Some(name.as_bytes()) && record.text(256)?.is_some() {
            let size = record.number::<8>()?.map_or(0, u64::from_le_bytes);
            let mut data = record.by_ref().take(size);
            let whole = io::copy(&mut data, &mut out)? == size;
            let crc = record.crc.clone().finalize();
            let saved = record.number::<4>()?.map(u32::from_le_bytes);
            return Ok(whole && (saved == Some(crc) || saved == Some(0)));
        }
        let rest = record.input.limit();
        skip(&mut input, rest)?;
    }
    Ok(false)
}

/// A record with the checksum of what was read of it.
struct Checked<R> {
    input: R,
    crc: crc32fast::Hasher,
}

impl<R: Read> Read for Checked<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let got = self.input.read(into)?;
        self.crc.update(into.get(..got).unwrap_or_default());
        Ok(got)
    }
}

impl<R: Read> Checked<R> {
    fn skip(&mut self, bytes: u64) -> io::Result<()> {
        skip(self, bytes)
    }

    fn number<const N: usize>(&mut self) -> io::Result<Option<[u8; N]>> {
        let mut bytes = [0; N];
        Ok((fill(self, &mut bytes)? == N).then_some(bytes))
    }

    /// A text with its length before it, unless it is longer than `most` bytes.
    fn text(&mut self, most: u64) -> io::Result<Option<Vec<u8>>> {
        let length = self.number::<4>()?.map(u32::from_le_bytes);
        let Some(length) = length.map(u64::from).filter(|length| *length <= most) else {
            return Ok(None);
        };
        let mut text = Vec::new();
        let read = self.by_ref().take(length).read_to_end(&mut text)?;
        Ok((read as u64 == length).then_some(text))
    }
}

fn parts(head: [u8; HEAD]) -> (u8, u64) {
    let [opcode, length @ ..] = head;
    (opcode, u64::from_le_bytes(length))
}

/// Reads until the buffer is full or the input ends.
fn fill(input: &mut impl Read, into: &mut [u8]) -> io::Result<usize> {
    let mut held = 0;
    while let Some(rest) = into.get_mut(held..).filter(|rest| !rest.is_empty()) {
        match input.read(rest) {
            Ok(0) => break,
            Ok(got) => held += got,
            Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
            Err(e) => return Err(e),
        }
    }
    Ok(held)
}

fn skip(input: &mut impl Read, bytes: u64) -> io::Result<()> {
    io::copy(&mut input.take(bytes), &mut io::sink()).map(drop)
}
