//! The files that a command writes.
//!
//! An option that names such a file has the type [`Output`], and nothing else in this crate writes files
//! (`clippy.toml`). So [`check`] finds all of them on any command line, before the command begins, and no new command
//! can forget it:
//!
//! - an output is not an input of the same command, nor another output of it, be it by a link;
//! - a file that is there already is replaced without asking only by its own kind of what can be made again (a page,
//!   an SVG picture, JSON), as its first bytes tell; never a recording, log, rig file, controller file or table.
//!   `--force` overrides both;
//! - its folder exists and is writable.
//!
//! Files are written whole or not at all (crate `furuta-file`). One that cannot be written does not take the command's
//! answer along: [`failed`] says so at the end.

use std::ffi::OsStr;
use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use clap::builder::{PathBufValueParser, TypedValueParser};
use clap::parser::ValueSource;
use clap::{Arg, ArgMatches, Command};
use furuta_file::{Kind, Place, WholeFile};

use crate::failure::Failure;

/// A file to write, as an option names it.
#[derive(Clone, Debug)]
pub(crate) struct Output {
    path: PathBuf,
    kind: Kind,
}

/// An option's value: an HTML page.
pub(crate) fn page() -> impl TypedValueParser<Value = Output> {
    output(Kind::Page)
}

/// An option's value: a picture. It is SVG, and so must be the file's name.
pub(crate) fn picture() -> impl TypedValueParser<Value = Output> {
    output(Kind::Picture)
}

/// An option's value: JSON.
pub(crate) fn json() -> impl TypedValueParser<Value = Output> {
    output(Kind::Json)
}

/// An option's value: a recording, log, rig file, controller file or table.
pub(crate) fn data() -> impl TypedValueParser<Value = Output> {
    output(Kind::Data)
}

fn output(kind: Kind) -> impl TypedValueParser<Value = Output> {
    PathBufValueParser::new().map(move |path| Output { path, kind })
}

/// What could not be written so far.
static FAILED: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// What could not be written.
pub(crate) fn failed() -> Vec<String> {
    let mut failed = FAILED.lock().unwrap_or_else(|e| e.into_inner());
    std::mem::take(&mut failed)
}

/// How a recording is written.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(crate) enum RecordingKind {
    /// Text in columns, as `furuta simulate` writes it.
    Csv,
    /// A log, as `furuta run` writes it.
    Mcap,
}

impl Output {
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Refuses a name that is usual for files of another kind than this one.
    pub(crate) fn must_be(&self, kind: RecordingKind) -> Result<(), Failure> {
        const ENDINGS: [&str; 11] = [
            "csv", "svg", "png", "jpg", "pdf", "html", "htm", "json", "toml", "mcap", "xlsx",
        ];
        let (own, say) = match kind {
            RecordingKind::Csv => (
                "csv",
                "a recording is written as CSV: name it .csv; --plot draws a picture (SVG), --json prints JSON, furuta \
                 convert makes a log (MCAP)",
            ),
            RecordingKind::Mcap => (
                "mcap",
                "a log is written as MCAP: name it .mcap; furuta convert makes a recording in CSV of it",
            ),
        };
        let ending = self.path.extension().and_then(|ending| ending.to_str());
        let ending = ending.map(str::to_ascii_lowercase).unwrap_or_default();
        if ending != own && ENDINGS.contains(&ending.as_str()) {
            return Err(self.failure(&say));
        }
        Ok(())
    }

    /// What is wrong with the file, under its name.
    pub(crate) fn failure(&self, why: &dyn Display) -> Failure {
        Failure::new(format!("{self}: {why}"))
    }

    /// Writes the file, beside what the command answers: that it failed is said when the command is done. Whether it
    /// was written.
    pub(crate) fn write(&self, content: impl AsRef<[u8]>) -> bool {
        let written = furuta_file::write(&self.path, content.as_ref());
        if let Err(error) = &written {
            let mut failed = FAILED.lock().unwrap_or_else(|e| e.into_inner());
            failed.push(error.to_string());
        }
        written.is_ok()
    }

    /// Writes the file little by little: where it is all that the command is for.
    pub(crate) fn write_by<E: Display>(
        &self,
        content: impl FnOnce(&mut WholeFile) -> Result<(), E>,
    ) -> Result<(), Failure> {
        let mut file = WholeFile::create(&self.path)?;
        content(&mut file).map_err(|e| Failure::new(format!("{self}: cannot be written: {e}")))?;
        Ok(file.commit()?)
    }
}

impl Display for Output {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.path.display().fmt(f)
    }
}

/// In a folder that a command filled before: it may do so again.
const MARK: &str = ".furuta";

/// A folder that a command fills with files of its own names.
#[derive(Clone, Debug)]
pub(crate) struct Folder {
    path: PathBuf,
    names: &'static [&'static str],
}

/// An option's value: a folder for these files.
pub(crate) fn folder(names: &'static [&'static str]) -> impl TypedValueParser<Value = Folder> {
    PathBufValueParser::new().map(move |path| Folder { path, names })
}

impl Folder {
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Makes the folder where it is not there.
    pub(crate) fn create(&self) -> Result<(), Failure> {
        std::fs::create_dir_all(&self.path).map_err(|e| {
            let path = self.path.display();
            Failure::new(format!(
                "{path}: cannot be created: {e}; give another folder"
            ))
        })?;
        Ok(furuta_file::write(&self.path.join(MARK), b"")?)
    }

    /// Writes one of its files.
    pub(crate) fn write(&self, name: &str, content: &str) -> Result<(), Failure> {
        Ok(furuta_file::write(
            &self.path.join(name),
            content.as_bytes(),
        )?)
    }

    /// Files of another origin are not replaced.
    fn check(&self, name: &str) -> Result<(), Failure> {
        let other = self
            .names
            .iter()
            .map(|name| self.path.join(name))
            .find(|file| file.exists());
        match other {
            Some(file) if !self.path.join(MARK).exists() => Err(Failure::new(format!(
                "{name} {}: {} is there already and would be replaced; give another folder, or --force to replace it",
                self.path.display(),
                file.display()
            ))),
            _ => Ok(()),
        }
    }
}

/// Refuses a command line whose outputs would destroy data or cannot be written.
pub(crate) fn check(command: &Command, matches: &ArgMatches, force: bool) -> Result<(), Failure> {
    let (mut command, mut matches) = (command, matches);
    let mut named = Named::default();
    loop {
        let json = matches.try_get_one::<bool>("json").ok().flatten();
        let moved = command
            .get_arguments()
            .any(|arg| arg.get_id() == "json_file");
        for arg in command.get_arguments() {
            if moved && json == Some(&true) {
                json_takes_no_value(arg, matches)?;
            }
            named.add(arg, matches);
        }
        let Some((name, below)) = matches.subcommand() else {
            return named.check(force);
        };
        let Some(next) = command.find_subcommand(name) else {
            return named.check(force);
        };
        (command, matches) = (next, below);
    }
}

/// What a command line names.
#[derive(Default)]
struct Named<'a> {
    outputs: Vec<(String, &'a Output)>,
    folders: Vec<(String, &'a Folder)>,
    /// Every other value: whichever is a file's name is an input.
    others: Vec<(String, &'a OsStr)>,
}

impl<'a> Named<'a> {
    fn add(&mut self, arg: &Arg, matches: &'a ArgMatches) {
        let id = arg.get_id().as_str();
        let name = shown(arg);
        if let Ok(Some(outputs)) = matches.try_get_many::<Output>(id) {
            self.outputs.extend(outputs.map(|o| (name.clone(), o)));
        } else if let Ok(Some(folders)) = matches.try_get_many::<Folder>(id) {
            self.folders.extend(folders.map(|f| (name.clone(), f)));
        } else {
            self.others
                .extend(given(arg, matches).map(|value| (name.clone(), value)));
        }
    }

    fn check(&self, force: bool) -> Result<(), Failure> {
        if !force {
            for (name, folder) in &self.folders {
                folder.check(name)?;
            }
        }
        let mut places: Vec<(&str, Place)> = Vec::new();
        for (name, output) in &self.outputs {
            let refuse = |why: &dyn Display| Failure::new(format!("{name} {why}"));
            if output.path == Path::new("-") {
                return Err(refuse(
                    &"-: names no file; for standard output: /dev/stdout",
                ));
            }
            let place = Place::of(&output.path).map_err(|e| refuse(&e))?;
            let same = |(_, other): &&(&str, Place)| !place.is_stream() && other.is(&output.path);
            if let Some((other, _)) = places.iter().find(same) {
                return Err(refuse(&format!(
                    "{output}: is what {other} writes too; give each a name of its own"
                )));
            }
            if !force {
                let or_force =
                    |why: &dyn Display| refuse(&format!("{why}, or --force to replace it"));
                if let Some((input, _)) = self.others.iter().find(|(_, p)| place.is(Path::new(p))) {
                    let why = format!(
                        "{output}: is an input of this command ({input}); give another name"
                    );
                    return Err(or_force(&why));
                }
                place
                    .may_be_replaced_by(output.kind)
                    .map_err(|e| or_force(&e))?;
            }
            let svg = output
                .path
                .extension()
                .is_some_and(|e| e.eq_ignore_ascii_case("svg"));
            if output.kind == Kind::Picture && !svg && !place.is_stream() {
                return Err(refuse(&format!(
                    "{output}: pictures are SVG; let the name end in .svg"
                )));
            }
            place.is_writable().map_err(|e| refuse(&e))?;
            places.push((name, place));
        }
        Ok(())
    }
}

/// `--report`, or for one without a name `OUT`.
fn shown(arg: &Arg) -> String {
    match (arg.get_long(), arg.get_value_names()) {
        (Some(long), _) => format!("--{long}"),
        (None, Some([name, ..])) => name.to_string(),
        (None, _) => arg.get_id().to_string(),
    }
}

/// The values that the person gave.
fn given<'a>(arg: &Arg, matches: &'a ArgMatches) -> impl Iterator<Item = &'a OsStr> {
    let id = arg.get_id().as_str();
    let values = matches.try_get_raw(id).ok().flatten();
    let by_hand = values.is_some() && matches.value_source(id) == Some(ValueSource::CommandLine);
    values.into_iter().flatten().filter(move |_| by_hand)
}

/// A person who still writes a file behind `--json`, as some commands once had it, is told before the file is taken
/// for data.
fn json_takes_no_value(arg: &Arg, matches: &ArgMatches) -> Result<(), Failure> {
    let meant = |value: &&OsStr| {
        let json = Path::new(value).extension().is_some_and(|e| e == "json");
        arg.is_positional() && (*value == "-" || json)
    };
    match given(arg, matches).find(meant) {
        Some(value) => Err(Failure::new(format!(
            "{} {}: --json takes no value any more: it prints JSON on standard output; for a file: --json-file FILE",
            shown(arg),
            value.display()
        ))),
        None => Ok(()),
    }
}
