//! What the tests share: random messages and ways to damage a frame, the same every time.
#![allow(dead_code)] // each test file uses a part

pub(crate) mod compiled;

use furuta_wire::{
    ArmCounts, Command, Hello, MAX_FRAME, Message, PROTOCOL_VERSION, PendulumCounts, Query,
    RigLimits, RigName, Sample, Status, encode,
};

/// xorshift64 of G. Marsaglia (J. Stat. Softw. 8 (2003) 14).
#[derive(Clone, Debug)]
pub(crate) struct Xorshift(u64);

impl Xorshift {
    pub(crate) fn new(seed: u64) -> Self {
        // Small seeds give small numbers at first.
        let mut random = Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
        for _ in 0..8 {
            random.next();
        }
        random
    }

    pub(crate) fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    /// Uniform in 0..n.
    pub(crate) fn below(&mut self, n: usize) -> usize {
        (((self.next() >> 32) * n as u64) >> 32) as usize
    }

    /// Uniform in [0, 1).
    pub(crate) fn uniform(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Numbers of every size alike: real messages hold small ones too.
    fn of_any_size(&mut self) -> u64 {
        let shift = self.below(64);
        self.next() >> shift
    }

    /// Damages a frame in one to four places, as lines, cables and buffers do.
    pub(crate) fn mutate(&mut self, bytes: &mut Vec<u8>) {
        for _ in 0..=self.below(4) {
            let i = self.below(bytes.len().max(1));
            match self.below(7) {
                0 if i < bytes.len() => drop(bytes.remove(i)),
                1 if i < bytes.len() => bytes.insert(i, bytes[i]),
                2 => bytes.insert(i, self.next() as u8),
                3 if i < bytes.len() => bytes[i] = self.next() as u8,
                4 if i < bytes.len() => {
                    let j = self.below(bytes.len());
                    bytes.swap(i, j);
                }
                5 => bytes.truncate(i),
                _ if i < bytes.len() => bytes[i] ^= 1 << self.below(8),
                _ => {}
            }
        }
    }
}

pub(crate) fn any_message(random: &mut Xorshift) -> Message {
    let volts = |random: &mut Xorshift| f32::from_bits(random.next() as u32);
    match random.below(8) {
        0 => Message::Query(Query {
            version: PROTOCOL_VERSION,
        }),
        1 => {
            let limit = |random: &mut Xorshift| (random.below(2) == 0).then(|| volts(random));
            let name: String = (0..1 + random.below(32))
                .map(|_| char::from(b'a' + random.below(26) as u8))
                .collect();
            Message::Hello(Hello {
                version: PROTOCOL_VERSION,
                rig: RigName::from(&name).expect("32 bytes at most"),
                period_us: random.of_any_size() as u32,
                arm_counts_per_rev: f64::from_bits(random.next()),
                pendulum_counts_per_rev: f64::from_bits(random.next()),
                command_limit: volts(random),
                limits: RigLimits {
                    arm_angle: limit(random),
                    arm_speed: limit(random),
                    pendulum_speed: limit(random),
                },
                watchdog_periods: random.of_any_size() as u16,
                actuation: random.of_any_size() as u8,
            })
        }
        2..5 => Message::Command(Command {
            seq: random.of_any_size() as u32,
            volts: volts(random),
        }),
        _ => Message::Sample(Sample {
            seq: random.of_any_size() as u32,
            t_us: random.of_any_size(),
            theta: ArmCounts(random.of_any_size() as i32),
            alpha: PendulumCounts((random.of_any_size() as i32).wrapping_neg()),
            volts: volts(random),
            status: Status::from_bits(random.next() as u8),
        }),
    }
}

pub(crate) fn frame(message: &Message) -> Vec<u8> {
    let mut buffer = [0; MAX_FRAME];
    encode(message, &mut buffer)
        .expect("MAX_FRAME holds every message")
        .to_vec()
}
