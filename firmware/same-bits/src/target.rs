//! The start on the microcontroller. There is no allocator: the program would not link if the model allocated.

use core::fmt;
use cortex_m_rt::{ExceptionFrame, entry, exception};
use semihosting::io::{self, Write as _};
use semihosting::process;

struct Console(io::Stdout);

impl fmt::Write for Console {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.0.write_all(text.as_bytes()).map_err(|_| fmt::Error)
    }
}

#[entry]
fn main() -> ! {
    let printed = io::stdout().map(|out| same_bits::print(&mut Console(out)));
    match printed {
        Ok(Ok(())) => process::exit(0),
        _ => process::exit(1),
    }
}

#[panic_handler]
fn panic(info: &core::panic::PanicInfo<'_>) -> ! {
    semihosting::println!("{info}");
    process::exit(101)
}

// A stack overflow or a stray address ends the run instead of looping for ever. The runtime wants an `unsafe fn`; its
// body is safe.
#[allow(unsafe_code)]
#[exception]
unsafe fn HardFault(_: &ExceptionFrame) -> ! {
    process::exit(2)
}
