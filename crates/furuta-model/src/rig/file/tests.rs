use super::*;

const QUBE: &str = include_str!("../../../rigs/qube-servo-2.toml");

fn message(text: &str) -> String {
    parse(text).expect_err("must be refused").to_string()
}

#[test]
fn mistakes_are_named() {
    let unknown = message(&QUBE.replace("[arm]", "[arm]\nlenght = 3.0"));
    assert!(
        unknown.contains("lenght") && unknown.contains("line "),
        "{unknown}"
    );
    let negative = message(&QUBE.replace("mass = 0.024", "mass = -0.024"));
    assert!(
        negative.contains("pendulum.mass = -0.024") && negative.contains("(0, 100] kg"),
        "{negative}"
    );
    let nan = message(&QUBE.replace("mass = 0.024", "mass = nan"));
    assert!(nan.contains("pendulum.mass = NaN"), "{nan}");
    let effect = message(&format!(
        "{QUBE}\n[effects.\"arm.springs\"]\nstiffness = 1.0\n"
    ));
    assert!(
        effect.contains("arm.springs") && effect.contains("arm.spring,"),
        "{effect}"
    );
    let parameter = message(&format!(
        "{QUBE}\n[effects.\"arm.spring\"]\nstiffness = 1.0\n"
    ));
    assert!(parameter.contains("lacks `rest`"), "{parameter}");
    let word = message(&format!(
        "{QUBE}\n[effects.\"drive.backlash\"]\ngap = 0.05\nmotor_share = 0.4\nencoder = \"gear\"\n"
    ));
    assert!(
        word.contains("encoder = \"gear\" must be \"arm\" or \"motor\""),
        "{word}"
    );
    let whole = message(&format!(
        "{QUBE}\n[effects.\"arm.cogging\"]\namplitude = 0.05\norder = 2.5\n"
    ));
    assert!(
        whole.contains("order = 2.5 must be a whole number"),
        "{whole}"
    );
    let range = message(&format!(
        "{QUBE}\n[effects.\"arm.coulomb\"]\ntorque = -1.0\n"
    ));
    assert!(range.contains("torque = -1"), "{range}");
    let unquoted = message(&format!("{QUBE}\n[effects.arm.spring]\nstiffness = 1.0\n"));
    assert!(
        unquoted.contains("write [effects.\"arm.spring\"]"),
        "{unquoted}"
    );
    let list = message(&format!(
        "{QUBE}\n[effects.\"arm.spring\"]\nstiffness = [1.0]\n"
    ));
    assert!(list.contains("must be a number or a word"), "{list}");
    let huge = message(&QUBE.replace("mass = 0.024", "mass = 1e300"));
    assert!(huge.contains("pendulum.mass = 1e300 is"), "{huge}");
    assert!(
        message("").contains("rig"),
        "an empty file lacks everything"
    );
}

/// No escape sequence of a file reaches a terminal, and of what is long only a piece is quoted.
#[test]
fn what_is_quoted_is_short_and_printable() {
    let key = "k".repeat(100_000);
    for text in [
        QUBE.replace("qube-servo-2", "\\u001b]0;mine\\u0007"),
        QUBE.replace("qube-servo-2", &key),
        format!("{QUBE}\n[effects.\"\\u001b[31m{key}\"]\n"),
        format!("{QUBE}\n[effects.\"arm.spring\"]\n\"\\u001b[31m{key}\" = 1\n"),
        QUBE.replace("[arm]", &format!("[arm]\n\"\\u001b[31m{key}\" = 1")),
        QUBE.replace("[arm]", &format!("[arm]\n\u{1b}[31m{key}")),
    ] {
        let message = message(&text);
        assert!(message.chars().all(is_printable), "{message:?}");
        let quoted = message.matches('k').count();
        assert!(quoted < 100 && message.len() < 2000, "{message}");
    }
}

#[test]
fn written_rigs_read_back_equal() {
    for name in Rig::BUILTIN {
        let rig = Rig::builtin(name).expect("built in");
        assert_eq!(parse(&write(&rig)).expect("readable"), rig);
    }
}

#[test]
fn every_effect_is_written_and_read_back() {
    let plain = parse(QUBE).expect("valid");
    for spec in effects::CATALOGUE.iter().chain(effects::RARE) {
        let values: Vec<f64> = spec
            .parameters
            .iter()
            .map(|p| p.off + p.typical(&plain.params))
            .collect();
        let mut rig = plain.clone();
        rig.effects
            .push(Effect::new(spec.id, &values).expect("valid"));
        assert_eq!(parse(&write(&rig)).expect("readable"), rig, "{}", spec.id);
    }
}

#[test]
fn tolerances_are_shares_of_numbers_that_a_sheet_has() {
    let rig = parse(&format!(
        "{QUBE}\n[tolerance]\narm.length = 0.01\nmotor.resistance = 0.2\n"
    ))
    .expect("valid");
    assert_eq!(
        rig.tolerance.stated().collect::<Vec<_>>(),
        [("arm.length", 0.01), ("motor.resistance", 0.2)]
    );
    assert_eq!(parse(&write(&rig)).expect("readable"), rig);
    let unknown = message(&format!("{QUBE}\n[tolerance]\narm.lenght = 0.01\n"));
    assert!(
        unknown.contains("`arm.lenght`") && unknown.contains("arm.length, arm.inertia"),
        "{unknown}"
    );
    for wrong in ["0.0", "-0.1", "nan", "20.0"] {
        let text = format!("{QUBE}\n[tolerance]\narm.length = {wrong}\n");
        let range = message(&text);
        assert!(
            range.contains("arm.length =") && range.contains("0.02 is 2 %"),
            "{range}"
        );
    }
    let flat = message(&format!("{QUBE}\n[tolerance]\nlength = 0.01\n"));
    assert!(flat.contains("line "), "{flat}");
}

/// The gain is a product and a quotient: relative variances add. The arm's inertia is a sum.
#[test]
fn tolerances_of_what_is_computed() {
    let rig = parse(QUBE).expect("valid");
    let (p, t) = (rig.params, rig.tolerance);
    let gain = t.of(&p, |p| p.coefficients().drive).expect("known");
    let wanted = (3.0 * 0.1f64.powi(2) + 0.05f64.powi(2)).sqrt();
    assert!((gain - wanted).abs() < 1e-12, "{gain}");
    let carried = p.pendulum.mass * p.arm.length.powi(2);
    let arm = t.of(&p, |p| p.coefficients().arm).expect("known");
    let deviation = p.arm.inertia.hypot(carried * 0.01f64.hypot(2.0 * 0.02));
    assert!(
        (arm - deviation / (p.arm.inertia + carried)).abs() < 1e-12,
        "{arm}"
    );
    assert_eq!(t.of(&p, |p| p.coefficients().arm_damping), None);
}

#[test]
fn words_and_defaults_are_understood() {
    let text = format!(
        "{QUBE}\n[effects.\"drive.backlash\"]\ngap = 0.05\nmotor_share = 0.4\nencoder = \
         \"motor\"\n[effects.\"pendulum.spring\"]\nstiffness = 1e-4\n"
    );
    let rig = parse(&text).expect("valid");
    assert_eq!(rig.effects[0].values()[..], [0.05, 0.4, 1.0]);
    assert_eq!(rig.effects[1].values()[..], [1e-4, std::f64::consts::PI]);
    assert!(write(&rig).contains("encoder = \"motor\""));
}

proptest::proptest! {
    #[test]
    fn any_text_is_answered(text in ".{0,400}") {
        let _ = parse(&text);
    }

    #[test]
    fn any_cut_of_a_valid_file_is_answered(cut in 0..QUBE.len()) {
        if QUBE.is_char_boundary(cut) {
            let _ = parse(&QUBE[..cut]);
        }
    }
}
