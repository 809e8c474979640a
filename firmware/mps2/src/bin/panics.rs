//! Drives the motor, then panics: shows that the motor is off afterwards. For the test of just that.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    use mps2::{Mps2, motor_is_on, say, semihosting::process, the_rig};
    use rig::Board;
    let Ok(mechanics) = the_rig::TheRig::new().and_then(|rig| rig.mechanics()) else {
        process::exit(1)
    };
    let mut board = Mps2::new(mechanics);
    board.drive(3.0);
    say!("motor {}", if motor_is_on() { "on" } else { "OFF" });
    panic!("meant")
}

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("this program is for the board");
}
