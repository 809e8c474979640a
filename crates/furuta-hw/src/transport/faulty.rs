//! A wire with faults, around any other transport: for tests of what a run survives.

use std::time::{Duration, Instant};

use super::{Transport, TransportError};

/// Bytes that one read hands on, before doubling.
const LATE: usize = 128;

/// How often what goes through is damaged: probabilities.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct FaultRates {
    /// Whole frame lost, per frame.
    pub frame_lost: f64,
    /// What has arrived comes only with the next that arrives, per read.
    pub delayed: f64,
    /// Byte lost, per byte; the next two are, too.
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
    frames_lost: u64,
    /// Whether the frame that is arriving is one to be lost; `None` between frames.
    losing: Option<bool>,
    /// Arrived, and held back.
    late: arrayvec::ArrayVec<u8, LATE>,
}

impl<T> FaultyTransport<T> {
    /// Damages what goes through `inner`.
    pub fn new(inner: T, rates: FaultRates, seed: u64) -> Self {
        Self {
            inner,
            rates,
            // Spread, or small seeds would give small numbers at first.
            random: seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1,
            damaged: 0,
            frames_lost: 0,
            losing: None,
            late: arrayvec::ArrayVec::new(),
        }
    }

    /// What the faults are from now on.
    pub fn set_rates(&mut self, rates: FaultRates) {
        self.rates = rates;
    }

    /// The transport behind the faults.
    pub fn inner(&mut self) -> &mut T {
        &mut self.inner
    }

    /// Frames lost whole so far.
    pub fn frames_lost(&self) -> u64 {
        self.frames_lost
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
            ..
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

impl<T> FaultyTransport<T> {
    fn loses_frame(&mut self) -> bool {
        let loses = self.uniform() < self.rates.frame_lost;
        self.frames_lost += u64::from(loses);
        loses
    }

    /// Whether this byte belongs to a frame that is lost.
    fn is_of_lost_frame(&mut self, byte: u8) -> bool {
        let losing = match self.losing {
            Some(losing) => losing,
            None => self.loses_frame(),
        };
        self.losing = (byte != 0).then_some(losing);
        losing
    }
}

impl<T: Transport> Transport for FaultyTransport<T> {
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, TransportError> {
        // Room for every byte to be doubled, and for what is late.
        let mut raw = [0; LATE / 2];
        let size = raw.len().min(buffer.len() / 4);
        let n = self
            .inner
            .read(raw.get_mut(..size).unwrap_or_default(), timeout)?;
        let hold = n > 0 && self.late.is_empty() && self.uniform() < self.rates.delayed;
        let raw: arrayvec::ArrayVec<u8, LATE> = if hold {
            self.late = raw.iter().take(n.min(LATE)).copied().collect();
            return Ok(0);
        } else {
            let late = std::mem::take(&mut self.late);
            late.into_iter()
                .chain(raw.into_iter().take(n))
                .take(LATE)
                .collect()
        };
        let mut filled = 0;
        for &byte in &raw {
            if self.is_of_lost_frame(byte) {
                continue;
            }
            self.pass(byte, |byte| {
                if let Some(slot) = buffer.get_mut(filled) {
                    *slot = byte;
                    filled += 1;
                }
            });
        }
        Ok(filled)
    }

    /// Each call is a frame.
    fn write(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        if self.loses_frame() {
            return Ok(());
        }
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

    fn now(&self) -> Instant {
        self.inner.now()
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

        fn now(&self) -> Instant {
            Instant::now()
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
    fn frames_are_lost_whole_and_late_ones_come_in_order() {
        let rates = FaultRates {
            frame_lost: 0.1,
            delayed: 0.2,
            ..FaultRates::default()
        };
        let mut wire = FaultyTransport::new(Loopback::default(), rates, 3);
        let (mut got, mut buffer, mut sent_on) = (Vec::new(), [0; 300], 0);
        for k in 0..10_000_u16 {
            let before = wire.frames_lost();
            let (high, low) = ((k / 200) as u8 + 1, (k % 200) as u8 + 1);
            wire.write(&[1, low, high, 0]).expect("loopback");
            sent_on += u64::from(wire.frames_lost() == before);
            let n = wire.read(&mut buffer, Duration::ZERO).expect("loopback");
            got.extend_from_slice(&buffer[..n]);
        }
        wire.set_rates(FaultRates::default());
        let n = wire.read(&mut buffer, Duration::ZERO).expect("loopback");
        got.extend_from_slice(&buffer[..n]);
        assert_eq!(got.len() % 4, 0);
        let numbers: Vec<_> = got.chunks(4).map(|f| (f[2], f[1])).collect();
        assert!(numbers.is_sorted());
        // One in ten each way: 8100 +- 39 arrive; five deviations.
        assert!((7905..8295).contains(&numbers.len()) && (8850..9150).contains(&sent_on));
        assert_eq!(numbers.len() as u64 + wire.frames_lost(), 10_000);
    }

    #[test]
    fn faults_come_as_often_as_asked() {
        let n = 100_000;
        assert_eq!(through(FaultRates::default(), n), (vec![0; n], 0));
        let (got, damaged) = through(
            FaultRates {
                lost: 0.01,
                flipped: 0.02,
                ..FaultRates::default()
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
