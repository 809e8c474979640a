//! The rig's end of the wire: a host leads. Its serial line is QEMU's.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    use mps2::{Mps2, say, semihosting::process, the_rig};
    let mechanics = match the_rig::TheRig::new().and_then(|rig| rig.mechanics()) {
        Ok(mechanics) => mechanics,
        Err(error) => {
            say!("{error}");
            process::exit(1)
        }
    };
    let mut server = rig::Server::new(Mps2::new(mechanics), rig::HostLed, the_rig::hello());
    loop {
        server.poll();
    }
}

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("this program is for the board: cargo run --release --target thumbv7em-none-eabihf");
}
