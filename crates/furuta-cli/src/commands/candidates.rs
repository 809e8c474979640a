//! `--candidate`: laws of the user's own, from files.

use std::path::PathBuf;

use furuta_input::read_text;
use furuta_model::Spec;
use furuta_model::effects::own;

use crate::failure::Failure;

/// Files with laws of the user's own.
#[derive(clap::Args, Debug)]
pub(crate) struct CandidateArgs {
    /// File with laws of your own, tables [hypothesis."user.NAME"]: each is then an effect like those of the catalogue;
    /// may be repeated.
    #[arg(long = "candidate", value_name = "FILE.toml")]
    files: Vec<PathBuf>,
}

impl CandidateArgs {
    /// The same options as they are written, each behind a space.
    pub(crate) fn words(&self) -> String {
        let shown = |path: &PathBuf| format!(" --candidate {}", furuta_input::shown(path));
        self.files.iter().map(shown).collect()
    }

    /// The hypotheses of all files, each id once.
    pub(crate) fn load(&self) -> Result<Vec<&'static Spec>, Failure> {
        let mut all: Vec<&'static Spec> = Vec::new();
        for path in &self.files {
            let text = read_text(path, "a file of hypotheses")?;
            let shown = furuta_input::shown(path);
            let specs = own::read(&text).map_err(|e| Failure::new(format!("{shown}: {e}")))?;
            for spec in specs {
                if all.iter().any(|s| s.id == spec.id) {
                    return Err(Failure::new(format!(
                        "{shown}: {} is in two of the files: give each law an id of its own",
                        spec.id
                    )));
                }
                all.push(spec);
            }
        }
        Ok(all)
    }
}
