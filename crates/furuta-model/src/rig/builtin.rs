//! The built-in rigs: one TOML file each in `rigs/`, one line here.

const RIGS: [(&str, &str); 6] = [
    (
        "fong2014-emecs",
        include_str!("../../rigs/fong2014-emecs.toml"),
    ),
    (
        "shahzad2022-srv02",
        include_str!("../../rigs/shahzad2022-srv02.toml"),
    ),
    (
        "ramos-velasco",
        include_str!("../../rigs/ramos-velasco.toml"),
    ),
    ("qube-servo-2", include_str!("../../rigs/qube-servo-2.toml")),
    ("qube-servo-3", include_str!("../../rigs/qube-servo-3.toml")),
    ("stepper-kit", include_str!("../../rigs/stepper-kit.toml")),
];

pub(super) const NAMES: [&str; RIGS.len()] = {
    let mut names = [""; RIGS.len()];
    let mut i = 0;
    while i < RIGS.len() {
        names[i] = RIGS[i].0;
        i += 1;
    }
    names
};

/// Those whose command is a voltage.
pub(super) const VOLTAGE: [&str; 4] = [NAMES[0], NAMES[1], NAMES[2], NAMES[3]];

pub(super) fn text(name: &str) -> Option<&'static str> {
    RIGS.iter().find(|(n, _)| *n == name).map(|(_, text)| *text)
}

#[cfg(test)]
mod tests {
    use crate::{Actuation, Rig};

    #[test]
    fn every_builtin_rig_is_valid_and_bears_its_name() {
        for (name, text) in super::RIGS {
            let rig = Rig::from_toml(text).unwrap_or_else(|e| panic!("{name}: {e}"));
            assert_eq!(rig.name, name);
        }
    }

    #[test]
    fn those_driven_by_a_voltage_are_listed() {
        let driven = |name: &&str| {
            let rig = Rig::builtin(name).expect("built in");
            rig.params.motor.actuation == Actuation::Voltage
        };
        let listed: Vec<_> = Rig::BUILTIN.iter().copied().filter(driven).collect();
        assert_eq!(listed, Rig::VOLTAGE);
    }
}
