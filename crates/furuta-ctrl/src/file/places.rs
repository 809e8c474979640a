//! Where sections and keys stand in a controller file.

/// The line of a byte of the text, from 1.
pub(super) fn line_at(text: &str, byte: usize) -> usize {
    let before = text.as_bytes().iter().take(byte);
    before.filter(|b| **b == b'\n').count() + 1
}

/// Lines of a file's sections and keys, for messages.
pub(super) struct Places<'a> {
    pub(super) text: &'a str,
}

impl Places<'_> {
    /// The line on which a section begins, 1 where it is not written as `[name]`.
    pub(super) fn section(&self, name: &str) -> usize {
        self.lines()
            .find(|(_, line)| header(line) == Some(name))
            .map_or(1, |(number, _)| number)
    }

    /// The line of a key in a section ("" before the first); the section's own where it is written in another way.
    pub(super) fn key(&self, section: &str, key: &str) -> usize {
        let start = self.section(section);
        let inside = |(number, line): &(usize, &str)| *number > start && header(line).is_none();
        let own = |line: &str| {
            let left = line.split('=').next().unwrap_or_default().trim();
            left.trim_matches('"') == key
        };
        if section.is_empty() {
            return self
                .lines()
                .find(|(_, line)| own(line))
                .map_or(1, |(number, _)| number);
        }
        self.lines()
            .skip(start)
            .take_while(|pair| inside(pair))
            .find(|(_, line)| own(line))
            .map_or(start, |(number, _)| number)
    }

    fn lines(&self) -> impl Iterator<Item = (usize, &str)> {
        self.text.lines().enumerate().map(|(i, line)| (i + 1, line))
    }
}

/// The name in a line `[name]`.
fn header(line: &str) -> Option<&str> {
    let (name, _) = line.trim().strip_prefix('[')?.split_once(']')?;
    // A list that goes on over several lines may begin with a bracket, too, but holds no bare word.
    let name = name.trim().trim_matches('"');
    name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
        .then_some(name)
}
