//! Whether 95 % intervals hold the truth in 95 of 100 repeats. `furuta study calibration` does the same with 200
//! repeats and prints the table of docs/calibration.md.

use crate::common;

use common::{RunSetup, qube, record, sweep};
use furuta_ident::calibrate::{Options, calibrate};

#[test]
fn intervals_hold_the_truth() {
    const REPEATS: u64 = 40;
    let real = qube();
    let repeats = (0..REPEATS).map(|seed| {
        let run = RunSetup {
            rate: 200.0,
            seconds: 6.0,
            noise: 1e-3,
            seed: 1 + seed,
            ..RunSetup::default()
        };
        let recording = record("a.csv", &real, run, sweep(2.0, 0.37 * seed as f64));
        // A sheet that is off by up to 20 % either way.
        let mut sheet = real.clone();
        let off = |k: u64| 1.0 + 0.2 * (12.9898 * (10 * seed + k) as f64).sin();
        sheet.params.arm.inertia *= off(0);
        sheet.params.motor.torque_constant *= off(1);
        sheet.params.pendulum.viscous *= off(2);
        let c = calibrate(&[recording], &sheet, &Options::default())
            .expect("a good recording")
            .calibration;
        [
            ("arm.inertia", real.params.arm.inertia),
            ("motor.torque_constant", real.params.motor.torque_constant),
            ("pendulum.inertia", real.params.pendulum.inertia),
            ("pendulum.viscous", real.params.pendulum.viscous),
            ("arm.length", real.params.arm.length),
        ]
        .map(|(key, truth)| {
            let p = &c.parameters[key];
            let [low, high] = p.interval.expect("an interval");
            (low <= truth && truth <= high, (p.fitted - truth) / p.std)
        })
    });
    let all: Vec<(bool, f64)> = repeats.flatten().collect();
    let held = all.iter().filter(|a| a.0).count() as f64 / all.len() as f64;
    // Of 200 intervals whose errors go together in fives: 95 % with a standard deviation of 2.5 %.
    assert!((0.88..=1.0).contains(&held), "{held}");
    // And they are not wider than they need be: the errors' mean square in units of the standard deviation is 1 for
    // honest ones.
    let square = all.iter().map(|a| a.1 * a.1).sum::<f64>() / all.len() as f64;
    assert!((0.5..1.6).contains(&square), "{square}");
}
