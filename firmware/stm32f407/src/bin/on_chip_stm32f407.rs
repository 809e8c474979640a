//! The control loop on the chip. The button starts and stops it; a host may listen on the serial line.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    use furuta_ctrl::supervisor::{Mode, Request};
    use rig::{OnChip, Server, the_rig};

    // Takes a second or so: the design computes in double precision, in software.
    let designed = the_rig::TheRig::new().and_then(|rig| rig.supervisor());
    if let (Some((mut board, button)), Ok(supervisor)) = (stm32f407::start(), designed) {
        board.start_watchdog();
        let hello = the_rig::hello();
        let mut server = Server::new(board, OnChip::new(supervisor, &hello), hello);
        let (mut pressed, mut pressed_for) = (false, 0_u32);
        loop {
            if server.poll().is_none() {
                continue;
            }
            // 20 ms in the same position: contacts bounce.
            let now = button.is_high();
            pressed_for = if now == pressed { 0 } else { pressed_for + 1 };
            if pressed_for >= 20_000 / the_rig::PERIOD_US {
                (pressed, pressed_for) = (now, 0);
                if pressed {
                    let pilot = server.pilot();
                    pilot.request(match pilot.mode() {
                        Mode::Idle => Request::Start,
                        Mode::Fault => Request::Reset,
                        Mode::SwingUp | Mode::Balance | Mode::Stopping | Mode::Braking => {
                            Request::Stop
                        }
                    });
                }
            }
        }
    }
    // No clocks, or no control system for this rig: the motor's driver has never been enabled.
    loop {
        cortex_m::asm::wfi();
    }
}

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("this program is for the board: see docs/firmware.md");
}
