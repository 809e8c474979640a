//! Progress bars of long work, where there is a terminal.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

/// Of work that is counted, over `count` runs.
pub(crate) fn bar(count: u64) -> ProgressBar {
    drawn(count, "{bar:30} {pos}/{len} {prefix} {eta} left")
}

/// Of work in stages, in per cent: the stage is the prefix, what it is at the message.
pub(crate) fn stages() -> ProgressBar {
    drawn(
        100,
        "{spinner} {elapsed:>4} {bar:12} {pos:>3} % {prefix} {wide_msg}",
    )
}

fn drawn(length: u64, template: &str) -> ProgressBar {
    let bar = ProgressBar::new(length);
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}
