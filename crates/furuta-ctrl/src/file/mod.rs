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
//! A table `[trajectory]` holds a swing-up to follow; `furuta design swing-up` writes it.
//!
//! Every section, and every key in it, may be left out: the standard value, or what the rig's model says, takes its
//! place. The sections and what they take: [`crate::config::SECTIONS`].

mod error;
mod places;
#[cfg(test)]
mod tests;
mod trajectory;
mod value;

pub use error::FileError;

use crate::config::{Config, SECTIONS};
use crate::section::{Settings, Spec};
use furuta_input::{is_printable, read_text};
use places::{Places, line_at};
use std::fmt::Write as _;
use std::path::Path;
use toml::Value;
use value::{number, numbers, wanted, written};

/// A controller file.
///
/// ```
/// use furuta_ctrl::ControllerFile;
/// let file = ControllerFile::from_toml("[controller]\nkind = \"lqr\"\ngain = [-1.0, 27.7, -2.0, 3.6]\n")?;
/// assert_eq!(file.config.controller.numbers("gain").map(|k| k[1]), Some(27.7));
/// assert_eq!(ControllerFile::from_toml(&file.to_toml())?, file);
/// let error = ControllerFile::from_toml("[controller]\ngian = [1.0]\n").unwrap_err();
/// let wrong = "controller file, line 2: [controller] has no key `gian`; of kind \"lqr\" it has kind, gain, q, r";
/// assert_eq!(error.to_string(), wrong);
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
            if name == "trajectory" {
                file.config.trajectory = Some(trajectory::read(table(name)?, &at)?);
                continue;
            }
            let Some(place) = SECTIONS.iter().position(|(section, _)| section == name) else {
                let known = SECTIONS.iter().map(|(name, _)| *name);
                return Err(FileError::UnknownSection {
                    line: at.section(name),
                    name: name.clone(),
                    known: listed(
                        std::iter::once("made_for")
                            .chain(known)
                            .chain(["trajectory"]),
                    ),
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
        if let Some(trajectory) = &self.config.trajectory {
            let between = if out.is_empty() { "" } else { "\n" };
            out.push_str(between);
            out.push_str(&trajectory::written(trajectory));
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
        let values = numbers(p, value).ok_or_else(|| FileError::WrongType {
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

fn listed<'a>(names: impl Iterator<Item = &'a str>) -> String {
    names.collect::<Vec<_>>().join(", ")
}
