//! What a log says about its run.

use std::collections::BTreeMap;

/// What a log says about its run, in the MCAP metadata record `furuta`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Metadata {
    /// Name of the rig.
    pub rig: String,
    /// The rig file, as TOML.
    pub rig_file: String,
    /// The controller and its gains, in words.
    pub controller: String,
    /// Program and version that wrote the log.
    pub software: String,
    /// Anything further, by name.
    pub extra: BTreeMap<String, String>,
}

/// Key of [`Metadata::extra`] with the time of day at the start of the run (ns since 1970, UTC). A log without it
/// begins when it is written.
pub const STARTED: &str = "started_ns";

/// Name of the MCAP metadata record.
pub(crate) const RECORD_NAME: &str = "furuta";

/// Name of the record that says what the system granted the loop.
pub(crate) const REAL_TIME_RECORD: &str = "furuta.real_time";

const RIG: &str = "rig";
const RIG_FILE: &str = "rig_file";
const CONTROLLER: &str = "controller";
const SOFTWARE: &str = "software";
const UNITS: &str = "units";

impl Metadata {
    /// Everything but the extra, by its key.
    pub(crate) fn own(&self) -> [(&'static str, &str); 4] {
        [
            (RIG, &self.rig),
            (CONTROLLER, &self.controller),
            (SOFTWARE, &self.software),
            (RIG_FILE, &self.rig_file),
        ]
    }

    /// Unit of the commands: a voltage's, unless the extra says another.
    pub(crate) fn command_unit(&self) -> &str {
        self.extra
            .get(crate::schema::COMMAND_UNIT)
            .map_or("V", String::as_str)
    }

    /// The value of a key, empty where it was not there.
    pub(crate) fn entry(&mut self, key: &str) -> &mut String {
        match key {
            RIG => &mut self.rig,
            CONTROLLER => &mut self.controller,
            SOFTWARE => &mut self.software,
            RIG_FILE => &mut self.rig_file,
            _ => self.extra.entry(key.to_owned()).or_default(),
        }
    }

    pub(crate) fn to_map(&self) -> BTreeMap<String, String> {
        let mut map = self.extra.clone();
        map.insert(RIG.into(), self.rig.clone());
        map.insert(RIG_FILE.into(), self.rig_file.clone());
        map.insert(CONTROLLER.into(), self.controller.clone());
        map.insert(SOFTWARE.into(), self.software.clone());
        map.insert(
            UNITS.into(),
            crate::schema::units(self.command_unit()).to_string(),
        );
        map
    }

    pub(crate) fn from_map(mut map: BTreeMap<String, String>) -> Self {
        map.remove(UNITS); // a fact of the format, not of the run
        let mut take = |key| map.remove(key).unwrap_or_default();
        let (rig, rig_file) = (take(RIG), take(RIG_FILE));
        let (controller, software) = (take(CONTROLLER), take(SOFTWARE));
        Self {
            rig,
            rig_file,
            controller,
            software,
            extra: map,
        }
    }
}
