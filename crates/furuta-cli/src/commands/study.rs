//! `furuta study`: experiments on controllers, the source papers' among them.

mod ramos_velasco;
mod shahzad2022;

use std::path::Path;
use std::time::Duration;

use furuta_design::chart::Chart;
use indicatif::{ProgressBar, ProgressStyle};

use crate::failure::Failure;

/// Repeat an experiment of a source paper, print its figures and draw it.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    #[command(subcommand)]
    study: Study,
}

#[derive(clap::Subcommand, Debug)]
enum Study {
    #[command(name = "shahzad2022")]
    Shahzad2022(shahzad2022::Args),
    RamosVelasco(ramos_velasco::Args),
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    match &args.study {
        Study::Shahzad2022(args) => shahzad2022::run(args),
        Study::RamosVelasco(args) => ramos_velasco::run(args),
    }
}

/// Writes a picture. It is SVG, and so must be the file's name.
pub(crate) fn plot(path: &Path, chart: &Chart) -> Result<(), Failure> {
    if path
        .extension()
        .is_none_or(|e| !e.eq_ignore_ascii_case("svg"))
    {
        return Err(Failure::new(format!(
            "{}: pictures are SVG; let the name end in .svg",
            path.display()
        )));
    }
    std::fs::write(path, chart.svg())
        .map_err(|e| Failure::new(format!("{}: cannot be written: {e}", path.display())))
}

/// A progress bar over `count` runs, where there is a terminal.
fn bar(count: u64) -> ProgressBar {
    let bar = ProgressBar::new(count);
    if let Ok(style) = ProgressStyle::with_template("{bar:30} {pos}/{len} {prefix} {eta} left") {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}
