//! The built-in rigs: one TOML file each in `rigs/`, one line here.

const RIGS: [(&str, &str); 4] = [
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

pub(super) fn text(name: &str) -> Option<&'static str> {
    RIGS.iter().find(|(n, _)| *n == name).map(|(_, text)| *text)
}

#[cfg(test)]
mod tests {
    use crate::Rig;

    #[test]
    fn every_builtin_rig_is_valid_and_bears_its_name() {
        for (name, text) in super::RIGS {
            let rig = Rig::from_toml(text).unwrap_or_else(|e| panic!("{name}: {e}"));
            assert_eq!(rig.name, name);
        }
    }
}
