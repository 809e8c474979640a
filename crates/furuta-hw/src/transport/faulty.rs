//! A wire with faults, around any other transport: for tests of what a run survives.

use std::time::Duration;

use super::{Transport, TransportError};

/// How often bytes are damaged, each a probability per byte.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct FaultRates {
    /// Byte lost.
    pub lost: f64,
    /// One bit flipped.
    pub flipped: f64,
    /// Byte sent twice.
    pub doubled: f64,
}

/// A transport that damages what goes through it in both directions; the same way every time for the same seed.
#[derive(Debug)]
pub struct FaultyTransport<T> {
    inner: T,
    rates: FaultRates,
    random: u64,
    damaged: u64,
}

impl<T> FaultyTransport<T> {
    /// Damages what goes through `inner`.
    pub fn new(inner: T, rates: FaultRates, seed: u64) -> Self {
        Self {
            inner,
            rates,
            random: seed | 1,
            damaged: 0,
        }
    }

    /// Bytes damaged so far.
    pub fn damaged(&self) -> u64 {
        self.damaged
    }

    /// Uniform in [0, 1): xorshift64 of G. Marsaglia (J. Stat. Softw. 8 (2003) 14).
    fn uniform(&mut self) -> f64 {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 7;
        self.random ^= self.random << 17;
        (self.random >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Passes a byte on 0, 1 or 2 times, perhaps altered.
    fn pass(&mut self, byte: u8, mut to: impl FnMut(u8)) {
        let FaultRates {
            lost,
            flipped,
            doubled,
        } = self.rates;
        let dice = self.uniform();
        self.damaged += u64::from(dice < lost + flipped + doubled);
        if dice < lost {
            return;
        }
        if dice < lost + flipped {
            let bit = (self.uniform() * 8.0) as u8;
            return to(byte ^ (1 << (bit & 7)));
        }
        if dice < lost + flipped + doubled {
            to(byte);
        }
        to(byte);
    }
}

impl<T: Transport> Transport for FaultyTransport<T> {
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, TransportError> {
        // Room for every byte to be doubled.
        let mut raw = [0; 128];
        let room = raw.len().min(buffer.len() / 2);
        let n = self
            .inner
            .read(raw.get_mut(..room).unwrap_or_default(), timeout)?;
        let mut filled = 0;
        for &byte in raw.iter().take(n) {
            self.pass(byte, |byte| {
                if let Some(slot) = buffer.get_mut(filled) {
                    *slot = byte;
                    filled += 1;
                }
            });
        }
        Ok(filled)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        let mut damaged = arrayvec::ArrayVec::<u8, 256>::new();
        for chunk in bytes.chunks(128) {
            damaged.clear();
            for &byte in chunk {
                self.pass(byte, |byte| {
                    // 128 bytes doubled fit.
                    let _ = damaged.try_push(byte);
                });
            }
            self.inner.write(&damaged)?;
        }
        Ok(())
    }

    fn discard_input(&mut self) -> Result<(), TransportError> {
        self.inner.discard_input()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Default)]
    struct Loopback(Vec<u8>);

    impl Transport for Loopback {
        fn read(&mut self, buffer: &mut [u8], _: Duration) -> Result<usize, TransportError> {
            let n = buffer.len().min(self.0.len());
            buffer[..n].copy_from_slice(&self.0[..n]);
            self.0.drain(..n);
            Ok(n)
        }

        fn write(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
            self.0.extend(bytes);
            Ok(())
        }

        fn discard_input(&mut self) -> Result<(), TransportError> {
            self.0.clear();
            Ok(())
        }
    }

    fn through(rates: FaultRates, bytes: usize) -> (Vec<u8>, u64) {
        let mut wire = FaultyTransport::new(Loopback::default(), rates, 7);
        wire.write(&vec![0; bytes]).expect("loopback");
        let damaged = wire.damaged();
        wire.rates = FaultRates::default(); // damage on the way out only
        let (mut got, mut buffer) = (Vec::new(), [0; 300]);
        loop {
            match wire.read(&mut buffer, Duration::ZERO).expect("loopback") {
                0 => return (got, damaged),
                n => got.extend_from_slice(&buffer[..n]),
            }
        }
    }

    #[test]
    fn faults_come_as_often_as_asked() {
        let n = 100_000;
        assert_eq!(through(FaultRates::default(), n), (vec![0; n], 0));
        let (got, damaged) = through(
            FaultRates {
                lost: 0.01,
                flipped: 0.02,
                doubled: 0.0,
            },
            n,
        );
        let flipped = got.iter().filter(|&&b| b != 0).count();
        // Binomial: 1000 +- 31 and 2000 +- 44; five deviations.
        assert!((845..=1155).contains(&(n - got.len())) && (1780..=2220).contains(&flipped));
        assert_eq!(damaged as usize, n - got.len() + flipped);
        let (got, _) = through(
            FaultRates {
                doubled: 0.01,
                ..FaultRates::default()
            },
            n,
        );
        assert!((845..=1155).contains(&(got.len() - n)));
    }
}
