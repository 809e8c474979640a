//! The JSON schema of a record, and the table it is made from.

use serde_json::{Value, json};

use crate::Mode;

/// One field of a [`Record`](crate::Record): name in JSON, type in JSON schema, unit, meaning.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Field {
    /// Name.
    pub name: &'static str,
    /// `number`, `integer` or `string`.
    pub kind: &'static str,
    /// SI unit, empty for pure numbers.
    pub unit: &'static str,
    /// One line for a person.
    pub meaning: &'static str,
}

const fn field(
    name: &'static str,
    kind: &'static str,
    unit: &'static str,
    meaning: &'static str,
) -> Field {
    Field {
        name,
        kind,
        unit,
        meaning,
    }
}

/// Every field of a record, in order.
pub const FIELDS: [Field; 14] = [
    field("t", "number", "s", "rig's clock since the first sample"),
    field(
        "u",
        "number",
        "V",
        "motor voltage held from this sample to the next",
    ),
    field("theta", "number", "rad", "arm angle, measured"),
    field(
        "alpha",
        "number",
        "rad",
        "pendulum angle from upright, measured, not wrapped",
    ),
    field("theta_dot", "number", "rad/s", "arm speed, estimated"),
    field("alpha_dot", "number", "rad/s", "pendulum speed, estimated"),
    field("reference", "number", "rad", "arm angle asked for"),
    field(
        "command",
        "number",
        "V",
        "voltage answered to this sample, acts from the next",
    ),
    field("mode", "string", "", "what the host was doing"),
    field("seq", "integer", "", "rig's number of this sample"),
    field(
        "status",
        "integer",
        "",
        "rig's status flags: 1 held, 2 watchdog, 4 clipped, 8 limit, 16 refused",
    ),
    field("lost", "integer", "", "samples lost just before this one"),
    field(
        "delay",
        "number",
        "s",
        "arrival later than the promptest sample's",
    ),
    field(
        "compute",
        "number",
        "s",
        "host's time from arrival to answer",
    ),
];

/// Name of the schema in the file.
pub(crate) const SCHEMA_NAME: &str = "furuta.Sample";

/// Key of the metadata that says the unit of `u` and `command` where they are no voltages.
pub const COMMAND_UNIT: &str = "command_unit";

impl Field {
    /// Its unit in a log whose commands are in `command`.
    fn unit_in(self, command: &str) -> &str {
        match self.unit {
            "V" => command,
            unit => unit,
        }
    }
}

/// `command` is the unit of commands.
pub(crate) fn json_schema(command: &str) -> Value {
    let properties = FIELDS.iter().map(|f| {
        let unit = match f.unit_in(command) {
            "" => String::new(),
            unit => format!(" [{unit}]"),
        };
        let mut property = json!({ "type": f.kind, "description": format!("{}{unit}", f.meaning) });
        if f.name == "mode" {
            property["enum"] = Mode::ALL.iter().map(|m| m.name()).collect();
        }
        (f.name.to_owned(), property)
    });
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": SCHEMA_NAME,
        "type": "object",
        "properties": properties.collect::<serde_json::Map<_, _>>(),
        "required": FIELDS.iter().map(|f| f.name).collect::<Vec<_>>(),
    })
}

/// `{"t": "s", ...}`: units by field, for the metadata record.
pub(crate) fn units(command: &str) -> Value {
    FIELDS
        .iter()
        .filter(|f| !f.unit.is_empty())
        .map(|f| (f.name.to_owned(), Value::from(f.unit_in(command))))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Record;

    #[test]
    fn the_table_is_the_record() {
        let Value::Object(record) = serde_json::to_value(Record::default()).expect("plain numbers")
        else {
            panic!("a record is an object");
        };
        let mut names: Vec<_> = record.keys().map(String::as_str).collect();
        let mut table: Vec<_> = FIELDS.iter().map(|f| f.name).collect();
        names.sort_unstable();
        table.sort_unstable();
        assert_eq!(names, table);
        for f in FIELDS {
            let value = &record[f.name];
            assert_eq!(f.kind == "string", value.is_string(), "{}", f.name);
            assert_eq!(f.kind == "integer", value.is_u64(), "{}", f.name);
        }
    }

    #[test]
    fn modes_are_named_alike_everywhere() {
        for mode in Mode::ALL {
            assert_eq!(
                serde_json::to_value(mode).expect("a string"),
                Value::from(mode.name())
            );
        }
    }
}
