//! What must hold at both ends of the wire whatever comes over it: tried by the fuzzer, and on the corpus by `cargo
//! test -p furuta-hw`. The bytes are a script: each step is a byte and its arguments; what is missing at the end is
//! zeros.

use std::time::{Duration, Instant};

use furuta_hw::{
    Decision, EmulatedRig, Emulation, Link, LoopSettings, Measurement, Pilot, RecordSender,
    Transport, TransportError, run,
};
use furuta_log::Mode;
use furuta_model::{Rig, State};
use furuta_wire::{
    ArmCounts, Command, Decoder, Hello, MAX_FRAME, Message, PROTOCOL_VERSION, PendulumCounts,
    Query, Sample, Status, encode,
};

struct Script<'a>(&'a [u8]);

impl<'a> Script<'a> {
    fn byte(&mut self) -> u8 {
        self.take(1).first().copied().unwrap_or(0)
    }

    fn take(&mut self, n: usize) -> &'a [u8] {
        let (taken, rest) = self.0.split_at(n.min(self.0.len()));
        self.0 = rest;
        taken
    }

    fn word(&mut self) -> u32 {
        self.take(4)
            .iter()
            .fold(0, |word, &byte| word << 8 | u32::from(byte))
    }

    fn is_over(&self) -> bool {
        self.0.is_empty()
    }
}

fn framed(message: &Message) -> Vec<u8> {
    let mut buffer = [0; MAX_FRAME];
    match encode(message, &mut buffer) {
        Ok(frame) => frame.to_vec(),
        Err(error) => panic!("{error}"),
    }
}

fn qube() -> Rig {
    let Some(rig) = Rig::builtin("qube-servo-2") else {
        panic!("built in")
    };
    rig
}

/// Frames, noise, repeated and old commands, ticks and shoves into an emulated rig: its voltage is within the limit,
/// and its motor is off when no news has come for the watchdog's time.
pub(crate) fn rig(bytes: &[u8]) {
    let mut script = Script(bytes);
    let watchdog = u16::from(script.byte() % 20 + 1);
    let mut model = qube();
    if script.byte() % 2 == 1 {
        model.limits.arm_angle = Some(0.5);
    }
    let emulation = Emulation {
        watchdog_periods: watchdog,
        actuation: 0,
        ..Emulation::default()
    };
    let Ok(mut rig) = EmulatedRig::new(&model, &emulation) else {
        panic!("valid")
    };
    let limit = rig.settings().command_limit;
    // What a host's bytes mean, by a decoder of our own.
    let mut decoder = Decoder::new();
    let (mut obeyed, mut foreign, mut alive) = (None, false, false);
    let (mut ticks, mut silent) = (0_u32, u32::MAX);
    let mut last = Vec::new();
    while !script.is_over() {
        let said = match script.byte() % 8 {
            0 => {
                let n = usize::from(script.byte());
                script.take(n).to_vec()
            }
            1 => {
                let seq = ticks.wrapping_add_signed(i32::from(script.byte().cast_signed()));
                let volts = f32::from_bits(script.word());
                framed(&Message::Command(Command { seq, volts }))
            }
            2 => {
                let volts = f32::from(script.byte().cast_signed()) / 8.0;
                let seq = ticks.wrapping_sub(1);
                framed(&Message::Command(Command { seq, volts }))
            }
            3 => {
                let version = u16::from(script.byte() % 3);
                framed(&Message::Query(Query { version }))
            }
            4 => last.clone(),
            5 => {
                let seq = script.word();
                let volts = f32::from_bits(script.word());
                framed(&Message::Command(Command { seq, volts }))
            }
            6 => {
                let mut turn = || f64::from(script.byte().cast_signed()) / 16.0;
                rig.set_state(State::new(turn(), turn(), 4.0 * turn(), 4.0 * turn()));
                Vec::new()
            }
            _ => {
                let _ = rig.hello();
                Vec::new()
            }
        };
        rig.receive(&said);
        for &byte in &said {
            match decoder.push(byte) {
                Some(Ok(Message::Command(Command { seq, volts }))) if volts.is_finite() => {
                    let is_recent = seq < ticks && ticks - seq <= u32::from(watchdog);
                    if is_recent && obeyed.is_none_or(|last| seq > last) && !foreign {
                        (obeyed, alive) = (Some(seq), true);
                    }
                }
                Some(Ok(Message::Query(_))) => foreign = false,
                Some(Err(furuta_wire::FrameError::Version { .. })) => {
                    (foreign, alive, silent) = (true, false, u32::MAX);
                }
                _ => {}
            }
        }
        if !said.is_empty() {
            last = said;
        }
        for _ in 0..script.byte() % 16 {
            let sample = rig.tick();
            ticks += 1;
            silent = if std::mem::take(&mut alive) {
                0
            } else {
                silent.saturating_add(1)
            };
            assert!(sample.volts.abs() <= limit, "{sample:?}");
            if silent >= u32::from(watchdog) {
                assert_eq!(
                    sample.volts, 0.0,
                    "{sample:?} {silent} ticks after the last news"
                );
                assert!(sample.status.contains(Status::WATCHDOG | Status::HELD));
            }
        }
    }
}

/// A device that says what the script says; time passes at each read.
struct Device<'a> {
    script: Script<'a>,
    hello: Hello,
    sample: Sample,
    began: Instant,
    elapsed: Duration,
    decoder: Decoder,
    commands: Vec<Command>,
}

impl Device<'_> {
    fn say(&mut self) -> Vec<u8> {
        let step = Duration::from_micros(match self.script.byte() % 4 {
            0 => 100,
            1 | 2 => 2000,
            _ => 300 * u64::from(self.script.byte()),
        });
        self.elapsed += step;
        match self.script.byte() % 8 {
            0 => {
                let n = usize::from(self.script.byte() % 64);
                self.script.take(n).to_vec()
            }
            // A good sample, by the time that has passed.
            1..=3 => {
                self.sample.seq = self.sample.seq.wrapping_add(1);
                self.sample.t_us += 2000;
                framed(&Message::Sample(self.sample))
            }
            // The same again, or of another time or number.
            4 => framed(&Message::Sample(self.sample)),
            5 => {
                let seq = i32::from(self.script.byte().cast_signed());
                let t_us = i64::from(self.script.byte().cast_signed()) * 1000;
                self.sample.seq = self.sample.seq.wrapping_add_signed(seq);
                self.sample.t_us = self.sample.t_us.saturating_add_signed(t_us);
                framed(&Message::Sample(self.sample))
            }
            6 => {
                let wild = Sample {
                    seq: self.script.word(),
                    t_us: u64::from(self.script.word()) << (self.script.byte() % 33),
                    theta: ArmCounts(self.script.word().cast_signed()),
                    alpha: PendulumCounts(self.script.word().cast_signed()),
                    volts: f32::from_bits(self.script.word()),
                    status: Status::from_bits(self.script.byte()),
                };
                framed(&Message::Sample(wild))
            }
            _ => framed(&Message::Hello(self.hello)),
        }
    }
}

impl Transport for Device<'_> {
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, TransportError> {
        let said = if self.script.is_over() {
            self.elapsed += timeout.max(Duration::from_millis(1));
            Vec::new()
        } else {
            self.say()
        };
        let n = said.len().min(buffer.len());
        buffer[..n].copy_from_slice(&said[..n]);
        Ok(n)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        for message in bytes.iter().filter_map(|&byte| self.decoder.push(byte)) {
            if let Ok(Message::Command(command)) = message {
                self.commands.push(command);
            }
        }
        Ok(())
    }

    fn discard_input(&mut self) -> Result<(), TransportError> {
        Ok(())
    }

    fn now(&self) -> Instant {
        self.began + self.elapsed
    }
}

/// Answers every sample with 1 V.
struct OneVolt;

impl Pilot for OneVolt {
    type State = ();

    fn start(&self) {}

    fn process(&self, (): &mut (), _: &Measurement) -> Decision {
        Decision {
            volts: 1.0,
            theta_dot: 0.0,
            alpha_dot: 0.0,
            reference: 0.0,
            mode: Mode::Excite,
            fault: None,
        }
    }
}

/// Samples of any kind into a run: it ends in its time, each command answers a newer sample than the one before, and
/// the last word is 0 V.
pub(crate) fn host(bytes: &[u8]) {
    let model = qube();
    let Ok(emulated) = EmulatedRig::new(&model, &Emulation::default()) else {
        panic!("valid")
    };
    let hello = *emulated.settings();
    assert_eq!(hello.version, PROTOCOL_VERSION);
    let mut device = Device {
        script: Script(bytes),
        hello,
        sample: Sample {
            seq: 0,
            t_us: 0,
            theta: ArmCounts(0),
            alpha: PendulumCounts(0),
            volts: 0.0,
            status: Status::OK,
        },
        began: Instant::now(),
        elapsed: Duration::ZERO,
        decoder: Decoder::new(),
        commands: Vec::new(),
    };
    let duration = Duration::from_millis(500);
    let settings = LoopSettings {
        probe: Some(LoopSettings::PROBE),
        ..LoopSettings::new(&model, 0.002, duration)
    };
    let summary = run(
        &mut Link::new(&mut device),
        &hello,
        &OneVolt,
        &settings,
        &mut RecordSender::nowhere(),
    );
    // What one read may take, and what is read when the time is over.
    let longest = settings.clock.longest(duration) + 40 * Duration::from_micros(300 * 255);
    assert!(
        device.elapsed <= longest,
        "{:?} {:?}",
        device.elapsed,
        summary.end
    );
    let Some((answers, farewells)) = device.commands.split_last_chunk::<3>() else {
        panic!("0 V is said three times, {:?}", summary.end)
    };
    assert!(farewells.iter().all(|command| command.volts == 0.0));
    let limit = model.params.motor.command_limit as f32;
    assert!(answers.iter().all(|command| command.volts.abs() <= limit));
    for pair in answers.windows(2) {
        let ahead = pair[1].seq.wrapping_sub(pair[0].seq);
        assert!((1..=u32::MAX / 2).contains(&ahead), "{pair:?}");
    }
    assert_eq!(answers.len() as u64, summary.samples);
}
