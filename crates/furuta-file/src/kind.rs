//! What is written, and what of it may be replaced.

/// What is to be written.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Kind {
    /// An HTML page.
    Page,
    /// An SVG picture.
    Picture,
    /// JSON.
    Json,
    /// A recording, log, rig file, controller file or table.
    Data,
}

impl Kind {
    /// Whether a file that begins like this is of this kind and can be made again. Data are never replaced unasked.
    pub(crate) fn replaces(self, start: &[u8]) -> bool {
        let start = start.trim_ascii_start();
        let begins = |with: &str| {
            let start = start.get(..with.len());
            start.is_some_and(|s| s.eq_ignore_ascii_case(with.as_bytes()))
        };
        match self {
            Self::Page => begins("<!doctype html"),
            Self::Picture => begins("<svg"),
            // A list begins as a section of a TOML file does: ours are objects.
            Self::Json => begins("{"),
            Self::Data => false,
        }
    }

    /// What may be replaced.
    pub(crate) fn words(self) -> &'static str {
        match self {
            Self::Page => "an HTML page replaces only an HTML page",
            Self::Picture => "a picture replaces only an SVG picture",
            Self::Json => "JSON replaces only JSON",
            Self::Data => "it is not replaced unasked",
        }
    }
}
