//! Bytes on their way to the host.

/// Two samples and a hello fit.
const CAPACITY: usize = 256;

/// A ring of bytes. A frame that does not fit is left out whole, as on a line that loses it: the host counts it.
#[derive(Debug)]
pub(crate) struct Outbox {
    bytes: [u8; CAPACITY],
    first: usize,
    len: usize,
}

impl Outbox {
    pub(crate) const fn new() -> Self {
        Self {
            bytes: [0; CAPACITY],
            first: 0,
            len: 0,
        }
    }

    pub(crate) fn put(&mut self, frame: &[u8]) {
        if frame.len() > CAPACITY - self.len {
            return;
        }
        for &byte in frame {
            let end = (self.first + self.len) % CAPACITY;
            if let Some(slot) = self.bytes.get_mut(end) {
                *slot = byte;
                self.len += 1;
            }
        }
    }

    /// Hands bytes over as long as they are taken.
    pub(crate) fn send(&mut self, mut take: impl FnMut(u8) -> bool) {
        while self.len > 0 {
            let byte = self.bytes.get(self.first).copied().unwrap_or_default();
            if !take(byte) {
                return;
            }
            self.first = (self.first + 1) % CAPACITY;
            self.len -= 1;
        }
    }
}
