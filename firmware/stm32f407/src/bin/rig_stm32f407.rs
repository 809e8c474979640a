//! The rig's end of the wire: a host leads.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    use rig::{HostLed, Server, the_rig};
    if let Some((mut board, _)) = stm32f407::start() {
        board.start_watchdog();
        let mut server = Server::new(board, HostLed, the_rig::hello());
        loop {
            server.poll();
        }
    }
    // The clocks did not start: the motor's driver has never been enabled.
    loop {
        cortex_m::asm::wfi();
    }
}

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("this program is for the board: see docs/firmware.md");
}
