//! What a file does not say.

/// A file's text and what it leaves out of the rig.
#[derive(Clone, Debug, PartialEq)]
pub struct Exported {
    /// The file's text.
    pub text: String,
    /// What of the rig it does not carry over; the text lists the same in a comment.
    pub left_out: Vec<Remark>,
}

/// Something of a rig that a file does not carry over.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Remark {
    /// An effect's id, or a key of the rig file.
    pub what: String,
    /// Why, or what stands in its place.
    pub why: &'static str,
}

impl Remark {
    pub(crate) fn new(what: impl Into<String>, why: &'static str) -> Self {
        Self {
            what: what.into(),
            why,
        }
    }
}

impl core::fmt::Display for Remark {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "not carried over: {}: {}", self.what, self.why)
    }
}

/// Text that can stand in an XML comment: two hyphens in a row would end it.
pub(crate) fn comment(text: &str) -> String {
    let printable: String = text
        .chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect();
    printable.replace("--", "- -")
}

/// A name that can stand in an XML attribute: letters, digits, `-`, `_` and `.`; others become `_`.
pub(crate) fn name(text: &str) -> String {
    text.chars()
        .map(|c| match c {
            'a'..='z' | 'A'..='Z' | '0'..='9' | '-' | '_' | '.' => c,
            _ => '_',
        })
        .collect()
}
