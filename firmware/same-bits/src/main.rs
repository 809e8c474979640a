//! Prints the lines of [`same_bits::print`], on a host and on the target.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod target;

#[cfg(not(target_os = "none"))]
fn main() -> std::process::ExitCode {
    let mut lines = String::new();
    if same_bits::print(&mut lines).is_err() {
        return std::process::ExitCode::FAILURE;
    }
    print!("{lines}");
    std::process::ExitCode::SUCCESS
}
