//! The control loop on the chip: swings up and balances, without a host; a host may listen on the serial line. Prints
//! what happens.
#![cfg_attr(target_os = "none", no_std, no_main)]

/// Length of the run, s.
#[cfg(target_os = "none")]
const SECONDS: u32 = 10;

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    use furuta_ctrl::supervisor::{Mode, Request};
    use mps2::{Mps2, measure::StackMark, say, semihosting::process, the_rig};
    use rig::{OnChip, Server};

    let stack = StackMark::set();
    let designed = the_rig::TheRig::new().and_then(|rig| Ok((rig.mechanics()?, rig.supervisor()?)));
    let (mechanics, supervisor) = match designed {
        Ok(both) => both,
        Err(error) => {
            say!("no control system for this rig: {error}");
            process::exit(1)
        }
    };
    let design = stack.used();
    let hello = the_rig::hello();
    let mut server = Server::new(Mps2::new(mechanics), OnChip::new(supervisor, &hello), hello);
    server.pilot().request(Request::Start);
    let mut mode = Mode::Idle;
    let mut balanced_since = None;
    loop {
        let Some(sample) = server.poll() else {
            continue;
        };
        let now = server.pilot().mode();
        if now != mode {
            say!(
                "{:.3} s: {}",
                f64::from(sample.seq) * 1e-6 * f64::from(the_rig::PERIOD_US),
                now.name()
            );
            balanced_since = (now == Mode::Balance).then_some(sample.seq);
            mode = now;
        }
        if sample.seq >= SECONDS * 1_000_000 / the_rig::PERIOD_US {
            let x = server.board().mechanics().state();
            say!(
                "after {SECONDS} s: theta {:.3} rad, alpha {:.3} rad",
                x.theta,
                furuta_ctrl::wrap(x.alpha)
            );
            say!(
                "stack: {} bytes at most, {design} in the design",
                stack.used()
            );
            let held = balanced_since.map(|since| sample.seq - since);
            // Up for at least half of the time.
            process::exit(i32::from(held.is_none_or(|held| held < sample.seq / 2)))
        }
    }
}

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!(
        "this program is for the board: cargo run --release --target thumbv7em-none-eabihf --bin on_chip"
    );
}
