//! The program `furuta`.

fn main() -> std::process::ExitCode {
    furuta_cli::main(std::env::args_os()).into()
}
