//! Studies in parts: machines share the runs of one study, and `--parts` makes its answer of what each printed.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::Write;
use std::ops::Range;
use std::path::PathBuf;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::failure::Failure;
use crate::streams;

/// Which runs of a study are computed here.
#[derive(clap::Args, Debug)]
pub(super) struct PartArgs {
    /// Compute the K-th of N parts of the runs alone and print them as JSON, for --parts.
    #[arg(long, value_name = "K/N", value_parser = part, conflicts_with = "parts")]
    part: Option<Part>,
    /// In place of computing, put together what --part printed with otherwise the same options; may be repeated.
    #[arg(long, value_name = "FILE")]
    parts: Vec<PathBuf>,
}

/// The part `k` of `n`, counted from 1.
#[derive(Copy, Clone, Debug)]
struct Part {
    k: usize,
    n: usize,
}

fn part(text: &str) -> Result<Part, String> {
    let numbers = text
        .split_once('/')
        .and_then(|(k, n)| Some((k.trim().parse().ok()?, n.trim().parse().ok()?)));
    match numbers {
        Some((k, n)) if 1 <= k && k <= n => Ok(Part { k, n }),
        _ => Err("must be K/N with K from 1 to N, as in 3/20".to_owned()),
    }
}

/// Some runs, as `--part` prints them.
#[derive(Serialize, Deserialize)]
struct Line {
    /// What decides the runs: see [`digest`].
    digest: String,
    /// Place of the first run.
    begin: usize,
    runs: Vec<Value>,
}

/// Where the runs of a study come from.
pub(super) struct Parts {
    part: Option<Part>,
    given: Option<Vec<Line>>,
}

impl PartArgs {
    /// Reads what other machines computed; `pictured`: whether a picture was asked for.
    pub(super) fn open(&self, pictured: bool) -> Result<Parts, Failure> {
        if self.part.is_some() && pictured {
            return Err(Failure::new(
                "a part of a study has no picture: give --plot with --parts",
            ));
        }
        let mut given = Vec::new();
        for path in &self.parts {
            let wrong = |why: &dyn std::fmt::Display| {
                Failure::new(format!(
                    "{}: {why}; give files that hold what --part printed",
                    path.display()
                ))
            };
            let text = std::fs::read_to_string(path).map_err(|e| wrong(&e))?;
            for line in text.lines().filter(|line| !line.trim().is_empty()) {
                given.push(serde_json::from_str(line).map_err(|e| wrong(&e))?);
            }
        }
        Ok(Parts {
            part: self.part,
            given: (!self.parts.is_empty()).then_some(given),
        })
    }
}

impl Parts {
    /// All `count` runs of what `about` describes in full: computed, or as parts give them. `None` where a part was
    /// asked for, which then is printed.
    pub(super) fn runs<T: Serialize + DeserializeOwned>(
        &self,
        about: &str,
        count: usize,
        compute: impl FnOnce(Range<usize>) -> Result<Vec<T>, Failure>,
    ) -> Result<Option<Vec<T>>, Failure> {
        if let Some(given) = &self.given {
            return put_together(given, &digest(about), count).map(Some);
        }
        let Some(Part { k, n }) = self.part else {
            return compute(0..count).map(Some);
        };
        let range = (k - 1) * count / n..k * count / n;
        let begin = range.start;
        let runs = compute(range)?;
        let runs: Result<Vec<Value>, _> = runs.iter().map(serde_json::to_value).collect();
        let line = Line {
            digest: digest(about),
            begin,
            runs: runs?,
        };
        writeln!(streams::output(), "{}", serde_json::to_string(&line)?)?;
        Ok(None)
    }
}

/// Each run once, in their order.
fn put_together<T: DeserializeOwned>(
    given: &[Line],
    digest: &str,
    count: usize,
) -> Result<Vec<T>, Failure> {
    let mut of: Vec<&Line> = given.iter().filter(|line| line.digest == digest).collect();
    of.sort_by_key(|line| (line.begin, line.runs.len()));
    if of.is_empty() {
        return Err(Failure::new(
            "none of the parts is of this study with these options: give those of --part, of the same version",
        ));
    }
    let mut runs = Vec::with_capacity(count);
    for line in of {
        let (there, begin) = (runs.len(), line.begin);
        if begin > there {
            return Err(missing(there, begin, count));
        }
        if begin < there && !line.runs.is_empty() {
            return Err(Failure::new(format!(
                "run {begin} of {count} is in two parts: give each part once"
            )));
        }
        for run in &line.runs {
            runs.push(serde_json::from_value(run.clone())?);
        }
    }
    if runs.len() < count {
        return Err(missing(runs.len(), count, count));
    }
    Ok(runs)
}

fn missing(from: usize, to: usize, count: usize) -> Failure {
    Failure::new(format!(
        "runs {from} to {} of {count} are in none of the parts: give every part K of N",
        to - 1
    ))
}

/// The same for the same description, of the same version.
fn digest(about: &str) -> String {
    let mut hasher = DefaultHasher::new();
    (env!("CARGO_PKG_VERSION"), about).hash(&mut hasher);
    format!("{:016x}", hasher.finish())
}
