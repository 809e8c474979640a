//! The loop.

use furuta_wire::{Hello, MAX_FRAME, Message, RigEnd, Sample, encode};

use crate::board::{Board, Clock};
use crate::outbox::Outbox;
use crate::pilot::Pilot;

/// How long emulated mechanics wait for a host, us: long against what a busy computer does to a process, short against
/// the silence after which a host gives up (0.5 s).
const PATIENCE_US: u64 = 200_000;

/// A rig that is switched on.
#[derive(Debug)]
pub struct Server<B, P> {
    board: B,
    pilot: P,
    end: RigEnd,
    outbox: Outbox,
    period_us: u64,
    due_us: u64,
    /// The rig's clock as the samples show it, us.
    t_us: u64,
    answered: bool,
    decided: Option<f32>,
}

impl<B: Board, P: Pilot> Server<B, P> {
    /// Begins to tick now, the motor off.
    pub fn new(mut board: B, pilot: P, hello: Hello) -> Self {
        board.drive(0.0);
        let now_us = board.now_us();
        Self {
            board,
            pilot,
            end: RigEnd::new(hello),
            outbox: Outbox::new(),
            period_us: u64::from(hello.period_us),
            due_us: now_us,
            t_us: 0,
            answered: false,
            decided: None,
        }
    }

    /// The board.
    pub fn board(&mut self) -> &mut B {
        &mut self.board
    }

    /// Who decides.
    pub fn pilot(&mut self) -> &mut P {
        &mut self.pilot
    }

    /// Listens, answers, sends; and ticks if it is time to. Returns the sample of the tick.
    pub fn poll(&mut self) -> Option<Sample> {
        while let Some(byte) = self.board.read() {
            self.end.receive(byte);
        }
        if let Some(hello) = self.end.hello() {
            self.say(&Message::Hello(hello));
        }
        self.send();
        let now_us = self.board.now_us();
        if !self.is_due(now_us) {
            self.board.idle();
            return None;
        }
        let sample = self.tick(now_us);
        self.send();
        Some(sample)
    }

    fn is_due(&self, now_us: u64) -> bool {
        let waits = B::CLOCK == Clock::Emulated
            && self.decided.is_none()
            && self.answered
            && !self.end.is_answered()
            && now_us < self.due_us + PATIENCE_US;
        now_us >= self.due_us && !waits
    }

    fn tick(&mut self, now_us: u64) -> Sample {
        self.answered = self.end.is_answered();
        if let Some(volts) = self.decided {
            // Overrules what a host may have said meanwhile.
            self.end.command(volts);
        }
        if B::CLOCK == Clock::Real {
            self.t_us = now_us;
        }
        let (theta, alpha) = self.board.counts();
        let sample = self.end.tick(self.t_us, theta, alpha);
        self.board.drive(sample.volts);
        self.board.alive();
        self.say(&Message::Sample(sample));
        self.decided = self.pilot.decide(&sample);
        self.due_us = match B::CLOCK {
            // After a gap (a debugger's halt) the ticks go on from now: they do not catch up.
            Clock::Real if now_us > self.due_us + 2 * self.period_us => now_us + self.period_us,
            Clock::Real => self.due_us + self.period_us,
            // Two ticks in a row would leave the host no time to answer.
            Clock::Emulated => (self.due_us + self.period_us).max(now_us + self.period_us / 2),
        };
        self.t_us += self.period_us;
        sample
    }

    fn say(&mut self, message: &Message) {
        let mut buffer = [0; MAX_FRAME];
        if let Ok(frame) = encode(message, &mut buffer) {
            self.outbox.put(frame);
        }
    }

    fn send(&mut self) {
        let board = &mut self.board;
        self.outbox.send(|byte| board.write(byte));
    }
}
