//! Controller files: TOML in, TOML out, every mistake named with its line, its key and what is allowed.
//!
//! ```toml
//! [made_for]                 # optional: `run` and `simulate` say so where they use it for something else
//! rig = "qube-servo-2"
//! rate = 500                 # Hz
//!
//! [controller]               # one of `furuta controllers`
//! kind = "lqr"
//! gain = [-1.9, 33.0, -1.4, 2.9]
//!
//! [estimator]
//! kind = "observer"
//!
//! [limits]
//! arm_angle = 2.5            # rad
//! ```
//!
//! Every section, and every key in it, may be left out: the standard value, or what the rig's model says, takes its place. The sections
//! and what they take: [`crate::config::SECTIONS`].

use crate::config::{Config, SECTIONS};
use crate::settings::{ParameterSpec, Settings, SettingsError, Shape, Spec};
use furuta_input::{InputError, foreign, is_printable, quoted, read_text};
use std::fmt::Write as _;
use std::path::Path;
use toml::Value;

/// A controller file.
///
/// ```
/// use furuta_ctrl::ControllerFile;
/// let file = ControllerFile::from_toml("[controller]\nkind = \"lqr\"\ngain = [-1.0, 27.7, -2.0, 3.6]\n")?;
/// assert_eq!(file.config.controller.numbers("gain").map(|k| k[1]), Some(27.7));
/// assert_eq!(ControllerFile::from_toml(&file.to_toml())?, file);
/// let error = ControllerFile::from_toml("[controller]\ngian = [1.0]\n").unwrap_err();
/// assert_eq!(error.to_string(), "controller file, line 2: [controller] has no key `gian`; of kind \"lqr\" it has kind, gain, q, r");
/// # Ok::<(), furuta_ctrl::FileError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Default)]
pub struct ControllerFile {
    /// What it was made for.
    pub made_for: MadeFor,
    /// Its settings.
    pub config: Config,
}

/// What a controller was made for, where its file says so.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct MadeFor {
    /// Name of the rig.
    pub rig: Option<String>,
    /// Samples per second, Hz.
    pub rate: Option<f64>,
}

/// What is wrong with a controller file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FileError {
    /// A file that cannot be read.
    #[error("controller file {0}")]
    Unreadable(#[from] InputError),
    /// Not TOML.
    #[error("controller file, line {line}: {}", foreign(message))]
    Syntax {
        /// Where, from 1.
        line: usize,
        /// What.
        message: String,
    },
    /// A section that controller files do not have.
    #[error(
        "controller file, line {line}: no section `{}`; there are {known}",
        quoted(name)
    )]
    UnknownSection {
        /// Where, from 1.
        line: usize,
        /// What was given.
        name: String,
        /// What there is.
        known: String,
    },
    /// A kind that the section does not have.
    #[error(
        "controller file, line {line}: [{section}] has no kind {}; it has {known}",
        quoted(kind)
    )]
    UnknownKind {
        /// Where, from 1.
        line: usize,
        /// The section.
        section: &'static str,
        /// What was given.
        kind: String,
        /// What there is.
        known: String,
    },
    /// A key that the section does not have.
    #[error(
        "controller file, line {line}: [{section}] has no key `{}`; {known}",
        quoted(key)
    )]
    UnknownKey {
        /// Where, from 1.
        line: usize,
        /// The section.
        section: &'static str,
        /// What was given.
        key: String,
        /// What there is.
        known: String,
    },
    /// A value of the wrong kind.
    #[error("controller file, line {line}: {} must be {wanted}", quoted(key))]
    WrongType {
        /// Where, from 1.
        line: usize,
        /// Which key.
        key: String,
        /// What it must be.
        wanted: String,
    },
    /// A value that is not possible.
    #[error("controller file, line {line}: {error}")]
    Setting {
        /// Where, from 1.
        line: usize,
        /// What is wrong with it.
        error: SettingsError,
    },
    /// Any of these in a file with a name.
    #[error("{}: {error}", quoted(path))]
    InFile {
        /// The file.
        path: String,
        /// What is wrong in it.
        error: Box<FileError>,
    },
}

impl ControllerFile {
    /// From the file at this path.
    ///
    /// # Errors
    /// A file that cannot be read, or see [`ControllerFile::from_toml`].
    pub fn load(path: impl AsRef<Path>) -> Result<Self, FileError> {
        let path = path.as_ref();
        let name = path.display().to_string();
        let text = read_text(path, "a controller file")?;
        Self::from_toml(&text).map_err(|error| FileError::InFile {
            path: name,
            error: Box::new(error),
        })
    }

    /// From the text of a file.
    ///
    /// # Errors
    /// Not TOML; sections, kinds or keys that there are not; values of the wrong type or outside their range.
    pub fn from_toml(text: &str) -> Result<Self, FileError> {
        let tables: toml::Table = toml::from_str(text).map_err(|e| FileError::Syntax {
            line: line_at(text, e.span().map_or(0, |s| s.start)),
            message: e.message().replace('\n', " "),
        })?;
        let mut file = Self::default();
        let at = Places { text };
        for (name, value) in &tables {
            let table = |name: &str| {
                value.as_table().ok_or_else(|| FileError::WrongType {
                    line: at.key("", name),
                    key: name.to_owned(),
                    wanted: format!("a section, [{name}]"),
                })
            };
            if name == "made_for" {
                file.made_for = made_for(table(name)?, &at)?;
                continue;
            }
            let Some(place) = SECTIONS.iter().position(|(section, _)| section == name) else {
                let known = SECTIONS.iter().map(|(name, _)| *name);
                return Err(FileError::UnknownSection {
                    line: at.section(name),
                    name: name.clone(),
                    known: listed(std::iter::once("made_for").chain(known)),
                });
            };
            let (section, kinds) = SECTIONS[place];
            *file.config.sections_mut()[place] = read(section, kinds, table(name)?, &at)?;
        }
        Ok(file)
    }

    /// The text of a file. Sections in which nothing is given are left out.
    #[must_use]
    pub fn to_toml(&self) -> String {
        let mut out = String::new();
        // Writing to a String cannot fail.
        let MadeFor { rig, rate } = &self.made_for;
        if rig.is_some() || rate.is_some() {
            let _ = writeln!(out, "[made_for]");
        }
        if let Some(rig) = rig {
            let _ = writeln!(out, "rig = {}", Value::from(rig.as_str()));
        }
        if let Some(rate) = rate {
            let _ = writeln!(out, "rate = {rate:?}   # Hz");
        }
        for ((section, kinds), settings) in SECTIONS.iter().zip(self.config.sections()) {
            let spec = settings.spec();
            let standard = spec.id == kinds[0].id && *section != "controller";
            if standard && settings.given().next().is_none() {
                continue;
            }
            let between = if out.is_empty() { "" } else { "\n" };
            let _ = writeln!(out, "{between}[{section}]   # {}", spec.sentence);
            if kinds.len() > 1 || *section == "controller" {
                let _ = writeln!(out, "kind = \"{}\"", spec.id);
            }
            for (p, values) in settings.given() {
                let unit = if p.unit.is_empty() {
                    String::new()
                } else {
                    format!("   # {}", p.unit)
                };
                let _ = writeln!(out, "{} = {}{unit}", p.name, written(p, values));
            }
        }
        out
    }
}

/// One section.
fn read(
    section: &'static str,
    kinds: &[&'static Spec],
    table: &toml::Table,
    at: &Places<'_>,
) -> Result<Settings, FileError> {
    let several = kinds.len() > 1 || section == "controller";
    let spec = match table.get("kind").filter(|_| several) {
        None => kinds[0],
        Some(kind) => kinds
            .iter()
            .find(|spec| kind.as_str() == Some(spec.id))
            .ok_or_else(|| FileError::UnknownKind {
                line: at.key(section, "kind"),
                section,
                kind: kind.to_string(),
                known: listed(kinds.iter().map(|spec| spec.id)),
            })?,
    };
    let mut settings = Settings::new(spec);
    for (key, value) in table.iter().filter(|(key, _)| !several || *key != "kind") {
        let line = at.key(section, key);
        let Some(place) = spec.place(key) else {
            let names = spec.parameters.iter().map(|p| p.name);
            let known = if several {
                let all = listed(std::iter::once("kind").chain(names));
                format!("of kind \"{}\" it has {all}", spec.id)
            } else {
                format!("it has {}", listed(names))
            };
            return Err(FileError::UnknownKey {
                line,
                section,
                key: key.clone(),
                known,
            });
        };
        let p = &spec.parameters[place];
        let values = values(p, value).ok_or_else(|| FileError::WrongType {
            line,
            key: key.clone(),
            wanted: wanted(p.shape),
        })?;
        settings = settings
            .with(key, &values)
            .map_err(|error| FileError::Setting { line, error })?;
    }
    Ok(settings)
}

fn made_for(table: &toml::Table, at: &Places<'_>) -> Result<MadeFor, FileError> {
    let mut made_for = MadeFor::default();
    for (key, value) in table {
        let line = at.key("made_for", key);
        let wrong = |wanted: &str| FileError::WrongType {
            line,
            key: key.clone(),
            wanted: wanted.to_owned(),
        };
        match key.as_str() {
            "rig" => {
                let name = value
                    .as_str()
                    .filter(|name| name.chars().all(is_printable))
                    .ok_or_else(|| wrong("a rig's name, of printable characters"))?;
                made_for.rig = Some(name.to_owned());
            }
            "rate" => {
                let rate = number(value)
                    .filter(|rate| *rate >= 1.0 && *rate <= 1e6)
                    .ok_or_else(|| wrong("a number of samples per second, 1 to 1000000"))?;
                made_for.rate = Some(rate);
            }
            _ => {
                return Err(FileError::UnknownKey {
                    line,
                    section: "made_for",
                    key: key.clone(),
                    known: "it has rig, rate".to_owned(),
                });
            }
        }
    }
    Ok(made_for)
}

#[allow(clippy::cast_precision_loss)] // nobody gives so large a number
fn number(value: &Value) -> Option<f64> {
    value
        .as_float()
        .or_else(|| value.as_integer().map(|i| i as f64))
}

#[allow(clippy::cast_precision_loss)]
fn values(p: &ParameterSpec, value: &Value) -> Option<Vec<f64>> {
    match p.shape {
        Shape::Number | Shape::Whole => number(value).map(|x| vec![x]),
        Shape::Numbers(_) => value.as_array()?.iter().map(number).collect(),
        Shape::Switch => value.as_bool().map(|on| vec![f64::from(u8::from(on))]),
        Shape::Word(words) => {
            let word = value.as_str()?;
            let place = words.iter().position(|w| *w == word)?;
            Some(vec![place as f64])
        }
    }
}

fn wanted(shape: Shape) -> String {
    match shape {
        Shape::Number => "a number".to_owned(),
        Shape::Numbers(n) => format!("a list of {n} numbers, [..., ...]"),
        Shape::Whole => "a whole number".to_owned(),
        Shape::Switch => "true or false".to_owned(),
        Shape::Word(words) => format!("one of \"{}\"", words.join("\", \"")),
    }
}

fn written(p: &ParameterSpec, values: &[f64]) -> String {
    let first = values.first().copied().unwrap_or_default();
    match p.shape {
        Shape::Number => format!("{first:?}"),
        Shape::Numbers(_) => format!("{values:?}"),
        Shape::Whole => format!("{first:.0}"),
        Shape::Switch => (first == 1.0).to_string(),
        Shape::Word(_) => format!("\"{}\"", p.shape.word(first).unwrap_or_default()),
    }
}

fn listed<'a>(names: impl Iterator<Item = &'a str>) -> String {
    names.collect::<Vec<_>>().join(", ")
}

fn line_at(text: &str, byte: usize) -> usize {
    let before = text.as_bytes().iter().take(byte);
    before.filter(|b| **b == b'\n').count() + 1
}

/// Lines of a file's sections and keys, for messages.
struct Places<'a> {
    text: &'a str,
}

impl Places<'_> {
    /// The line on which a section begins, 1 where it is not written as `[name]`.
    fn section(&self, name: &str) -> usize {
        self.lines()
            .find(|(_, line)| header(line) == Some(name))
            .map_or(1, |(number, _)| number)
    }

    /// The line of a key in a section ("" before the first); the section's own where it is written in another way.
    fn key(&self, section: &str, key: &str) -> usize {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn message(text: &str) -> String {
        ControllerFile::from_toml(text)
            .expect_err("must be refused")
            .to_string()
    }

    #[test]
    fn mistakes_are_named() {
        for (text, expected) in [
            (
                "[controler]\n",
                "line 1: no section `controler`; there are made_for, controller, estimator, swing_up, supervisor, limits, compensate",
            ),
            (
                "[controller]\nkind = \"pid\"\n",
                "line 2: [controller] has no kind \"pid\"; it has lqr",
            ),
            (
                "[controller]\nkind = \"lqr\"\n\n[limits]\n# a remark\ncommand = -3\n",
                "line 6: limits: command = -3 is outside the allowed range [0.001, 1000] V",
            ),
            (
                "[controller]\ngain = [1, 2, 3]\n",
                "line 2: lqr: gain needs 4 numbers, not 3",
            ),
            (
                "[controller]\ngain = [1, 2, 3, nan]\n",
                "gain = NaN is outside",
            ),
            (
                "[controller]\ngain = 3\n",
                "line 2: gain must be a list of 4 numbers",
            ),
            (
                "[supervisor]\ncatch_every = 1.5\n",
                "catch_every = 1.5 must be a whole number from 1 to 1000",
            ),
            (
                "[compensate]\nhold = 1\n",
                "line 2: hold must be true or false",
            ),
            ("[limits]\nkind = \"x\"\n", "[limits] has no key `kind`"),
            ("limits = 3\n", "line 1: limits must be a section, [limits]"),
            (
                "[made_for]\nrate = 0\n",
                "rate must be a number of samples per second",
            ),
            ("[controller\n", "line 1: "),
        ] {
            let message = message(text);
            assert!(message.contains(expected), "{message}\nlacks\n{expected}");
        }
    }

    #[test]
    fn what_is_quoted_is_short_and_printable() {
        let key = "k".repeat(100_000);
        for text in [
            format!("[\"\\u001b[31m{key}\"]\n"),
            format!("[limits]\n\"\\u001b[31m{key}\" = 1\n"),
            format!("[controller]\nkind = \"\\u001b[31m{key}\"\n"),
            format!("[made_for]\nrig = \"\\u001b[31m{key}\"\n"),
            format!("\u{1b}[31m{key} = {key}\n"),
        ] {
            let message = message(&text);
            assert!(message.chars().all(is_printable), "{message:?}");
            let quoted = message.matches('k').count();
            assert!(quoted < 120 && message.len() < 2000, "{message}");
        }
        let huge = message("[limits]\ncommand = 1e300\n");
        assert!(huge.contains("command = 1e300 is"), "{huge}");
    }

    #[test]
    fn what_is_written_reads_back() {
        let text = "[made_for]\nrig = \"my \\\"rig\\\"\"\nrate = 500\n[controller]\nq = [1, 2, 3, 4.5]\nr = 0.1\n[estimator]\nkind = \"derivative\"\n[limits]\ncommand = 5\n[compensate]\nhold = false\n[supervisor]\ncatch_every = 4\n";
        let file = ControllerFile::from_toml(text).expect("valid");
        let again = ControllerFile::from_toml(&file.to_toml()).expect("readable");
        assert_eq!(again, file, "{}", file.to_toml());
        assert_eq!(
            ControllerFile::from_toml("").expect("all standard").config,
            Config::default()
        );
    }

    proptest::proptest! {
        #[test]
        fn any_text_is_answered(text in "(\\[[a-z_\"]{0,12}\\]\n?|[a-z_]{1,8} ?= ?[-\\[0-9.,\"a-z]{0,9}\n){0,12}") {
            let _ = ControllerFile::from_toml(&text);
        }
    }
}
