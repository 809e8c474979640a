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
            "line 1: no section `controler`; there are made_for, controller, estimator, swing_up, \
             supervisor, limits, compensate, trajectory",
        ),
        (
            "[controller]\nkind = \"bang_bang\"\n",
            "line 2: [controller] has no kind \"bang_bang\"; it has lqr",
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
        (
            "[trajectory]\nversion = 7\n",
            "line 2: version must be 1, the version that this program reads; make the file again with furuta design \
             swing-up",
        ),
        (
            "[trajectory]\nversion = 1\ninterval = 0.1\nwhen_lost = \"panic\"\n",
            "line 4: when_lost must be \"energy\" or \"stop\"",
        ),
        (
            "[trajectory]\nversion = 1\ninterval = 0.1\npoints = [[1, 2], [3, 4]]\n",
            "line 4: points must be a list of points, each [theta, alpha,",
        ),
        (
            "[trajectory]\nversion = 1\ninterval = 0.1\npoints = [[0, 3, 0, 0, 1, 0, 0, 0, 0]]\n",
            "line 4: trajectory: 1 points: a trajectory has 2 to 128; design it again",
        ),
        (
            "[trajectory]\nversion = 1\ninterval = 0.1\npoints = [[0, 3, 0, 0, 1, 0, 0, 0, 0],\n[0, nan, 0, 0, 1, 0, 0, 0, \
             0]]\n",
            "trajectory: point 1: alpha = NaN is outside the allowed range [-1000, 1000]",
        ),
        (
            "[trajectory]\nversion = 1\nspeed = 2\n",
            "line 3: [trajectory] has no key `speed`; it has version, interval, when_lost, points",
        ),
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
    let text = "[made_for]\nrig = \"my \\\"rig\\\"\"\nrate = 500\n[controller]\nq = [1, 2, 3, 4.5]\nr = \
        0.1\n[estimator]\nkind = \"derivative\"\n[limits]\ncommand = 5\n[compensate]\nhold = \
        false\n[supervisor]\ncatch_every = 4\n[trajectory]\nversion = 1\ninterval = 0.0125\nwhen_lost = \
        \"stop\"\npoints = [[0.1, 3.1415927, 0, 0, -1.5, 1e-3, 2, 3, 4], [0, 0, 0, 0, 0, 0, 0, 0, 0]]\n";
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
