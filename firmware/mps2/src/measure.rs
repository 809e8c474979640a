//! What a computation costs: instructions and stack. Instructions need QEMU's `-icount`, under which time is the number
//! of instructions executed.

use crate::registers as r;

/// How far below the present stack pointer the stack is painted, bytes: for a control step, and for a program.
const STEP: usize = 32 * 1024;
const PROGRAM: usize = 256 * 1024;
/// What it is painted with.
const PAINT: u32 = 0xd00d_feed;

/// What something costs.
#[derive(Copy, Clone, Debug, Default)]
pub struct Cost {
    /// Instructions, on average.
    pub mean: u32,
    /// Instructions at most.
    pub max: u32,
    /// Bytes of stack at most.
    pub stack: usize,
    /// How often it was measured.
    pub calls: u32,
    total: u64,
}

impl Cost {
    /// Takes one more call into account.
    pub fn add(&mut self, call: &Call) {
        self.calls += 1;
        self.total += u64::from(call.instructions);
        self.mean = (self.total / u64::from(self.calls)) as u32;
        self.max = self.max.max(call.instructions);
        self.stack = self.stack.max(call.stack);
    }
}

/// One measured call.
#[derive(Copy, Clone, Debug)]
pub struct Call {
    /// Instructions.
    pub instructions: u32,
    /// Bytes of stack.
    pub stack: usize,
}

/// Measures calls.
#[derive(Debug)]
pub struct Meter {
    /// Ticks of the timer for 1,000 instructions.
    ticks_per_thousand: u32,
    /// What a call of nothing takes, ticks.
    overhead: u32,
}

impl Meter {
    /// Finds out how long an instruction is. `None` without `-icount`, when time has nothing to do with instructions.
    #[must_use]
    pub fn new() -> Option<Self> {
        r::TIMER0.reload.write(u32::MAX);
        r::TIMER0.value.write(u32::MAX);
        r::TIMER0.control.write(r::TIMER_ENABLE);
        // Two instructions for each two cycles asked for, and a few around them.
        let long = ticks(|| cortex_m::asm::delay(220_000));
        let again = ticks(|| cortex_m::asm::delay(220_000));
        let short = ticks(|| cortex_m::asm::delay(20_000));
        let mut meter = Self {
            ticks_per_thousand: (long.wrapping_sub(short)) / 200,
            overhead: 0,
        };
        meter.overhead = ticks(|| {});
        (long == again && meter.ticks_per_thousand >= 1000).then_some(meter)
    }

    /// Runs something and tells what it cost, and what it returned.
    pub fn measure<R>(&mut self, call: impl FnOnce() -> R) -> (Call, R) {
        let mut result = None;
        let painted = paint(STEP);
        let took = ticks(|| result = Some(core::hint::black_box(call())));
        let stack = used(painted);
        let instructions = u64::from(took.saturating_sub(self.overhead)) * 1000
            / u64::from(self.ticks_per_thousand);
        let call = Call {
            instructions: instructions as u32,
            stack,
        };
        match result {
            Some(result) => (call, result),
            None => semihosting::process::exit(1),
        }
    }
}

/// How far down the stack has reached since a mark was set.
#[derive(Copy, Clone, Debug)]
pub struct StackMark(Painted);

impl StackMark {
    /// Paints what lies below the stack in use.
    #[must_use]
    pub fn set() -> Self {
        Self(paint(PROGRAM))
    }

    /// Bytes below the mark that were used since.
    #[must_use]
    pub fn used(&self) -> usize {
        used(self.0)
    }
}

/// Ticks of the timer that something takes.
#[inline(never)]
fn ticks(call: impl FnOnce()) -> u32 {
    let begin = r::TIMER0.value.read();
    call();
    begin.wrapping_sub(r::TIMER0.value.read())
}

/// Addresses between which the stack was painted.
#[derive(Copy, Clone, Debug)]
struct Painted {
    start: usize,
    end: usize,
}

/// Paints what lies below the stack in use.
#[inline(never)]
#[allow(unsafe_code)]
fn paint(bytes: usize) -> Painted {
    // Room for this function's own frame and those that follow it before the call.
    let end = (cortex_m::register::msp::read() as usize & !3) - 64;
    let start = end - bytes;
    for address in (start..end).step_by(4) {
        // SAFETY: below the stack pointer, no value lives there; interrupts are masked, so nothing is put there
        // meanwhile. The board has 4 MB of RAM, the statics a few bytes.
        unsafe { core::ptr::with_exposed_provenance_mut::<u32>(address).write_volatile(PAINT) }
    }
    Painted { start, end }
}

/// Bytes below `end` that were written to since.
#[inline(never)]
#[allow(unsafe_code)]
fn used(painted: Painted) -> usize {
    let mut words = (painted.start..painted.end).step_by(4);
    let first = words.find(|&address| {
        // SAFETY: as in `paint`.
        unsafe { core::ptr::with_exposed_provenance::<u32>(address).read_volatile() != PAINT }
    });
    first.map_or(0, |first| painted.end - first)
}
