//! Progress of work that is counted.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

/// A progress bar over `count` runs, where there is a terminal.
pub(crate) fn bar(count: u64) -> ProgressBar {
    let bar = ProgressBar::new(count);
    if let Ok(style) = ProgressStyle::with_template("{bar:30} {pos}/{len} {prefix} {eta} left") {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}
